// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "collision/manifold.hpp"
#include "collision/terrain_contacts.hpp"

namespace delassus::collision {

/// Points between two placed solids. Keeps its memory from pair to pair.
class NarrowPhase {
public:
    /// Appends the points of the pair nearer than envelope (m); shape_a and shape_b are left to the caller.
    void collide(Placed& a, Placed& b, double envelope, std::vector<ContactPoint>& contacts);

private:
    Manifold manifold_;
    TerrainContacts terrain_;
    std::vector<CorePoint> points_;
};

/// The point of a box, segment, cylinder or point core nearest to a point, both in the core's frame. distance is
/// negative inside, normal is unit and outward.
void nearest_on_core(const Solid& solid, const Vector3d& point, double& distance, Vector3d& normal, Vector3d& nearest);

}  // namespace delassus::collision
