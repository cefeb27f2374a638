// SPDX-License-Identifier: BSD-3-Clause
// C, C_q, C_t, the curvature and the stiffness of a multibody system's joints.
#include <algorithm>
#include <cmath>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::Attachment;
using mechanics::Feature;
using mechanics::Gear;
using mechanics::Matrix3d;
using mechanics::ModalAttachment;
using mechanics::ModalPlacement;
using mechanics::Placement;
using mechanics::Row;
using mechanics::Vector3d;

namespace {

void put(const Eigen::VectorXd& values, double* to) {
    std::copy(values.begin(), values.end(), to);
}

}  // namespace

std::vector<std::int32_t> MultibodySystem::constraint_blocks() const {
    implementation_->must_be_finished();
    std::vector<std::int32_t> blocks;
    // Rows of one unit make a block: three of a point (m), then the others one by one or, of equal kind, together.
    for (const auto& joint : implementation_->joints) {
        if (joint.gear) {
            if (implementation_->place_of(joint, 0) >= 0) blocks.push_back(1);
            continue;
        }
        std::int32_t count = 0;
        bool last_is_point = false;
        for (std::size_t i = 0; i < joint.rows.size(); ++i) {
            if (implementation_->place_of(joint, i) < 0) continue;
            const bool point = joint.rows[i].u.count == 2;
            if (count > 0 && point != last_is_point) {
                blocks.push_back(count);
                count = 0;
            }
            last_is_point = point;
            ++count;
        }
        if (count > 0) blocks.push_back(count);
    }
    blocks.insert(blocks.end(), implementation_->attachments.size(), 3);
    for (const auto& one : implementation_->modal_attachments)
        blocks.insert(blocks.end(), static_cast<std::size_t>(one.rows() / 3), 3);
    return blocks;
}

void MultibodySystem::constraint(const State& state, double* C) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_row([&](std::int32_t i, const Row& row) { C[i] = row.value(self.at, state.t); });
    self.for_each_gear([&](std::int32_t i, const Gear& gear) { C[i] = gear.value(self.at, state.t); });
    self.for_each_attachment([&](std::int32_t i, const Attachment& one, const Placement& body) {
        Eigen::Map<Vector3d>(C + i) = self.node_at(one.node, state.q.data(), state.v.data()).x - one.place(body);
    });
    self.for_each_modal_attachment([&](std::int32_t i, const ModalAttachment& one, const ModalPlacement& own,
                                       const Placement& body) { put(one.value(own, body), C + i); });
}

void MultibodySystem::all_constraints(const State& state, double* C) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    for (const auto& joint : self.joints) {
        double* own = C + joint.first_row;
        if (joint.gear) own[0] = joint.gear->value(self.at, state.t);
        for (std::size_t i = 0; i < joint.rows.size(); ++i) own[i] = joint.rows[i].value(self.at, state.t);
    }
    for (const auto& one : self.attachments)
        Eigen::Map<Vector3d>(C + one.first_row) =
            self.node_at(one.node, state.q.data(), state.v.data()).x - one.place(self.at[one.body]);
    for (const auto& one : self.modal_attachments)
        put(one.value(self.modal_at[static_cast<std::size_t>(one.reduced)], self.at[one.body]), C + one.first_row);
}

void MultibodySystem::Implementation::add_gradient(const Row& row, std::int32_t to, MatrixAssembler& D,
                                                   double factor) const {
    const auto columns = row.columns(at);
    row.gradient(at, columns, gradient);
    for (int k = 0; k < columns.bodies; ++k)
        for (int j = row.angle ? 3 : 0; j < 6; ++j)
            D.add(to, columns.column[static_cast<std::size_t>(k)] + j, factor * gradient[6 * k + j]);
}

void MultibodySystem::add_joint_jacobian(const State& state, MatrixAssembler& D) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    for (const auto& joint : self.joints)
        for (std::size_t i = 0; i < joint.rows.size(); ++i)
            self.add_gradient(joint.rows[i], joint.first_row + static_cast<std::int32_t>(i), D);
}

