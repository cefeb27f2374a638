// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "delassus/mesh_files.hpp"
#include "mechanics/checks.hpp"

namespace delassus {

void check_closed_surface(const Mesh& mesh, const std::string& who) {
    const auto count = static_cast<std::int32_t>(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!mechanics::finite(mesh.vertices[i]))
            throw InputError(fmt::format("{}: vertex {} of the mesh is not finite.", who, i));
    }
    std::set<std::pair<std::int32_t, std::int32_t>> directed;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& triangle = mesh.triangles[i];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t tail = triangle[k], head = triangle[(k + 1) % 3];
            if (tail < 0 || tail >= count || tail == head) {
                throw InputError(fmt::format(
                    "{}: triangle {} of the mesh has the vertices {}, {}, {}; they should be three different "
                    "numbers from 0 to {}.",
                    who, i, triangle[0], triangle[1], triangle[2], count - 1));
            }
            if (!directed.emplace(tail, head).second) {
                throw InputError(fmt::format(
                    "{}: two triangles of the mesh run from vertex {} to {}; neighbours should run along their edge in "
                    "opposite directions, all triangles counter-clockwise from outside.",
                    who, tail, head));
            }
        }
    }
    for (const auto& [tail, head] : directed) {
        if (!directed.contains({head, tail})) {
            throw InputError(
                fmt::format("{}: the mesh is open at the edge from vertex {} to {}; it should be a closed "
                            "surface.",
                            who, tail, head));
        }
    }
    // Six times the volume is the sum of determinants over the triangles, about any point; the size is for rounding.
    double volume = 0.0, size = 0.0;
    for (const auto& triangle : mesh.triangles) {
        std::array<Vector3, 3> edge;
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < 3; ++i) {
                edge[k][i] = mesh.vertices[triangle[k]][i] - mesh.vertices[0][i];
                size = std::max(size, std::abs(edge[k][i]));
            }
        }
        volume += edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) +
                  edge[0][1] * (edge[1][2] * edge[2][0] - edge[1][0] * edge[2][2]) +
                  edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
    }
    if (!(std::abs(volume) > 1e-12 * size * size * size))
        throw InputError(fmt::format("{}: the mesh has no volume; its triangles should bound a solid.", who));
    if (volume < 0.0) {
        throw InputError(fmt::format(
            "{}: the triangles of the mesh run clockwise from outside; they should run counter-clockwise.", who));
    }
}

}  // namespace delassus
