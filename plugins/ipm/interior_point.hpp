// SPDX-License-Identifier: BSD-3-Clause
// The interior point method in one process: the associated law by the iteration of iteration.hpp, and exact Coulomb by
// one of its own (README.md).
#pragma once

#include <functional>
#include <optional>

#include "equations.hpp"
#include "iteration.hpp"

namespace delassus::ipm {

class InteriorPoint : public sdk::Solver, private Iteration<Equations> {
public:
    explicit InteriorPoint(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override { system_.analyze(problem); }
    void factorize(const sdk::ProblemView& problem) override { system_.factorize(problem); }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return system_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return system_.factorizations(); }

private:
    // Exact Coulomb only, as all that follows.
    void start_path();
    void iterate(sdk::Monitor& monitor, bool judged);
    bool is_slow();

    bool step();  // coulomb_step.cpp
    void aim(double tau, bool second_order);
    [[nodiscard]] double allowed_length() const { return std::min(1.0, 0.95 * cones_.longest_step()); }
    [[nodiscard]] bool is_jammed() const;

    // coulomb_path.cpp
    using Judge = std::function<bool()>;  // of the iterate; true: stop
    bool follow_shift(const Judge& judge, double tau, double goal, int most);
    struct Hop {
        Hop(double to, const Complementarity& from, const sdk::Vector& x) : tau(to), kept(from), kept_x(x) {}
        double tau, h = 1.0;         // where it goes, and the step of Euler's method
        double lag = infinity;       // of the shift, after the latest step
        double tried_at = infinity;  // the least lag at which the path was tried
        int steps = 0, failures = 0;
        Complementarity kept;  // after the latest step, with its x̂
        sdk::Vector kept_x;
    };
    bool follow_flow(const Judge& judge, Hop& hop);
    bool hop_on(const Judge& judge);
    bool end_hop(const Judge& judge);

    bool shift_first_;
    std::int64_t most_hops_;

    double path_error_ = 0.0;    // the smallest of the iterates, the given start left out
    double halved_error_ = 0.0;  // of is_slow
    std::int64_t slow_iterations_ = 0;
    int centre_next_ = 0;  // iterations that aim at the present products
    int hops_ = 0;
    double rise_ = 1.0, lowest_tau_ = 0.0;
    std::optional<Hop> hop_;   // at hand
    bool is_stopped_ = false;  // in a hop
    double jam_ = 0.0;         // counts short steps
};

}  // namespace delassus::ipm
