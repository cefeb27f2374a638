// SPDX-License-Identifier: BSD-3-Clause
// Surfaces in files as they stand there: open, doubled or turned inside out too, which the readers of scenes refuse.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "model_import/model.hpp"

namespace delassus::model_import {

struct RawMesh {
    std::vector<Vector3d> points;  ///< in single precision, as simulators keep them
    std::vector<std::array<std::int32_t, 3>> triangles;
};

/// OBJ (v and f lines; polygons become fans), STL (binary or text), MSH (MuJoCo's), and what assimp reads. Throws
/// InputError without the file's name: what is wrong in the file.
[[nodiscard]] DELASSUS_API RawMesh read_raw_mesh(const std::filesystem::path& file);

}  // namespace delassus::model_import
