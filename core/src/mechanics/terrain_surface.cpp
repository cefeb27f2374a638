// SPDX-License-Identifier: BSD-3-Clause
// Surfaces of terrain: heights over a grid, and what every terrain must satisfy.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "delassus/mesh_files.hpp"
#include "mechanics/checks.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

constexpr std::size_t most_heights = 4'000'000;

/// A grey picture (PGM), plain (P2) or binary (P5), of 8 or 16 bits: http://netpbm.sourceforge.net/doc/pgm.html.
class Picture {
public:
    Picture(std::string bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {}

    Heights read() {
        const bool plain = bytes_[1] == '2';
        at_ = 2;
        Heights heights;
        heights.columns = static_cast<std::int32_t>(number("width", 1'000'000));
        heights.rows = static_cast<std::int32_t>(number("height", 1'000'000));
        const auto white = number("maximum", 65535);
        const auto count = static_cast<std::size_t>(heights.columns) * static_cast<std::size_t>(heights.rows);
        if (count > most_heights) refuse(fmt::format("it has more than {} points", most_heights));
        if (white == 0) refuse("its maximum is 0");
        ++at_;  // one blank ends the head
        const std::size_t width = white < 256 ? 1 : 2;
        if (!plain && bytes_.size() < at_ + width * count) refuse("it ends before its last point");
        for (std::size_t i = 0; i < count; ++i) {
            std::size_t value = 0;
            if (plain) {
                value = number("point", white);
            } else {
                for (std::size_t k = 0; k < width; ++k) value = value << 8U | static_cast<unsigned char>(bytes_[at_++]);
                if (value > white) refuse(fmt::format("a point is {}, above the maximum {}", value, white));
            }
            heights.values.push_back(static_cast<double>(value) / static_cast<double>(white));
        }
        return heights;
    }

private:
    [[noreturn]] void refuse(std::string_view why) const {
        throw InputError(fmt::format("{}: no picture of heights (PGM): {}", name_, why));
    }
    std::size_t number(std::string_view what, std::size_t most) {
        while (at_ < bytes_.size() &&
               (std::isspace(static_cast<unsigned char>(bytes_[at_])) != 0 || bytes_[at_] == '#'))
            at_ = bytes_[at_] == '#' ? std::min(bytes_.find('\n', at_), bytes_.size()) : at_ + 1;
        std::size_t value = 0;
        const char* end = bytes_.data() + bytes_.size();
        const auto read = std::from_chars(bytes_.data() + at_, end, value);
        if (read.ec != std::errc() || value > most)
            refuse(fmt::format("its {} should be a number from 0 to {}", what, most));
        at_ = static_cast<std::size_t>(read.ptr - bytes_.data());
        return value;
    }

    std::string bytes_, name_;
    std::size_t at_ = 0;
};

/// Numbers between blanks or commas, a row in each line; what follows # is a comment.
Heights read_rows(const std::string& text, const std::string& name) {
    Heights heights;
    std::int32_t line_number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string_view line(text.data() + begin, end - begin);
        begin = end + 1;
        ++line_number;
        line = line.substr(0, line.find('#'));
        std::int32_t columns = 0;
        for (std::size_t at = line.find_first_not_of(" \t\r,"); at < line.size();) {
            double value = 0.0;
            const auto read = std::from_chars(line.data() + at, line.data() + line.size(), value);
            if (read.ec != std::errc() || !std::isfinite(value))
                throw InputError(
                    fmt::format("{}, line {}: the height {} is no finite number", name, line_number, columns + 1));
            heights.values.push_back(value);
            ++columns;
            const auto after = static_cast<std::size_t>(read.ptr - line.data());
            at = line.find_first_not_of(" \t\r,", after);
            if (at == after)
                throw InputError(fmt::format("{}, line {}: blanks or commas should be between heights, not \"{}\"",
                                             name, line_number, line.substr(after, 1)));
        }
        if (columns == 0) continue;
        if (heights.rows > 0 && columns != heights.columns)
            throw InputError(fmt::format("{}, line {}: the row has {} heights, those before it {}", name, line_number,
                                         columns, heights.columns));
        heights.columns = columns;
        ++heights.rows;
    }
    return heights;
}

}  // namespace

