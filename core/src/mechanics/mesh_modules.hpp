// SPDX-License-Identifier: BSD-3-Clause
// What the modules that read meshes export. They are built together with libdelassus_mechanics, so C++ types may cross.
#pragma once

#include "delassus/mesh_files.hpp"

extern "C" {
/// delassus_surface_mesh_read of delassus_surface_mesh.so: all triangles of the file, points not yet joined.
/// Coordinates are as exact as single precision is of their distance from `middle`.
using DelassusSurfaceMeshRead = void (*)(const std::filesystem::path& file, delassus::Mesh& mesh,
                                         delassus::Vector3& middle);
/// delassus_volume_mesh_read and _fill of delassus_volume_mesh.so; elements are not checked.
using DelassusVolumeMeshRead = void (*)(const std::filesystem::path& file, delassus::TetrahedralMesh& mesh);
using DelassusVolumeMeshFill = void (*)(const delassus::Mesh& surface, int refinements,
                                        const std::filesystem::path& file, delassus::TetrahedralMesh& mesh);
}
