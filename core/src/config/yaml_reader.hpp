// SPDX-License-Identifier: BSD-3-Clause
// Reading YAML so that every complaint names the place, the key and what would be right.
#pragma once

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

/// A place in the text, for messages: "solver.yaml, line 3".
class Source {
public:
    explicit Source(std::string_view where) : where_(where) {}

    [[nodiscard]] std::string at(const YAML::Mark& mark) const {
        return mark.is_null() ? where_ : fmt::format("{}, line {}", where_, mark.line + 1);
    }
    [[nodiscard]] std::string at(const YAML::Node& node) const {
        for (const auto& [set, place] : elsewhere_)
            if (set.is(node)) return place;
        return at(node.Mark());
    }
    [[noreturn]] void refuse(const YAML::Node& node, std::string_view what) const {
        throw InputError(fmt::format("{}: {}", at(node), what));
    }
    /// The folder that relative paths in the text start from: that of the file.
    [[nodiscard]] std::filesystem::path folder() const { return std::filesystem::path(where_).parent_path(); }
    /// Records that the node came from that place and not from the text.
    void comes_from(const YAML::Node& node, const std::string& place) { elsewhere_.emplace_back(node, place); }

private:
    std::string where_;
    std::vector<std::pair<YAML::Node, std::string>> elsewhere_;
};

/// The one document of the text; null if it is empty. Throws YAML::Exception, and InputError if there is another one.
inline YAML::Node load_document(const Source& source, const std::string& text) {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.size() > 1)
        source.refuse(documents[1],
                      "here begins a second YAML document, but a file has one; take away the line \"---\"");
    return documents.empty() ? YAML::Node() : documents[0];
}

inline std::string scalar(const Source& source, const YAML::Node& node, std::string_view key) {
    if (!node.IsScalar()) source.refuse(node, fmt::format("\"{}\" must be a single value", key));
    return node.Scalar();
}

template <class Value>
Value value(const Source& source, const YAML::Node& node, std::string_view key, std::string_view kind) {
    const std::string text = scalar(source, node, key);
    Value result{};
    if (!YAML::convert<Value>::decode(node, result))
        source.refuse(node, fmt::format("\"{}\" is \"{}\"; it must be {}", key, text, kind));
    return result;
}

using Handler = std::function<void(const YAML::Node&)>;

/// Hands each key of a map to its handler; refuses other keys, and a key that comes twice.
inline void read_map(const Source& source, const YAML::Node& map, std::string_view name,
                     const std::vector<std::pair<std::string_view, Handler>>& handlers) {
    std::vector<std::string_view> keys;
    for (const auto& handler : handlers) keys.push_back(handler.first);
    if (!map.IsMap())
        source.refuse(map,
                      fmt::format("{} must be a map of keys to values; its keys are {}", name, fmt::join(keys, ", ")));
    std::vector<std::string> seen;
    for (const auto& entry : map) {
        const std::string key = scalar(source, entry.first, "key");
        if (std::find(seen.begin(), seen.end(), key) != seen.end())
            source.refuse(entry.first, fmt::format("\"{}\" is given twice", key));
        seen.push_back(key);
        const auto handler = std::find_if(handlers.begin(), handlers.end(),
                                          [&](const auto& candidate) { return candidate.first == key; });
        if (handler == handlers.end())
            source.refuse(entry.first, fmt::format("{} has no key \"{}\"{}", name, key, nearest_name_hint(key, keys)));
        handler->second(entry.second);
    }
}

}  // namespace delassus
