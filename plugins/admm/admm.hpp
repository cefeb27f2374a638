// SPDX-License-Identifier: BSD-3-Clause
// The alternating direction method of multipliers for contact, as a fixed-point iteration (README.md).
//
// ADMM on  minimise ½xᵀHx − aᵀx + ½λᵀEλ + σ(z)  subject to D x + E λ + b = z, where σ stands for the law, is Douglas
// and Rachford's splitting of  0 ∈ (N λ + r) + N_Υ(λ)  (Gabay 1983; Eckstein and Bertsekas 1992). All of its state is
// y = λ − ρ z, in scaled variables:
//
//     λ = law(y)                        the reactions of the law, with z = (λ − y)/ρ             (contact_law.hpp)
//     μ = (1 + ρN)⁻¹(2λ − y − ρ r)      those of the equations of motion, with u = (2λ − y − μ)/ρ  (resolvent.hpp)
//     y ← y + α (μ − λ)                 α: over-relaxation
//
// At a fixed point μ = λ, hence u = z. One vector of state is what the acceleration works on.
#pragma once

#include "contact_law.hpp"
#include "delassus/sdk/anderson.hpp"
#include "delassus/sdk/monitor.hpp"
#include "measure.hpp"
#include "penalty_rule.hpp"
#include "resolvent.hpp"

namespace delassus::admm {

class Admm : public sdk::Solver {
public:
    explicit Admm(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override;
    void factorize(const sdk::ProblemView& problem) override;
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return resolvent_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return resolvent_.factorizations(); }

private:
    enum class Acceleration { None, Nesterov, Anderson };
    struct Run;

    void start(Run& run, bool warm, const sdk::MutableVectorView& x, const sdk::MutableVectorView& lambda);
    void iterate(Run& run);
    bool judge(Run& run);
    bool change_penalty(const Run& run);
    bool extrapolate();
    void forget();

    double initial_penalty_, over_relaxation_;
    bool adaptive_;
    Acceleration acceleration_;
    int memory_;
    std::int64_t stall_iterations_;

    RowScaling scaling_;
    Resolvent resolvent_;
    ContactLaw law_;
    PenaltyRule penalty_rule_;
    sdk::Anderson anderson_;
    double theta_ = 1.0;                               // Nesterov's sequence
    bool has_last_ = false;                            // whether last_ is there to extrapolate from
    sdk::Vector y_, lambda_;                           // the state and its λ̂
    sdk::Vector z_, w_;                                // ẑ; 2λ̂ − ŷ
    sdk::Vector mu_, u_;                               // the equations' μ̂ and û
    sdk::Vector step_, plain_;                         // α(μ̂ − λ̂), and ŷ after it
    sdk::Vector last_;                                 // the plain_ before
    sdk::Vector reactions_, velocities_, x_, best_x_;  // of μ̂, in the problem's units
};

}  // namespace delassus::admm
