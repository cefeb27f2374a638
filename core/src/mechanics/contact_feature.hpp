// SPDX-License-Identifier: BSD-3-Clause
// Which features of a pair make a contact point. They are named by the shapes' own vertices and edges, whichever
// shape's face the points were measured from, so that they keep their names while the shapes slide.
#pragma once

#include <cstddef>
#include <cstdint>

namespace delassus::collision {

enum class FeatureKind : std::uint32_t { Nearest = 0, VertexOfA = 1, VertexOfB = 2, Edges = 3 };

constexpr std::uint32_t feature_id(FeatureKind kind, std::size_t of_a, std::size_t of_b) {
    return static_cast<std::uint32_t>(kind) << 30 | static_cast<std::uint32_t>(of_a & 0x7fff) << 15 |
           static_cast<std::uint32_t>(of_b & 0x7fff);
}

/// Of a feature of an edge and another shape, b: which one of them it is, in 15 bits.
constexpr std::size_t short_feature_of_b(std::uint32_t feature) {
    const std::uint32_t kind = feature >> 30;
    const bool edges = kind == static_cast<std::uint32_t>(FeatureKind::Edges);
    return kind << 13 | ((edges ? feature : feature >> 15) & 0x1fff);
}

}  // namespace delassus::collision