void MultibodySystem::add_constraint_jacobian(const State& state, std::int32_t first_row, MatrixAssembler& D) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_row([&](std::int32_t i, const Row& row) { self.add_gradient(row, first_row + i, D); });
    self.for_each_gear([&](std::int32_t i, const Gear& gear) {
        self.add_gradient(gear.second, first_row + i, D);
        self.add_gradient(gear.first, first_row + i, D, -gear.ratio());
    });
    self.for_each_attachment([&](std::int32_t i, const Attachment& one, const Placement& body) {
        const auto node = self.nodes[static_cast<std::size_t>(one.node)].column;
        const Matrix3d turn = one.turn(body);
        for (int k = 0; k < 3; ++k) {
            D.add(first_row + i + k, node + k, 1.0);
            if (body.column < 0) continue;
            D.add(first_row + i + k, body.column + k, -1.0);
            for (int j = 0; j < 3; ++j) D.add(first_row + i + k, body.column + 3 + j, turn(k, j));
        }
    });
    self.for_each_modal_attachment(
        [&](std::int32_t i, const ModalAttachment& one, const ModalPlacement& own, const Placement& body) {
            const auto rows = one.jacobian(own, body);
            self.for_each_part(own, body, [&](std::int32_t from, std::int32_t to, std::int32_t count) {
                for (std::int32_t row = 0; row < one.rows(); ++row)
                    for (std::int32_t j = 0; j < count; ++j) D.add(first_row + i + row, to + j, rows(row, from + j));
            });
        });
}

void MultibodySystem::constraint_rate(const State& state, double* C_t) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_row([&](std::int32_t i, const Row& row) { C_t[i] = row.rate(self.at, state.t); });
    self.for_each_gear([&](std::int32_t i, const Gear& gear) { C_t[i] = gear.rate(self.at, state.t); });
    self.for_each_attachment([&](std::int32_t i, const Attachment& one, const Placement& body) {
        Eigen::Map<Vector3d>(C_t + i) = body.prescribed() ? Vector3d(-one.velocity(body)) : Vector3d::Zero();
    });
    self.for_each_modal_attachment([&](std::int32_t i, const ModalAttachment& one, const ModalPlacement& own,
                                       const Placement& body) { put(one.rate(own, body), C_t + i); });
}

void MultibodySystem::constraint_curvature(const State& state, double* c) const {
    const auto& self = *implementation_;
    self.place(state);
    self.for_each_row([&](std::int32_t i, const Row& row) { c[i] = row.curvature(self.at, state.t); });
    self.for_each_gear([&](std::int32_t i, const Gear& gear) { c[i] = gear.curvature(self.at, state.t); });
    self.for_each_attachment([&](std::int32_t i, const Attachment& one, const Placement& body) {
        Eigen::Map<Vector3d>(c + i) = one.curvature(body);
    });
    self.for_each_modal_attachment([&](std::int32_t i, const ModalAttachment& one, const ModalPlacement& own,
                                       const Placement& body) { put(one.curvature(own, body), c + i); });
}

