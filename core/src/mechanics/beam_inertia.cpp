// SPDX-License-Identifier: BSD-3-Clause
// The kinetic energy of a beam's element is that of its mass centre c, and that of its end velocities in the frame R
// halfway between its ends (beam.cpp), with a constant matrix:
//
//     T = ½ m |ċ|² + ½ v̂ᵀ M' v̂,   v̂ = (Rᵀ v₁, P₁ ω̄₁, Rᵀ v₂, P₂ ω̄₂) = E(q) v,   P_i = Rᵀ A_i
//     c = ½ (x₁ + x₂) + λ (A₁ e − A₂ e),   λ = L/12,   e = (1, 0, 0)
//
// c is that of the cubic that has the ends' places and tangents L A_i e, affine in the poses. In the frame R of a
// straight element ċ is V v̂ with V = (½ I, −λ [e]×, ½ I, λ [e]×), and M' = M_e − m Vᵀ V, with the consistent mass M_e
// below: a uniform velocity gives M' nothing, M_e having V as its mean. So rigid motions of positions and velocities do
// not change T, and a uniform velocity adds to it what it adds to a particle's (with M_e in place of M' it would not: a
// beam in a fast train would feel gyroscopic moments at its ends). Lagrange's equations conserve momentum m ċ, angular
// momentum and energy, and a beam falls as if there were no weight.
//
// ---- M_e ----
// Bending: ρ A ∫ N Nᵀ + ρ I ∫ G Gᵀ with the displacement w = N·(w₁, θ₁, w₂, θ₂) and the turn of the section θ = G·(…)
// of Timoshenko's beam under end loads (Friedman and Kosmatka, Computers & Structures 47, 1993), whose stiffness K
// beam.cpp has. As K gives exact displacements of nodes under any load, all of the error is that of the load of inertia
// q = ρ A ω² w, by what w has within an element beside N. Bending adds q x² (L − x)²/(24 E I), an error of order 4.
// Shear adds q x (L − x)/(2 G A_s), of order 2: on average q L²/(12 G A_s), and its inertia is ω² ρ A L²/(12 G A_s) of
// that of the rest, ω² M by ω² M ≈ K for a mode. So
//
//     M_e = ρ A ∫ N Nᵀ + ρ I ∫ G Gᵀ + ρ A L²/(12 G A_s) K
//
// takes it away but for the share of the rotary inertia in ω² M. With Φ = 12 E I/(G A_s L²) the factor is
// ρ A L⁴ Φ/(144 E I). Rigid motions have nothing of it.
//
// Stretching and twisting: linear displacements have m [2 1; 1 2]/6. The same reasoning adds m [1 −1; −1 1]/12, which
// makes m [5 1; 1 5]/12, the mean with lumped masses, of order 4 (Goudreau and Taylor, Comput. Methods Appl. Mech.
// Engrg. 2, 1973).
//
// What T leaves out is of the second order in φ: the velocity along an element of its points beside the chord, and
// their part in the rotary inertia.
//
// ---- Lagrange's equations ----
// Of the second part: û = M' v̂; û_k, v̂_k are its blocks of three. R turns by μ in its own axes,
// μ = ½(ω̂₁ + ω̂₂) + Z (ω̂₂ − ω̂₁). Then d/dt Rᵀ v = −μ × Rᵀ v at fixed v, and for ω̄ likewise, Ė v = −μ × v̂ by blocks. The
// momenta of the group are Eᵀ û; with ω̄_i × (P_iᵀ û_i) of the body frames,
//
//     f = Eᵀ f̂,    f̂_k = −μ × û_k + (M' (μ × v̂))_k   and, on the turning of end i,
//                  f̂_i  += ω̂_i × û_i − (½ h ∓ Zᵀ h),   h = Σ_k v̂_k × û_k
//
// The last line is ∂T/∂θ: a turn a_i = P_i θ_i changes v̂_k by −μ_δ × v̂_k and ω̂_i by a_i × ω̂_i besides, with
// μ_δ = c + Z b, c = ½(a₁ + a₂), b = a₂ − a₁. The upper sign is that of the first end. Derivatives of it along
// increments are taken forwards, one motion of an end after the other.
//
// Of the first part, with ċ = C v, λ₁ = λ, λ₂ = −λ, and of the weight −m g · c:
//
//     C = (½ I, −λ₁ A₁ [e]×, ½ I, −λ₂ A₂ [e]×),   γ = Ċ v = Σ λ_i A_i (ω̄_i × (ω̄_i × e))
//     M = m Cᵀ C,   f = m Cᵀ (g − γ),   ∂(Cᵀ y)/∂θ_i = λ_i [e]× [A_iᵀ y]×
//     ∂γ/∂ω̄_i = −λ_i A_i ([ω̄_i × e]× + [ω̄_i]× [e]×),   ∂γ/∂θ_i = −λ_i A_i [ω̄_i × (ω̄_i × e)]×
#include "mechanics/beam_inertia.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace delassus::mechanics {
namespace {

using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

Eigen::VectorBlock<Vector12, 3> block(Vector12& v, int k) {
    return v.segment<3>(3 * k);
}
Eigen::VectorBlock<const Vector12, 3> block(const Vector12& v, int k) {
    return v.segment<3>(3 * k);
}

/// The turning of end i is block 1 or 3.
int turning(int end) {
    return 2 * end + 1;
}

/// u × v_k for each block.
Vector12 cross(const Vector3d& u, const Vector12& v) {
    Vector12 result;
    for (int k = 0; k < 4; ++k) block(result, k) = u.cross(Vector3d(block(v, k)));
    return result;
}

/// M_e of (w₁, θ₁, w₂, θ₂): mass ρ A and rotary inertia ρ I per length.
Eigen::Matrix4d bending_mass(double mass, double rotary, double length, double shear) {
    // Gauss' rule of four points, exact for the degree 7.
    const double inner = std::sqrt(3.0 / 7.0 - 2.0 / 7.0 * std::sqrt(1.2)),
                 outer = std::sqrt(3.0 / 7.0 + 2.0 / 7.0 * std::sqrt(1.2));
    const double heavy = (18.0 + std::sqrt(30.0)) / 72.0, light = (18.0 - std::sqrt(30.0)) / 72.0;
    Eigen::Matrix4d result = Eigen::Matrix4d::Zero();
    const double unit = 1.0 / (1.0 + shear);
    for (const auto& [place, weight] : {std::pair{-outer, light}, {-inner, heavy}, {inner, heavy}, {outer, light}}) {
        const double x = 0.5 * (1.0 + place), x2 = x * x, x3 = x2 * x;
        const Eigen::Vector4d N =
            unit * Eigen::Vector4d(2.0 * x3 - 3.0 * x2 - shear * x + 1.0 + shear,
                                   length * (x3 - (2.0 + 0.5 * shear) * x2 + (1.0 + 0.5 * shear) * x),
                                   -2.0 * x3 + 3.0 * x2 + shear * x,
                                   length * (x3 - (1.0 - 0.5 * shear) * x2 - 0.5 * shear * x));
        const Eigen::Vector4d G =
            unit * Eigen::Vector4d(6.0 * (x2 - x) / length, 3.0 * x2 - (4.0 + shear) * x + 1.0 + shear,
                                   -6.0 * (x2 - x) / length, 3.0 * x2 - (2.0 - shear) * x);
        result += weight * length * (mass * N * N.transpose() + rotary * G * G.transpose());
    }
    const double l = length, l2 = l * l, near = (4.0 + shear) * l2, far = (2.0 - shear) * l2;
    Eigen::Matrix4d stiffness;                   // by E I/((1 + Φ) L³)
    stiffness << 12.0, 6.0 * l, -12.0, 6.0 * l,  //
        6.0 * l, near, -6.0 * l, far,            //
        -12.0, -6.0 * l, 12.0, -6.0 * l,         //
        6.0 * l, far, -6.0 * l, near;
    return result + mass * length * shear * unit / 144.0 * stiffness;
}

}  // namespace

