// SPDX-License-Identifier: BSD-3-Clause
// The cones, by kind. A new kind is one file in cones/ and one row of cone_table here.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "delassus/plugin.h"
#include "delassus/sdk/cones/box.hpp"
#include "delassus/sdk/cones/free.hpp"
#include "delassus/sdk/cones/friction.hpp"
#include "delassus/sdk/cones/nonnegative.hpp"

namespace delassus::sdk {

/// What one kind of cone can do. All vectors hold the block's rows.
struct ConeOperations {
    std::string_view name;                                  ///< as in problem.json
    std::string_view plural;                                ///< for messages: "1421 friction cones"
    std::uint64_t capability;                               ///< the DELASSUS_CAN_* bit a solver needs for it
    void (*project)(const delassus_cone&, double* lambda);  ///< Euclidean projection onto Υ, in place
    void (*project_dual)(const delassus_cone&, double* u);  ///< Euclidean projection onto Υ*, in place
    double (*gap)(const delassus_cone&, const double* lambda, const double* u);  ///< 0 at a solution
};

template <class Cone>
constexpr ConeOperations cone_operations(std::string_view name, std::string_view plural, std::uint64_t capability) {
    return {name, plural, capability, &Cone::project, &Cone::project_dual, &Cone::gap};
}

/// Row k serves the kind with number k (delassus_cone_kind).
inline constexpr std::array cone_table = {
    cone_operations<FreeCone>("free", "free rows", DELASSUS_CAN_FREE),
    cone_operations<NonnegativeCone>("nonnegative", "nonnegative rows", DELASSUS_CAN_NONNEGATIVE),
    cone_operations<BoxCone>("box", "box rows", DELASSUS_CAN_BOX),
    cone_operations<FrictionCone>("friction", "friction cones", DELASSUS_CAN_FRICTION),
};

inline const ConeOperations& operations_of(const delassus_cone& cone) {
    return cone_table[static_cast<std::size_t>(cone.kind)];
}

/// Projects the block's rows of λ onto Υ; inlined for the two kinds that fill hot loops.
inline void project(const delassus_cone& cone, double* lambda) {
    if (cone.kind == DELASSUS_CONE_FRICTION) {
        FrictionCone::project(cone, lambda);
    } else if (cone.kind == DELASSUS_CONE_NONNEGATIVE) {
        NonnegativeCone::project(cone, lambda);
    } else {
        operations_of(cone).project(cone, lambda);
    }
}

/// Whether a change of one row leaves the others' sets alone, so that rows may be scaled and stepped one by one.
inline bool is_separable(const delassus_cone& cone) {
    return cone.kind != DELASSUS_CONE_FRICTION;
}

}  // namespace delassus::sdk
