// SPDX-License-Identifier: BSD-3-Clause
// The kinetic energy of a beam's element is that of its end velocities in the frame R halfway between its ends
// (beam.cpp), with a constant matrix:
//
//     T = ½ v̂ᵀ M_e v̂,   v̂ = (Rᵀ v₁, P₁ ω̄₁, Rᵀ v₂, P₂ ω̄₂) = E(q) v,   P_i = Rᵀ A_i
//
// No rigid motion of positions and velocities changes T, so that Lagrange's equations conserve momentum, angular
// momentum and energy. M = Eᵀ M_e E depends on the orientations alone.
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
// What T leaves out is the bulge of an element that is bent: the axial velocity of points beside the chord, and their
// part in the rotary inertia. It is of the second order in φ, as what the frame itself leaves out.
//
// ---- Lagrange's equations ----
// û = M_e v̂; û_k, v̂_k are its blocks of three. R turns by μ in its own axes, μ = ½(ω̂₁ + ω̂₂) + Z (ω̂₂ − ω̂₁). Then
// d/dt Rᵀ v = −μ × Rᵀ v at fixed v, and for ω̄ likewise, Ė v = −μ × v̂ by blocks. The momenta of the group are Eᵀ û; with
// ω̄_i × (P_iᵀ û_i) of the body frames,
//
//     M v̇ = Q + Eᵀ f̂,    f̂_k = −μ × û_k + (M_e (μ × v̂))_k   and, on the turning of end i,
//                         f̂_i  += ω̂_i × û_i − (½ h ∓ Zᵀ h),   h = Σ_k v̂_k × û_k
//
// The last line is ∂T/∂θ: a turn a_i = P_i θ_i changes v̂_k by −μ_δ × v̂_k and ω̂_i by a_i × ω̂_i besides, with
// μ_δ = c + Z b, c = ½(a₁ + a₂), b = a₂ − a₁. The upper sign is that of the first end.
//
// ---- Weight ----
// V = −½ m g · (x₁ + x₂) + κ φ · (e × ĝ),   κ = m L/12,  ĝ = Rᵀ g,  e = (1, 0, 0)
//
// where the second part is the weight's work on the bulge: M_e times the acceleration g at both ends are these forces
// and, at φ = 0, these moments. So a straight beam falls straight. With τ̂ = e × ĝ and s = (φ × e) × ĝ,
//
//     δ(φ · τ̂) = (W τ̂ + Zᵀ s) · b + s · c
//
// Derivatives of all this along increments are taken forwards, one motion of an end after the other.
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
    inner_.setZero();
    const auto add_rod = [&](int dof, double inertia) {
        inner_(dof, dof) = inner_(dof + 6, dof + 6) = 5.0 / 12.0 * inertia;
        inner_(dof, dof + 6) = inner_(dof + 6, dof) = inertia / 12.0;
    };
    add_rod(0, mass_);
    add_rod(3, density * (section.inertia_y + section.inertia_z) * length);
    // The turn about y lowers z along x.
    const auto add_bending = [&](int across, int about, double sign, double inertia, double shear_area) {
        const double phi = 12.0 * young * inertia / (shear * shear_area * length * length);
        const Eigen::Matrix4d M = bending_mass(density * section.area, density * inertia, length, phi);
        const std::array<int, 4> dofs{across, about, across + 6, about + 6};
        const std::array<double, 4> signs{1.0, sign, 1.0, sign};
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = 0; j < 4; ++j)
                inner_(dofs[i], dofs[j]) =
                    signs[i] * signs[j] * M(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    };
    add_bending(1, 5, 1.0, section.inertia_z, section.shear_area_y);
    add_bending(2, 4, -1.0, section.inertia_y, section.shear_area_z);
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

    /// Moments of weight on the turning of both ends, by κ.
    [[nodiscard]] Vector12 weight(double kappa, const Vector3d& gravity) const {
        const Vector3d e = Vector3d::UnitX(), g = R.transpose() * gravity;
        const Vector3d s = phi.cross(e).cross(g);
        const Vector3d by_b = W * e.cross(g) - Z * s;
        Vector12 result = Vector12::Zero();
        block(result, 1) = kappa * (by_b - 0.5 * s);
        block(result, 3) = kappa * (-by_b - 0.5 * s);
        return result;
    }
    [[nodiscard]] Vector12 weight_along(double kappa, const Vector3d& gravity, const Vector3d& turn,
                                        const Vector3d& dphi) const {
        const Vector3d e = Vector3d::UnitX(), g = R.transpose() * gravity, dg = g.cross(turn);
        const Vector3d bulge = phi.cross(e), s = bulge.cross(g);
        const Vector3d ds = dphi.cross(e).cross(g) + bulge.cross(dg);
        const Vector3d by_b = W * e.cross(dg) + change_of_W(e.cross(g)) * dphi - Z * ds - change_of_Z(s) * dphi;
        Vector12 result = Vector12::Zero();
        block(result, 1) = kappa * (by_b - 0.5 * ds);
        block(result, 3) = kappa * (-by_b - 0.5 * ds);
        return result;
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

void BeamInertia::mass(const Ends& at, Matrix& result) const {
    const Kinematics now(at, inner_);
    Matrix12 E = Matrix12::Zero();
    for (int i = 0; i < 2; ++i) {
        E.block<3, 3>(6 * i, 6 * i) = now.R.transpose();
        E.block<3, 3>(6 * i + 3, 6 * i + 3) = now.P[static_cast<std::size_t>(i)];
    }
    result = E.transpose() * inner_ * E;
}

void BeamInertia::multiply_mass(const Ends& at, const Forces& x, Forces& result) const {
    const Kinematics now(at, inner_);
    result = now.out_of(inner_ * now.into(x));
}

void BeamInertia::force(const Ends& at, const Vector3d& gravity, Forces& result) const {
    const Kinematics now(at, inner_);
    result = now.out_of(now.force() + now.weight(mass_ * length_ / 12.0, gravity));
    for (int i = 0; i < 2; ++i) result.segment<3>(6 * i) += 0.5 * mass_ * gravity;
}

// δ(Eᵀ f̂) = Eᵀ (δf̂ − of_into(f̂)): E is orthogonal, so that δEᵀ = −Eᵀ δE Eᵀ.
void BeamInertia::stiffness(const Ends& at, const Vector3d& gravity, Matrix& result) const {
    const Kinematics now(at, inner_);
    const double kappa = mass_ * length_ / 12.0;
    const Vector12 f = now.force() + now.weight(kappa, gravity);
    now.along_turns(result, [&](int end, const Vector3d& turn, const Vector3d& dphi, const Vector3d& a) -> Vector12 {
        const Vector12 dv = Kinematics::of_into(now.v, end, turn, a);
        return -now.force_along(dv, dphi) - now.weight_along(kappa, gravity, turn, dphi) +
               Kinematics::of_into(f, end, turn, a);
    });
}

void BeamInertia::damping(const Ends& at, Matrix& result) const {
    const Kinematics now(at, inner_);
    for (int j = 0; j < 12; ++j)
        result.col(j) = -now.out_of(now.force_along(now.into(Vector12::Unit(j)), Vector3d::Zero()));
}

void BeamInertia::inertial_stiffness(const Ends& at, const Forces& acceleration, Matrix& result) const {
    const Kinematics now(at, inner_);
    const Vector12 a_hat = now.into(acceleration), f = inner_ * a_hat;
    now.along_turns(result, [&](int end, const Vector3d& turn, const Vector3d&, const Vector3d& a) -> Vector12 {
        return inner_ * Kinematics::of_into(a_hat, end, turn, a) - Kinematics::of_into(f, end, turn, a);
    });
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
    return 0.5 * now.v.dot(now.u);
}

double BeamInertia::potential(const Ends& at, const Vector3d& gravity) const {
    const Kinematics now(at, inner_);
    const Vector3d g = now.R.transpose() * gravity;
    return -0.5 * mass_ * gravity.dot(at[0].x + at[1].x) +
           mass_ * length_ / 12.0 * now.phi.dot(Vector3d::UnitX().cross(g));
}

void BeamInertia::momentum(const Ends& at, Vector3d& linear, Vector3d& angular) const {
    const Kinematics now(at, inner_);
    for (int i = 0; i < 2; ++i) {
        const Vector3d p = now.R * block(now.u, 2 * i);
        linear += p;
        angular += at[static_cast<std::size_t>(i)].x.cross(p) + now.R * block(now.u, turning(i));
    }
}

}  // namespace delassus::mechanics
