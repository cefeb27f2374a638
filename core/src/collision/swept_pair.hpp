// SPDX-License-Identifier: BSD-3-Clause
// Contacts of shapes that meet on their way in a step.
//
// A contact is a linear bound on the velocities of a step: n·(Δ_b − Δ_a) ≥ −gap for the displacements Δ of its points.
// What is farther away than the envelope at the beginning has no bound, and goes through what it meets; what is nearer
// is held off by a half-space, though it may pass beside the shape. Which pairs can meet follows from the motion that
// they have now: their distance changes by at most
//
//     m = |d_b − d_a| + |θ_a| r_a + |θ_b| r_b
//
// with the translations d of the shapes' origins, the rotations θ and the reaches r. A pair with m below the envelope
// is looked at where it is. Otherwise
//   near    points up to min(m, a quarter of the smaller reach) away count if one of them would come into the envelope:
//           all points of the pair, since what one of them stops turns the others in. Over so short a way normals
//           hardly turn.
//   far     the shapes are advanced conservatively (Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems,
//           1996, section 2.3) until they are in the envelope. From the distance g and the normal n they cannot meet
//           before g = s τ + ½ c τ². There s = n·(d_a − d_b) + max p·(n×θ_a) + max p·(θ_b×n) is the largest speed along
//           n of two of their points: p are those of the cores, about the origins of their bodies, whose translations
//           are d; and c = |θ_a|² r_a + |θ_b|² r_b bounds how s grows. So what turns past a surface takes few advances.
//           A contact of that place, at the share t of the way, has the arms and the normal that it has there, since
//           they say how fast the bodies close, and the gap that this speed takes until t.
// Points of a pair where it is, or near, may be closer than its bodies move towards them at first, as the bound has it,
// while none touches yet; and what comes into the envelope on the way may pass. Then the shapes are advanced in the
// same way, to a millionth of their gap or of the envelope: those that pass get no contact, and those that strike where
// the normal has turned till then, or was not that of the beginning already, have the contacts of that place.
#pragma once

#include <vector>

#include "collision/narrow_phase.hpp"

namespace delassus::collision {

/// How a shape moves over the step: with its body, which moves straight on and turns about its origin.
struct Sweep {
    Vector3d straight = Vector3d::Zero();     ///< translation of the body's origin, m
    Vector3d arm = Vector3d::Zero();          ///< from there to the shape's origin, m
    Vector3d rotation = Vector3d::Zero();     ///< rotation vector, rad
    Vector3d fall = Vector3d::Zero();         ///< the part of the translation that its weight adds, m
    Vector3d translation = Vector3d::Zero();  ///< of the shape's origin over the whole step, m
    /// How far a point of it gets at most from where the shape would be without rotation along the chord, m.
    double turned = 0.0;
};

/// m: how much nearer to each other two shapes can come.
[[nodiscard]] double approach_bound(const Sweep& a, const Sweep& b);

class SweptPair {
public:
    /// Appends the points of a pair; shape_a and shape_b are left to the caller.
    void collide(NarrowPhase& by, Placed& a, Placed& b, const Sweep& of_a, const Sweep& of_b, double envelope,
                 std::vector<ContactPoint>& contacts);

private:
    bool near(const Placed& a, const Placed& b, const Sweep& of_a, const Sweep& of_b, double envelope) const;
    /// found_ ← the points in the envelope at the place where the shapes come nearer than `distance`, if they do.
    void advance_to(double distance, NarrowPhase& by, const Placed& a, const Placed& b, const Sweep& of_a,
                    const Sweep& of_b, double envelope);
    /// found_ ← what is left of it where the shapes pass, or meet elsewhere.
    void keep_what_meets(NarrowPhase& by, const Placed& a, const Placed& b, const Sweep& of_a, const Sweep& of_b,
                         double envelope);

    Placed moved_a_, moved_b_;
    std::vector<ContactPoint> found_, begin_;
};

}  // namespace delassus::collision
