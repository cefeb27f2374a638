// SPDX-License-Identifier: BSD-3-Clause
// Option tables: checking what a user wrote, and showing what there is.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/plugin_info.hpp"
#include "support/json.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

namespace {

std::string number_text(double value) {
    if (std::isinf(value)) return value > 0 ? "infinity" : "-infinity";
    return fmt::format("{}", value);
}

[[noreturn]] void refuse(std::string_view solver, const OptionInfo& option, std::string_view text) {
    throw InputError(
        fmt::format("option \"{}\" of {} cannot be \"{}\": it is {}", option.key, solver, text, option.domain()));
}

template <class Number>
bool parse(std::string_view text, Number& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc{} && end == text.data() + text.size();
}

OptionValue checked(std::string_view solver, const OptionInfo& option, const std::string& text) {
    OptionValue value{option.key, option.type, 0, 0.0, {}};
    const auto in_range = [&](double number) { return number >= option.minimum && number <= option.maximum; };
    switch (option.type) {
        case DELASSUS_OPTION_BOOLEAN:
            if (text != "true" && text != "false") refuse(solver, option, text);
            value.integer = text == "true";
            break;
        case DELASSUS_OPTION_INTEGER:
            if (!parse(text, value.integer) || !in_range(static_cast<double>(value.integer)))
                refuse(solver, option, text);
            break;
        case DELASSUS_OPTION_REAL:
            if (!parse(text, value.real) || std::isnan(value.real) || !in_range(value.real))
                refuse(solver, option, text);
            break;
        case DELASSUS_OPTION_CHOICE:
            if (std::find(option.choices.begin(), option.choices.end(), text) == option.choices.end())
                refuse(solver, option, text);
            value.text = text;
            break;
        case DELASSUS_OPTION_TEXT:
            value.text = text;
            break;
    }
    return value;
}

}  // namespace

std::string OptionInfo::domain() const {
    switch (type) {
        case DELASSUS_OPTION_BOOLEAN:
            return "true or false";
        case DELASSUS_OPTION_CHOICE:
            return fmt::format("one of {}", fmt::join(choices, ", "));
        case DELASSUS_OPTION_TEXT:
            return "text";
        default:
            break;
    }
    const std::string_view kind = type == DELASSUS_OPTION_INTEGER ? "an integer" : "a number";
    const bool below = std::isfinite(minimum), above = std::isfinite(maximum);
    if (below && above) return fmt::format("{} from {} to {}", kind, number_text(minimum), number_text(maximum));
    if (below) return fmt::format("{}, at least {}", kind, number_text(minimum));
    if (above) return fmt::format("{}, at most {}", kind, number_text(maximum));
    return std::string(kind);
}

std::vector<OptionValue> resolve_options(std::string_view solver, const std::vector<OptionInfo>& table,
                                         const OptionTexts& chosen) {
    std::vector<std::string_view> keys;
    for (const auto& option : table) keys.push_back(option.key);
    for (const auto& [key, text] : chosen) {
        if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
        if (keys.empty()) throw InputError(fmt::format("{} has no option \"{}\": it has no options", solver, key));
        throw InputError(fmt::format("{} has no option \"{}\"{}", solver, key, nearest_name_hint(key, keys)));
    }
    std::vector<OptionValue> values;
    for (const auto& option : table) {
        const auto found = chosen.find(option.key);
        values.push_back(checked(solver, option, found != chosen.end() ? found->second : option.default_value));
    }
    return values;
}

std::string options_schema(std::string_view solver, const std::vector<OptionInfo>& table) {
    nlohmann::ordered_json properties = nlohmann::ordered_json::object();
    for (const auto& option : table) {
        nlohmann::ordered_json property = nlohmann::ordered_json::object();
        property["description"] = option.unit.empty() ? option.doc : fmt::format("{} [{}]", option.doc, option.unit);
        switch (option.type) {
            case DELASSUS_OPTION_BOOLEAN:
                property["type"] = "boolean";
                property["default"] = option.default_value == "true";
                break;
            case DELASSUS_OPTION_CHOICE:
                property["enum"] = option.choices;
                property["default"] = option.default_value;
                break;
            case DELASSUS_OPTION_TEXT:
                property["type"] = "string";
                property["default"] = option.default_value;
                break;
            default: {
                property["type"] = option.type == DELASSUS_OPTION_INTEGER ? "integer" : "number";
                if (std::isfinite(option.minimum)) property["minimum"] = option.minimum;
                if (std::isfinite(option.maximum)) property["maximum"] = option.maximum;
                std::int64_t integer = 0;
                double real = 0.0;
                if (option.type == DELASSUS_OPTION_INTEGER && parse(option.default_value, integer)) {
                    property["default"] = integer;
                } else if (parse(option.default_value, real) && std::isfinite(real)) {
                    property["default"] = real;
                }
                break;
            }
        }
        properties[option.key] = std::move(property);
    }
    const nlohmann::ordered_json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                                           {"title", fmt::format("Options of the solver {}", solver)},
                                           {"type", "object"},
                                           {"additionalProperties", false},
                                           {"properties", properties}};
    return json_text(schema, 2) + "\n";
}

}  // namespace delassus
