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
/// and equal points one. Throws InputError, naming the file, where this build has no assimp, the file is unreadable or
/// has no triangles, a vertex is not finite or not there, single precision costs a part more than 1e-4 of its size, or
/// a part is not a closed surface seen counter-clockwise from outside (with the triangle or edge).
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

/// The surface of a terrain in a file, which may be open; otherwise as read_surface_mesh, all parts in one. Throws
/// InputError, naming the file, as check_terrain does.
[[nodiscard]] DELASSUS_API Mesh read_terrain(const std::filesystem::path& file, double scale = 1.0);

/// The triangles in a file as they are, equal points joined, whatever they bound. Throws InputError, naming the file,
/// where this build has no assimp, the file is unreadable or has no triangles, or a vertex is not finite or not there.
[[nodiscard]] DELASSUS_API Mesh read_triangles(const std::filesystem::path& file);

/// Heights over a grid, row by row as on a map: the first row is that of the largest y, and x ascends in a row.
struct Heights {
    std::int32_t rows = 0, columns = 0;
    std::vector<double> values;
};

/// Heights from a text with a row in each line (blanks or commas between numbers), or from a grey picture (PGM of 8 or
/// 16 bits), where black is 0 and white is 1. Throws InputError, naming the file and the line.
[[nodiscard]] DELASSUS_API Heights read_heights(const std::filesystem::path& file);

/// The surface of a height field, its middle over the origin: size_x and size_y along x and y (m), scale (m) times the
/// heights along z. Throws InputError for fewer than 2 × 2 heights, more than 4 million, or sizes that are not
/// positive.
[[nodiscard]] DELASSUS_API Mesh height_field(const Heights& heights, double size_x, double size_y, double scale = 1.0);

/// Throws InputError "who: …" unless the triangles have areas and neighbours run along their edge in opposite
/// directions.
DELASSUS_API void check_terrain(const Mesh& mesh, const std::string& who);

}  // namespace delassus
