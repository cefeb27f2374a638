// SPDX-License-Identifier: BSD-3-Clause
// Primal-dual interior point method: for the convex problem of the associated law, and for exact Coulomb (README.md).
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "delassus/sdk/monitor.hpp"
#include "kkt_system.hpp"

namespace delassus::ipm {

class InteriorPoint : public sdk::Solver {
public:
    explicit InteriorPoint(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override;
    void factorize(const sdk::ProblemView& problem) override { scaling_.factorize(problem); }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return kkt_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override {
        return scaling_.factorizations() + kkt_.factorizations();
    }

private:
    // Relative residuals of linear solves. The predictor is only a forecast. Errors that the corrector leaves show in
    // the residuals of the next iteration.
    static constexpr double predictor_residual = 1e-3;
    static constexpr double corrector_residual = 1e-9;

    void start_cold();
    void start_warm(const sdk::ProblemView& problem, double error);
    void find_residuals();
    /// Judges the iterate in true_x_, true_lambda_; true: stop.
    bool judge(const sdk::ProblemView& problem, sdk::Monitor& monitor, std::int64_t iteration);
    void iterate(const sdk::ProblemView& problem, sdk::Monitor& monitor);
    bool step();
    bool coulomb_step();  // coulomb_step.cpp
    /// δ for the target in target_; its error of the linear solve is at most `enough`.
    void find_direction(double enough);
    void aim(double tau, bool second_order);
    [[nodiscard]] double allowed_length() const { return std::min(1.0, 0.95 * cones_.longest_step()); }
    bool move(double length);
    [[nodiscard]] bool is_jammed() const;

    // coulomb_path.cpp
    using Judge = std::function<bool()>;  // of the iterate; true: stop
    bool follow_shift(const Judge& judge, double tau, double goal, int most);
    bool hop(const Judge& judge, double tau);
    bool hop_on(const Judge& judge);
    /// Whether the iteration has stopped getting anywhere.
    bool is_stuck(double error);
    bool is_slow();  // coulomb
    /// A lower bound of ‖(x̂, ẑ)‖ over all solutions that the iterates prove; zero if they prove nothing.
    [[nodiscard]] double proven_size() const;

    Scaling scaling_;
    Complementarity cones_;
    KktSystem kkt_;
    double step_fraction_;
    std::int64_t stall_iterations_;
    bool shift_first_;
    std::int64_t most_hops_;

    sdk::Vector x_;                                 // x̂
    sdk::Vector f_, g_;                             // what is left of the two equations
    sdk::Vector theta_, target_, right_, dx_, dz_;  // of a step
    sdk::Vector true_x_, true_lambda_, best_x_;     // in the problem's units
    double least_error_ = 0.0, least_rest_ = 0.0;   // of is_stuck
    std::int64_t idle_iterations_ = 0;
    double path_error_ = 0.0;    // the smallest of the iterates, the given start left out
    double halved_error_ = 0.0;  // of is_slow
    std::int64_t slow_iterations_ = 0;
    int centre_next_ = 0;  // exact Coulomb: iterations that aim at the present products
    int hops_ = 0;
    double rise_ = 1.0, lowest_tau_ = 0.0;
    bool is_stopped_ = false;  // in a hop
    double jam_ = 0.0;         // counts short steps
};

}  // namespace delassus::ipm
