// SPDX-License-Identifier: BSD-3-Clause
// What there is to know of a kind of cone. Each kind's file has one ConeDescription; sdk/cones.hpp makes the table.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "delassus/plugin.h"

namespace delassus::sdk {

/// A block that is projected, or treated by a kernel, as a whole has at most so many rows.
inline constexpr std::int32_t largest_block_rows = 6;
/// A kind has at most so many parameters.
inline constexpr std::int32_t most_parameters = 4;

/// A number that a block's cone has, e.g. the friction coefficient.
struct ConeParameter {
    std::string_view key;                                   ///< in problem.json
    std::string_view name;                                  ///< in messages
    double least = 0.0;                                     ///< the smallest allowed value
    double example = 0.0;                                   ///< an ordinary one, for problems of tests
    bool is_reaction = false;                               ///< whether it has the unit of λ
    double most = std::numeric_limits<double>::infinity();  ///< the largest allowed value
    std::string_view why_most = {};                         ///< what is wrong with larger ones, as messages say it

    [[nodiscard]] constexpr bool takes(double value) const {
        return value >= least && value <= most && value < std::numeric_limits<double>::infinity();
    }
};

/// lo ≤ λ ≤ hi of one row; bounds may be infinite.
struct Interval {
    double lo = -std::numeric_limits<double>::infinity();
    double hi = std::numeric_limits<double>::infinity();
};

/// Vectors hold the block's rows. In a kind whose rows do not separate, and which is a cone, the first row is one along
/// which λ is positive for every λ ∈ Υ but 0 (a normal), and e₁ lies inside Υ*.
struct ConeDescription {
    std::int32_t kind = 0;               ///< delassus_cone_kind, and the row in the table
    std::string_view name = {};          ///< in problem.json, sidecars and messages
    std::string_view plural = {};        ///< in messages: "1421 friction cones"; without its last letter the singular
    std::string_view set = {};           ///< Υ, for the documentation
    std::string_view dual = {};          ///< Υ*, likewise
    std::string_view use = {};           ///< what it is for, likewise
    std::string_view allowed_rows = {};  ///< of a block, as messages say it
    std::int32_t least_rows = 1;         ///< of a block
    std::int32_t most_rows = std::numeric_limits<std::int32_t>::max();
    std::int32_t usual_rows = 1;       ///< of a block for which problem.json gives no dimension
    std::int32_t parameter_count = 0;  ///< at most most_parameters
    ConeParameter parameters[most_parameters] = {};
    bool has_bounds = false;  ///< whether its blocks have lo and hi
    bool is_linear = false;   ///< Υ = Rᵏ and u = 0: a problem of such rows only is a linear system
    bool is_cone = true;  ///< t λ ∈ Υ for every λ ∈ Υ and t > 0; otherwise Υ* is that of the recession cone
};

}  // namespace delassus::sdk
