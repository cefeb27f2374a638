// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/tree_derivatives.hpp"

#include "support/frames.hpp"

namespace delassus::mechanics {

namespace {

Vector6 six(const Vector3d& angular, const Vector3d& linear) {
    Vector6 result;
    result << angular, linear;
    return result;
}

/// V × S.
Vector6 cross(const Vector6& V, const Vector6& S) {
    const Vector3d w = V.head<3>(), v = V.tail<3>(), a = S.head<3>(), l = S.tail<3>();
    return six(w.cross(a), w.cross(l) + v.cross(a));
}

/// V ×* f.
Vector6 cross_force(const Vector6& V, const Vector6& f) {
    const Vector3d w = V.head<3>(), v = V.tail<3>(), torque = f.head<3>(), force = f.tail<3>();
    return six(w.cross(torque) + v.cross(force), w.cross(force));
}

/// V × as a matrix.
Matrix6 cross_matrix(const Vector6& V) {
    Matrix6 result = Matrix6::Zero();
    result.topLeftCorner<3, 3>() = result.bottomRightCorner<3, 3>() = skew(V.head<3>());
    result.bottomLeftCorner<3, 3>() = skew(V.tail<3>());
    return result;
}

/// The number of each column's group within its link.
std::int32_t group_of(LinkJoint kind, std::int32_t column) {
    switch (kind) {
        case LinkJoint::Spherical:
            return 0;
        case LinkJoint::Free:
            return column < 3 ? column : 3;
        default:
            return column;
    }
}

}  // namespace

TreeDerivatives::TreeDerivatives(const KinematicTree& tree, std::function<bool(std::size_t)> skips)
    : tree_(&tree), skips_(std::move(skips)) {}

void TreeDerivatives::set_motion(const double* u, const Vector3d& gravity) {
    find_columns(u, nullptr, -gravity);
    sum_up();
}

void TreeDerivatives::set_acceleration(const double* a) {
    find_columns(nullptr, a, Vector3d::Zero());
    sum_up();
}

void TreeDerivatives::find_columns(const double* u, const double* a, const Vector3d& ground) {
    const auto& links = tree_->links();
    columns_.resize(static_cast<std::size_t>(tree_->n()));
    speed_.assign(links.size(), Vector6::Zero());
    acceleration_.assign(links.size(), Vector6::Zero());
    acceleration_[0].tail<3>() = ground;
    for (std::size_t k = 1; k < links.size(); ++k) {
        const Link& link = links[k];
        const LinkMotion& motion = tree_->motion(k);
        Vector6 V = speed_[static_cast<std::size_t>(link.parent)],
                A = acceleration_[static_cast<std::size_t>(link.parent)];
        for (std::int32_t first = 0; first < link.freedoms;) {
            const std::int32_t group = group_of(link.kind, first);
            Vector6 w = Vector6::Zero(), jolt = Vector6::Zero();
            std::int32_t end = first;
            for (; end < link.freedoms && group_of(link.kind, end) == group; ++end) {
                Column& one = columns_[static_cast<std::size_t>(link.column + end)];
                const Vector3d axis = motion.angular.col(end);
                one.S = six(axis, motion.linear.col(end) + motion.x.cross(axis));
                one.link = static_cast<std::int32_t>(k);
                one.group = group;
                one.before = V;
                one.acceleration = A;
                if (u) w += u[link.column + end] * one.S;
                if (a) jolt += a[link.column + end] * one.S;
            }
            A += cross(V, w) + jolt;
            V += w;
            for (; first < end; ++first) columns_[static_cast<std::size_t>(link.column + first)].after = V;
        }
        speed_[k] = V;
        acceleration_[k] = A;
    }
}

void TreeDerivatives::sum_up() {
    const auto& links = tree_->links();
    force_.assign(links.size(), Vector6::Zero());
    inertia_.assign(links.size(), Matrix6::Zero());
    coupling_.assign(links.size(), Matrix6::Zero());
    for (std::size_t k = links.size() - 1; k > 0; --k) {
        if (!skips_(k)) {
            const Link& link = links[k];
            const LinkMotion& motion = tree_->motion(k);
            const Matrix3d x = skew(motion.x);
            Matrix6 inertia;
            inertia << motion.A * link.inertia * motion.A.transpose() - link.mass * x * x, link.mass * x,
                -link.mass * x, link.mass * Matrix3d::Identity();
            const Vector6& V = speed_[k];
            const Vector6 momentum = inertia * V;
            const Matrix6 V_cross = cross_matrix(V);
            const Matrix3d force = skew(momentum.tail<3>());
            Matrix6 B = -V_cross.transpose() * inertia - inertia * V_cross;
            B.topLeftCorner<3, 3>() -= skew(momentum.head<3>());
            B.topRightCorner<3, 3>() -= force;
            B.bottomLeftCorner<3, 3>() -= force;
            inertia_[k] += inertia;
            coupling_[k] += B;
            force_[k] += inertia * acceleration_[k] + cross_force(V, momentum);
        }
        const auto parent = static_cast<std::size_t>(links[k].parent);
        inertia_[parent] += inertia_[k];
        coupling_[parent] += coupling_[k];
        force_[parent] += force_[k];
    }
}

template <class Visitor>
void TreeDerivatives::for_pairs(Visitor&& visit) const {
    const auto& links = tree_->links();
    for (std::size_t i = 0; i < columns_.size(); ++i)
        for (std::int32_t at = columns_[i].link; at > 0; at = links[static_cast<std::size_t>(at)].parent) {
            const Link& link = links[static_cast<std::size_t>(at)];
            for (std::int32_t j = link.column; j < link.column + link.freedoms; ++j)
                visit(static_cast<std::int32_t>(i), j, columns_[i], columns_[static_cast<std::size_t>(j)]);
        }
}

void TreeDerivatives::positions(const Add& add) const {
    const auto base_motion = [](const Column& j, Vector6& speed, Vector6& rest) {
        speed = cross(j.before, j.S);
        rest = cross(j.acceleration, j.S) - cross(speed, j.before);
    };
    Vector6 row_i = Vector6::Zero(), coupled_i = row_i, own = row_i;
    std::int32_t last = -1;
    for_pairs([&](std::int32_t number_i, std::int32_t number_j, const Column& i, const Column& j) {
        const auto m = static_cast<std::size_t>(i.link);
        if (skips_(m)) return;
        Vector6 speed, rest;
        if (number_i != last) {
            last = number_i;
            row_i = inertia_[m] * i.S;
            coupled_i = coupling_[m].transpose() * i.S;
            base_motion(i, speed, rest);
            own = cross_force(i.S, force_[m]) + inertia_[m] * rest + coupling_[m] * speed;
        }
        base_motion(j, speed, rest);
        double value = row_i.dot(rest) + coupled_i.dot(speed);
        if (!moves_with(j, i)) value += i.S.dot(cross_force(j.S, force_[m]));
        add(number_i, number_j, value);
        if (i.link != j.link) add(number_j, number_i, j.S.dot(own));
    });
}

void TreeDerivatives::rates(const Add& add) const {
    Vector6 row_i = Vector6::Zero(), coupled_i = row_i, own = row_i;
    std::int32_t last = -1;
    for_pairs([&](std::int32_t number_i, std::int32_t number_j, const Column& i, const Column& j) {
        const auto m = static_cast<std::size_t>(i.link);
        if (skips_(m)) return;
        if (number_i != last) {
            last = number_i;
            row_i = inertia_[m] * i.S;
            coupled_i = coupling_[m].transpose() * i.S;
            own = inertia_[m] * cross(i.before + i.after, i.S) + coupling_[m] * i.S;
        }
        add(number_i, number_j, row_i.dot(cross(j.before + j.after, j.S)) + coupled_i.dot(j.S));
        if (i.link != j.link) add(number_j, number_i, j.S.dot(own));
    });
}

// With f fixed, its force F does not turn, while its torque τ turns with the body and its point of action x moves:
// about the origin the wrench changes by (ω × τ + δx × F, 0), δx = v + ω × x, as a linear map T of (ω, v); of Jᵀ f,
//
//     ∂(S_iᵀ W)/∂q_j = (S_j × S_i)ᵀ W [j ≼ i] + S_iᵀ T S_j
//
// with W and T summed up over the links that both move.
void TreeDerivatives::geometry(const double* f, const Add& add) const {
    const auto& links = tree_->links();
    std::vector<Vector6> wrench(links.size(), Vector6::Zero());
    std::vector<Matrix6> turning(links.size(), Matrix6::Zero());
    for (std::size_t k = links.size() - 1; k > 0; --k) {
        const LinkMotion& motion = tree_->motion(k);
        const double* own = f + links[k].body_column;
        const Vector3d force = Eigen::Map<const Vector3d>(own), torque = motion.A * Eigen::Map<const Vector3d>(own + 3);
        wrench[k] += six(torque + motion.x.cross(force), force);
        turning[k].topLeftCorner<3, 3>() += skew(force) * skew(motion.x) - skew(torque);
        turning[k].topRightCorner<3, 3>() -= skew(force);
        const auto parent = static_cast<std::size_t>(links[k].parent);
        wrench[parent] += wrench[k];
        turning[parent] += turning[k];
    }
    for_pairs([&](std::int32_t number_i, std::int32_t number_j, const Column& i, const Column& j) {
        const auto m = static_cast<std::size_t>(i.link);
        double value = i.S.dot(turning[m] * j.S);
        if (moves_with(j, i)) value += cross(j.S, i.S).dot(wrench[m]);
        add(number_i, number_j, value);
        if (i.link != j.link) add(number_j, number_i, j.S.dot(turning[m] * i.S));
    });
}

// J u of a link changes with all that comes after S_j and seen from a base that stands still: by S_j × (V_k − V).
Vector6 TreeDerivatives::turned_velocity(std::size_t link, std::int32_t number) const {
    const Column& j = columns_[static_cast<std::size_t>(number)];
    const LinkMotion& motion = tree_->motion(link);
    const Vector6 change = cross(j.S, speed_[link] - j.before);
    const Vector3d axis = j.S.head<3>(), turning = change.head<3>();
    const Vector3d moved = j.S.tail<3>() + axis.cross(motion.x);
    Vector6 result;
    result << change.tail<3>() + turning.cross(motion.x) + motion.omega.cross(moved),
        motion.A.transpose() * (turning + motion.omega.cross(axis));
    return result;
}

}  // namespace delassus::mechanics
