// SPDX-License-Identifier: BSD-3-Clause
// The natural map of a proximal subproblem and its generalised Jacobian.
//
// In the scaled variables of sdk/scaled_problem.hpp (hats left out), with a centre c, a proximal weight τ = 1/σ ≥ 0 and
// a step ρ > 0,
//
//     F(λ) = λ − Π(z),   z = λ − ρ (w + g(w)),   w = N λ + r + τ (λ − c),   g(w) = (θ μ‖w_t‖, 0, 0) per friction block
//
// is the natural map of the problem whose N is N + τ1 and whose r is r − τ c. θ = 0 is the associated law, θ = 1 the
// exact Coulomb law, whose g is the De Saxcé term (De Saxcé and Feng 1998), and the laws between connect the two. F
// vanishes at the solution of that problem for every ρ; with ρ = 1, τ = 0 its norm over ‖r‖ is the natural error; with
// ρ = σ the map is λ − Π(c − σ(Nλ + r)), the augmented Lagrangian's.
//
// Generalised Jacobian. With G = 1 + e_n θ μ w_tᵀ/‖w_t‖ and J an element of ∂Π(z),
// F' = 1 − J + ρ J G (N + τ1). J is symmetric, 0 ≤ J ≤ 1 (Alart and Curnier 1991 for discs; here the whole cone):
//     interval row       between its bounds J = 1, else 0
//     friction           z inside the cone: J = 1;   z in the polar cone: J = 0;
//                        else Π(z) = (e·z) e with the generator e = (1, μ t)/√(1 + μ²), t = z_t/‖z_t‖, and turning t by
//                        an angle moves Π(z) by its radius ‖Π(z)_t‖:   J = e eᵀ + (‖Π(z)_t‖/‖z_t‖) c cᵀ,   c = (0, t⊥)
// Let the columns of B be the orthonormal eigenvectors with eigenvalue j > 0. Newton's equation F' δ = −F splits:
//     normal to B:   δ_⊥ = −(1 − B Bᵀ) F
//     in B:          [A (N + τ1) B + K/ρ] δ_B = −Bᵀ F/(ρ j) − A (N + τ1) δ_⊥,    A = Bᵀ G,   K = diag(1/j − 1) ≥ 0
// Where z lies inside the cone the rows are multiplied by G⁻¹, so that A = 1 and the right-hand side is −w: a sticking
// contact gives symmetric rows under both laws, and needs no direction of w_t, which vanishes there. With the
// associated law A = Bᵀ everywhere, and the matrix is symmetric positive definite for τ > 0.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::ssn {

using sdk::Vector;

/// Which problem and which step; see above.
struct Proximal {
    double tau = 0.0;                ///< τ = 1/σ
    double rho = 1.0;                ///< ρ
    const Vector* centre = nullptr;  ///< c, m; null: c = λ, so that the proximal term acts on the Jacobian only
};

/// One friction block, or one row of any other kind, and how the projection acts there.
struct Piece {
    std::int32_t first, rows;             ///< rows: 1 … 3
    std::int32_t active = 0;              ///< columns of B: 0 … rows
    const delassus_cone* cone = nullptr;  ///< of a friction block, else null
    // Column-major with leading dimension 3.
    std::array<double, 9> B{};  ///< rows × active
    std::array<double, 9> A{};  ///< active × rows
    std::array<double, 9> M{};  ///< active × active: τ A B + K/ρ
};

class NaturalMap {
public:
    /// Takes the pieces of a problem; scaled must outlive the map, and load() of it must be followed by this.
    void load(const sdk::ScaledProblem& scaled);

    /// θ: 0 for the associated law … 1 for the exact Coulomb law.
    void set_law(double theta) { theta_ = theta; }
    [[nodiscard]] double law() const { return theta_; }

    /// F ← F(λ). u = N λ + r; all m.
    void evaluate(const Vector& lambda, const Vector& u, const Proximal& proximal, Vector& F) const;

    /// F, the pieces, and the right-hand side of the equation in B without its last term: local holds −Bᵀ F/(ρ j) in
    /// the first `active` rows of each piece and zeros below. normal ← δ_⊥. All m.
    void linearise(const Vector& lambda, const Vector& u, const Proximal& proximal, Vector& F, Vector& normal,
                   Vector& local);

    [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }

    /// result ← B v and result ← A v; m. v and result are different vectors, local ones as above.
    void expand(const Vector& v, Vector& result) const;
    void contract(const Vector& v, Vector& result) const;
    /// result += M v, both local.
    void add_diagonal(const Vector& v, Vector& result) const;

private:
    void linearise_row(Piece& piece, double z, double residual, const Proximal& proximal, Vector& normal,
                       Vector& local) const;
    void linearise_friction(Piece& piece, const std::array<double, 3>& z, const std::array<double, 3>& p,
                            const std::array<double, 3>& w, const double* F, const Proximal& proximal, double* normal,
                            double* local) const;

    const sdk::ScaledProblem* scaled_ = nullptr;
    double theta_ = 0.0;
    std::vector<Piece> pieces_;
};

}  // namespace delassus::ssn
