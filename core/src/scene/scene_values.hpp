// SPDX-License-Identifier: BSD-3-Clause
// Values of a scene file: numbers with ranges, vectors, orientations, motions, names with a place in a grid.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "config/yaml_reader.hpp"
#include "delassus/inputs.hpp"

namespace delassus::scene {

double finite_number(const Source& source, const YAML::Node& node, std::string_view key);
double positive_number(const Source& source, const YAML::Node& node, std::string_view key);
double nonnegative_number(const Source& source, const YAML::Node& node, std::string_view key);
bool truth(const Source& source, const YAML::Node& node, std::string_view key);
Vector3 vector3(const Source& source, const YAML::Node& node, std::string_view key);

/// [w, x, y, z] or {axis: [x, y, z], angle: degrees}; the result has length one.
Quaternion orientation(const Source& source, const YAML::Node& node);

/// A number, or a map with one of the keys constant, linear, sine, table, polynomial, ramp and input (docs/scenes.md).
/// inputs: to which an input is added; null: there can be none.
Motion motion(const Source& source, const YAML::Node& node, std::string_view key, Inputs* inputs);

/// The elements of a list; refuses anything else.
std::vector<YAML::Node> elements(const Source& source, const YAML::Node& node, std::string_view key);

/// One copy of an item with `repeat`: where it lies in the grid.
struct Copy {
    bool repeated = false;
    std::array<std::int64_t, 3> index{0, 0, 0};
    Vector3 offset{0.0, 0.0, 0.0};  ///< m; added to the item's points
};

/// {count: n or [nx, ny, nz], spacing: [x, y, z]}; the copies in the order of k, j, i, the last being the fastest.
std::vector<Copy> repeat(const Source& source, const YAML::Node& node);

/// Replaces {i}, {j}, {k}, also {i+1} and {i-1}, in a repeated item's names; others are taken as they are.
std::string name_in(const Source& source, const YAML::Node& node, std::string_view key, const Copy& copy);

Vector3 point_in(const Source& source, const YAML::Node& node, std::string_view key, const Copy& copy);

}  // namespace delassus::scene
