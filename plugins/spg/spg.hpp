// SPDX-License-Identifier: BSD-3-Clause
// P-SPG-FB: the spectral projected gradient method with a diagonal preconditioner (README.md).
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/sdk/face_step.hpp"
#include "delassus/sdk/scaled_run.hpp"

namespace delassus::spg {

class SpectralGradient : public sdk::Solver {
public:
    explicit SpectralGradient(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override { scaled_.analyze(problem); }
    void factorize(const sdk::ProblemView& problem) override { scaled_.factorize(problem, team()); }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return scaled_.unscaled().inverse().analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return scaled_.unscaled().inverse().factorizations(); }

private:
    enum class Steps : std::uint8_t { Alternating, Long };

    void iterate(sdk::ScaledRun& run, const sdk::Team& team);
    double line_search(double slope, double curvature);
    double next_step(std::int64_t iteration, double square, double curvature);
    bool take_face_step(sdk::ScaledRun& run);

    sdk::ScaledProblem scaled_;
    Steps steps_;
    std::size_t memory_;
    bool tangential_, face_steps_;
    std::int64_t stall_iterations_;

    sdk::Vector lambda_, gradient_;    // λ̂ and û
    sdk::Vector direction_, product_;  // d and N̂ d
    std::vector<double> history_;      // the last values of f, relative to the latest
    std::size_t oldest_ = 0;           // in history_
    sdk::FaceStep face_;
    std::int64_t face_period_ = 0, since_face_ = 0;
};

}  // namespace delassus::spg