void MultibodySystem::add_constraint_stiffness(const State& state, const double* lambda, double factor, Tangent tangent,
                                               MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    // Rows of the same bodies, as a joint's are, are summed up before they are added.
    mechanics::RowColumns common;
    mechanics::RowMatrix sum;
    self.for_each_row([&](std::int32_t i, const Row& row) {
        const auto columns = row.columns(self.at);
        row.hessian(self.at, columns, self.hessian);
        if (columns.bodies == common.bodies && columns.column == common.column) {
            sum += factor * lambda[i] * self.hessian;
            return;
        }
        add_local(common, sum, 1.0, tangent, H);
        common = columns;
        sum = factor * lambda[i] * self.hessian;
    });
    add_local(common, sum, 1.0, tangent, H);
    self.for_each_gear([&](std::int32_t i, const Gear& gear) {
        for (const bool second : {true, false}) {
            const Row& row = second ? gear.second : gear.first;
            const auto columns = row.columns(self.at);
            row.hessian(self.at, columns, self.hessian);
            const double weight = second ? 1.0 : -gear.ratio();
            add_local(columns, self.hessian, factor * lambda[i] * weight, tangent, H);
        }
    });
    self.for_each_attachment([&](std::int32_t i, const Attachment& one, const Placement& body) {
        if (body.column < 0) return;
        Matrix3d K = factor * one.stiffness(body, Eigen::Map<const Vector3d>(lambda + i));
        if (tangent != Tangent::Exact) K = (0.5 * (K + K.transpose())).eval();
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) H.add(body.column + 3 + a, body.column + 3 + b, K(a, b));
    });
    self.for_each_modal_attachment(
        [&](std::int32_t i, const ModalAttachment& one, const ModalPlacement& own, const Placement& body) {
            Eigen::MatrixXd K = factor * one.stiffness(own, body, lambda + i);
            if (tangent != Tangent::Exact) K = (0.5 * (K + K.transpose())).eval();
            const auto add = [&](std::int32_t row, std::int32_t to_row, std::int32_t rows) {
                self.for_each_part(own, body, [&](std::int32_t column, std::int32_t to, std::int32_t columns) {
                    for (std::int32_t a = 0; a < rows; ++a)
                        for (std::int32_t b = 0; b < columns; ++b) H.add(to_row + a, to + b, K(row + a, column + b));
                });
            };
            self.for_each_part(own, body, add);
        });
}

// A point of a body at the arm c̄ (body frame), on which a joint puts the force s y, adds s [c̄]× [Aᵀy]× to
// ∂(C_qᵀ λ)/∂θ, which is s (Aᵀy c̄ᵀ − (c̄ · Aᵀy) I). Under a force along the arm the negative of it is
//
//     k (I − ĉ ĉᵀ),      k = s c̄ · Aᵀ y,   ĉ = c̄/|c̄|
//
// the stiffness of a pulled arm against being turned out of line. It is positive under pull, and nothing under a turn
// about the arm. This term is kept where k > 0. The symmetric part of the whole would not work: the force of the last
// step is always a little across the arm, and would couple turns about the arm to others by a torque that does not
// exist. A step bears h² k explicitly up to a tenth of the moment of inertia about the point; up to there the method
// conserves energy far better without the term (a pendulum of 1 m and 9.81 J loses 0.44 J with it in a period at 1 ms,
// 3e-6 J without). Nothing is kept of what a joint does to directions, and of the swing of a rod's own ends. H keeps
// its blocks.
void MultibodySystem::add_definite_constraint_stiffness(const State& state, const double* lambda, double factor,
                                                        MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), nullptr, state.t);
    for (const auto& joint : self.joints) {
        Vector3d force = Vector3d::Zero();  // of all rows on the span of points that they share
        const Feature* span = nullptr;
        for (std::size_t i = 0; i < joint.rows.size(); ++i) {
            const Row& row = joint.rows[i];
            const auto place = self.place_of(joint, i);
            if (row.u.count != 2 || place < 0) continue;
            force += row.force(self.at, lambda[place]);
            span = &row.u;
        }
        if (span == nullptr) continue;
        for (const auto& part : span->parts) {
            const auto& place = self.at[part.body];
            if (place.column < 0) continue;
            const Vector3d& c = part.arm;
            const auto& body = self.bodies[static_cast<std::size_t>(part.body)];
            const double moment = body.parameters.mass * c.squaredNorm() + body.inertia.diagonal().minCoeff();
            const double k = factor * part.sign * c.dot(place.A.transpose() * force) - 0.1 * moment;
            if (k <= 0.0) continue;
            const Matrix3d G = k * (Matrix3d::Identity() - c * c.transpose() / c.squaredNorm());
            H.add_block(place.column + 3, place.column + 3, 3, 3, G.data());
        }
    }
}

}  // namespace delassus
