// SPDX-License-Identifier: BSD-3-Clause
// What libsdformat passes over in SDF files, as losses.
#pragma once

#include <filesystem>
#include <sdf/sdf.hh>

#include "model_import/model.hpp"

namespace delassus::importers {

/// Looks into the file, and into all files that it includes.
void note_unread_sdf(const sdf::Root& root, const std::filesystem::path& file, model_import::Model& model);

}  // namespace delassus::importers
