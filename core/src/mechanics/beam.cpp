// SPDX-License-Identifier: BSD-3-Clause
// A corotational beam of two ends, after Crisfield (A consistent co-rotational formulation for non-linear,
// three-dimensional, beam-elements, Comput. Methods Appl. Mech. Engrg. 81, 1990), with the frame in the middle between
// its ends, so that everything follows from one potential.
//
// End i has the position p_i = x_i + A_i s̄_i and the axes R_i = A_i B̄_i, the same at both ends at the start, x along
// the beam. The ends are turned against each other by φ = log(R₁ᵀ R₂); halfway between them are the axes
// R = R₁ exp(φ/2), in which d = Rᵀ (p₂ − p₁) is the span. With L the length at the start, the potential is
//
//     V = ½ (d − L e_x)ᵀ N (d − L e_x) + ½ φᵀ Q φ,     Q = diag(G J, E I_y, E I_z)/L,
//     N = diag(E A, S_y, S_z)/L,   1/S_y = 1/(G A_y) + L²/(12 E I_z),   1/S_z = 1/(G A_z) + L²/(12 E I_y)
//
// A straight beam under end loads bends by a symmetric part, of energy ½ (E I/L) φ², and an antisymmetric one, of
// energy 6 E I/(L (1 + Φ)) γ² with γ = d_y/L and Φ = 12 E I/(G A L²) (Przemieniecki, Theory of Matrix Structural
// Analysis, 1968, section 5.6): that is V, so that small deflections by loads at the nodes are exact with any number of
// elements. No rigid motion changes d or φ. Infinite shear areas give the beam of Euler and Bernoulli.
//
// ---- First variation ----
// Let a_i be the spins of the ends and ρ the variation of p₂ − p₁, in the axes R; b = a₂ − a₁, c = ½(a₁ + a₂). With
// s = φ·φ, x = |φ|/2, w = x/sin x, y = (1 − w)/s and z = tan(|φ|/4)/|φ| :
//
//     δφ = W b,   W = w I + y φ φᵀ               (T(φ)⁻¹ with exp(∓φ/2) taken out: symmetric)
//     μ  = c + Z b,   Z = −½ z [φ]×              the spin of R
//     δd = ρ + d × μ
//     δV = n·δd + m·δφ = n·ρ + g·b + t·c,   n = N(d − L e_x),  m = Q φ,   t = n × d,   g = W m + Zᵀ t
//
// With P_i = Rᵀ A_i and increments (δx, θ) of the bodies, ρ = δx₂ − δx₁ (turned by Rᵀ) − P₂ [s̄₂]× θ₂ + P₁ [s̄₁]× θ₁ and
// a_i = P_i θ_i: (ρ, b, c) = B δ, and the gradient is Bᵀ(n, g, t).
//
// ---- Second variation ----
// In the axes R, which turn by μ, the derivative of R n is dn + μ × n, and likewise for g and t; what is left of
// d(Bᵀ) is the turning of the bodies' own axes, Aᵀu → Aᵀu − θ × Aᵀu:
//
//     K = Bᵀ H B + [P_iᵀ(½t ± g)]× ± [s̄_i]× [P_iᵀ n]×  at (θ_i, θ_i),   H = rows (dn − [n]×μ, dg − [g]×μ, dt − [t]×μ)
//     dn = N δd,   dm = Q δφ,   dt = n × δd − d × dn
//     dg = W dm + (dW) m + ½ z φ × dt + ½ z δφ × t + z_s (φ·δφ) φ × t
//     (dW) m = 2 (w_s m + y_s (φ·m) φ)(φ·δφ) + y ((φ·m) δφ + φ (m·δφ)),   index s: derivative to s
//
// Damping (Kelvin and Voigt): n and m grow by τ N ḋ and τ Q φ̇, with ḋ and φ̇ by the first variation along velocities.
#include "mechanics/beam.hpp"

#include <fmt/format.h>

#include <cmath>

#include "delassus/error.hpp"
#include "mechanics/beam_frame.hpp"

