// SPDX-License-Identifier: BSD-3-Clause
// Trees of links: how joints are chosen, kinematics, projections, the mass matrix.
#include "mechanics/kinematic_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

#include "delassus/error.hpp"
#include "mechanics/model.hpp"

namespace delassus::mechanics {

// ---- The trees ----

namespace {

struct Shape {
    LinkJoint kind;
    std::int32_t freedoms, coordinates;
};

Shape shape_of(JointKind kind) {
    switch (kind) {
        case JointKind::Fixed:
            return {LinkJoint::Fixed, 0, 0};
        case JointKind::Revolute:
            return {LinkJoint::Revolute, 1, 1};
        case JointKind::Prismatic:
            return {LinkJoint::Prismatic, 1, 1};
        case JointKind::Cylindrical:
            return {LinkJoint::Cylindrical, 2, 2};
        case JointKind::Universal:
            return {LinkJoint::Universal, 2, 2};
        case JointKind::Spherical:
            return {LinkJoint::Spherical, 3, 4};
        case JointKind::Planar:
            return {LinkJoint::Planar, 3, 3};
        case JointKind::PointOnPlane:
        case JointKind::Distance:
        case JointKind::Gear:
            break;
    }
    return {LinkJoint::Free, 6, 7};
}

/// Rows that a joint has in maximal coordinates and saves as a joint of a tree; 0 of kinds that are none.
int rows_saved(JointKind kind) {
    return 6 - shape_of(kind).freedoms;
}

/// Pose of a body that does not move with the tree.
struct Frame {
    Vector3d x = Vector3d::Zero();
    Quaterniond Q = Quaterniond::Identity();
};

Frame given_frame(const MultibodySystem& system, BodyIndex body) {
    if (body == world_body) return {};
    const Pose& pose = system.body(body).pose;
    return {vector(pose.position), quaternion(pose.orientation)};
}

}  // namespace

KinematicTree::KinematicTree(const MultibodySystem& system) {
    if (system.node_count() > 0)
        throw Unsupported(
            "joint coordinates take rigid bodies alone, and the scene has nodes of elastic bodies or cables; leave out "
            "\"coordinates\" or give it as maximal");
    links_.emplace_back();
    links_[0].freedoms = links_[0].coordinates = 0;
    links_[0].kind = LinkJoint::Fixed;
    choose_joints(system);
    look_at_massless(system);
    motions_.resize(links_.size());
    wrench_.resize(links_.size());
    acceleration_.resize(links_.size());
    articulated_.resize(links_.size());
    composite_.resize(links_.size());
}

void KinematicTree::choose_joints(const MultibodySystem& system) {
    const auto bodies = static_cast<std::size_t>(system.body_count());
    const auto moves = [&](BodyIndex body) { return body != world_body && system.body_column(body) >= 0; };
    const auto told = [&](BodyIndex body) { return body != world_body && system.body(body).motion.has_value(); };
    std::vector<std::vector<std::int32_t>> joints_of(bodies + 1);  // the last: of the ground
    const auto place = [&](BodyIndex body) { return moves(body) ? static_cast<std::size_t>(body) : bodies; };
    for (std::int32_t k = 0; k < system.joint_count(); ++k) {
        const JointParameters& joint = system.joint(k);
        if (rows_saved(joint.kind) == 0 || told(joint.first) || told(joint.second)) continue;
        for (const BodyIndex end : {joint.first, joint.second}) joints_of[place(end)].push_back(k);
    }
    link_of_.assign(bodies, 0);
    // Joints that only trees take, with an armature or at a massless body, go before all others; of equal ones those
    // with a start, since trees place bodies by it.
    const auto massless = [&](BodyIndex body) { return body != world_body && system.body(body).massless; };
    const auto rank = [&](const JointParameters& joint) {
        const bool needed =
            joint.slide.armature > 0.0 || joint.turn.armature > 0.0 || massless(joint.first) || massless(joint.second);
        return 2 * (rows_saved(joint.kind) + (needed ? 6 : 0)) + (has_start(joint) ? 1 : 0);
    };
    using Candidate = std::tuple<int, std::int32_t>;  // rank, −joint: the largest is taken first
    std::priority_queue<Candidate> candidates;
    const auto reached = [&](std::size_t at) {
        for (const auto k : joints_of[at]) candidates.emplace(rank(system.joint(k)), -k);
    };
    const auto grow = [&] {
        while (!candidates.empty()) {
            const std::int32_t k = -std::get<1>(candidates.top());
            candidates.pop();
            const JointParameters& joint = system.joint(k);
            const auto in = [&](BodyIndex body) {
                return !moves(body) || link_of_[static_cast<std::size_t>(body)] > 0;
            };
            if (in(joint.first) == in(joint.second)) continue;
            const BodyIndex child = in(joint.first) ? joint.second : joint.first;
            const BodyIndex parent = in(joint.first) ? joint.first : joint.second;
            add_link(system, child, moves(parent) ? link_of(parent) : 0, k);
            reached(static_cast<std::size_t>(child));
        }
    };
    reached(bodies);
    grow();
    // A tree that floats begins with a body that no joint has as its second one: by a start the second one moves.
    std::vector<char> second(bodies, 0);
    for (std::int32_t k = 0; k < system.joint_count(); ++k)
        if (const JointParameters& joint = system.joint(k); rows_saved(joint.kind) > 0 && joint.second != world_body)
            second[static_cast<std::size_t>(joint.second)] = 1;
    std::vector<std::size_t> roots(bodies);
    std::iota(roots.begin(), roots.end(), std::size_t{0});
    std::stable_sort(roots.begin(), roots.end(), [&](std::size_t one, std::size_t other) {
        const auto turn = [&](std::size_t body) {
            return std::pair(massless(static_cast<BodyIndex>(body)), second[body] != 0);
        };
        return turn(one) < turn(other);
    });
    for (const std::size_t body : roots) {
        if (!moves(static_cast<BodyIndex>(body)) || link_of_[body] > 0) continue;
        add_link(system, static_cast<BodyIndex>(body), 0, -1);
        reached(body);
        grow();
    }
}

void KinematicTree::look_at_massless(const MultibodySystem& system) {
    std::vector<char> held(static_cast<std::size_t>(system.joint_count()), 0);
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const Link& link = links_[k];
        if (link.joint >= 0) held[static_cast<std::size_t>(link.joint)] = 1;
        const BodyParameters& own = system.body(link.body);
        for (auto at = static_cast<std::size_t>(link.parent); at > 0;
             at = static_cast<std::size_t>(links_[at].parent)) {
            Link& base = links_[at];
            if (base.mass > 0.0 || base.joint < 0) continue;
            const Vector3d arm = vector(own.pose.position) - vector(system.joint(base.joint).point);
            base.carried_mass += link.mass;
            base.carried_inertia += link.mass * arm.squaredNorm() + link.inertia.trace();
        }
    }
    for (std::size_t k = 1; k < links_.size(); ++k) {
        Link& link = links_[k];
        if (link.mass > 0.0) continue;
        link.name = system.body(link.body).name;
        if (link.joint < 0)
            throw InputError(fmt::format(
                "the body \"{}\" has no mass, and no joint of a tree holds it: give it a mass or a joint", link.name));
        if (link.carried_mass == 0.0)
            throw InputError(fmt::format(
                "the body \"{}\" has no mass, and carries none: give it a mass, or something to carry", link.name));
    }
    for (std::int32_t k = 0; k < system.joint_count(); ++k) {
        const JointParameters& joint = system.joint(k);
        if (joint.slide.armature == 0.0 && joint.turn.armature == 0.0) continue;
        if (held[static_cast<std::size_t>(k)] == 0)
            throw InputError(fmt::format(
                "the joint \"{}\" has an armature and closes a loop, or a body with a motion of its own takes part in "
                "it; joints of trees alone take one",
                joint.name));
    }
}

