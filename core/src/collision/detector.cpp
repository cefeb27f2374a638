// SPDX-License-Identifier: BSD-3-Clause
#include "collision/detector.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "delassus/error.hpp"

namespace delassus::collision {
namespace {

/// Normalises: a quaternion drifts from unit length by rounding. False if it is zero or not finite.
bool rotation_of(const Quaternion& orientation, Matrix3d& rotation) {
    const Eigen::Quaterniond q(orientation[0], orientation[1], orientation[2], orientation[3]);
    const double norm = q.norm();
    rotation = q.normalized().toRotationMatrix();
    return std::isfinite(norm) && norm > 0.0;
}

/// Whether volumes of boxes of this size are numbers.
bool is_measurable(const Vector3d& v) {
    constexpr double largest = 1e50;
    return v.allFinite() && v.cwiseAbs().maxCoeff() < largest;
}

/// In the world, with what may be out of flush.
BroadPhase::Box box_of_terrain(const Placed& placed) {
    const AlignedBox3d& own = placed.solid->terrain->box();
    const Vector3d middle = placed.position + placed.rotation * own.center();
    const Vector3d half = placed.rotation.cwiseAbs() * (0.5 * own.sizes()) +
                          Vector3d::Constant(placed.solid->radius + kFlush * own.sizes().norm());
    return {middle - half, middle + half};
}

}  // namespace

Detector::Detector(CollisionSetup setup)
    : setup_(std::move(setup)), broad_phase_([this](std::int32_t a, std::int32_t b) {
          return may_touch(bounded_[a], bounded_[b]) || pass_flush(bounded_[a], bounded_[b]);
      }) {
    for (auto& [first, second] : setup_.apart) {
        if (first > second) std::swap(first, second);
    }
    std::sort(setup_.apart.begin(), setup_.apart.end());
    std::sort(setup_.passing.begin(), setup_.passing.end());
    const auto count = static_cast<std::int32_t>(setup_.shapes.size());
    solids_.reserve(setup_.shapes.size());
    placed_.resize(setup_.shapes.size());
    local_rotations_.resize(setup_.shapes.size());
    body_rotations_.resize(setup_.fixed.size());
    for (std::int32_t i = 0; i < count; ++i) {
        const Shape& shape = setup_.shapes[i];
        solids_.push_back(make_solid(shape, i));
        placed_[i].solid = &solids_[i];
        rotation_of(shape.pose.orientation, local_rotations_[i]);
        const bool by_itself =
            !setup_.solid.empty() && shape.body >= 0 ? setup_.solid[shape.body] < 0 : !is_fixed(shape.body);
        const bool numbered = !by_itself && !setup_.solid.empty() && shape.body >= 0;
        solid_.push_back(by_itself ? -1 - shape.body : numbered ? setup_.solid[shape.body] : 0);
        given_moves_ = given_moves_ || (solid_[i] == 0 && !is_fixed(shape.body));
        in_bounded_.push_back(-1);
        if (shape.kind == ShapeKind::Plane) {
            planes_.push_back(i);
        } else if (solids_[i].terrain) {
            terrains_.push_back(i);
        } else {
            in_bounded_[i] = static_cast<std::int32_t>(bounded_.size());
            bounded_.push_back(i);
            slack_ += 0.1 * solids_[i].reach;
        }
    }
    if (!bounded_.empty()) slack_ /= static_cast<double>(bounded_.size());
    boxes_.resize(bounded_.size());
    balls_.resize(bounded_.size());
}

bool Detector::is_fixed(std::int32_t body) const {
    return body < 0 || setup_.fixed[body];
}

bool Detector::may_touch(std::int32_t shape_a, std::int32_t shape_b) const {
    const std::int32_t a = setup_.shapes[shape_a].body, b = setup_.shapes[shape_b].body;
    if (a == b || (is_fixed(a) && is_fixed(b))) return false;
    if (!setup_.group.empty() && a >= 0 && b >= 0 && setup_.group[a] >= 0 && setup_.group[a] == setup_.group[b])
        return false;
    if (!setup_.passing.empty()) {
        const std::int32_t first = setup_.material[shape_a], second = setup_.material[shape_b];
        if (std::binary_search(setup_.passing.begin(), setup_.passing.end(),
                               std::pair(std::min(first, second), std::max(first, second))))
            return false;
    }
    return !std::binary_search(setup_.apart.begin(), setup_.apart.end(), std::pair(std::min(a, b), std::max(a, b)));
}

bool Detector::may_be_flush(std::int32_t shape_a, std::int32_t shape_b) const {
    return solid_[shape_a] == solid_[shape_b] && has_flat_faces(solids_[shape_a]) && has_flat_faces(solids_[shape_b]);
}

bool Detector::pass_flush(std::int32_t shape_a, std::int32_t shape_b) const {
    if (!given_moves_ || solid_[shape_a] != 0 || solid_[shape_b] != 0) return false;
    const std::int32_t a = setup_.shapes[shape_a].body, b = setup_.shapes[shape_b].body;
    return a != b && !(is_fixed(a) && is_fixed(b)) && may_be_flush(shape_a, shape_b);
}

void Detector::find_neighbours() {
    has_neighbours_.assign(placed_.size(), 0);
    std::vector<BroadPhase::Box> boxes;
    for (const std::int32_t shape : bounded_) {
        const Vector3d half = half_extent(placed_[shape]) + Vector3d::Constant(kFlush * placed_[shape].solid->reach);
        boxes.emplace_back(placed_[shape].position - half, placed_[shape].position + half);
    }
    BroadPhase near([this](std::int32_t a, std::int32_t b) {
        return may_be_flush(bounded_[a], bounded_[b]) && !pass_flush(bounded_[a], bounded_[b]);
    });
    for (const auto& [a, b] : near.near_pairs(boxes, 0.0)) {
        neighbours_.emplace_back(bounded_[a], bounded_[b]);
        neighbours_.emplace_back(bounded_[b], bounded_[a]);
    }
    for (std::size_t i = 0; i < terrains_.size(); ++i) {
        const std::int32_t terrain = terrains_[i];
        const BroadPhase::Box around = box_of_terrain(placed_[terrain]);
        const auto add = [&](std::int32_t other, const BroadPhase::Box& box) {
            if (!may_be_flush(terrain, other) || pass_flush(terrain, other) || !around.overlap(box)) return;
            neighbours_.emplace_back(terrain, other);
            neighbours_.emplace_back(other, terrain);
        };
        for (std::size_t k = 0; k < bounded_.size(); ++k) add(bounded_[k], boxes[k]);
        for (std::size_t k = 0; k < i; ++k) add(terrains_[k], box_of_terrain(placed_[terrains_[k]]));
    }
    std::sort(neighbours_.begin(), neighbours_.end());
    const bool others_come = given_moves_ || !planes_.empty();
    for (const auto* shapes : {&bounded_, &terrains_})
        for (const std::int32_t shape : *shapes)
            has_neighbours_[shape] = others_come && solid_[shape] == 0 && has_flat_faces(solids_[shape]) ? 1 : 0;
    for (const auto& pair : neighbours_) has_neighbours_[pair.first] = 1;
}

void Detector::collect_neighbours(std::int32_t shape, std::int32_t other,
                                  std::vector<const Placed*>& neighbours) const {
    neighbours.clear();
    // A half-space leads to no edge. Shapes that the other one does not come near are not in its way.
    if (solids_[other].kind == ShapeKind::Plane) return;
    const std::int32_t place = in_bounded_[other];
    for (const auto* all : {&neighbours_, &passing_}) {
        auto next = std::lower_bound(all->begin(), all->end(), BroadPhase::Pair(shape, -1));
        for (; next != all->end() && next->first == shape; ++next)
            if ((place < 0 || in_bounded_[next->second] < 0 ||
                 boxes_[place].overlap(boxes_[in_bounded_[next->second]])) &&
                may_touch(other, next->second))
                neighbours.push_back(&placed_[next->second]);
    }
    for (const std::int32_t plane : planes_)
        if (plane != shape && may_be_flush(shape, plane) && may_touch(other, plane))
            neighbours.push_back(&placed_[plane]);
}

void Detector::leave_out_covered(std::int32_t a, std::int32_t b, const Placed& placed_a, const Placed& placed_b,
                                 std::size_t first, Worker& by, std::vector<ContactPoint>& contacts) const {
    if (contacts.size() == first || (has_neighbours_[a] == 0 && has_neighbours_[b] == 0)) return;
    collect_neighbours(a, b, by.of_a);
    collect_neighbours(b, a, by.of_b);
    if (by.of_a.empty() && by.of_b.empty()) return;
    const auto covered = [&](const ContactPoint& contact) {
        const Vector3d normal = vector(contact.normal);
        return is_covered(placed_a, by.of_a, vector(contact.point_a), normal, placed_b.solid->reach) ||
               is_covered(placed_b, by.of_b, vector(contact.point_b), -normal, placed_a.solid->reach);
    };
    contacts.erase(std::remove_if(contacts.begin() + static_cast<std::ptrdiff_t>(first), contacts.end(), covered),
                   contacts.end());
}

void Detector::place(std::span<const Pose> poses) {
    if (poses.size() != setup_.fixed.size()) {
        throw InputError(fmt::format("Collision detection got the poses of {} bodies; there are {}.", poses.size(),
                                     setup_.fixed.size()));
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!rotation_of(poses[i].orientation, body_rotations_[i]) || !is_measurable(vector(poses[i].position)))
            throw InputError(
                fmt::format("The pose of body {} is not finite or beyond 1e50 m, or its quaternion is zero.",
                            setup_.name_of(static_cast<std::int32_t>(i))));
    }
    for (std::size_t i = 0; i < placed_.size(); ++i) {
        const auto shape = static_cast<std::int32_t>(i);
        if (const std::int32_t body = setup_.shapes[i].body; body < 0) {
            place(shape, {}, Matrix3d::Identity(), placed_[i]);
        } else {
            place(shape, poses[body], body_rotations_[body], placed_[i]);
        }
    }
}

