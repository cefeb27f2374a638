// SPDX-License-Identifier: BSD-3-Clause
// Meshes in files. The first file loads a module that reads it by a maintained library: surfaces by assimp (OBJ, STL,
// PLY, OFF, glTF, COLLADA and more), tetrahedra by Netgen.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "delassus/collision.hpp"
#include "delassus/export.hpp"

namespace delassus {

/// The surface in a file, one mesh for each connected part; lengths are multiplied by scale. Polygons become triangles,
/// and equal points one. assimp keeps coordinates in single precision. Throws InputError, naming the file, where this
/// build has no assimp, the file is unreadable or has no triangles, or a part is not a closed surface seen
/// counter-clockwise from outside (with the triangle or edge).
[[nodiscard]] DELASSUS_API std::vector<Mesh> read_surface_mesh(const std::filesystem::path& file, double scale = 1.0);

/// Tetrahedra in their own frame, m.
struct TetrahedralMesh {
    std::vector<Vector3> vertices;
    std::vector<std::array<std::int32_t, 4>> tetrahedra;  ///< of positive volume: det(b − a, c − a, d − a) > 0
};

/// The tetrahedra in a Netgen file (.vol); any other file is read as a surface, which Netgen fills with tetrahedra
/// about as large as the surface's triangles. Each is then divided into eight, `refinements` times (0 to 6). Throws
/// InputError, naming the file, where this build lacks the library, the file is unreadable, an element is inverted or
/// flat or not a tetrahedron, a vertex belongs to no element, a face to more than two, or refinements are asked of a
/// .vol file.
[[nodiscard]] DELASSUS_API TetrahedralMesh read_tetrahedral_mesh(const std::filesystem::path& file, double scale = 1.0,
                                                                 int refinements = 0);

/// Throws InputError "who: …" unless the triangles bound a solid: closed, counter-clockwise from outside, with volume.
DELASSUS_API void check_closed_surface(const Mesh& mesh, const std::string& who);

}  // namespace delassus