// A joint whose first body is the child moves the other way round: with its axes reversed its coordinates are the same.
void KinematicTree::add_link(const MultibodySystem& system, BodyIndex body, std::int32_t parent, std::int32_t joint) {
    Link link;
    link.body = body;
    link.parent = parent;
    link.joint = joint;
    link.mass = system.body(body).mass;
    const auto& [xx, yy, zz, xy, xz, yz] = system.body(body).inertia;
    link.inertia << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    link.body_column = system.body_column(body);
    link.body_position = link.body_column / 6 * 7;
    Shape shape{LinkJoint::Free, 6, 7};
    if (joint >= 0) {
        const JointParameters& given = system.joint(joint);
        shape = shape_of(given.kind);
        const bool reversed = given.first == body;
        const double sign = reversed ? -1.0 : 1.0;
        Vector3d z = sign * vector(given.axis).normalized(), across = sign * vector(given.second_axis).normalized();
        if (given.kind == JointKind::Universal && reversed) std::swap(z, across);
        const Frame child = given_frame(system, body);
        // Fixed bodies are the ground: their frames do not matter.
        const Frame base = parent > 0 ? given_frame(system, links_[static_cast<std::size_t>(parent)].body) : Frame{};
        const Quaterniond to_base = base.Q.conjugate(), to_child = child.Q.conjugate();
        const Vector3d point = vector(given.point);
        link.point = to_base * (point - base.x);
        link.axis = to_base * z;
        link.normals[0] = to_base * normal_to(z);
        link.normals[1] = to_base * z.cross(normal_to(z));
        link.turned = (to_base * child.Q).normalized();
        link.arm = to_child * (point - child.x);
        link.own_axis = to_child * z;
        link.second_axis = to_child * across;
        switch (given.kind) {
            case JointKind::Revolute:
                link.armature[0] = given.turn.armature;
                break;
            case JointKind::Prismatic:
                link.armature[0] = given.slide.armature;
                break;
            case JointKind::Cylindrical:
                link.armature[0] = given.slide.armature;
                link.armature[1] = given.turn.armature;
                break;
            case JointKind::Spherical:
                link.armature.head<3>().setConstant(given.turn.armature);
                break;
            default:
                break;
        }
    }
    link.kind = shape.kind;
    link.freedoms = shape.freedoms;
    link.coordinates = shape.coordinates;
    link.column = n_;
    link.position = position_size_;
    n_ += shape.freedoms;
    position_size_ += shape.coordinates;
    link_of_[static_cast<std::size_t>(body)] = static_cast<std::int32_t>(links_.size());
    links_[static_cast<std::size_t>(parent)].leaf = false;
    links_.push_back(link);
}

