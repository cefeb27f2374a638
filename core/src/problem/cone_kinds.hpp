// SPDX-License-Identifier: BSD-3-Clause
// The table of cones for what the host keeps.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "delassus/problem.hpp"
#include "delassus/sdk/cones.hpp"

namespace delassus {

static_assert(sdk::most_parameters == std::tuple_size_v<decltype(Cone::parameters)>);

/// The kind's row of the table; the kind must be one of the table's.
inline const sdk::ConeOperations& operations_of(ConeKind kind) {
    return sdk::cone_table[static_cast<std::size_t>(kind)];
}
inline const sdk::ConeOperations& operations_of(const Cone& cone) {
    return operations_of(cone.kind);
}

[[nodiscard]] inline bool is_known(ConeKind kind) {
    const auto number = static_cast<std::int32_t>(kind);
    return number >= 0 && static_cast<std::size_t>(number) < sdk::cone_table.size();
}

/// The row of the kind of that name; null if there is none.
inline const sdk::ConeOperations* find_cone_kind(std::string_view name) {
    const auto* row = std::find_if(sdk::cone_table.begin(), sdk::cone_table.end(),
                                   [&](const sdk::ConeOperations& kind) { return kind.name == name; });
    return row == sdk::cone_table.end() ? nullptr : row;
}

/// What a parameter must be, in words that follow "it must be".
[[nodiscard]] inline std::string domain_of(const sdk::ConeParameter& parameter) {
    if (parameter.most == std::numeric_limits<double>::infinity())
        return fmt::format("finite and at least {}", parameter.least);
    return fmt::format("at least {} and at most {}: {}", parameter.least, parameter.most, parameter.why_most);
}

/// The bytes of its parameters that enter a hash. The first parameter always does, so that older hashes stay valid.
inline std::size_t parameter_bytes(const Cone& cone) {
    return sizeof(double) * static_cast<std::size_t>(std::max(1, operations_of(cone).parameter_count));
}

/// The cone as it crosses the border: valid as long as the cone stays where it is.
inline delassus_cone raw_cone(const Cone& cone, std::int32_t first_row = 0) {
    const sdk::ConeOperations& kind = operations_of(cone);
    return {kind.kind,
            first_row,
            cone.rows,
            kind.parameter_count,
            kind.parameter_count > 0 ? cone.parameters.data() : nullptr,
            kind.has_bounds ? cone.lo.data() : nullptr,
            kind.has_bounds ? cone.hi.data() : nullptr};
}

/// Has the cones point to copies of their parameters that stand side by side, since solvers read them in every sweep.
inline void put_side_by_side(std::vector<delassus_cone>& cones, std::vector<double>& parameters) {
    std::size_t count = 0;
    for (const delassus_cone& cone : cones) count += static_cast<std::size_t>(cone.parameter_count);
    parameters.resize(count);
    double* place = parameters.data();
    for (delassus_cone& cone : cones) {
        if (cone.parameter_count == 0) continue;
        std::copy_n(cone.parameters, cone.parameter_count, place);
        cone.parameters = place;
        place += cone.parameter_count;
    }
}

}  // namespace delassus
