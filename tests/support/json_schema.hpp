// SPDX-License-Identifier: BSD-3-Clause
// As much of JSON Schema (draft 7) as the schema of scenes uses.
#pragma once

#include <regex.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace delassus::tests {

class JsonSchema {
public:
    explicit JsonSchema(nlohmann::json schema) : root_(std::move(schema)) {}

    /// The first place where the value does not fit, with the keyword; empty if it fits. Throws std::runtime_error on a
    /// keyword that is not known here.
    [[nodiscard]] std::string fault(const nlohmann::json& value) const { return fault(root_, value, ""); }

private:
    using Json = nlohmann::json;

    [[nodiscard]] const Json& resolved(const std::string& reference) const {
        return root_.at(Json::json_pointer(reference.substr(1)));
    }

    [[nodiscard]] std::string fault(const Json& schema, const Json& value, const std::string& place) const {
        const auto wrong = [&](const std::string& keyword) { return place + ": " + keyword; };
        for (const auto& [keyword, rule] : schema.items()) {
            std::string inner;
            if (keyword == "$ref") {
                inner = fault(resolved(rule), value, place);
            } else if (keyword == "type") {
                const bool one = rule.is_string() ? is(rule, value)
                                                  : std::any_of(rule.begin(), rule.end(),
                                                                [&](const Json& type) { return is(type, value); });
                if (!one) return wrong("type " + rule.dump());
            } else if (keyword == "enum") {
                if (std::find(rule.begin(), rule.end(), value) == rule.end()) return wrong("enum");
            } else if (keyword == "allOf") {
                for (const auto& part : rule)
                    if (inner.empty()) inner = fault(part, value, place);
            } else if (keyword == "oneOf") {
                if (std::count_if(rule.begin(), rule.end(),
                                  [&](const Json& part) { return fault(part, value, place).empty(); }) != 1)
                    return wrong("oneOf");
            } else if (keyword == "anyOf") {
                if (std::none_of(rule.begin(), rule.end(),
                                 [&](const Json& part) { return fault(part, value, place).empty(); }))
                    return wrong("anyOf");
            } else if (keyword == "not") {
                if (fault(rule, value, place).empty()) return wrong("not");
            } else if (keyword == "if") {
                const char* branch = fault(rule, value, place).empty() ? "then" : "else";
                if (schema.contains(branch)) inner = fault(schema.at(branch), value, place);
            } else if (value.is_object()) {
                inner = object_fault(schema, keyword, rule, value, place);
            } else if (value.is_array()) {
                inner = array_fault(keyword, rule, value, place);
            } else if (value.is_number()) {
                const auto number = value.get<double>();
                if ((keyword == "minimum" && number < rule.get<double>()) ||
                    (keyword == "maximum" && number > rule.get<double>()) ||
                    (keyword == "exclusiveMinimum" && number <= rule.get<double>()))
                    return wrong(keyword);
            } else if (value.is_string() && keyword == "pattern") {
                if (!matches(rule.get<std::string>(), value.get<std::string>())) return wrong("pattern");
            }
            check_known(keyword);
            if (!inner.empty()) return inner;
        }
        return {};
    }

    [[nodiscard]] std::string object_fault(const Json& schema, const std::string& keyword, const Json& rule,
                                           const Json& value, const std::string& place) const {
        if (keyword == "required") {
            for (const auto& key : rule)
                if (!value.contains(key.get<std::string>())) return place + ": required " + key.get<std::string>();
        } else if (keyword == "minProperties") {
            if (value.size() < rule.get<std::size_t>()) return place + ": minProperties";
        } else if (keyword == "maxProperties") {
            if (value.size() > rule.get<std::size_t>()) return place + ": maxProperties";
        }
        for (const auto& [key, member] : value.items()) {
            const std::string inside = place + "/" + key;
            const bool listed = schema.contains("properties") && schema.at("properties").contains(key);
            std::string inner;
            if (keyword == "properties" && listed) inner = fault(rule.at(key), member, inside);
            if (keyword == "propertyNames") inner = fault(rule, key, inside);
            if (keyword == "additionalProperties" && !listed) {
                if (rule == false) return inside + ": additionalProperties";
                inner = fault(rule, member, inside);
            }
            if (!inner.empty()) return inner;
        }
        return {};
    }

    [[nodiscard]] std::string array_fault(const std::string& keyword, const Json& rule, const Json& value,
                                          const std::string& place) const {
        if (keyword == "minItems" && value.size() < rule.get<std::size_t>()) return place + ": minItems";
        if (keyword == "maxItems" && value.size() > rule.get<std::size_t>()) return place + ": maxItems";
        for (std::size_t i = 0; keyword == "items" && i < value.size(); ++i)
            if (auto inner = fault(rule, value[i], place + "/" + std::to_string(i)); !inner.empty()) return inner;
        return {};
    }

    /// POSIX extended expressions: std::regex gives false warnings with g++ 12 and sanitizers.
    static bool matches(const std::string& pattern, const std::string& text) {
        regex_t compiled;
        if (regcomp(&compiled, pattern.c_str(), REG_EXTENDED | REG_NOSUB) != 0)
            throw std::runtime_error("the pattern " + pattern + " is not valid");
        const bool found = regexec(&compiled, text.c_str(), 0, nullptr, 0) == 0;
        regfree(&compiled);
        return found;
    }

    static bool is(const Json& type, const Json& value) {
        if (type == "object") return value.is_object();
        if (type == "array") return value.is_array();
        if (type == "string") return value.is_string();
        if (type == "boolean") return value.is_boolean();
        if (type == "null") return value.is_null();
        if (type == "number") return value.is_number();
        if (type == "integer") return value.is_number() && std::floor(value.get<double>()) == value.get<double>();
        throw std::runtime_error("the type " + type.dump() + " is not known");
    }

    static void check_known(const std::string& keyword) {
        for (const char* known : {"$schema",
                                  "$ref",
                                  "title",
                                  "description",
                                  "definitions",
                                  "type",
                                  "enum",
                                  "allOf",
                                  "anyOf",
                                  "oneOf",
                                  "not",
                                  "if",
                                  "then",
                                  "else",
                                  "required",
                                  "minProperties",
                                  "maxProperties",
                                  "propertyNames",
                                  "properties",
                                  "pattern",
                                  "items",
                                  "minItems",
                                  "maxItems",
                                  "minimum",
                                  "maximum",
                                  "exclusiveMinimum",
                                  "additionalProperties"})
            if (keyword == known) return;
        throw std::runtime_error("the keyword " + keyword + " is not known");
    }

    Json root_;
};

}  // namespace delassus::tests
