// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/modal_body.hpp"

namespace delassus::mechanics {
namespace {

/// tr(Q) I − Q of a symmetric tensor.
Matrix3d inertia_of(const std::array<double, 6>& Q) {
    Matrix3d J;
    J << Q[1] + Q[2], -Q[3], -Q[4], -Q[3], Q[0] + Q[2], -Q[5], -Q[4], -Q[5], Q[0] + Q[1];
    return J;
}

/// ω · (tr(Q) I − Q) ω = Σ weights · entries of Q.
std::array<double, 6> weights_of(const Vector3d& w) {
    return {w.y() * w.y() + w.z() * w.z(), w.x() * w.x() + w.z() * w.z(), w.x() * w.x() + w.y() * w.y(),
            -2.0 * w.x() * w.y(),          -2.0 * w.x() * w.z(),          -2.0 * w.y() * w.z()};
}

}  // namespace

ModalDynamics::ModalDynamics(const ModalInertia& body, const ModalPlacement& at) : body_(body), at_(at) {
    std::array<double, 6> Q = body.moments, rate{};
    for (std::size_t c = 0; c < 6; ++c) {
        const VectorXd square = body.square_moments[c] * at.s;
        slopes_[c] = body.linear_moments[c] + 2.0 * square;
        Q[c] += at.s.dot(body.linear_moments[c] + square);
        rate[c] = slopes_[c].dot(at.s_dot);
    }
    J_ = inertia_of(Q);
    J_dot_ = inertia_of(rate);
    L_ = -products_with(at.s);  // N^iᵀ = −N^i
    h_ = J_ * at.omega + L_ * at.s_dot;
}

Matrix3Xd ModalDynamics::turned(const Six& Q, const Vector3d& w) {
    Matrix3Xd result(3, Q[0].size());
    result.row(0) = ((Q[1] + Q[2]) * w.x() - Q[3] * w.y() - Q[4] * w.z()).transpose();
    result.row(1) = ((Q[0] + Q[2]) * w.y() - Q[3] * w.x() - Q[5] * w.z()).transpose();
    result.row(2) = ((Q[0] + Q[1]) * w.z() - Q[4] * w.x() - Q[5] * w.y()).transpose();
    return result;
}

Matrix3Xd ModalDynamics::products_with(const VectorXd& x) const {
    Matrix3Xd result(3, body_.modes());
    for (Eigen::Index i = 0; i < 3; ++i) result.row(i) = (body_.products[static_cast<std::size_t>(i)] * x).transpose();
    return result;
}

MatrixXd ModalDynamics::weighted(const Vector3d& w) const {
    return -(w.x() * body_.products[0] + w.y() * body_.products[1] + w.z() * body_.products[2]);
}

double ModalDynamics::kinetic_energy() const {
    return 0.5 * (body_.mass * (at_.v.squaredNorm() + at_.s_dot.squaredNorm()) + at_.omega.dot(J_ * at_.omega)) +
           at_.omega.dot(L_ * at_.s_dot);
}

double ModalDynamics::elastic_energy() const {
    return 0.5 * body_.mass * body_.squares.dot(at_.s.cwiseAbs2());
}

MatrixXd ModalDynamics::mass() const {
    const auto k = body_.modes();
    MatrixXd M = MatrixXd::Zero(3 + k, 3 + k);
    M.topLeftCorner<3, 3>() = J_;
    M.topRightCorner(3, k) = L_;
    M.bottomLeftCorner(k, 3) = L_.transpose();
    M.bottomRightCorner(k, k).diagonal().setConstant(body_.mass);
    return M;
}

void ModalDynamics::multiply_mass(double factor, const double* x, double* result) const {
    const auto k = body_.modes();
    const Eigen::Map<const Vector3d> linear(x), turning(x + 3);
    const Eigen::Map<const VectorXd> amplitudes(x + 6, k);
    Eigen::Map<Vector3d>{result} += factor * body_.mass * linear;
    Eigen::Map<Vector3d>(result + 3) += factor * (J_ * turning + L_ * amplitudes);
    Eigen::Map<VectorXd>(result + 6, k) += factor * (L_.transpose() * turning + body_.mass * amplitudes);
}

void ModalDynamics::add_force(double factor, double* result) const {
    const auto k = body_.modes();
    const Vector3d& w = at_.omega;
    Eigen::Map<Vector3d>(result + 3) -= factor * (J_dot_ * w + w.cross(h_));
    const VectorXd elastic = body_.squares.cwiseProduct(at_.s + body_.damping_time * at_.s_dot);
    const VectorXd centrifugal = 0.5 * turned(slopes_, w).transpose() * w;
    Eigen::Map<VectorXd>(result + 6, k) +=
        factor * (centrifugal - 2.0 * (weighted(w) * at_.s_dot) - body_.mass * elastic);
    if (body_.damping_rate == 0.0) return;
    VectorXd v(6 + k);
    v << at_.v, w, at_.s_dot;
    multiply_mass(-factor * body_.damping_rate, v.data(), result);
}

// With ∂J̇/∂s_a = J of 2 P ṡ, and ∂(L ṡ)/∂s_a = Σ_b N_ab ṡ_b.
MatrixXd ModalDynamics::stiffness() const {
    const auto k = body_.modes();
    const Vector3d& w = at_.omega;
    MatrixXd K = MatrixXd::Zero(3 + k, 3 + k);
    Six rates;
    for (std::size_t c = 0; c < 6; ++c) rates[c] = 2.0 * (body_.square_moments[c] * at_.s_dot);
    K.topRightCorner(3, k) = turned(rates, w) + skew(w) * (turned(slopes_, w) + products_with(at_.s_dot));
    auto elastic = K.bottomRightCorner(k, k);
    elastic.diagonal() = body_.mass * body_.squares;
    const auto weights = weights_of(w);
    for (std::size_t c = 0; c < 6; ++c) elastic -= weights[c] * body_.square_moments[c];
    if (body_.damping_rate > 0.0) K += body_.damping_rate * inertial_stiffness(w, at_.s_dot);
    return K;
}

MatrixXd ModalDynamics::damping() const {
    const auto k = body_.modes();
    const Vector3d& w = at_.omega;
    const Matrix3Xd slope = turned(slopes_, w);
    MatrixXd R(3 + k, 3 + k);
    R.topLeftCorner<3, 3>() = J_dot_ - skew(L_ * at_.s_dot);
    R.topRightCorner(3, k) = slope + skew(w) * L_;
    R.bottomLeftCorner(k, 3) = -(2.0 * products_with(at_.s_dot) + slope).transpose();
    R.bottomRightCorner(k, k) = 2.0 * weighted(w);
    R.bottomRightCorner(k, k).diagonal() += body_.damping_time * body_.mass * body_.squares;
    if (body_.damping_rate > 0.0) R += body_.damping_rate * mass();
    return R;
}

MatrixXd ModalDynamics::inertial_stiffness(const Vector3d& turning, const VectorXd& amplitudes) const {
    const auto k = body_.modes();
    MatrixXd K = MatrixXd::Zero(3 + k, 3 + k);
    K.topRightCorner(3, k) = turned(slopes_, turning) + products_with(amplitudes);
    K.bottomRightCorner(k, k) = weighted(turning);
    return K;
}

}  // namespace delassus::mechanics
