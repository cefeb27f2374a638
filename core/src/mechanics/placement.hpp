// SPDX-License-Identifier: BSD-3-Clause
// Where the bodies of a system are and how they move.
#pragma once

#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

/// Where a body is and how it moves. Columns of v: x at column, θ at column + 3; −1 if it is fixed. A body whose motion
/// is prescribed has none either: a number of its own below −1 stands there.
struct Placement {
    Vector3d x = Vector3d::Zero();
    Matrix3d A = Matrix3d::Identity();
    Vector3d v = Vector3d::Zero();
    Vector3d omega = Vector3d::Zero();
    std::int32_t column = -1;
    // Of a prescribed motion: v̇, ω̇, and its turn since t = 0, over whole turns, in the frame of the body.
    Vector3d acceleration = Vector3d::Zero(), turning = Vector3d::Zero(), turn = Vector3d::Zero();

    [[nodiscard]] bool prescribed() const { return column < -1; }
};

/// Placements of all bodies, the world last, and what is known of angles over whole turns.
class Placements {
public:
    std::vector<double> angles;  ///< what q has of those that are counted, rad: see Angle

    explicit Placements(std::size_t bodies = 0) : items_(bodies + 1) {}
    Placement& operator[](BodyIndex body) {
        return items_[body == world_body ? items_.size() - 1 : static_cast<std::size_t>(body)];
    }
    const Placement& operator[](BodyIndex body) const {
        return items_[body == world_body ? items_.size() - 1 : static_cast<std::size_t>(body)];
    }

private:
    std::vector<Placement> items_;
};

}  // namespace delassus::mechanics