void Detector::place(std::int32_t shape, const Pose& pose, const Matrix3d& rotation, Placed& placed) const {
    placed.rotated = false;
    placed.rotation.noalias() = rotation * local_rotations_[shape];
    placed.position = vector(pose.position) + rotation * vector(setup_.shapes[shape].pose.position);
}

void Detector::detect_pair(std::int32_t shape_a, std::int32_t shape_b, const Pose& pose_a, const Pose& pose_b,
                           double envelope, std::vector<ContactPoint>& contacts) {
    const auto put = [this](std::int32_t shape, const Pose& pose, Placed& placed) {
        Matrix3d rotation;
        if (!rotation_of(pose.orientation, rotation) || !is_measurable(vector(pose.position))) return false;
        placed.solid = placed_[shape].solid;
        placed.body = placed_[shape].body;
        place(shape, pose, rotation, placed);
        return true;
    };
    if (!put(shape_a, pose_a, one_) || !put(shape_b, pose_b, other_)) return;
    if (workers_.empty()) workers_.resize(1);
    collide_pair(shape_a, shape_b, one_, other_, {}, {}, envelope, workers_.front(), contacts);
}

void Detector::sweep(std::span<const Pose> poses, std::span<const BodyDisplacement> displacements) {
    if (!displacements.empty() && displacements.size() != poses.size())
        throw InputError(fmt::format("Collision detection got the displacements of {} bodies; there are {}.",
                                     displacements.size(), poses.size()));
    sweeps_.assign(placed_.size(), {});
    for (Placed& placed : placed_) placed.body = {};
    if (displacements.empty()) return;
    for (std::size_t i = 0; i < placed_.size(); ++i) {
        const std::int32_t body = setup_.shapes[i].body;
        if (body < 0) continue;
        const auto& [translation, rotation, fall] = displacements[static_cast<std::size_t>(body)];
        if (!is_measurable(vector(translation)) || !is_measurable(vector(rotation)))
            throw InputError(
                fmt::format("The motion of body {} in a step is not finite or beyond 1e50 m.", setup_.name_of(body)));
        Sweep& sweep = sweeps_[i];
        sweep.rotation = vector(rotation);
        sweep.fall = vector(fall);
        sweep.straight = sweep.translation = vector(translation);
        const double angle = sweep.rotation.norm();
        sweep.turned = angle * placed_[i].solid->reach;
        sweep.arm = placed_[i].position - vector(poses[static_cast<std::size_t>(body)].position);
        placed_[i].body = {true, sweep.straight, sweep.rotation, -sweep.arm};
        if (angle > 0.0 && !sweep.arm.isZero(0.0)) {
            sweep.translation += Eigen::AngleAxisd(angle, sweep.rotation / angle) * sweep.arm - sweep.arm;
            sweep.turned += sweep.arm.norm() * (1.0 - std::cos(std::min(0.5 * angle, std::numbers::pi)));
        }
    }
}