// ---- Kinematics ----

namespace {

Quaterniond about(const Vector3d& axis, double angle) {
    const double s = std::sin(0.5 * angle), c = std::cos(0.5 * angle);
    return {c, s * axis.x(), s * axis.y(), s * axis.z()};
}

/// One Newton step of the norm takes away what products of unit quaternions leave.
Quaterniond normalised(Quaterniond q) {
    q.coeffs() *= 1.5 - 0.5 * q.squaredNorm();
    return q;
}

Quaterniond quaternion_at(const double* q) {
    return {q[0], q[1], q[2], q[3]};
}

}  // namespace

void KinematicTree::place(const double* q) {
    if (placed_q_.empty() || !std::equal(placed_q_.begin(), placed_q_.end(), q)) place(q, nullptr);
}

void KinematicTree::place(const double* all_q, const double* all_v) {
    static constexpr double still[LinkMotion::most] = {};
    const auto stands = [](double speed) { return speed == 0.0; };
    const bool same =
        !placed_q_.empty() && std::equal(placed_q_.begin(), placed_q_.end(), all_q) &&
        (all_v ? std::equal(placed_v_.begin(), placed_v_.end(), all_v) : std::ranges::all_of(placed_v_, stands));
    if (same) return;
    placed_q_.assign(all_q, all_q + position_size_);
    placed_v_.assign(static_cast<std::size_t>(n_), 0.0);
    if (all_v) std::copy_n(all_v, n_, placed_v_.begin());
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const Link& link = links_[k];
        LinkMotion& own = motions_[k];
        const LinkMotion& base = motions_[static_cast<std::size_t>(link.parent)];
        const double *q = all_q + link.position, *u = all_v ? all_v + link.column : still;
        if (link.kind == LinkJoint::Free) {
            own.x = own.d = Eigen::Map<const Vector3d>(q);
            own.Q = quaternion_at(q + 3);
            own.A = own.Q.toRotationMatrix();
            own.v = Eigen::Map<const Vector3d>(u);
            own.omega = own.A * Eigen::Map<const Vector3d>(u + 3);
            own.linear << Matrix3d::Identity(), Matrix3d::Zero();
            own.angular << Matrix3d::Zero(), own.A;
            own.turn_bias.setZero();
            own.bias.setZero();
            continue;
        }
        Vector3d reach = base.A * link.point;
        Vector3d sliding = Vector3d::Zero(), turning = Vector3d::Zero(), turn_bias = Vector3d::Zero();
        // Turns first: the columns of a turn need the arm.
        Quaterniond turned = link.turned;
        switch (link.kind) {
            case LinkJoint::Revolute:
                turned = turned * about(link.own_axis, q[0]);
                break;
            case LinkJoint::Cylindrical:
                turned = turned * about(link.own_axis, q[1]);
                break;
            case LinkJoint::Planar:
                turned = turned * about(link.own_axis, q[2]);
                break;
            case LinkJoint::Universal:
                turned = turned * about(link.own_axis, q[0]) * about(link.second_axis, q[1]);
                break;
            case LinkJoint::Spherical:
                turned = quaternion_at(q);
                break;
            case LinkJoint::Free:
            case LinkJoint::Fixed:
            case LinkJoint::Prismatic:
                break;
        }
        own.Q = normalised(base.Q * turned);
        own.A = own.Q.toRotationMatrix();
        const Vector3d arm = own.A * link.arm;
        const auto slide = [&](int column, const Vector3d& axis) {
            reach += q[column] * axis;
            sliding += u[column] * axis;
            own.angular.col(column).setZero();
            own.linear.col(column) = axis;
        };
        const auto turn = [&](int column, const Vector3d& axis) {
            turning += u[column] * axis;
            own.angular.col(column) = axis;
            own.linear.col(column) = arm.cross(axis);
        };
        switch (link.kind) {
            case LinkJoint::Revolute:
                turn(0, base.A * link.axis);
                break;
            case LinkJoint::Prismatic:
                slide(0, base.A * link.axis);
                break;
            case LinkJoint::Cylindrical:
                slide(0, base.A * link.axis);
                turn(1, own.linear.col(0));
                break;
            case LinkJoint::Universal:
                turn(0, base.A * link.axis);
                turn(1, own.A * link.second_axis);
                turn_bias = u[0] * u[1] * own.angular.col(0).cross(own.angular.col(1));
                break;
            case LinkJoint::Spherical:
                for (int i = 0; i < 3; ++i) turn(i, own.A.col(i));
                break;
            case LinkJoint::Planar:
                slide(0, base.A * link.normals[0]);
                slide(1, base.A * link.normals[1]);
                turn(2, base.A * link.axis);
                break;
            case LinkJoint::Free:
            case LinkJoint::Fixed:
                break;
        }
        own.d = reach - arm;
        own.x = base.x + own.d;
        if (!all_v) {
            own.omega.setZero();
            own.v.setZero();
            own.turn_bias.setZero();
            own.bias.setZero();
            continue;
        }
        own.omega = base.omega + turning;
        own.v = base.v + base.omega.cross(reach) + sliding - own.omega.cross(arm);
        own.turn_bias = base.omega.cross(turning) + turn_bias;
        own.bias = base.omega.cross(base.omega.cross(reach) + 2.0 * sliding) - own.turn_bias.cross(arm) -
                   own.omega.cross(own.omega.cross(arm));
    }
}