BeamInertia::BeamInertia(const ElasticBeamParameters& beam, double length, const std::array<BodyIndex, 2>& bodies)
    : bodies_(bodies), mass_(beam.material.density * beam.section.area * length), length_(length) {
    const auto& section = beam.section;
    const double density = beam.material.density, young = beam.material.young;
    const double shear = 0.5 * young / (1.0 + beam.material.poisson);
    Matrix12 M = Matrix12::Zero();
    const auto add_rod = [&](int dof, double inertia) {
        M(dof, dof) = M(dof + 6, dof + 6) = 5.0 / 12.0 * inertia;
        M(dof, dof + 6) = M(dof + 6, dof) = inertia / 12.0;
    };
    add_rod(0, mass_);
    add_rod(3, density * (section.inertia_y + section.inertia_z) * length);
    // The turn about y lowers z along x.
    const auto add_bending = [&](int across, int about, double sign, double inertia, double shear_area) {
        const double phi = 12.0 * young * inertia / (shear * shear_area * length * length);
        const Eigen::Matrix4d bending = bending_mass(density * section.area, density * inertia, length, phi);
        const std::array<int, 4> dofs{across, about, across + 6, about + 6};
        const std::array<double, 4> signs{1.0, sign, 1.0, sign};
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = 0; j < 4; ++j)
                M(dofs[i], dofs[j]) =
                    signs[i] * signs[j] * bending(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    };
    add_bending(1, 5, 1.0, section.inertia_z, section.shear_area_y);
    add_bending(2, 4, -1.0, section.inertia_y, section.shear_area_z);
    const Matrix3d arm = length / 12.0 * skew(Vector3d::UnitX());
    Eigen::Matrix<double, 3, 12> V;
    V << 0.5 * Matrix3d::Identity(), -arm, 0.5 * Matrix3d::Identity(), arm;
    inner_ = M - mass_ * V.transpose() * V;
}

