// SPDX-License-Identifier: BSD-3-Clause
// A plugin's option table and the values that a user chose.
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "delassus/plugin.h"

namespace delassus::sdk {

// Rows of an option table. All strings must be literals: the table is static. Defaults are written as a user would.

constexpr delassus_option boolean_option(const char* key, const char* standard, const char* doc) {
    return {key, DELASSUS_OPTION_BOOLEAN, 0, standard, 0.0, 1.0, nullptr, "", doc};
}
/// With a bool itself, not with what converts to one, as every text does to true.
constexpr delassus_option boolean_option(const char* key, std::same_as<bool> auto standard, const char* doc) {
    return boolean_option(key, standard ? "true" : "false", doc);
}
constexpr delassus_option integer_option(const char* key, const char* standard, double minimum, double maximum,
                                         const char* unit, const char* doc) {
    return {key, DELASSUS_OPTION_INTEGER, 0, standard, minimum, maximum, nullptr, unit, doc};
}
constexpr delassus_option real_option(const char* key, const char* standard, double minimum, double maximum,
                                      const char* unit, const char* doc) {
    return {key, DELASSUS_OPTION_REAL, 0, standard, minimum, maximum, nullptr, unit, doc};
}
template <std::size_t Count>
constexpr delassus_option choice_option(const char* key, const char* standard, const char* const (&choices)[Count],
                                        const char* doc) {
    return {key, DELASSUS_OPTION_CHOICE, static_cast<std::int32_t>(Count), standard, 0.0, 0.0, choices, "", doc};
}
constexpr delassus_option text_option(const char* key, const char* standard, const char* doc) {
    return {key, DELASSUS_OPTION_TEXT, 0, standard, 0.0, 0.0, nullptr, "", doc};
}
inline constexpr double unbounded = std::numeric_limits<double>::infinity();

/// The values that the host passes to a new solver: one for every row of the table, already checked against it.
/// Asking for a key or a type that the table does not have is a mistake of the plugin and throws std::logic_error.
class OptionValues {
public:
    explicit OptionValues(std::span<const delassus_option_value> values) : values_(values) {}

    [[nodiscard]] bool boolean(std::string_view key) const { return find(key, DELASSUS_OPTION_BOOLEAN).integer != 0; }
    [[nodiscard]] std::int64_t integer(std::string_view key) const {
        return find(key, DELASSUS_OPTION_INTEGER).integer;
    }
    [[nodiscard]] double real(std::string_view key) const { return find(key, DELASSUS_OPTION_REAL).real; }
    [[nodiscard]] std::string choice(std::string_view key) const { return find(key, DELASSUS_OPTION_CHOICE).text; }
    [[nodiscard]] std::string text(std::string_view key) const { return find(key, DELASSUS_OPTION_TEXT).text; }

private:
    [[nodiscard]] const delassus_option_value& find(std::string_view key, delassus_option_type type) const {
        for (const auto& value : values_)
            if (key == value.key && value.type == type) return value;
        throw std::logic_error("the option table has no \"" + std::string(key) + "\" of that type");
    }

    std::span<const delassus_option_value> values_;
};

}  // namespace delassus::sdk
