// SPDX-License-Identifier: BSD-3-Clause
// Lists in place of values: a map of keys to values or lists stands for one map for each combination.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "config/yaml_reader.hpp"

namespace delassus::bench {

using Combination = std::map<std::string, std::string>;

/// A key with the values it takes, in the order of the file.
using Axis = std::pair<std::string, std::vector<std::string>>;

/// The values of a key: one, or a list. Refuses an empty list and nested values.
inline std::vector<std::string> values_of(const Source& source, const YAML::Node& node, const std::string& key) {
    if (!node.IsSequence()) return {scalar(source, node, key)};
    std::vector<std::string> values;
    for (const auto& item : node) values.push_back(scalar(source, item, key));
    if (values.empty()) source.refuse(node, fmt::format("the list of \"{}\" is empty", key));
    return values;
}

/// All combinations; the last axis changes fastest.
inline std::vector<Combination> combinations(const std::vector<Axis>& axes) {
    std::vector<Combination> all = {{}};
    for (const auto& [key, values] : axes) {
        std::vector<Combination> longer;
        for (const auto& one : all)
            for (const auto& value : values) {
                longer.push_back(one);
                longer.back()[key] = value;
            }
        all = std::move(longer);
    }
    return all;
}

/// The axes of a map.
inline std::vector<Axis> axes_of(const Source& source, const YAML::Node& map, std::string_view name) {
    if (!map.IsMap()) source.refuse(map, fmt::format("\"{}\" must be a map of keys to values or lists", name));
    std::vector<Axis> axes;
    for (const auto& entry : map) {
        const std::string key = scalar(source, entry.first, "key");
        for (const auto& axis : axes)
            if (axis.first == key) source.refuse(entry.first, fmt::format("\"{}\" is given twice", key));
        axes.emplace_back(key, values_of(source, entry.second, key));
    }
    return axes;
}

}  // namespace delassus::bench
