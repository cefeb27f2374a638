// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string_view>
#include <utility>

#include "delassus/multibody.hpp"

namespace delassus::scene {

/// The kinds of joints with their names in scene files, in the order of JointKind.
inline constexpr std::array<std::pair<std::string_view, JointKind>, 10> joint_kinds = {
    {{"spherical", JointKind::Spherical},
     {"revolute", JointKind::Revolute},
     {"prismatic", JointKind::Prismatic},
     {"cylindrical", JointKind::Cylindrical},
     {"universal", JointKind::Universal},
     {"fixed", JointKind::Fixed},
     {"planar", JointKind::Planar},
     {"point_on_plane", JointKind::PointOnPlane},
     {"distance", JointKind::Distance},
     {"gear", JointKind::Gear}}};

}  // namespace delassus::scene