struct BeamInertia::Kinematics : BeamFrame {
    Kinematics(const Ends& at, const Matrix12& inner) : BeamFrame(at[0].A, at[1].A), M(inner) {
        for (std::size_t i = 0; i < 2; ++i) P[i] = R.transpose() * at[i].A;
        Vector12 velocity;
        velocity << at[0].v, at[0].omega, at[1].v, at[1].omega;
        v = into(velocity);
        u = M * v;
        difference = block(v, 3) - block(v, 1);
        mu = 0.5 * (block(v, 1) + block(v, 3)) + Z * difference;
        for (int k = 0; k < 4; ++k) h += Vector3d(block(v, k)).cross(Vector3d(block(u, k)));
    }

    const Matrix12& M;
    std::array<Matrix3d, 2> P;
    Vector12 v, u;  // v̂, û
    Vector3d difference, mu, h = Vector3d::Zero();

    /// E x and Eᵀ y.
    [[nodiscard]] Vector12 into(const Vector12& x) const {
        Vector12 result;
        for (int i = 0; i < 2; ++i) {
            block(result, 2 * i) = R.transpose() * block(x, 2 * i);
            block(result, turning(i)) = P[static_cast<std::size_t>(i)] * block(x, turning(i));
        }
        return result;
    }
    [[nodiscard]] Vector12 out_of(const Vector12& y) const {
        Vector12 result;
        for (int i = 0; i < 2; ++i) {
            block(result, 2 * i) = R * block(y, 2 * i);
            block(result, turning(i)) = P[static_cast<std::size_t>(i)].transpose() * block(y, turning(i));
        }
        return result;
    }

    [[nodiscard]] Vector12 force() const {
        Vector12 result = -cross(mu, u) + M * cross(mu, v);
        for (int i = 0; i < 2; ++i) {
            const double sign = i == 0 ? -1.0 : 1.0;
            const Vector3d spin = block(v, turning(i)), momentum = block(u, turning(i));
            block(result, turning(i)) += spin.cross(momentum) - 0.5 * h + sign * (Z * h);  // Zᵀ = −Z
        }
        return result;
    }
    /// Of force() along dv̂ and dφ.
    [[nodiscard]] Vector12 force_along(const Vector12& dv, const Vector3d& dphi) const {
        const Vector12 du = M * dv;
        const Vector3d dmu =
            0.5 * (block(dv, 1) + block(dv, 3)) + Z * (block(dv, 3) - block(dv, 1)) + change_of_Z(difference) * dphi;
        Vector3d dh = Vector3d::Zero();
        for (int k = 0; k < 4; ++k)
            dh += Vector3d(block(dv, k)).cross(Vector3d(block(u, k))) +
                  Vector3d(block(v, k)).cross(Vector3d(block(du, k)));
        Vector12 df = -cross(dmu, u) - cross(mu, du) + M * (cross(dmu, v) + cross(mu, dv));
        for (int i = 0; i < 2; ++i) {
            const double sign = i == 0 ? -1.0 : 1.0;
            const Vector3d spin = block(v, turning(i)), d_spin = block(dv, turning(i));
            const Vector3d momentum = block(u, turning(i)), d_momentum = block(du, turning(i));
            block(df, turning(i)) +=
                d_spin.cross(momentum) + spin.cross(d_momentum) - 0.5 * dh + sign * (Z * dh + change_of_Z(h) * dphi);
        }
        return df;
    }

