// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "config/yaml_reader.hpp"

namespace delassus::scene {

/// Replaces the node at `path` in the tree by a value. Steps of the path are keys, positions in lists (from 0), or the
/// names of a list's items; the last may be a key that the map does not have yet. The source records where the value
/// came from. Throws InputError that names the step that leads nowhere.
void set_value(Source& source, const YAML::Node& root, const std::string& path, const std::string& text);

}  // namespace delassus::scene
