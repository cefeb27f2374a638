// SPDX-License-Identifier: BSD-3-Clause
// What plugins/admm/scaled_system.hpp is in one process, for the own rows of a partitioned problem with a definite H.
#pragma once

#include "contact_law.hpp"
#include "delassus/sdk/anderson.hpp"
#include "petsc/part_system.hpp"

namespace delassus::petsc {

/// Vectors hold own rows or columns. All operations but the getters and project() are collective.
///
/// The affine half of the splitting is the primal form of plugins/admm/resolvent.hpp, on Cholesky factors by MUMPS. It
/// solves  μ̂ + ρ (N̂ μ̂ + r̂) = ŵ  for μ̂ by  (H + D̂ᵀ V D̂) x = a + D̂ᵀ V (ŵ/ρ − b̂),  μ̂ = V (ŵ/ρ − b̂ − D̂ x),
/// V = (Ê + 1/ρ)⁻¹, which is blocks of contacts.
class ScaledPartSystem : public PartSystem {
public:
    void analyze(const sdk::LocalProblemView& problem);
    /// set_penalty has to follow.
    void factorize(const sdk::LocalProblemView& problem);
    /// problem must last as long as the solve.
    void load(const sdk::LocalProblemView& problem);

    [[nodiscard]] const sdk::Vector& scale() const { return scale_; }  ///< the diagonal of P
    [[nodiscard]] static bool definite() { return true; }

    [[nodiscard]] double penalty() const { return penalty_; }
    /// Factors for this ρ, unless it has it. Throws sdk::NumericalFailure if the matrix is not definite.
    void set_penalty(double penalty);

    /// λ̂ ← the law's reactions for ŷ; may be one vector.
    void project(const sdk::Vector& y, sdk::Vector& lambda) const {
        const auto span = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
        law_.apply(y, lambda);
    }
    /// μ̂ ← the solution for ŵ, û ← (ŵ − μ̂)/ρ.
    void resolve(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u);
    [[nodiscard]] const sdk::Vector& x() const { return x_; }  ///< of the latest resolve()

    /// x ← H⁻¹(a + Dᵀλ); the natural error with u = D x + E λ + b computed anew.
    [[nodiscard]] double claim(const sdk::Vector& lambda, sdk::Vector& x) const {
        return measured(*problem_, lambda, x);
    }
    [[nodiscard]] sdk::Vector velocities(const sdk::Vector& lambda, const sdk::Vector& x) const {
        return PartSystem::velocities(*problem_, lambda, x);
    }
    [[nodiscard]] sdk::Vector velocity(const sdk::Vector& lambda) const {
        return PartSystem::velocity(*problem_, lambda);
    }

    [[nodiscard]] sdk::Anderson::Sum sum() const {
        return [this](std::span<double> values) { processes().sum(values); };
    }

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    void find_V();
    void apply_V(sdk::Vector& v) const;

    const sdk::LocalProblemView* problem_ = nullptr;
    admm::ContactLaw law_;
    std::vector<std::int32_t> groups_;
    MatrixHandle matrix_;
    KrylovHandle krylov_;
    double penalty_ = 0.0;
    sdk::Vector scale_, b_, x_;
    sdk::Vector diagonal_V_;                 // where Ê is diagonal
    std::vector<Eigen::Matrix3d> blocks_V_;  // of the groups, where it is not
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus::petsc
