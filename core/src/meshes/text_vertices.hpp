// SPDX-License-Identifier: BSD-3-Clause
// Vertices in the text of an OBJ, STL or PLY file, in double precision. assimp keeps coordinates in single precision:
// moved to the middle of all, they lose no digits to a distance from the file's origin.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/collision.hpp"
#include "delassus/error.hpp"

namespace delassus::meshes {

class TextVertices {
public:
    /// No vertices of other formats, nor of a text that is not as expected. Throws InputError for one that is not
    /// finite.
    TextVertices(const std::filesystem::path& file, const std::string& text) : text_(text) {
        if (text.find('\0') != std::string::npos) return;
        std::string extension = file.extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        const bool as_expected = extension == ".obj"   ? find_after("v")
                                 : extension == ".stl" ? find_after("vertex")
                                 : extension == ".ply" ? find_in_table()
                                                       : false;
        if (!as_expected) numbers_.clear();
        for (const Number& number : numbers_)
            if (!std::isfinite(number.value))
                throw InputError(fmt::format("{}, line {}: the vertex is not finite", file.string(),
                                             1 + std::count(text.begin(), text.begin() + number.first, '\n')));
    }

    [[nodiscard]] bool empty() const { return numbers_.empty(); }
    /// Of the box about them.
    [[nodiscard]] Vector3 middle() const {
        Vector3 middle{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double least = numbers_[axis].value, most = least;
            for (std::size_t k = axis; k < numbers_.size(); k += 3) {
                least = std::min(least, numbers_[k].value);
                most = std::max(most, numbers_[k].value);
            }
            middle[axis] = 0.5 * (least + most);
        }
        return middle;
    }
    /// The text with all vertices less a vector.
    [[nodiscard]] std::string moved_by(const Vector3& less) const {
        std::string result;
        std::size_t done = 0;
        for (std::size_t k = 0; k < numbers_.size(); ++k) {
            const auto first = static_cast<std::size_t>(numbers_[k].first);
            result.append(text_, done, first - done);
            result += fmt::format("{:.9g}", numbers_[k].value - less[k % 3]);
            done = first + numbers_[k].length;
        }
        return result.append(text_, done);
    }

private:
    struct Number {
        std::ptrdiff_t first;
        std::size_t length;
        double value;
    };

    /// Visits the words of each line until visit returns false.
    template <class Visitor>
    bool for_each_line(std::size_t from, Visitor&& visit) const {
        const std::string_view all = text_;
        std::vector<std::string_view> words;
        for (std::size_t at = from; at < all.size();) {
            const std::size_t end = std::min(all.find('\n', at), all.size());
            words.clear();
            for (std::size_t k = at; (k = all.find_first_not_of(" \t\r", k)) < end;) {
                const std::size_t last = std::min(all.find_first_of(" \t\r\n", k), end);
                words.push_back(all.substr(k, last - k));
                k = last;
            }
            at = end + 1;
            if (!words.empty() && !visit(words)) return false;
        }
        return true;
    }

    bool take(std::string_view word) {
        double value = 0.0;
        const char *begin = word.data() + (word.starts_with('+') ? 1 : 0), *end = word.data() + word.size();
        if (const auto [stop, error] = std::from_chars(begin, end, value); error != std::errc() || stop != end)
            return false;
        numbers_.push_back({word.data() - text_.data(), word.size(), value});
        return true;
    }

    bool find_after(std::string_view key) {
        return for_each_line(0, [&](const std::vector<std::string_view>& words) {
            if (words[0] != key) return true;
            return words.size() >= 4 && take(words[1]) && take(words[2]) && take(words[3]);
        });
    }

    /// element vertex N first, then N lines of its properties after end_header.
    bool find_in_table() {
        std::size_t count = 0, body = 0, properties = 0;
        std::array<std::optional<std::size_t>, 3> column;
        bool ascii = false, first = true, scalars = true;
        for_each_line(0, [&](const std::vector<std::string_view>& words) {
            if (words[0] == "format") ascii = words.size() > 1 && words[1] == "ascii";
            if (words[0] == "element" && words.size() > 2) {
                if (count > 0) first = false;
                if (count == 0 && words[1] != "vertex") scalars = false;
                if (count == 0) std::from_chars(words[2].data(), words[2].data() + words[2].size(), count);
            }
            if (words[0] == "property" && first) {
                scalars = scalars && words.size() == 3;
                for (std::size_t axis = 0; axis < 3; ++axis)
                    if (words.back() == std::string_view("xyz").substr(axis, 1)) column[axis] = properties;
                ++properties;
            }
            if (words[0] != "end_header") return true;
            body = static_cast<std::size_t>(words[0].data() - text_.data()) + words[0].size();
            return false;
        });
        if (!ascii || !scalars || body == 0 || count == 0 || !column[0] || !column[1] || !column[2]) return false;
        for_each_line(body, [&](const std::vector<std::string_view>& words) {
            return numbers_.size() < 3 * count && words.size() == properties && take(words[*column[0]]) &&
                   take(words[*column[1]]) && take(words[*column[2]]);
        });
        return numbers_.size() == 3 * count;
    }

    const std::string& text_;
    std::vector<Number> numbers_;
};

}  // namespace delassus::meshes
