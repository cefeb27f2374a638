// SPDX-License-Identifier: BSD-3-Clause
// A scene as a tree of keys and values, which relations turn, scale, shuffle and shrink before it is read as any other.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "bench/json_text.hpp"

namespace delassus::relations {

using bench::Json;

/// The lists that a scene of this folder may have, in the order in which they are written.
inline constexpr std::array<std::string_view, 9> list_keys = {
    "bodies", "joints", "motors", "actuators", "springs", "bushings", "loads", "material_pairs", "keep_apart"};

/// The document as YAML: one line for each item of a list. head: lines of a comment before it, without "# ".
[[nodiscard]] std::string scene_yaml(const Json& document, const std::vector<std::string>& head = {});

/// The inverse. Throws InputError if the file is absent or no YAML.
[[nodiscard]] Json read_document(const std::filesystem::path& file);

struct SystemDocument {
    std::string name;  ///< "main" in a file of one system
    Json scene;
};

/// The systems of a file that somebody wrote, each as a scene of its own, with what relations change written out where
/// the file leaves it to the default. Throws InputError as read_document does, and for a system of variable steps.
[[nodiscard]] std::vector<SystemDocument> read_systems(const std::filesystem::path& file);

/// Whether the scene moves the body: it is neither fixed nor kinematic.
[[nodiscard]] bool moves(const Json& body);

/// The radius of the ball about the body's origin that holds its shapes, m; 0 without shapes. Planes and terrain are
/// not counted.
[[nodiscard]] double radius_of(const Json& body);

/// The item of that name in a list of the document, or null.
[[nodiscard]] const Json* find_named(const Json& document, const char* list, const std::string& name);

}  // namespace delassus::relations
