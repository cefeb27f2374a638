// SPDX-License-Identifier: BSD-3-Clause
// A family of problems: its table of parameters and its function, tied together once so that the two cannot disagree.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"

namespace delassus::generating {

/// A row of a family's table. The default is the member's in a default-constructed Parameters.
template <class Parameters>
struct Field {
    std::string_view key;
    std::variant<double Parameters::*, std::int32_t Parameters::*, std::uint64_t Parameters::*, bool Parameters::*>
        member;
    double minimum;
    double maximum;
    std::string_view unit;
    std::string_view doc;

    [[nodiscard]] double get(const Parameters& parameters) const {
        return std::visit([&](const auto& pointer) { return static_cast<double>(parameters.*pointer); }, member);
    }
    void set(Parameters& parameters, double value) const {
        std::visit(
            [&](const auto& pointer) {
                using Member = std::remove_reference_t<decltype(parameters.*pointer)>;
                parameters.*pointer = static_cast<Member>(value);
            },
            member);
    }
    [[nodiscard]] bool integer() const { return member.index() != 0; }

    /// Throws InputError unless the value lies in the range and is whole where it has to be. NaN is outside.
    void check(std::string_view family, double value) const {
        if (!(value >= minimum && value <= maximum)) {
            throw InputError(fmt::format("{}: {} = {:g} lies outside its range, {:g} to {:g}{}{}", family, key, value,
                                         minimum, maximum, unit.empty() ? "" : " ", unit));
        }
        if (integer() && value != std::floor(value)) {
            throw InputError(fmt::format("{}: {} = {:g} must be a whole number", family, key, value));
        }
    }
};

struct Family {
    std::string_view name;
    std::string_view doc;
    std::vector<GeneratorParameter> parameters;
    /// Every key is known to be in the table.
    std::function<Problem(const std::map<std::string, double>&)> make;
};

/// The seed's range ends where doubles stop holding every whole number.
inline constexpr double kLargestSeed = 9007199254740992.0;

template <class Parameters>
void check_parameters(std::string_view family, std::span<const Field<Parameters>> fields,
                      const Parameters& parameters) {
    for (const auto& field : fields) field.check(family, field.get(parameters));
}

template <class Parameters>
Family make_family(std::string_view name, std::string_view doc, std::span<const Field<Parameters>> fields,
                   Problem (*function)(const Parameters&)) {
    Family family{name, doc, {}, {}};
    static const Parameters defaults;
    for (const auto& field : fields) {
        family.parameters.push_back(
            {field.key, field.get(defaults), field.minimum, field.maximum, field.integer(), field.unit, field.doc});
    }
    family.make = [name, fields, function](const std::map<std::string, double>& values) {
        Parameters parameters;
        for (const auto& field : fields) {
            const auto found = values.find(std::string(field.key));
            if (found == values.end()) continue;
            field.check(name, found->second);
            field.set(parameters, found->second);
        }
        return function(parameters);
    };
    return family;
}

/// Throws InputError if a product of parameters asks for more things than memory and 32-bit indices are good for.
inline void check_count(std::string_view family, std::string_view things, double count) {
    constexpr double most = 4e6;
    if (count > most) {
        throw InputError(
            fmt::format("{}: the parameters ask for {:g} {}, more than {:g}", family, count, things, most));
    }
}

Family chain_family();
Family net_family();
Family sphere_pile_family();
Family pile_family();
Family box_stack_family();
Family brick_wall_family();
Family elastic_block_family();
Family gyroscopic_family();
Family motors_family();

}  // namespace delassus::generating
