// SPDX-License-Identifier: BSD-3-Clause
// Gyroscopic torques of a multibody system, and the free spin of its bodies.
#include <algorithm>
#include <cmath>
#include <numeric>

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
// as a quaternion it is (1, ½h w), normalised. Newton's method converges at once while |h ω| is small.
//
// By itself it is of order 2: about an axis of inertia it turns by φ − φ³/12 in place of φ = h |ω|. Since both are
// kept, what it errs by is known to be of two kinds only: ω runs along its true curve at another pace, and the body is
// turned about its momentum, A J ω, which stays in space. To order h² these are quadratic forms in ω, diagonal in the
// axes of J. With the moments I, I', I'' of such an axis, the rotation about it gives one equation for the two
// coefficients of ω², and a small oscillation about it, whose true angle ψ = φ √((I − I')(I − I'')/(I' I'')) comes out
// as ψ − ψ³/12, the other. For all three axes together:
//
//     pace:   s = |w|²/12 + (2 yᵀ J y − tr(J) |y|²)/(12 det J)         y = J w
//     turn:   d = (tr(J) wᵀ y − 2 |y|²)/(12 det J)
//
//     J (ω⁺ − ω) = −τ w × J w,   A⁺ = A cay(τ w) exp(h³ d J ω⁺),   τ = h (1 + h² s)
//
// keeps energy and momentum as well, is symmetric in time, and of order 4 (as modified moments of inertia do it for
// the discrete Moser-Veselov map: Hairer and Vilmart, J. Phys. A 39, 2006). Since no moment exceeds the sum of the two
// others, |h² s| ≤ φ²/12. Steps that turn by more than largest_turn are made of several, which err by 1e-10 of the turn
// at most.
namespace {

constexpr double largest_turn = 0.01, most_parts = 250000.0;

/// Steps of the free spin of a body with the inertia J, in the body frame.
class FreeRotation {
public:
    explicit FreeRotation(const Matrix3d& J) : J_(J / J.trace()), share_(1.0 / (12.0 * J_.determinant())) {}

    /// ω ← ω⁺ and turn ← turn cay(τ w) exp(h³ d J ω⁺).
    void step(double h, Vector3d& omega, Quaterniond& turn) const {
        Vector3d next = omega, w, y;
        double tau = h;
        for (int i = 0; i < 20; ++i) {
            w = 0.5 * (omega + next);
            y = J_ * w;
            tau = h * (1.0 + h * h * (w.squaredNorm() / 12.0 + (2.0 * y.dot(J_ * y) - y.squaredNorm()) * share_));
            const Vector3d residual = J_ * (next - omega) + tau * w.cross(y);
            const Matrix3d slope = J_ + 0.5 * tau * (skew(w) * J_ - skew(y));
            const Vector3d change = slope.inverse() * residual;
            next -= change;
            if (change.norm() <= 1e-15 * next.norm()) break;
        }
        omega = next;
        const double d = (w.dot(y) - 2.0 * y.squaredNorm()) * share_;
        const Vector3d half = 0.5 * tau * w;
        turn = turn * Quaterniond(1.0, half.x(), half.y(), half.z()).normalized() *
               mechanics::exponential(h * h * h * d * (J_ * omega));
    }

private:
    Matrix3d J_;  // of which only ratios matter: of trace 1
    double share_;
};

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

std::vector<std::int32_t> MultibodySystem::bodies_of_columns() const {
    const auto& self = *implementation_;
    std::vector<std::int32_t> numbers(static_cast<std::size_t>(n()), 0);
    const auto begin = [&](std::int32_t column) {
        if (column > 0) numbers[static_cast<std::size_t>(column)] = 1;
    };
    for (const auto& body : self.moving) begin(body.column);
    for (const auto& body : self.reduced) begin(body.column);
    for (std::int32_t node = 0; node < node_count(); ++node) begin(node_column(node));
    std::partial_sum(numbers.begin(), numbers.end(), numbers.begin());
    return numbers;
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
        const FreeRotation rotation(J);
        for (double k = 0.0; k < parts; ++k) rotation.step(h / parts, speed, turn);
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
