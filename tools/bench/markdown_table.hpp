// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace delassus::bench {

/// With a unit that suits it; a dash where it is not known.
inline std::string seconds_text(double value) {
    if (!std::isfinite(value)) return "—";
    if (value < 1e-3) return fmt::format("{:.3g} µs", value * 1e6);
    if (value < 1.0) return fmt::format("{:.3g} ms", value * 1e3);
    return fmt::format("{:.3g} s", value);
}

/// A Markdown table with columns padded, so that it is a table on a terminal too.
class MarkdownTable {
public:
    explicit MarkdownTable(std::vector<std::string> head) : rows_{std::move(head)} {}
    void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
    [[nodiscard]] std::string text() const {
        std::vector<std::size_t> widths(rows_.front().size(), 3);
        for (const auto& row : rows_)
            for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
        std::string text;
        for (std::size_t r = 0; r < rows_.size(); ++r) {
            for (std::size_t i = 0; i < widths.size(); ++i) {
                const std::string padding(widths[i] - width_of(rows_[r][i]), ' ');
                text += i == 0 ? "| " + rows_[r][i] + padding + " |" : " " + padding + rows_[r][i] + " |";
            }
            text += '\n';
            if (r > 0) continue;
            for (std::size_t i = 0; i < widths.size(); ++i)
                text += i == 0 ? "|:" + std::string(widths[i] + 1, '-') + "|" : std::string(widths[i] + 1, '-') + ":|";
            text += '\n';
        }
        return text;
    }

private:
    /// Characters of UTF-8.
    static std::size_t width_of(const std::string& text) {
        return static_cast<std::size_t>(std::count_if(
            text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
    }
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace delassus::bench