void KinematicTree::write(State& bodies) const {
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const Link& link = links_[k];
        const LinkMotion& own = motions_[k];
        double* q = bodies.q.data() + link.body_position;
        Eigen::Map<Vector3d> x(q);
        x = own.x;
        q[3] = own.Q.w();
        q[4] = own.Q.x();
        q[5] = own.Q.y();
        q[6] = own.Q.z();
        double* v = bodies.v.data() + link.body_column;
        Eigen::Map<Vector3d> linear(v), angular(v + 3);
        linear = own.v;
        angular = own.A.transpose() * own.omega;
    }
}

void KinematicTree::read(const State& bodies, State& state) const {
    state.t = bodies.t;
    state.q.assign(static_cast<std::size_t>(position_size_), 0.0);
    state.v.assign(static_cast<std::size_t>(n_), 0.0);
    struct Placed {
        Vector3d x = Vector3d::Zero(), v = Vector3d::Zero(), omega = Vector3d::Zero();
        Quaterniond Q = Quaterniond::Identity();
    };
    const auto placed = [&](std::size_t k) {
        if (k == 0) return Placed{};
        const double *q = bodies.q.data() + links_[k].body_position, *v = bodies.v.data() + links_[k].body_column;
        const Quaterniond Q = quaternion_at(q + 3);
        return Placed{Eigen::Map<const Vector3d>(q), Eigen::Map<const Vector3d>(v),
                      Q * Eigen::Map<const Vector3d>(v + 3), Q};
    };
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const Link& link = links_[k];
        double *q = state.q.data() + link.position, *u = state.v.data() + link.column;
        if (link.kind == LinkJoint::Free) {
            std::copy_n(bodies.q.data() + link.body_position, 7, q);
            std::copy_n(bodies.v.data() + link.body_column, 6, u);
            continue;
        }
        const Placed own = placed(k), base = placed(static_cast<std::size_t>(link.parent));
        const Vector3d arm = own.Q * link.arm, reach = own.x + arm - base.x;
        const Vector3d slide = reach - base.Q * link.point;
        const Vector3d sliding = own.v - base.v - base.omega.cross(reach) + own.omega.cross(arm);
        const Vector3d turning = own.omega - base.omega, axis = base.Q * link.axis;
        const Quaterniond relative = base.Q.conjugate() * own.Q, r = link.turned.conjugate() * relative;
        const auto angle = [&] {
            return std::remainder(2.0 * std::atan2(r.vec().dot(link.own_axis), r.w()), 2.0 * M_PI);
        };
        switch (link.kind) {
            case LinkJoint::Revolute:
                q[0] = angle();
                u[0] = axis.dot(turning);
                break;
            case LinkJoint::Prismatic:
                q[0] = axis.dot(slide);
                u[0] = axis.dot(sliding);
                break;
            case LinkJoint::Cylindrical:
                q[0] = axis.dot(slide);
                q[1] = angle();
                u[0] = axis.dot(sliding);
                u[1] = axis.dot(turning);
                break;
            case LinkJoint::Universal: {
                // r = (c₁ c₂, s₁ c₂ z + c₁ s₂ x + s₁ s₂ z × x), of the halves of the angles.
                const Vector3d &z = link.own_axis, &x = link.second_axis;
                const double c1c2 = r.w(), s1c2 = r.vec().dot(z), c1s2 = r.vec().dot(x), s1s2 = r.vec().dot(z.cross(x));
                const bool flat = std::hypot(c1c2, s1c2) >= std::hypot(c1s2, s1s2);
                const double first = flat ? std::atan2(s1c2, c1c2) : std::atan2(s1s2, c1s2);
                const double c = std::cos(first), s = std::sin(first);
                q[0] = std::remainder(2.0 * first, 2.0 * M_PI);
                q[1] = std::remainder(2.0 * std::atan2(c1s2 * c + s1s2 * s, c1c2 * c + s1c2 * s), 2.0 * M_PI);
                u[0] = axis.dot(turning);
                u[1] = (own.Q * x).dot(turning);
                break;
            }
            case LinkJoint::Spherical: {
                q[0] = relative.w();
                q[1] = relative.x();
                q[2] = relative.y();
                q[3] = relative.z();
                Eigen::Map<Vector3d> rate(u);
                rate = own.Q.conjugate() * turning;
                break;
            }
            case LinkJoint::Planar:
                for (int i = 0; i < 2; ++i) {
                    q[i] = (base.Q * link.normals[i]).dot(slide);
                    u[i] = (base.Q * link.normals[i]).dot(sliding);
                }
                q[2] = angle();
                u[2] = axis.dot(turning);
                break;
            case LinkJoint::Free:
            case LinkJoint::Fixed:
                break;
        }
    }
}