// Cost: linear in shapes, near pairs and points, but for the tree's logarithm where shapes left their boxes; planes and
// terrains are tried against every shape.
void Detector::detect(std::span<const Pose> poses, double envelope, std::vector<ContactPoint>& contacts,
                      const sdk::Team& team, std::span<const BodyDisplacement> displacements) {
    contacts.clear();
    if (!(envelope >= 0.0) || !std::isfinite(envelope))
        throw InputError(
            fmt::format("The envelope of contacts is {} m; it should be finite and not negative.", envelope));
    place(poses);
    if (has_neighbours_.empty()) find_neighbours();
    sweep(poses, displacements);
    // Of shapes that move less than half of the envelope, two cannot come nearer by more than it.
    for (std::size_t i = 0; i < bounded_.size(); ++i) {
        const Placed& placed = placed_[bounded_[i]];
        const Sweep& sweep = sweeps_[bounded_[i]];
        const double way = sweep.translation.norm() + sweep.turned, half_near = 0.5 * near_of(bounded_[i], envelope);
        const double more = half_near + (way <= half_near ? 0.0 : sweep.turned);
        const Vector3d half = half_extent(placed) + Vector3d::Constant(more);
        boxes_[i].min_ = placed.position - half;
        boxes_[i].max_ = placed.position + half;
        balls_[i] = {placed.position, (1.0 + 1e-12) * placed.solid->reach + half_near};
        if (way <= half_near) continue;
        boxes_[i].min_ += sweep.translation.cwiseMin(0.0);
        boxes_[i].max_ += sweep.translation.cwiseMax(0.0);
        balls_[i].radius += way;
    }
    pairs_.clear();
    passing_.clear();
    for (const auto& [a, b] : broad_phase_.near_pairs(boxes_, slack_)) {
        if (given_moves_ && pass_flush(bounded_[a], bounded_[b])) {
            passing_.emplace_back(bounded_[a], bounded_[b]);
            passing_.emplace_back(bounded_[b], bounded_[a]);
            if (!may_touch(bounded_[a], bounded_[b])) continue;
        }
        const double far = balls_[a].radius + balls_[b].radius;
        if ((balls_[a].center - balls_[b].center).squaredNorm() < far * far && boxes_[a].overlap(boxes_[b]))
            pairs_.emplace_back(bounded_[a], bounded_[b]);
    }
    std::sort(passing_.begin(), passing_.end());
    with_ground_.clear();
    for (const std::int32_t plane : planes_) {
        const Vector3d normal = placed_[plane].axis();
        for (const std::int32_t shape : bounded_) {
            const Placed& placed = placed_[shape];
            const double bound = std::max(near_of(shape, envelope), approach_bound(sweeps_[plane], sweeps_[shape]));
            if (normal.dot(placed.position - placed_[plane].position) - placed.solid->reach >= bound) continue;
            if (may_touch(plane, shape)) with_ground_.emplace_back(std::min(plane, shape), std::max(plane, shape));
        }
    }
    // A terrain looks for its triangles itself.
    for (const std::int32_t terrain : terrains_)
        for (const std::int32_t shape : bounded_)
            if (may_touch(terrain, shape))
                with_ground_.emplace_back(std::min(terrain, shape), std::max(terrain, shape));
    if (!with_ground_.empty()) {
        std::sort(with_ground_.begin(), with_ground_.end());
        merged_.clear();
        std::merge(pairs_.begin(), pairs_.end(), with_ground_.begin(), with_ground_.end(), std::back_inserter(merged_));
        pairs_.swap(merged_);
    }
    collide_pairs(envelope, contacts, team);
}

