// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/mesh_files.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include "delassus/error.hpp"
#include "mechanics/checks.hpp"
#include "mechanics/mesh_modules.hpp"
#include "support/module.hpp"

namespace delassus {
namespace {

void must_be_there(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
        throw InputError(fmt::format("{}: it is a folder, where a file of a mesh belongs", file.string()));
    if (!std::filesystem::is_regular_file(file, error))
        throw InputError(fmt::format("{}: there is no such file", file.string()));
}

/// What a file says is checked before anything is computed from it. Triangles and vertices are counted from 1.
void check_numbers(const Mesh& mesh, const std::string& who) {
    const auto count = static_cast<std::int32_t>(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const auto corner : mesh.triangles[i])
            if (corner < 0 || corner >= count)
                throw InputError(fmt::format("{}: triangle {} has the vertex {}, and there are {}", who, i + 1,
                                             std::int64_t{corner} + 1, count));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!mechanics::finite(mesh.vertices[i]))
            throw InputError(fmt::format("{}: vertex {} is not finite", who, i + 1));
}

/// The surface in a file, and from where single precision counts: it has 24 bits of the distance from there.
struct Surface {
    Mesh mesh;
    Vector3 middle{};

    void check_precision(const Mesh& part, const std::string& who) const {
        constexpr double bits = 0.5 * std::numeric_limits<float>::epsilon(), most = 1e-4;
        Eigen::AlignedBox3d box;
        double far = 0.0;
        for (const auto& vertex : part.vertices) {
            const Eigen::Vector3d place(vertex.data());
            box.extend(place);
            far = std::max(far, (place - Eigen::Vector3d(middle.data())).cwiseAbs().maxCoeff());
        }
        const double size = box.diagonal().norm();
        if (bits * far > most * size)
            throw InputError(fmt::format(
                "{}: a surface of size {:.3g} m lies {:.3g} m from where its file has its origin or its middle, and is "
                "read in single precision, with an error of {:.1e} m; move it to the origin in its file, and put the "
                "body or the shape to that position",
                who, size, far, bits * far));
    }
};

/// Equal points become one; triangles without area by that are left out.
Mesh joined(const Mesh& mesh) {
    Mesh result;
    std::map<Vector3, std::int32_t> numbers;
    std::vector<std::int32_t> number;
    for (const auto& vertex : mesh.vertices) {
        const auto [place, added] = numbers.emplace(vertex, static_cast<std::int32_t>(result.vertices.size()));
        if (added) result.vertices.push_back(vertex);
        number.push_back(place->second);
    }
    for (const auto& triangle : mesh.triangles) {
        std::array<std::int32_t, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) corners[k] = number[static_cast<std::size_t>(triangle[k])];
        if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
            result.triangles.push_back(corners);
    }
    return result;
}

/// One mesh for each set of triangles connected by vertices, in the order of their first triangles.
std::vector<Mesh> parts_of(const Mesh& mesh) {
    std::vector<std::int32_t> parent(mesh.vertices.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::int32_t vertex) {
        while (parent[static_cast<std::size_t>(vertex)] != vertex)
            vertex = parent[static_cast<std::size_t>(vertex)] =
                parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(vertex)])];
        return vertex;
    };
    for (const auto& triangle : mesh.triangles)
        for (const std::size_t k : {1, 2}) parent[static_cast<std::size_t>(root(triangle[k]))] = root(triangle[0]);
    std::vector<Mesh> parts;
    std::map<std::int32_t, std::size_t> part_of;
    std::vector<std::int32_t> number(mesh.vertices.size(), -1);
    for (const auto& triangle : mesh.triangles) {
        const auto [place, added] = part_of.emplace(root(triangle[0]), parts.size());
        if (added) parts.emplace_back();
        Mesh& part = parts[place->second];
        auto& corners = part.triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            auto& own = number[static_cast<std::size_t>(triangle[k])];
            if (own < 0) {
                own = static_cast<std::int32_t>(part.vertices.size());
                part.vertices.push_back(mesh.vertices[static_cast<std::size_t>(triangle[k])]);
            }
            corners[k] = own;
        }
    }
    return parts;
}

void scale_by(double scale, std::vector<Vector3>& vertices) {
    if (!(scale > 0.0) || !std::isfinite(scale))
        throw InputError(fmt::format("the scale of a mesh is {}; it must be positive", scale));
    for (auto& vertex : vertices)
        for (double& x : vertex) x *= scale;
}

Surface read_surface(const std::filesystem::path& file, double scale) {
    must_be_there(file);
    const auto read = reinterpret_cast<DelassusSurfaceMeshRead>(module_symbol(
        "delassus_surface_mesh", "delassus_surface_mesh_read", file.string() + " cannot be read", "assimp"));
    Mesh mesh;
    Vector3 middle = {};
    read(file, mesh, middle);
    scale_by(scale, mesh.vertices);
    for (double& x : middle) x *= scale;
    check_numbers(mesh, file.string());
    return {joined(mesh), middle};
}