Spatial KinematicTree::carried(std::size_t link) const {
    const Spatial& base = acceleration_[static_cast<std::size_t>(links_[link].parent)];
    return {base.angular, base.linear + base.angular.cross(motions_[link].d)};
}

// u̇ = 0.
void KinematicTree::find_bias() {
    for (std::size_t k = 1; k < links_.size(); ++k) {
        acceleration_[k] = carried(k);
        acceleration_[k].angular += motions_[k].turn_bias;
        acceleration_[k].linear += motions_[k].bias;
    }
}

Spatial KinematicTree::inertial(std::size_t link) const {
    const Matrix3d& A = motions_[link].A;
    const Spatial& moved = acceleration_[link];
    return {A * (links_[link].inertia * (A.transpose() * moved.angular)), links_[link].mass * moved.linear};
}

// In the frame of the body the angular velocity changes by Aᵀ ω̇.
void KinematicTree::bias(double* bodies) {
    find_bias();
    for (std::size_t k = 1; k < links_.size(); ++k) {
        double* own = bodies + links_[k].body_column;
        Eigen::Map<Vector3d> linear(own), angular(own + 3);
        linear = acceleration_[k].linear;
        angular = motions_[k].A.transpose() * acceleration_[k].angular;
    }
}

// ---- Projections ----

