// SPDX-License-Identifier: BSD-3-Clause
// Newton's method on the velocities, for the convex problem whose rows all have compliance (README.md).
#pragma once

#include <cstdint>

#include "delassus/sdk/solver.hpp"
#include "reactions.hpp"
#include "velocity_matrix.hpp"

namespace delassus::newton {

class VelocityNewton : public sdk::Solver {
public:
    explicit VelocityNewton(const sdk::OptionValues& options);
    [[nodiscard]] std::string refusal(const sdk::ProblemView& problem) override;
    void analyze(const sdk::ProblemView& problem) override;
    void factorize(const sdk::ProblemView& problem) override;
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return matrix_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return factorizations_; }

private:
    void start_at(const sdk::ProblemView& problem, const sdk::MutableVectorView& x);
    /// The gradient at the iterate, and its size relative to its parts.
    double gradient(const sdk::ProblemView& problem);
    [[nodiscard]] bool factorize_at_iterate(const sdk::ProblemView& problem);
    double search(const sdk::ProblemView& problem);
    double slope(double length);
    [[nodiscard]] double curvature() const;

    std::int64_t stall_iterations_;
    Reactions reactions_;
    VelocityMatrix matrix_;
    std::int64_t factorizations_ = 0;
    Linearisation at_, trial_;
    bool has_factor_ = false;
    std::vector<Piece::State> factored_;  // the states that the factor belongs to

    sdk::Vector w_, momentum_, gradient_;          // D x + b, H x and ∇f of the iterate
    sdk::Vector step_, rates_, change_, trial_w_;  // d, D d and H d
    double along_ = 0.0, stiffness_ = 0.0;         // (H x − a)ᵀd, dᵀH d
};

}  // namespace delassus::newton
