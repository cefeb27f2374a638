// SPDX-License-Identifier: BSD-3-Clause
// Meshes as bytes: libraries read files in a child process, since some crash on damaged ones.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

namespace delassus::meshes {

template <class Point, class Element>
std::string pack(const std::vector<Point>& points, const std::vector<Element>& elements) {
    static_assert(std::is_trivially_copyable_v<Point> && std::is_trivially_copyable_v<Element>);
    const std::size_t count = points.size();
    std::string bytes(reinterpret_cast<const char*>(&count), sizeof count);
    bytes.append(reinterpret_cast<const char*>(points.data()), count * sizeof(Point));
    bytes.append(reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(Element));
    return bytes;
}

/// Of what pack() made.
template <class Point, class Element>
void unpack(const std::string& bytes, std::vector<Point>& points, std::vector<Element>& elements) {
    std::size_t count = 0;
    std::memcpy(&count, bytes.data(), sizeof count);
    const std::size_t start = sizeof count + count * sizeof(Point);
    points.resize(count);
    elements.resize((bytes.size() - start) / sizeof(Element));
    if (count > 0) std::memcpy(points.data(), bytes.data() + sizeof count, count * sizeof(Point));
    if (!elements.empty()) std::memcpy(elements.data(), bytes.data() + start, elements.size() * sizeof(Element));
}

/// Processor time to read a file, s; some damaged files keep a library busy for ever.
inline unsigned seconds_to_read(const std::filesystem::path& file) {
    constexpr unsigned least = 20;
    constexpr std::uintmax_t bytes_per_second = 500'000;
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    return least + (error ? 0 : static_cast<unsigned>(bytes / bytes_per_second));
}

}  // namespace delassus::meshes