void KinematicTree::gather(double factor, double* result) {
    for (std::size_t k = links_.size() - 1; k > 0; --k) {
        const Link& link = links_[k];
        const LinkMotion& own = motions_[k];
        const Spatial& wrench = wrench_[k];
        for (int j = 0; j < link.freedoms; ++j)
            result[link.column + j] +=
                factor * (own.angular.col(j).dot(wrench.angular) + own.linear.col(j).dot(wrench.linear));
        if (link.parent == 0) continue;
        Spatial& base = wrench_[static_cast<std::size_t>(link.parent)];
        base.angular += wrench.angular + own.d.cross(wrench.linear);
        base.linear += wrench.linear;
    }
}

void KinematicTree::project_with_bias(const double* f, double factor, double* result) {
    find_bias();
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const double* own = f + links_[k].body_column;
        const Spatial lost = inertial(k);
        wrench_[k] = {motions_[k].A * Eigen::Map<const Vector3d>(own + 3) - lost.angular,
                      Eigen::Map<const Vector3d>(own) - lost.linear};
    }
    gather(factor, result);
}

void KinematicTree::multiply_mass(double factor, const double* x, double* result) {
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const Link& link = links_[k];
        Spatial moved = carried(k);
        for (int j = 0; j < link.freedoms; ++j) {
            moved.angular += x[link.column + j] * motions_[k].angular.col(j);
            moved.linear += x[link.column + j] * motions_[k].linear.col(j);
        }
        acceleration_[k] = moved;
        wrench_[k] = inertial(k);
        for (int j = 0; j < link.freedoms; ++j)
            result[link.column + j] += factor * link.armature[j] * x[link.column + j];
    }
    gather(factor, result);
}

Matrix3d KinematicTree::inertia(std::size_t link) const {
    const Matrix3d& A = motions_[link].A;
    return A * links_[link].inertia * A.transpose();
}

// ---- The mass matrix ----
//
// A link with all that it carries is one rigid body: of mass m, first moment h and inertia I about the link's own mass
// centre, the wrench of an acceleration is (I ω̇ + h × v̇, m v̇ + ω̇ × h). The column S_j of a link takes all of it along,
// and only links on the way to the ground see its wrench: that is where the mass matrix has entries (Featherstone 2008,
// section 6.3). On the parent,
//
//     h ← h + m d,      I ← I − [d]× [h]× − [h]× [d]× − m [d]×²
//
void KinematicTree::add_mass(double factor, MatrixAssembler& M) {
    for (std::size_t k = 1; k < links_.size(); ++k) composite_[k] = {links_[k].mass, Vector3d::Zero(), inertia(k)};
    for (std::size_t k = links_.size() - 1; k > 0; --k) {
        const Link& link = links_[k];
        const Composite& own = composite_[k];
        for (int j = 0; j < link.freedoms; ++j) {
            const Vector3d turning = motions_[k].angular.col(j), moving = motions_[k].linear.col(j);
            Spatial wrench{own.inertia * turning + own.moment.cross(moving),
                           own.mass * moving + turning.cross(own.moment)};
            const std::int32_t column = link.column + j;
            if (link.armature[j] > 0.0) M.add(column, column, factor * link.armature[j]);
            for (auto at = static_cast<std::int32_t>(k); at > 0;) {
                const Link& other = links_[static_cast<std::size_t>(at)];
                const LinkMotion& motion = motions_[static_cast<std::size_t>(at)];
                for (int i = 0; i < other.freedoms; ++i) {
                    const double value =
                        factor * (motion.angular.col(i).dot(wrench.angular) + motion.linear.col(i).dot(wrench.linear));
                    M.add(other.column + i, column, value);
                    if (at != static_cast<std::int32_t>(k)) M.add(column, other.column + i, value);
                }
                wrench.angular += motion.d.cross(wrench.linear);
                at = other.parent;
            }
        }
        if (link.parent == 0) continue;
        Composite& base = composite_[static_cast<std::size_t>(link.parent)];
        const Matrix3d d = skew(motions_[k].d), h = skew(own.moment);
        base.mass += own.mass;
        base.moment += own.moment + own.mass * motions_[k].d;
        base.inertia += own.inertia - d * h - h * d - own.mass * (d * d);
    }
}

}  // namespace delassus::mechanics