namespace delassus::mechanics {
namespace {

using Matrix39 = Eigen::Matrix<double, 3, 9>;
using Matrix99 = Eigen::Matrix<double, 9, 9>;
using Matrix912 = Eigen::Matrix<double, 9, 12>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

}  // namespace

Matrix3d Beam::axes(const BeamParameters& beam) {
    const Vector3d first(beam.first_point.data()), second(beam.second_point.data()), wanted(beam.section_y.data());
    const Vector3d span = second - first;
    const double length = span.norm();
    if (!(length > 0.0) || !std::isfinite(length))
        throw InputError(fmt::format("the ends of the beam \"{}\" coincide or are not finite", beam.name));
    const Vector3d along = span / length;
    Vector3d across = normal_to(along);
    if (wanted.norm() > 0.0) {
        across = wanted - along.dot(wanted) * along;
        if (!(across.norm() > 1e-6 * wanted.norm()))
            throw InputError(
                fmt::format("the y axis of the section of the beam \"{}\" runs along the beam; it must "
                            "point across it",
                            beam.name));
        across.normalize();
    }
    Matrix3d result;
    result << along, across, along.cross(across);
    return result;
}

Beam::Beam(const BeamParameters& beam, const Placements& at)
    : bodies_{beam.first, beam.second}, damping_time_(beam.material.damping_time) {
    const Matrix3d start = axes(beam);
    const std::array<Vector3d, 2> ends{Vector3d(beam.first_point.data()), Vector3d(beam.second_point.data())};
    for (std::size_t i = 0; i < 2; ++i) {
        const Placement& place = at[bodies_[i]];
        arm_[i] = place.A.transpose() * (ends[i] - place.x);
        turn_[i] = place.A.transpose() * start;
    }
    length_ = (ends[1] - ends[0]).norm();
    const auto& section = beam.section;
    const double young = beam.material.young, shear = 0.5 * young / (1.0 + beam.material.poisson);
    const auto shearing = [&](double shear_area, double inertia) {
        return 1.0 / (1.0 / (shear * shear_area) + length_ * length_ / (12.0 * young * inertia));
    };
    stretching_ = Vector3d(young * section.area, shearing(section.shear_area_y, section.inertia_z),
                           shearing(section.shear_area_z, section.inertia_y)) /
                  length_;
    bending_ = Vector3d(shear * section.torsion, young * section.inertia_y, young * section.inertia_z) / length_;
}

struct Beam::Kinematics : BeamFrame {
    Vector3d d;
    std::array<Matrix3d, 2> P;
    Matrix912 B;
    Vector3d n, m, t, g;                  // with damping
    std::array<Vector3d, 2> spin, swing;  // a_i, and P_i (ω̄_i × s̄_i), of the velocities
    Vector3d rho_rate, b_rate, c_rate, mu_rate;

