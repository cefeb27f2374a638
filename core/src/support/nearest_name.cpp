// SPDX-License-Identifier: BSD-3-Clause
#include "support/nearest_name.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace delassus {
namespace {

std::size_t distance(std::string_view left, std::string_view right) {
    const auto same = [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    };
    const std::size_t width = right.size() + 1;
    std::vector<std::size_t> table((left.size() + 1) * width);
    for (std::size_t i = 0; i <= left.size(); ++i) {
        for (std::size_t j = 0; j <= right.size(); ++j) {
            std::size_t& here = table[i * width + j];
            if (i == 0 || j == 0) {
                here = i + j;
                continue;
            }
            const std::size_t replaced = table[(i - 1) * width + j - 1] + (same(left[i - 1], right[j - 1]) ? 0 : 1);
            here = std::min({replaced, table[(i - 1) * width + j] + 1, table[i * width + j - 1] + 1});
            if (i > 1 && j > 1 && same(left[i - 1], right[j - 2]) && same(left[i - 2], right[j - 1])) {
                here = std::min(here, table[(i - 2) * width + j - 2] + 1);
            }
        }
    }
    return table.back();
}

}  // namespace

std::string_view nearest_name(std::string_view name, std::span<const std::string_view> choices) {
    constexpr std::size_t longest = 100;  // the table is quadratic, and no name of ours is as long
    if (name.size() > longest) return {};
    std::string_view best;
    std::size_t best_distance = 0;
    for (const std::string_view choice : choices) {
        const std::size_t d = distance(name, choice);
        if (best.empty() || d < best_distance) {
            best = choice;
            best_distance = d;
        }
    }
    return best_distance <= std::max<std::size_t>(1, std::max(name.size(), best.size()) / 2) ? best
                                                                                             : std::string_view();
}

std::string nearest_name_hint(std::string_view name, std::span<const std::string_view> choices) {
    const std::string_view nearest = nearest_name(name, choices);
    if (!nearest.empty()) return fmt::format("; did you mean \"{}\"?", nearest);
    return fmt::format("; there are {}", fmt::join(choices, ", "));
}

}  // namespace delassus
