// SPDX-License-Identifier: BSD-3-Clause
// Reactions as a function of the velocities, where every row has compliance.
//
// For a diagonal E > 0, D x + E λ + b = u ∈ Υ*, u ⊥ λ ∈ Υ determines λ by the velocities w = D x + b alone: it is the
// minimiser of ½ λᵀEλ + wᵀλ over Υ, that is, the projection of −E⁻¹w onto Υ in the norm of E. Block by block:
//
//     row with bounds    λ = min(max(−w/e, lo), hi)
//     friction           with P = E^(−½) = diag(p_n, p_t, p_t), λ = P ℓ and ℓ = Π'(z), z = −P w, the Euclidean
//                        projection onto the cone ‖ℓ_t‖ ≤ μ' ℓ_n with μ' = μ p_n/p_t; so the tangents need one e
//
// λ is Lipschitz and W = −∂λ/∂w (an element of the generalised Jacobian) symmetric positive semidefinite: 1/e or 0 for
// a row, and P J P for friction with
//
//     z inside the cone: J = 1;   z in the polar cone: J = 0;   else, with e = (1, μ' t)/√(1 + μ'²), t = z_t/‖z_t‖:
//     J = e eᵀ + (‖ℓ_t‖/‖z_t‖) c cᵀ,   c = (0, t⊥)
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::newton {

/// Whether E is diagonal and positive, with one value for the tangents of a friction block; else what it is not.
const char* unfit_compliance(const sdk::ProblemView& problem);

/// One friction block, or one row of another kind.
struct Piece {
    enum class State : std::uint8_t { Lower, Upper, Zero, Inside, Sliding };

    std::int32_t first, rows;
    bool friction;
    double lower, upper;     ///< of a row
    double compliance;       ///< e of a row
    double p_n, p_t, slope;  ///< p_n, p_t and μ' of a friction block
};

/// What pieces do at some velocities.
struct Linearisation {
    std::vector<double> lambda;            ///< m
    std::vector<Piece::State> state;       ///< one a piece
    std::vector<std::array<double, 9>> W;  ///< one a piece, row-major with leading dimension 3
};

class Reactions {
public:
    /// The pieces of a problem whose compliance is fit.
    void load(const sdk::ProblemView& problem);
    [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }

    /// λ(w), the states and W; w: m.
    void evaluate(const sdk::Vector& w, Linearisation& result) const;

private:
    std::vector<Piece> pieces_;
};

}  // namespace delassus::newton
