// SPDX-License-Identifier: BSD-3-Clause
// What the add_…() of a multibody system check.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <string_view>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"

namespace delassus::mechanics {

inline bool finite(const Vector3& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

inline bool finite_and_not_negative(std::initializer_list<double> values) {
    for (const double value : values)
        if (!(value >= 0.0) || std::isinf(value)) return false;
    return true;
}

/// Throws InputError "what "name" rule" unless the condition holds.
inline void refuse_unless(bool condition, std::string_view what, std::string_view name, std::string_view rule) {
    if (!condition) throw InputError(fmt::format("{} \"{}\" {}", what, name, rule));
}

/// Throws InputError unless the values are in the ranges that ElasticMaterial names.
void check_material(const ElasticMaterial& material);

/// Throws InputError unless the joint has the coordinates that its springs, dampers and friction act in.
void check_joint_forces(const JointParameters& joint);

}  // namespace delassus::mechanics
