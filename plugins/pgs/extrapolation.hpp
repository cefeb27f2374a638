// SPDX-License-Identifier: BSD-3-Clause
// Anderson acceleration of the sweeps.
//
// A sweep is a map λ ← F(λ), piecewise smooth and, while no contact changes between open, sticking and sliding, nearly
// linear, with modes that take 10³ to 10⁵ sweeps. Anderson's method replaces many of these. Where contacts change it
// may go astray, and the length of a sweep's step does not tell: slow modes have short steps however far they are off.
// The objective of the associated law does,
//
//     φ(λ) = ½λᵀNλ + rᵀλ + sᵀλ,      s = 0,
//
// which every sweep lowers (README.md). So an extrapolated point has to prove itself: a few sweeps later φ must be
// below that of the point before the extrapolation, or the sweeps go on from there. Under the Coulomb law s is De
// Saxcé's term μ‖u_t‖ in the normal rows, held as it was at that point: the solution minimises φ with its own s.
// Where others hold parts of the problem, the sums are those of all parts: two reductions each time.
#pragma once

#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "delassus/sdk/anderson.hpp"
#include "model.hpp"

namespace delassus::pgs {

class Extrapolation {
public:
    /// memory: differences kept; 0: never extrapolates. The model has its right-hand side.
    void reset(const Model& model, const sdk::DelassusOperator& N, int memory) {
        memory_ = memory;
        if (memory == 0) return;
        metric_ = model.metric(N);
        anderson_.reset(metric_.size(), memory);
        pending_ = tried_ = false;
        sweeps_ = 0;
    }

    /// Before a sweep: the state moves to the extrapolated point, if there is one.
    void before(const Model& model, SweepState& state) {
        if (memory_ == 0) return;
        if (pending_) move(model, next_, state);
        pending_ = false;
        if (sweeps_ % period == period - 1) begin_ = model.swept(state);
    }

    [[nodiscard]] bool works() const { return memory_ > 0; }

    /// Whether the sweep after before() is one whose end after() looks at.
    [[nodiscard]] bool looks() const { return works() && sweeps_ % period == period - 1; }

    /// After it: the state is that of the sweep, or the one before the extrapolation. The model looked at the state, if
    /// looks().
    void after(Model& model, SweepState& state) {
        if (memory_ == 0 || ++sweeps_ % period != 0) return;
        weigh_step(model, state);
        double sums[4] = {squared_length(), model.objective(state), 0.0,
                          model.work_against(model.sliding_terms(), state)};
        if (tried_) sums[2] = model.work_against(sliding_, state);
        model.others().sum(sums);
        const double length = std::sqrt(sums[0]);
        if (tried_ && !has_proved_itself(sums[1] + sums[2], length)) {
            move(model, plain_, state);
            anderson_.clear();
            tried_ = false;
            return;
        }
        sliding_ = model.sliding_terms();
        objective_ = sums[1] + sums[3];
        length_ = length;
        plain_.swap(end_);
        anderson_.push(step_, plain_, model.team(),
                       [&model](std::span<double> products) { model.others().sum(products); });
        pending_ = tried_ = anderson_.extrapolate(next_, model.team());
    }

    static constexpr int period = 5;  ///< sweeps from one extrapolation to the next

private:
    /// Where rounding hides the change of φ, the length of the step decides.
    [[nodiscard]] bool has_proved_itself(double objective, double length) const {
        const double rounding = 100.0 * std::numeric_limits<double>::epsilon() * std::abs(objective_);
        return objective < objective_ - rounding || (objective <= objective_ + rounding && length <= length_);
    }

    /// The latest sweep's end and step, weighed by the metric.
    void weigh_step(const Model& model, SweepState& state) {
        const auto lambda = model.swept(state);
        end_.resize(lambda.size());
        step_.resize(lambda.size());
        squares_.resize(static_cast<std::size_t>(sdk::Team::parts_of(lambda.size())));
        model.team().for_parts(lambda.size(), [&](Eigen::Index part, Eigen::Index first, Eigen::Index size) {
            const auto metric = metric_.segment(first, size);
            auto end = end_.segment(first, size), step = step_.segment(first, size);
            end = lambda.segment(first, size).cwiseProduct(metric);
            step = end - begin_.segment(first, size).cwiseProduct(metric);
            squares_[static_cast<std::size_t>(part)] = step.squaredNorm();
        });
    }
    /// Of the latest step.
    [[nodiscard]] double squared_length() const { return std::accumulate(squares_.begin(), squares_.end(), 0.0); }

    /// λ ← one that is weighed by the metric.
    void move(const Model& model, const sdk::Vector& weighed, SweepState& state) const {
        auto lambda = model.swept(state);
        model.team().for_parts(lambda.size(), [&](Eigen::Index, Eigen::Index first, Eigen::Index size) {
            lambda.segment(first, size) = weighed.segment(first, size).cwiseQuotient(metric_.segment(first, size));
        });
        model.renew(state);
    }

    int memory_ = 0;
    std::int64_t sweeps_ = 0;
    bool pending_ = false;  // next_ awaits its sweep
    bool tried_ = false;    // the sweeps come from an extrapolated point
    sdk::Anderson anderson_;
    // All m and in the order of the sweep. f and F are weighed by the metric √N_ii, so that rows of different units and
    // masses compare.
    sdk::Vector metric_, begin_, end_, step_, next_;
    // The latest point that was not rejected: λ (weighed), De Saxcé's terms by blocks, φ, ‖f‖.
    sdk::Vector plain_;
    std::vector<double> sliding_;
    std::vector<double> squares_;  // work space, by parts
    double objective_ = 0.0, length_ = 0.0;
};

}  // namespace delassus::pgs
