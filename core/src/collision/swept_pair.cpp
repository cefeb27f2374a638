// SPDX-License-Identifier: BSD-3-Clause
#include "collision/swept_pair.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::collision {
namespace {

/// By the velocities of the beginning, as a linear bound has it.
Vector3d displacement(const Placed& placed, const Sweep& sweep, const Vector3& point) {
    return sweep.straight + sweep.rotation.cross(vector(point) - placed.position + sweep.arm);
}

/// How far rotation would move a point of the core along a direction, as fast as it does after the share t of the way,
/// and by how much more at the end of a whole way from there on.
struct Turning {
    double speed, acceleration;
};

/// The sphere about a core does not change as it turns.
Turning turning(const Placed& placed, const Sweep& sweep, double t, Placed& moved, const Vector3d& direction) {
    const double angle = sweep.rotation.norm(), reach = sweep.arm.norm() + placed.solid->reach;
    if (angle == 0.0) return {0.0, 0.0};
    if (placed.solid->core.vertices.empty()) return {angle * reach, 0.0};
    if (!placed.solid->core.is_large()) moved.rotate_core();
    const Vector3d fastest = direction.cross(sweep.rotation);
    const Vector3d arm = moved.position - (placed.position - sweep.arm + t * sweep.straight);
    return {fastest.dot(arm + moved.support(fastest)), angle * angle * reach};
}

/// moved ← placed, after the share t of its way.
void advance(const Placed& placed, const Sweep& sweep, double t, Placed& moved) {
    moved.solid = placed.solid;
    moved.rotated = false;
    moved.body = placed.body;
    moved.position = placed.position + t * sweep.straight;
    const double angle = sweep.rotation.norm();
    moved.rotation = placed.rotation;
    if (angle > 0.0) {
        const Matrix3d turn = Eigen::AngleAxisd(t * angle, sweep.rotation / angle).toRotationMatrix();
        moved.rotation = turn * placed.rotation;
        moved.position += turn * sweep.arm - sweep.arm;
    }
}

/// With which a point moves from a to b along its normal over the step, m.
double closing(const Placed& a, const Placed& b, const Sweep& of_a, const Sweep& of_b, const ContactPoint& contact) {
    return vector(contact.normal).dot(displacement(a, of_a, contact.point_a) - displacement(b, of_b, contact.point_b));
}

/// The point with the least gap, or the end.
std::vector<ContactPoint>::const_iterator nearest_of(const std::vector<ContactPoint>& points) {
    return std::min_element(points.begin(), points.end(),
                            [](const auto& one, const auto& other) { return one.gap < other.gap; });
}

/// How far away points are found with the shapes where they are. The normal of a plane does not turn at all.
double near_limit(const Placed& a, const Placed& b) {
    constexpr double share = 0.25;
    if (a.solid->kind == ShapeKind::Plane || b.solid->kind == ShapeKind::Plane)
        return std::numeric_limits<double>::infinity();
    if (a.solid->terrain) return share * b.solid->reach;
    if (b.solid->terrain) return share * a.solid->reach;
    return share * std::min(a.solid->reach, b.solid->reach);
}

}  // namespace

double approach_bound(const Sweep& a, const Sweep& b) {
    return (b.translation - a.translation).norm() + a.turned + b.turned;
}

void SweptPair::collide(NarrowPhase& by, Placed& a, Placed& b, const Sweep& of_a, const Sweep& of_b, double envelope,
                        std::vector<ContactPoint>& contacts) {
    const double bound = approach_bound(of_a, of_b), limit = near_limit(a, b);
    found_.clear();
    by.collide(a, b, bound <= envelope ? envelope : std::clamp(limit, envelope, bound), found_);
    if (bound > envelope && !near(a, b, of_a, of_b, envelope)) {
        found_.clear();
        if (bound > limit) advance_to(envelope, by, a, b, of_a, of_b, envelope);
    }
    keep_what_meets(by, a, b, of_a, of_b, envelope);
    contacts.insert(contacts.end(), found_.begin(), found_.end());
}