    /// Column by column of the turning of the ends: column(a_i's end, μ_δ, δφ, a_i) is Eᵀ of what it returns.
    template <class Column>
    void along_turns(Matrix& result, Column&& column) const {
        result.setZero();
        for (int end = 0; end < 2; ++end)
            for (int axis = 0; axis < 3; ++axis) {
                const Vector3d a = P[static_cast<std::size_t>(end)].col(axis);
                const Vector3d b = end == 0 ? Vector3d(-a) : a;
                result.col(6 * end + 3 + axis) = out_of(column(end, Vector3d(0.5 * a + Z * b), Vector3d(W * b), a));
            }
    }
    /// Of E x at fixed x, y = E x; and Eᵀ in front of the derivative of Eᵀ y at fixed y.
    static Vector12 of_into(const Vector12& y, int end, const Vector3d& turn, const Vector3d& a) {
        Vector12 result = -cross(turn, y);
        block(result, turning(end)) += a.cross(Vector3d(block(y, turning(end))));
        return result;
    }
};

struct BeamInertia::Centre {
    using Jacobian = Eigen::Matrix<double, 3, 12>;
    std::array<Matrix3d, 2> arm;  // λ_i A_i
    Vector3d place, gamma;
    Jacobian C;

    Centre(const Ends& at, double length) {
        C << 0.5 * Matrix3d::Identity(), Matrix3d::Zero(), 0.5 * Matrix3d::Identity(), Matrix3d::Zero();
        place = 0.5 * (at[0].x + at[1].x);
        gamma.setZero();
        const Vector3d e = Vector3d::UnitX();
        for (std::size_t i = 0; i < 2; ++i) {
            arm[i] = (i == 0 ? length : -length) / 12.0 * at[i].A;
            C.middleCols<3>(6 * static_cast<Eigen::Index>(i) + 3) = -arm[i] * skew(e);
            place += arm[i] * e;
            gamma += arm[i] * at[i].omega.cross(at[i].omega.cross(e));
        }
    }
    [[nodiscard]] Vector3d velocity(const Ends& at) const {
        Vector12 v;
        v << at[0].v, at[0].omega, at[1].v, at[1].omega;
        return C * v;
    }
    /// result += ∂(Cᵀ y)/∂q
    void add_change(const Vector3d& y, Matrix& result) const {
        const Matrix3d e = skew(Vector3d::UnitX());
        for (int i = 0; i < 2; ++i)
            result.block<3, 3>(6 * i + 3, 6 * i + 3) +=
                e * skew(Vector3d(arm[static_cast<std::size_t>(i)].transpose() * y));
    }
};

void BeamInertia::mass(const Ends& at, Matrix& result) const {
    const Kinematics now(at, inner_);
    Matrix12 E = Matrix12::Zero();
    for (int i = 0; i < 2; ++i) {
        E.block<3, 3>(6 * i, 6 * i) = now.R.transpose();
        E.block<3, 3>(6 * i + 3, 6 * i + 3) = now.P[static_cast<std::size_t>(i)];
    }
    const Centre centre(at, length_);
    result = E.transpose() * inner_ * E + mass_ * centre.C.transpose() * centre.C;
}

void BeamInertia::multiply_mass(const Ends& at, const Forces& x, Forces& result) const {
    const Kinematics now(at, inner_);
    const Centre centre(at, length_);
    result = now.out_of(inner_ * now.into(x)) + mass_ * centre.C.transpose() * (centre.C * x);
}

void BeamInertia::force(const Ends& at, const Vector3d& gravity, Forces& result) const {
    const Kinematics now(at, inner_);
    const Centre centre(at, length_);
    result = now.out_of(now.force()) + mass_ * centre.C.transpose() * (gravity - centre.gamma);
}