/// Six times the volume of a tetrahedron.
double determinant(const TetrahedralMesh& mesh, const std::array<std::int32_t, 4>& element) {
    std::array<Vector3, 3> edge;
    const auto& origin = mesh.vertices[static_cast<std::size_t>(element[0])];
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i)
            edge[k][i] = mesh.vertices[static_cast<std::size_t>(element[k + 1])][i] - origin[i];
    return edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) +
           edge[0][1] * (edge[1][2] * edge[2][0] - edge[1][0] * edge[2][2]) +
           edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
}

// Elements are counted from 1 in what is said, as in the file.
void check_elements(const TetrahedralMesh& mesh, const std::string& who) {
    if (mesh.tetrahedra.empty()) throw InputError(fmt::format("{}: it has no tetrahedra", who));
    const auto count = static_cast<std::int32_t>(mesh.vertices.size());
    std::vector<bool> used(mesh.vertices.size(), false);
    std::map<std::array<std::int32_t, 3>, int> sides;
    for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
        const auto& element = mesh.tetrahedra[e];
        for (const auto corner : element) {
            if (corner < 0 || corner >= count)
                throw InputError(fmt::format("{}: element {} has the point {} of {}", who, e + 1, corner + 1, count));
            used[static_cast<std::size_t>(corner)] = true;
        }
        const double volume = determinant(mesh, element) / 6.0;
        if (!(volume > 0.0))
            throw InputError(fmt::format("{}: element {} is {}, with the volume {:.3g} m³", who, e + 1,
                                         volume < 0.0 ? "inverted" : "flat", volume));
        for (std::size_t left_out = 0; left_out < 4; ++left_out) {
            std::array<std::int32_t, 3> side{};
            std::copy_if(element.begin(), element.end(), side.begin(),
                         [&](std::int32_t corner) { return corner != element[left_out]; });
            std::sort(side.begin(), side.end());
            if (++sides[side] > 2)
                throw InputError(
                    fmt::format("{}: more than two elements share the face of points {}, {}, {}, the last "
                                "of them element {}",
                                who, side[0] + 1, side[1] + 1, side[2] + 1, e + 1));
        }
    }
    if (const auto unused = std::find(used.begin(), used.end(), false); unused != used.end())
        throw InputError(fmt::format("{}: point {} belongs to no element", who, unused - used.begin() + 1));
}

}  // namespace

std::vector<Mesh> read_surface_mesh(const std::filesystem::path& file, double scale) {
    const Surface surface = read_surface(file, scale);
    std::vector<Mesh> parts = parts_of(surface.mesh);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const std::string who = parts.size() == 1 ? file.string() : fmt::format("{}, part {}", file.string(), i + 1);
        check_closed_surface(parts[i], who);
        surface.check_precision(parts[i], who);
    }
    return parts;
}

Mesh read_triangles(const std::filesystem::path& file) {
    return read_surface(file, 1.0).mesh;
}

Mesh read_terrain(const std::filesystem::path& file, double scale) {
    Surface surface = read_surface(file, scale);
    check_terrain(surface.mesh, file.string());
    surface.check_precision(surface.mesh, file.string());
    return std::move(surface.mesh);
}

TetrahedralMesh read_tetrahedral_mesh(const std::filesystem::path& file, double scale, int refinements) {
    if (refinements < 0 || refinements > 6)
        throw InputError(fmt::format("the number of refinements of a mesh is {}; it must be from 0 to 6", refinements));
    TetrahedralMesh mesh;
    if (file.extension() == ".vol") {
        must_be_there(file);
        if (refinements != 0)
            throw InputError(fmt::format("{}: only tetrahedra that fill a surface can be refined", file.string()));
        const auto read = reinterpret_cast<DelassusVolumeMeshRead>(module_symbol(
            "delassus_volume_mesh", "delassus_volume_mesh_read", file.string() + " cannot be read", "Netgen"));
        read(file, mesh);
        scale_by(scale, mesh.vertices);
    } else {
        const Surface surface = read_surface(file, scale);
        check_closed_surface(surface.mesh, file.string());
        surface.check_precision(surface.mesh, file.string());
        const auto fill = reinterpret_cast<DelassusVolumeMeshFill>(module_symbol(
            "delassus_volume_mesh", "delassus_volume_mesh_fill", file.string() + " cannot be read", "Netgen"));
        fill(surface.mesh, refinements, file, mesh);
    }
    check_elements(mesh, file.string());
    return mesh;
}

}  // namespace delassus
