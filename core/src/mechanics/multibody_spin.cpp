// SPDX-License-Identifier: BSD-3-Clause
// Gyroscopic torques of a multibody system, and the free spin of its bodies.
#include <algorithm>
#include <array>
#include <cmath>

#include "mechanics/multibody_implementation.hpp"
#include "mechanics/rotation.hpp"

namespace delassus {

using mechanics::Matrix3d;
using mechanics::Quaterniond;
using mechanics::Vector3d;

// The implicit midpoint rule for Euler's equations J ω̇ = −ω × J ω in the body frame, with w = ½ (ω + ω⁺),
//
//     J (ω⁺ − ω) = −h w × J w,        A⁺ = A cay(h w),   cay(h w) = (I − ½h [w]×)⁻¹ (I + ½h [w]×)
//
// keeps the energy ½ ω · J ω, since the right-hand side is normal to w; and the momentum A J ω in space, since
// (I + ½h [w]×) J ω⁺ = (I − ½h [w]×) J ω follows from it (Simo and Wong, Int. J. Numer. Meth. Eng. 31, 1991; Austin,
// Krishnaprasad and Wang, J. Comput. Phys. 107, 1993). Order 2. The rotation cay(h w) turns by 2 atan(½h |w|) about w:
// as a quaternion it is (1, ½h w), normalised. Newton's method converges at once while |h ω| is small; longer steps are
// made of several.
//
// Of an angle φ = h |ω| a step is off by φ²/12 of it: 0.5 % at a quarter of a radian. So turns that are not small are
// made of five such steps, of c h, c h, (1 − 4 c) h, c h and c h with c = 1/(4 − 4^⅓), which is of order 4 and keeps
// what each of them keeps (Suzuki, Phys. Lett. A 146, 1990; Hairer, Lubich, Wanner, Geometric Numerical Integration,
// sec. II.4).
namespace {

constexpr double largest_turn = 0.25, small_turn = 0.01;
constexpr double most_parts = 10000.0;
constexpr double outer = 0.41449077179437573714;
constexpr std::array<double, 5> shares = {outer, outer, 1.0 - 4.0 * outer, outer, outer};

/// ω ← ω⁺ after h.
Vector3d midpoint_speed(const Matrix3d& J, const Vector3d& omega, double h) {
    Vector3d next = omega;
    for (int i = 0; i < 20; ++i) {
        const Vector3d sum = omega + next, momentum = J * sum;
        const Vector3d residual = J * (next - omega) + 0.25 * h * sum.cross(momentum);
        const Matrix3d slope = J + 0.25 * h * (skew(sum) * J - skew(momentum));
        const Vector3d change = slope.inverse() * residual;
        next -= change;
        if (change.norm() <= 1e-15 * next.norm()) break;
    }
    return next;
}

}  // namespace

std::vector<std::int32_t> MultibodySystem::vectors() const {
    const auto& self = *implementation_;
    std::vector<std::int32_t> columns;
    for (const auto& body : self.moving) columns.insert(columns.end(), {body.column, body.column + 3});
    for (const auto& body : self.reduced) columns.insert(columns.end(), {body.column, body.column + 3});
    for (std::int32_t node = 0; node < node_count(); ++node)
        if (node_column(node) >= 0) columns.push_back(node_column(node));
    std::sort(columns.begin(), columns.end());
    return columns;
}

void MultibodySystem::free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const {
    const auto& self = *implementation_;
    spins.clear();
    const auto add = [&](const Matrix3d& J, std::int32_t column, bool alone) {
        const Vector3d omega = Eigen::Map<const Vector3d>(state.v.data() + column);
        FreeSpin& spin = spins.emplace_back();
        spin.column = column;
        spin.alone = alone;
        const double angle = h * omega.norm(), parts = std::clamp(std::ceil(angle / largest_turn), 1.0, most_parts);
        Vector3d speed = omega;
        Quaterniond turn = Quaterniond::Identity();
        const auto spin_on = [&](double part) {
            const Vector3d next = midpoint_speed(J, speed, part), half = 0.25 * part * (speed + next);
            turn = turn * Quaterniond(1.0, half.x(), half.y(), half.z()).normalized();
            speed = next;
        };
        if (angle <= small_turn) {
            spin_on(h);
        } else {
            for (double k = 0.0; k < parts; ++k)
                for (const double share : shares) spin_on(share * h / parts);
        }
        spin.torque = mechanics::array(-omega.cross(J * omega));
        spin.impulse = mechanics::array(J * (speed - omega));
        spin.speed = mechanics::array(speed);
        spin.turn = mechanics::array(mechanics::logarithm(turn));
    };
    if (self.gyroscopic)
        for (const auto& body : self.moving)
            if (body.gyroscopic) add(body.inertia, body.column + 3, body.alone);
    self.place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < self.reduced.size(); ++k)  // with the inertia of the shape of now
        add(self.modal_dynamics(k).inertia(), self.reduced[k].column + 3, false);
}

// R = ∂(ω̄ × J ω̄)/∂ω̄ = [ω̄]× J − [J ω̄]×. Its symmetric part ½([ω̄]× J − J [ω̄]×) is indefinite; beside J it stays
// harmless while factor |R| is small against J. Beyond that (fast spin) it would make H indefinite, and it is left out
// of the symmetric tangent: a step is consistent with any tangent.
void MultibodySystem::add_gyroscopic_damping(const State& state, double factor, Tangent tangent,
                                             MatrixAssembler& H) const {
    const auto& self = *implementation_;
    const auto add = [&](const Matrix3d& J, std::int32_t column) {
        const Eigen::Map<const Vector3d> omega(state.v.data() + column);
        Matrix3d R = skew(omega) * J - skew(J * omega);
        if (tangent == Tangent::Symmetric) {
            R = (0.5 * (R + R.transpose())).eval();
            if (std::abs(factor) * R.norm() > 0.25 * J.diagonal().minCoeff()) R.setZero();
        }
        const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> block = R;
        H.add_block(column, column, 3, 3, block.data(), factor);
    };
    if (self.gyroscopic)
        for (const auto& body : self.moving)
            if (body.gyroscopic) add(body.inertia, body.column + 3);
    self.place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < self.reduced.size(); ++k)
        add(self.modal_dynamics(k).inertia(), self.reduced[k].column + 3);
}

}  // namespace delassus