// δ(Eᵀ f̂) = Eᵀ (δf̂ − of_into(f̂)): E is orthogonal, so that δEᵀ = −Eᵀ δE Eᵀ.
void BeamInertia::stiffness(const Ends& at, const Vector3d& gravity, Matrix& result) const {
    const Kinematics now(at, inner_);
    const Vector12 f = now.force();
    now.along_turns(result, [&](int end, const Vector3d& turn, const Vector3d& dphi, const Vector3d& a) -> Vector12 {
        const Vector12 dv = Kinematics::of_into(now.v, end, turn, a);
        return -now.force_along(dv, dphi) + Kinematics::of_into(f, end, turn, a);
    });
    const Centre centre(at, length_);
    centre.add_change(mass_ * (centre.gamma - gravity), result);
    for (int i = 0; i < 2; ++i) {
        const auto& end = at[static_cast<std::size_t>(i)];
        const Vector3d turning_in = end.omega.cross(end.omega.cross(Vector3d::UnitX()));
        result.middleCols<3>(6 * i + 3) -=
            mass_ * centre.C.transpose() * centre.arm[static_cast<std::size_t>(i)] * skew(turning_in);
    }
}

void BeamInertia::damping(const Ends& at, Matrix& result) const {
    const Kinematics now(at, inner_);
    for (int j = 0; j < 12; ++j)
        result.col(j) = -now.out_of(now.force_along(now.into(Vector12::Unit(j)), Vector3d::Zero()));
    const Centre centre(at, length_);
    const Vector3d e = Vector3d::UnitX();
    for (int i = 0; i < 2; ++i) {
        const Vector3d& omega = at[static_cast<std::size_t>(i)].omega;
        result.middleCols<3>(6 * i + 3) -= mass_ * centre.C.transpose() * centre.arm[static_cast<std::size_t>(i)] *
                                           (skew(Vector3d(omega.cross(e))) + skew(omega) * skew(e));
    }
}

void BeamInertia::inertial_stiffness(const Ends& at, const Forces& acceleration, Matrix& result) const {
    const Kinematics now(at, inner_);
    const Vector12 a_hat = now.into(acceleration), f = inner_ * a_hat;
    now.along_turns(result, [&](int end, const Vector3d& turn, const Vector3d&, const Vector3d& a) -> Vector12 {
        return inner_ * Kinematics::of_into(a_hat, end, turn, a) - Kinematics::of_into(f, end, turn, a);
    });
    const Centre centre(at, length_);
    centre.add_change(mass_ * (centre.C * acceleration), result);
    // δC a = Σ λ_i A_i (θ_i × (ᾱ_i × e))
    for (int i = 0; i < 2; ++i) {
        const Vector3d alpha = acceleration.segment<3>(6 * i + 3);
        result.middleCols<3>(6 * i + 3) -= mass_ * centre.C.transpose() * centre.arm[static_cast<std::size_t>(i)] *
                                           skew(Vector3d(alpha.cross(Vector3d::UnitX())));
    }
}

bool BeamInertia::leaves_definite(const Ends& at, const Matrix& matrix, double factor) const {
    constexpr double share = 0.3;
    Matrix sum;
    mass(at, sum);
    sum = (share * sum + 0.5 * factor * (matrix + matrix.transpose())).eval();
    return Eigen::LLT<Matrix12>(sum).info() == Eigen::Success;
}

double BeamInertia::kinetic_energy(const Ends& at) const {
    const Kinematics now(at, inner_);
    return 0.5 * now.v.dot(now.u) + 0.5 * mass_ * Centre(at, length_).velocity(at).squaredNorm();
}

double BeamInertia::potential(const Ends& at, const Vector3d& gravity) const {
    return -mass_ * gravity.dot(Centre(at, length_).place);
}

void BeamInertia::momentum(const Ends& at, Vector3d& linear, Vector3d& angular) const {
    const Kinematics now(at, inner_);
    const Centre centre(at, length_);
    const Vector3d p = mass_ * centre.velocity(at);
    linear += p;
    angular += centre.place.cross(p);
    for (int i = 0; i < 2; ++i)
        angular +=
            at[static_cast<std::size_t>(i)].x.cross(now.R * block(now.u, 2 * i)) + now.R * block(now.u, turning(i));
}

}  // namespace delassus::mechanics
