// SPDX-License-Identifier: BSD-3-Clause
#include "model_import/mesh_reading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"
#include "support/text_file.hpp"

namespace delassus::model_import {

namespace {

static_assert(std::endian::native == std::endian::little, "STL and MSH files are little-endian");

template <class Value>
Value at(const std::string& bytes, std::size_t place) {
    Value value{};
    std::memcpy(&value, bytes.data() + place, sizeof value);
    return value;
}

Vector3d point_at(const std::string& bytes, std::size_t place) {
    return {static_cast<double>(at<float>(bytes, place)), static_cast<double>(at<float>(bytes, place + 4)),
            static_cast<double>(at<float>(bytes, place + 8))};
}

/// Calls with the words of each line.
template <class Take>
void for_each_line(const std::string& text, Take&& take) {
    std::vector<std::string_view> words;
    const std::string_view all = text;
    for (std::size_t begin = 0; begin < all.size();) {
        const std::size_t end = std::min(all.find('\n', begin), all.size());
        const std::string_view line = all.substr(begin, end - begin);
        words.clear();
        for (std::size_t k = 0; k < line.size();) {
            const std::size_t from = line.find_first_not_of(" \t\r", k);
            if (from == std::string_view::npos) break;
            const std::size_t to = std::min(line.find_first_of(" \t\r", from), line.size());
            words.push_back(line.substr(from, to - from));
            k = to;
        }
        if (!words.empty()) take(words);
        begin = end + 1;
    }
}

double number(std::string_view word) {
    double value = 0.0;
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) return 0.0;
    if (error != std::errc{} || rest != word.data() + word.size())
        throw InputError(fmt::format("\"{}\" is no number", word.substr(0, 40)));
    return static_cast<double>(static_cast<float>(value));
}

Vector3d point_of(const std::vector<std::string_view>& words) {
    if (words.size() < 4) throw InputError("a vertex has fewer than three coordinates");
    return {number(words[1]), number(words[2]), number(words[3])};
}

RawMesh read_obj(const std::string& text) {
    RawMesh mesh;
    std::vector<std::int32_t> corners;
    for_each_line(text, [&](const std::vector<std::string_view>& words) {
        if (words[0] == "v") mesh.points.push_back(point_of(words));
        if (words[0] != "f") return;
        corners.clear();
        for (std::size_t k = 1; k < words.size(); ++k) {
            const std::string_view word = words[k].substr(0, words[k].find('/'));
            long corner = 0;
            const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), corner);
            if (error != std::errc{} || rest != word.data() + word.size())
                throw InputError(fmt::format("\"{}\" is no corner of a face", words[k].substr(0, 40)));
            const auto count = static_cast<long>(mesh.points.size());
            if (corner < 0) corner += count + 1;
            if (corner < 1 || corner > count)
                throw InputError(fmt::format("a face has vertex {} of {}", corner, count));
            corners.push_back(static_cast<std::int32_t>(corner - 1));
        }
        for (std::size_t k = 2; k < corners.size(); ++k)
            mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    });
    return mesh;
}

RawMesh read_stl(const std::string& bytes) {
    RawMesh mesh;
    const std::uint64_t triangles = bytes.size() < 84 ? 0 : at<std::uint32_t>(bytes, 80);
    if (bytes.size() >= 84 && bytes.size() >= 84 + 50 * triangles && !(triangles == 0 && bytes.starts_with("solid"))) {
        for (std::uint64_t k = 0; k < triangles; ++k)
            for (std::size_t corner = 0; corner < 3; ++corner)
                mesh.points.push_back(point_at(bytes, static_cast<std::size_t>(84 + 50 * k + 12 + 12 * corner)));
    } else if (bytes.starts_with("solid")) {
        for_each_line(bytes, [&](const std::vector<std::string_view>& words) {
            if (words[0] == "vertex") mesh.points.push_back(point_of(words));
        });
    } else {
        throw InputError("it is shorter than an STL file with its triangles");
    }
    for (std::size_t k = 0; k + 2 < mesh.points.size(); k += 3) {
        const auto first = static_cast<std::int32_t>(k);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

// Numbers of vertices, normals, texture coordinates and triangles, then these.
RawMesh read_msh(const std::string& bytes) {
    RawMesh mesh;
    std::array<std::int64_t, 4> count{};
    if (bytes.size() < 16) throw InputError("it is shorter than the head of an MSH file");
    for (std::size_t k = 0; k < 4; ++k) count[k] = at<std::int32_t>(bytes, 4 * k);
    const bool possible = std::all_of(count.begin(), count.end(), [](std::int64_t one) { return one >= 0; });
    const std::int64_t wanted = 16 + 12 * count[0] + 12 * count[1] + 8 * count[2] + 12 * count[3];
    if (!possible || wanted != static_cast<std::int64_t>(bytes.size()))
        throw InputError("its size is not that which the head of an MSH file says");
    for (std::int64_t k = 0; k < count[0]; ++k)
        mesh.points.push_back(point_at(bytes, static_cast<std::size_t>(16 + 12 * k)));
    const auto begin = static_cast<std::size_t>(wanted - 12 * count[3]);
    for (std::size_t k = 0; k < static_cast<std::size_t>(count[3]); ++k) {
        std::array<std::int32_t, 3> triangle{};
        for (std::size_t corner = 0; corner < 3; ++corner) {
            triangle[corner] = at<std::int32_t>(bytes, begin + 12 * k + 4 * corner);
            if (triangle[corner] < 0 || triangle[corner] >= count[0])
                throw InputError(fmt::format("a triangle has vertex {} of {}", triangle[corner], count[0]));
        }
        mesh.triangles.push_back(triangle);
    }
    return mesh;
}

}  // namespace

RawMesh read_raw_mesh(const std::filesystem::path& file) {
    std::string kind = file.extension().string();
    for (char& c : kind) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    RawMesh mesh;
    if (kind == ".obj" || kind == ".stl" || kind == ".msh") {
        const std::string bytes = read_file(file);
        mesh = kind == ".obj" ? read_obj(bytes) : kind == ".stl" ? read_stl(bytes) : read_msh(bytes);
    } else {
        const Mesh surface = read_triangles(file);
        for (const auto& vertex : surface.vertices) mesh.points.emplace_back(vertex.data());
        mesh.triangles = surface.triangles;
    }
    for (const Vector3d& point : mesh.points)
        if (!point.allFinite()) throw InputError("a coordinate of a vertex is not finite");
    return mesh;
}

}  // namespace delassus::model_import