Heights read_heights(const std::filesystem::path& file) {
    std::string bytes = read_file(file);
    if (bytes.starts_with("P2") || bytes.starts_with("P5")) return Picture(std::move(bytes), file.string()).read();
    return read_rows(bytes, file.string());
}

// Each cell is divided by the diagonal from its least x and y.
Mesh height_field(const Heights& heights, double size_x, double size_y, double scale) {
    const auto rows = static_cast<std::size_t>(std::max(0, heights.rows)),
               columns = static_cast<std::size_t>(std::max(0, heights.columns));
    if (rows < 2 || columns < 2 || heights.values.size() != rows * columns || heights.values.size() > most_heights)
        throw InputError(
            fmt::format("a height field has {} rows of {} heights; there should be at least 2 of each, and at most {} "
                        "heights",
                        heights.rows, heights.columns, most_heights));
    if (!(size_x > 0.0) || !(size_y > 0.0) || !std::isfinite(size_x) || !std::isfinite(size_y))
        throw InputError(
            fmt::format("the size of a height field is {} m by {} m; both should be positive", size_x, size_y));
    Mesh mesh;
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t column = 0; column < columns; ++column) {
            const double across = static_cast<double>(column) / static_cast<double>(columns - 1),
                         down = static_cast<double>(row) / static_cast<double>(rows - 1);
            mesh.vertices.push_back(
                {size_x * (across - 0.5), size_y * (0.5 - down), scale * heights.values[row * columns + column]});
        }
    for (std::size_t row = 0; row + 1 < rows; ++row)
        for (std::size_t column = 0; column + 1 < columns; ++column) {
            const auto corner = [&](std::size_t below, std::size_t right) {
                return static_cast<std::int32_t>((row + below) * columns + column + right);
            };
            mesh.triangles.push_back({corner(1, 0), corner(1, 1), corner(0, 1)});
            mesh.triangles.push_back({corner(1, 0), corner(0, 1), corner(0, 0)});
        }
    return mesh;
}

void check_terrain(const Mesh& mesh, const std::string& who) {
    if (mesh.triangles.empty()) throw InputError(fmt::format("{}: the mesh has no triangles.", who));
    const auto count = static_cast<std::int32_t>(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!mechanics::finite(mesh.vertices[i]))
            throw InputError(fmt::format("{}: vertex {} of the mesh is not finite.", who, i));
    std::vector<std::pair<std::int32_t, std::int32_t>> directed;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& triangle = mesh.triangles[i];
        std::array<Vector3, 2> edge{};
        double longest = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t tail = triangle[k], head = triangle[(k + 1) % 3];
            if (tail < 0 || tail >= count || tail == head)
                throw InputError(fmt::format(
                    "{}: triangle {} of the mesh has the vertices {}, {}, {}; they should be three different numbers "
                    "from 0 to {}.",
                    who, i, triangle[0], triangle[1], triangle[2], count - 1));
            directed.emplace_back(tail, head);
        }
        for (std::size_t k = 0; k < 2; ++k)
            for (std::size_t j = 0; j < 3; ++j) {
                edge[k][j] = mesh.vertices[triangle[k + 1]][j] - mesh.vertices[triangle[0]][j];
                longest = std::max(longest, std::abs(edge[k][j]));
            }
        const double twice_area = std::hypot(edge[0][1] * edge[1][2] - edge[0][2] * edge[1][1],
                                             edge[0][2] * edge[1][0] - edge[0][0] * edge[1][2],
                                             edge[0][0] * edge[1][1] - edge[0][1] * edge[1][0]);
        if (!(twice_area > 1e-12 * longest * longest))
            throw InputError(fmt::format("{}: triangle {} of the mesh has no area.", who, i));
    }
    std::sort(directed.begin(), directed.end());
    const auto twice = std::adjacent_find(directed.begin(), directed.end());
    if (twice != directed.end())
        throw InputError(fmt::format(
            "{}: two triangles of the mesh run from vertex {} to {}; neighbours should run along their edge "
            "in opposite directions, all triangles counter-clockwise from above.",
            who, twice->first, twice->second));
}

}  // namespace delassus