bool SweptPair::near(const Placed& a, const Placed& b, const Sweep& of_a, const Sweep& of_b, double envelope) const {
    return std::any_of(found_.begin(), found_.end(), [&](const ContactPoint& contact) {
        return contact.gap - std::max(closing(a, b, of_a, of_b, contact), 0.0) < envelope;
    });
}

// What strikes has the rows of the meeting. What touches all along but for a gap of rounding, or comes down slowly, has
// those of the beginning, which turn with its motion: most of its speed at the meeting comes from its weight and from
// the turn of the normal until then.
void SweptPair::keep_what_meets(NarrowPhase& by, const Placed& a, const Placed& b, const Sweep& of_a, const Sweep& of_b,
                                double envelope) {
    constexpr double touching = 1e-6, meeting = 1e-6, same_cosine = 1.0 - 1e-9, mostly = 0.5;
    const auto nearest = nearest_of(found_);
    const double reach = a.solid->reach > 0.0 && b.solid->reach > 0.0 ? std::min(a.solid->reach, b.solid->reach)
                                                                      : std::max(a.solid->reach, b.solid->reach);
    if (nearest == found_.end() || nearest->gap <= touching * reach) return;
    if (std::none_of(found_.begin(), found_.end(),
                     [&](const ContactPoint& contact) { return closing(a, b, of_a, of_b, contact) > contact.gap; }))
        return;
    const ContactPoint at_begin = *nearest;
    begin_.swap(found_);
    advance_to(meeting * std::min(at_begin.gap, envelope), by, a, b, of_a, of_b, envelope);
    if (at_begin.on_the_way || found_.empty()) return;
    const ContactPoint& met = *nearest_of(found_);
    const Vector3d normal = vector(at_begin.normal);
    const double begun = closing(a, b, of_a, of_b, at_begin) - normal.dot(of_a.fall - of_b.fall);
    if (normal.dot(vector(met.normal)) >= same_cosine || begun <= mostly * closing(a, b, of_a, of_b, met))
        found_.swap(begin_);
}

void SweptPair::advance_to(double distance, NarrowPhase& by, const Placed& a, const Placed& b, const Sweep& of_a,
                           const Sweep& of_b, double envelope) {
    constexpr int most_advances = 64;
    const double bound = approach_bound(of_a, of_b);
    double t = 0.0;
    for (int i = 0; i < most_advances; ++i) {
        advance(a, of_a, t, moved_a_);
        advance(b, of_b, t, moved_b_);
        found_.clear();
        by.collide(moved_a_, moved_b_, std::max((1.0 - t) * bound, envelope), found_);
        const auto nearest = nearest_of(found_);
        if (nearest == found_.end()) return;
        if (nearest->gap < distance) break;
        const Vector3d normal = vector(nearest->normal);
        const Turning turns_a = turning(a, of_a, t, moved_a_, normal), turns_b = turning(b, of_b, t, moved_b_, -normal);
        const double speed = normal.dot(of_a.straight - of_b.straight) + turns_a.speed + turns_b.speed;
        const double acceleration = turns_a.acceleration + turns_b.acceleration, way = nearest->gap - 0.5 * distance;
        const double root = speed + std::sqrt(speed * speed + 2.0 * acceleration * way);
        if (root > 0.0) t += 2.0 * way / root;
        if (!(root > 0.0) || t >= 1.0) {
            found_.clear();
            return;
        }
    }
    std::erase_if(found_, [&](const ContactPoint& contact) { return !(contact.gap < envelope); });
    for (ContactPoint& contact : found_) {
        contact.point_a = array(vector(contact.point_a) - t * of_a.straight);
        contact.point_b = array(vector(contact.point_b) - t * of_b.straight);
        contact.gap += t * closing(a, b, of_a, of_b, contact);
        contact.on_the_way = true;
    }
}

}  // namespace delassus::collision
