// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// The JSON Schema of scene files (docs/scene.schema.json), for editors and other programs.
[[nodiscard]] DELASSUS_API std::string_view scene_schema();

}  // namespace delassus