    /// δφ, μ and δd by (ρ, b, c).
    [[nodiscard]] Matrix39 turning() const {
        Matrix39 result = Matrix39::Zero();
        result.middleCols<3>(3) = W;
        return result;
    }
    [[nodiscard]] Matrix39 spinning() const {
        Matrix39 result = Matrix39::Zero();
        result.middleCols<3>(3) = Z;
        result.rightCols<3>().setIdentity();
        return result;
    }
    [[nodiscard]] Matrix39 spanning() const {
        Matrix39 result = skew(d) * spinning();
        result.leftCols<3>() += Matrix3d::Identity();
        return result;
    }
};

Beam::Kinematics Beam::kinematics(const Ends& at) const {
    Kinematics now;
    static_cast<BeamFrame&>(now) = BeamFrame(at[0].A * turn_[0], at[1].A * turn_[1]);
    const Matrix3d& R = now.R;
    now.d = R.transpose() * (at[1].x + at[1].A * arm_[1] - at[0].x - at[0].A * arm_[0]);
    now.B.setZero();
    for (std::size_t i = 0; i < 2; ++i) {
        const double sign = i == 0 ? -1.0 : 1.0;
        const auto column = 6 * static_cast<Eigen::Index>(i);
        now.P[i] = R.transpose() * at[i].A;
        now.B.block<3, 3>(0, column) = sign * R.transpose();
        now.B.block<3, 3>(0, column + 3) = -sign * now.P[i] * skew(arm_[i]);
        now.B.block<3, 3>(3, column + 3) = sign * now.P[i];
        now.B.block<3, 3>(6, column + 3) = 0.5 * now.P[i];
        now.spin[i] = now.P[i] * at[i].omega;
        now.swing[i] = now.P[i] * at[i].omega.cross(arm_[i]);
    }
    now.rho_rate = R.transpose() * (at[1].v - at[0].v) + now.swing[1] - now.swing[0];
    now.b_rate = now.spin[1] - now.spin[0];
    now.c_rate = 0.5 * (now.spin[0] + now.spin[1]);
    now.mu_rate = now.c_rate + now.Z * now.b_rate;
    Vector3d stretch = now.d - length_ * Vector3d::UnitX(), turn = now.phi;
    if (damped()) {
        stretch += damping_time_ * (now.rho_rate + now.d.cross(now.mu_rate));
        turn += damping_time_ * (now.W * now.b_rate);
    }
    now.n = stretching_.cwiseProduct(stretch);
    now.m = bending_.cwiseProduct(turn);
    now.t = now.n.cross(now.d);
    now.g = now.W * now.m + now.Z.transpose() * now.t;
    return now;
}

double Beam::energy(const Ends& at) const {
    const Kinematics now = kinematics(at);
    const Vector3d stretch = now.d - length_ * Vector3d::UnitX();
    return 0.5 * (stretch.dot(stretching_.cwiseProduct(stretch)) + now.phi.dot(bending_.cwiseProduct(now.phi)));
}

void Beam::force(const Ends& at, Forces& result) const {
    const Kinematics now = kinematics(at);
    Vector9 inner;
    inner << now.n, now.g, now.t;
    result = -now.B.transpose() * inner;
}

void Beam::stiffness(const Ends& at, Matrix& result) const {
    const Kinematics now = kinematics(at);
    const Matrix39 d_phi = now.turning(), mu = now.spinning(), d_d = now.spanning();
    Matrix39 d_stretch = d_d, d_turn = d_phi;
    if (damped()) {
        // Velocities stay as they are in the world (v) and in the bodies (ω̄). In R, which turns by μ, a vector of the
        // world changes by u × μ, one of body i by a_i × u besides; a₁ = c − ½b and a₂ = c + ½b.
        const auto in_R = [&](const Vector3d& u, const Vector3d& of_first, const Vector3d& of_second) {
            Matrix39 change = skew(u) * mu;
            change.middleCols<3>(3) += 0.5 * (skew(of_first) - skew(of_second));
            change.rightCols<3>() -= skew(of_first) + skew(of_second);
            return change;
        };
        const Matrix39 d_b = in_R(now.b_rate, -now.spin[0], now.spin[1]);
        const Matrix39 d_c = in_R(now.c_rate, 0.5 * now.spin[0], 0.5 * now.spin[1]);
        const Matrix39 d_rho = in_R(now.rho_rate, -now.swing[0], now.swing[1]);
        const Matrix39 d_mu = d_c + now.Z * d_b + now.change_of_Z(now.b_rate) * d_phi;
        d_stretch += damping_time_ * (d_rho - skew(now.mu_rate) * d_d + skew(now.d) * d_mu);
        d_turn += damping_time_ * (now.W * d_b + now.change_of_W(now.b_rate) * d_phi);
    }
    const Matrix39 d_n = stretching_.asDiagonal() * d_stretch, d_m = bending_.asDiagonal() * d_turn;
    const Matrix39 d_t = skew(now.n) * d_d - skew(now.d) * d_n;
    const Matrix3d turning = now.change_of_W(now.m) - now.change_of_Z(now.t);  // Zᵀ = −Z
    const Matrix39 d_g = now.W * d_m + now.Z.transpose() * d_t + turning * d_phi;
    Matrix99 H;
    H << d_n - skew(now.n) * mu, d_g - skew(now.g) * mu, d_t - skew(now.t) * mu;
    result = now.B.transpose() * H * now.B;
    for (std::size_t i = 0; i < 2; ++i) {
        const double sign = i == 0 ? -1.0 : 1.0;
        const auto at_theta = 6 * static_cast<Eigen::Index>(i) + 3;
        const Matrix3d inverse = now.P[i].transpose();
        result.block<3, 3>(at_theta, at_theta) +=
            skew(inverse * (0.5 * now.t + sign * now.g)) + skew(arm_[i]) * skew(sign * inverse * now.n);
    }
}

void Beam::damping(const Ends& at, Matrix& result) const {
    const Kinematics now = kinematics(at);
    const Matrix39 d_phi = now.turning(), d_d = now.spanning();
    const Matrix99 inner = damping_time_ * (d_d.transpose() * stretching_.asDiagonal() * d_d +
                                            d_phi.transpose() * bending_.asDiagonal() * d_phi);
    result = now.B.transpose() * inner * now.B;
}

}  // namespace delassus::mechanics
