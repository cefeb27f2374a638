// SPDX-License-Identifier: BSD-3-Clause
// A proximal semismooth Newton method on the natural map, for both friction laws (docs/solvers/ssn.md).
#pragma once

#include <cstdint>

#include "delassus/sdk/scaled_run.hpp"
#include "natural_map.hpp"
#include "newton_system.hpp"

namespace delassus::ssn {

class SemismoothNewton : public sdk::Solver {
public:
    explicit SemismoothNewton(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override;
    void factorize(const sdk::ProblemView& problem) override;
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override;
    [[nodiscard]] std::int64_t factorizations() const override;

    /// A phase gives up after so many solves that do not reduce the error to this fraction of what it was.
    struct Patience {
        std::int64_t solves;
        double gain;
    };

private:
    enum class Result {
        Reached,  ///< the goal
        Failed,   ///< no further this way
        Stopped   ///< the run asked to stop
    };

    // ssn.cpp: the order of the phases
    void iterate(sdk::ScaledRun& run, bool resumed);
    void begin_law(double tau);
    Result follow_law(sdk::ScaledRun& run, double goal);
    Result solve_law(sdk::ScaledRun& run, double goal, Patience patience);
    [[nodiscard]] bool at_rounding();

    // phases.cpp: Newton's method, a proximal subproblem, and their line searches
    Result newton(sdk::ScaledRun& run, double goal);
    Result proximal_step(sdk::ScaledRun& run);
    void start_subproblem(const Proximal& measure);
    void choose_next_weight(bool failed, int solves);
    [[nodiscard]] bool direction(const Proximal& proximal);
    [[nodiscard]] double convex_search(const Proximal& proximal);
    [[nodiscard]] double merit_search(const Proximal& proximal, double enough, double shortest, double& value);
    [[nodiscard]] double merit(const Vector& lambda, const Vector& u, const Proximal& proximal);
    void move_to(const Vector& lambda);

    /// ‖F‖/‖r̂‖ of the iterate under the law of the map.
    [[nodiscard]] double error() { return merit(lambda_, velocity_, {}); }

    sdk::ScaledProblem scaled_;
    NaturalMap map_;
    NewtonSystem system_;
    std::int64_t stall_iterations_;
    bool follow_law_;
    bool pattern_is_new_ = true;

    // Of solve_law:
    double threshold_ = 0.0;   // error below which Newton's method is tried without a centre
    double milestone_ = 0.0;   // the error that the next has to better
    std::int64_t waited_ = 0;  // iterations since then

    bool between_laws_ = false;  // the run stopped in follow_law
    double best_error_ = 0.0;    // of the iterates since the start
    double reference_ = 1.0;     // ‖r̂‖, or 1 if that is zero
    double tau_ = 0.1;           // of the next proximal subproblem
    double shrinkage_ = 10.0;    // by which τ falls after a subproblem that was solved
    double previous_tau_ = 0.0;  // of the subproblem that led from previous_ to the iterate; 0: none
    Vector lambda_, velocity_;   // the iterate λ̂ and its û
    Vector centre_, kept_, previous_;
    Vector F_, normal_, local_, step_, product_;  // of the latest linearisation; product_ = N̂ step_
    Vector trial_, trial_velocity_;
};

}  // namespace delassus::ssn
