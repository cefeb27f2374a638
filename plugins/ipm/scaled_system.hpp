// SPDX-License-Identifier: BSD-3-Clause
// The problem in variables without units whose friction cones are second-order cones.
#pragma once

#include <cmath>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::ipm {

/// Rows that belong to one cone: a friction block, or one row of any other kind.
struct Group {
    std::int32_t first = 0, rows = 0;
};

/// The groups of a problem, in the order of the rows; they depend on the kinds and sizes of the cones alone.
[[nodiscard]] std::vector<Group> groups_of(const sdk::ProblemView& problem);

/// With ρ = ‖S r‖ (the divisor of the natural error), x = ρ R x̂, λ = ρ P ẑ, u = ρ P⁻¹ ŝ:
///
///     Ĥ x̂ − D̂ᵀ ẑ = â,   D̂ x̂ + Ê ẑ + b̂ = ŝ,    Ĥ = R H R,  D̂ = P D R,  Ê = P E P,  â = R a/ρ,  b̂ = P b/ρ.
///
/// R = |diag H|^(−½). P of a friction block is p diag(1/μ, 1, 1): ‖λ_t‖ ≤ μ λ_n becomes ‖ẑ_t‖ ≤ ẑ_n and μ‖u_t‖ ≤ u_n
/// becomes ‖ŝ_t‖ ≤ ŝ_n, the same self-dual cone; p makes the mean diagonal of N̂ in the block one. Every other row has
/// its own N_ii^(−½). (μ = 0: P = p, and the block is a nonnegative row beside two rows that are held at zero.)
struct ScaledSystem {
    sdk::SparseColumns H;  ///< n × n, both triangles
    sdk::SparseRows D;     ///< m × n
    sdk::SparseColumns E;  ///< m × m, both triangles; empty if absent
    sdk::Vector a, b;      ///< n, m
    sdk::Vector x_scale;   ///< n: x = x_scale ∘ x̂
    sdk::Vector z_scale;   ///< m: λ = z_scale ∘ ẑ
};

/// The diagonal of P, from that of N; m. mean: what rows whose diagonal is zero take for theirs.
inline sdk::Vector row_scale(const sdk::ConeRange& cones, const sdk::Vector& diagonal, double mean) {
    sdk::Vector p(diagonal.size());
    for (const delassus_cone& cone : cones) {
        const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
        const double mu = friction ? sdk::friction_coefficient(cone) : 0.0;
        const double normal = mu > 0.0 ? 1.0 / mu : 1.0;
        double square = 0.0;
        for (std::int32_t i = 0; i < cone.rows; ++i)
            square += diagonal[cone.first_row + i] * (i == 0 ? normal * normal : 1.0) / cone.rows;
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const double size = friction ? square : diagonal[cone.first_row + i];
            p[cone.first_row + i] = (i == 0 && friction ? normal : 1.0) / std::sqrt(size > 0.0 ? size : mean);
        }
    }
    return p;
}

/// Measures N and the natural error in the problem's units, and makes the scaled system.
class Scaling {
public:
    void analyze(const sdk::ProblemView& problem);
    /// Values of H, D or E are new. Throws sdk::NumericalFailure if a definite H cannot be factored.
    void factorize(const sdk::ProblemView& problem);
    /// a, b, μ or the bounds are new.
    void load(const sdk::ProblemView& problem);

    [[nodiscard]] const ScaledSystem& system() const { return system_; }

    /// The error by which the host judges λ (m). Where H is definite x ← H⁻¹(a + Dᵀλ) first, and it is the natural
    /// error; otherwise x (n) is read, and the balance ‖Hx − Dᵀλ − a‖ over its largest term counts too.
    [[nodiscard]] double measure(const sdk::ProblemView& problem, sdk::Vector& x, const sdk::Vector& lambda) const;

    /// Whether H is known to be definite.
    [[nodiscard]] bool definite() const { return definite_; }
    [[nodiscard]] std::int64_t factorizations() const { return operator_.inverse().factorizations(); }

private:
    bool definite_ = true;
    sdk::DelassusOperator operator_;
    sdk::Vector h_;         // |diag H|, stand-ins for zeros
    sdk::Vector diagonal_;  // of N; with |diag H|⁻¹ for H⁻¹ where H is not definite, as in the host's measure
    sdk::NaturalResidual residual_;
    ScaledSystem system_;
};

}  // namespace delassus::ipm