// Runs of pairs are dealt out to the threads, and their contacts put together in the order of the pairs.
void Detector::collide_pairs(double envelope, std::vector<ContactPoint>& contacts, const sdk::Team& given) {
    constexpr std::size_t run = 128, worth_sharing = 1024;
    const sdk::Team team = given.if_worth(pairs_.size() >= worth_sharing);
    if (workers_.size() < static_cast<std::size_t>(team.size())) workers_.resize(static_cast<std::size_t>(team.size()));
    if (team.size() == 1) return collide_pairs(0, pairs_.size(), envelope, workers_[0], contacts);
    // A placed core that several pairs share is turned before.
    team.run([&](int member) {
        const auto [first, last] = team.share(bounded_.size(), member);
        for (std::size_t i = first; i < last; ++i) placed_[bounded_[i]].rotate_core();
    });
    const std::size_t runs = (pairs_.size() + run - 1) / run;
    if (found_.size() < runs) found_.resize(runs);
    team.for_each_by_member(runs, [&](std::size_t k, int member) {
        found_[k].clear();
        collide_pairs(k * run, std::min((k + 1) * run, pairs_.size()), envelope,
                      workers_[static_cast<std::size_t>(member)], found_[k]);
    });
    for (std::size_t k = 0; k < runs; ++k) contacts.insert(contacts.end(), found_[k].begin(), found_[k].end());
}

void Detector::collide_pairs(std::size_t first, std::size_t last, double envelope, Worker& by,
                             std::vector<ContactPoint>& contacts) {
    for (std::size_t k = first; k < last; ++k) {
        const auto& [a, b] = pairs_[k];
        collide_pair(a, b, placed_[a], placed_[b], sweeps_[a], sweeps_[b], envelope, by, contacts);
    }
}

void Detector::collide_pair(std::int32_t shape_a, std::int32_t shape_b, Placed& a, Placed& b, const Sweep& of_a,
                            const Sweep& of_b, double envelope, Worker& by, std::vector<ContactPoint>& contacts) {
    const std::size_t before = contacts.size();
    by.swept.collide(by.still, a, b, of_a, of_b, near_of(shape_a, shape_b, envelope), contacts);
    leave_out_covered(shape_a, shape_b, a, b, before, by, contacts);
    for (std::size_t i = before; i < contacts.size(); ++i) {
        contacts[i].shape_a = shape_a;
        contacts[i].shape_b = shape_b;
    }
}

}  // namespace delassus::collision
