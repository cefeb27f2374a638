// SPDX-License-Identifier: BSD-3-Clause
// The sweeps of one solve: their order, their extrapolation, and when their error is measured (README.md).
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>

#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/solver.hpp"
#include "extrapolation.hpp"
#include "model.hpp"
#include "options.hpp"

namespace delassus::pgs {

class Iteration {
public:
    /// Reads what options.hpp names.
    explicit Iteration(const sdk::OptionValues& options)
        : symmetric_(options.choice("variant") == "symmetric"),
          jacobi_(options.choice("variant") == "jacobi"),
          memory_(options.choice("acceleration") == "anderson" ? static_cast<int>(options.integer("memory")) : 0),
          check_every_(options.integer("check_every")),
          stall_window_(options.integer("stall_window")) {
        rule_.local = options.choice("local_solver") == "exact" ? Local::Exact : Local::Diagonal;
        rule_.omega = options.real("omega");
    }

    [[nodiscard]] bool jacobi() const { return jacobi_; }
    [[nodiscard]] bool exact() const { return rule_.local == Local::Exact; }
    [[nodiscard]] std::int64_t stall_window() const { return stall_window_; }

    /// Sweeps from λ (m, in its set) until the monitor says stop. The model has its right-hand side. reference: ‖S r‖
    /// of all parts. measured(λ): the natural error from velocities computed anew, as the host does it.
    template <class Measured>
    void run(Model& model, const sdk::DelassusOperator& N, double reference, bool coulomb, const sdk::Request& request,
             sdk::Monitor& monitor, sdk::Vector& lambda, const Measured& measured) {
        const bool resumed = request.resume();
        // A tolerance below rounding asks for all iterations: then only their end is measured. A few of them gain less
        // by extrapolation than it costs.
        const bool to_the_end = request.tolerance() < std::numeric_limits<double>::epsilon();
        if (!resumed) {
            rule_.coulomb = coulomb;
            reference_ = reference;
            model.state_of(lambda, state_);
            const bool few = to_the_end && request.max_iterations() < fewest_extrapolated;
            extrapolation_.reset(model, N, few ? 0 : memory_);
            // A warm start is a step of a simulation, whose sweeps are few: their own estimate says when to look.
            estimates_ = request.warm_start() && check_every_ == 0 && !jacobi_;
        }
        std::int64_t next_check = to_the_end ? request.max_iterations() : resumed ? Extrapolation::period : 0;
        shown_ = Clock::now();
        last_shown_ = 0;
        next_show_ = 1;
        if (resumed) extrapolation_.after(model, state_);
        for (std::int64_t iteration = resumed ? 1 : 0;; ++iteration) {
            bool looks = false;
            double error = std::numeric_limits<double>::infinity();
            if (iteration > 0) {
                extrapolation_.before(model, state_);
                looks = extrapolation_.looks();
                const bool records = estimates_ && (iteration == 1 || iteration % Extrapolation::period == 0);
                const double squares = advance(model, records);
                if (records) error = natural(model, squares);
                looks = looks && !records;
            }
            bool due = iteration >= next_check || iteration >= request.max_iterations() ||
                       error <= worth_a_look * request.tolerance();
            auto answer = DELASSUS_CONTINUE;
            if (!due && request.has_listener() && is_time_to_show(model, iteration)) {
                model.reactions(state_, lambda);
                answer = request.progress(iteration, nullptr, lambda.data());
                has_shown(model, iteration);
                due = answer != DELASSUS_CONTINUE;  // the iterate may be better than the best that was measured
            }
            if (due || looks) {
                const double squares = model.look(state_, coulomb);
                if (due) error = natural(model, squares);
            }
            if (due) {
                if (monitor.check(iteration, nullptr, lambda, confirmed(model, error, request, lambda, measured)))
                    return;
                if (answer != DELASSUS_CONTINUE) {
                    monitor.outcome().status = sdk::status_of(answer);
                    return;
                }
                has_shown(model, iteration);
                next_check =
                    estimates_ ? iteration + std::max(fewest_unchecked, iteration / 20) : next_check_after(iteration);
            }
            if (iteration > 0) extrapolation_.after(model, state_);
        }
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds patience{20};  // between two calls of progress
    static constexpr std::int64_t fewest_extrapolated = 30;
    static constexpr std::int64_t fewest_unchecked = 20;
    static constexpr double worth_a_look = 1.5;  // times the tolerance: an estimate that low

    /// From the sum of the own part's squares.
    [[nodiscard]] double natural(const Model& model, double squares) const {
        model.others().sum({&squares, 1});
        return std::sqrt(squares) / reference_;
    }

    // Clocks differ between processes: those that hold parts plan the iteration of the next call together.
    [[nodiscard]] bool is_time_to_show(const Model& model, std::int64_t iteration) const {
        return model.others().exist() ? iteration >= next_show_ : Clock::now() - shown_ > patience;
    }
    void has_shown(const Model& model, std::int64_t iteration) {
        const Clock::time_point now = Clock::now();
        if (model.others().exist()) {
            std::array<double, 2> sums = {std::chrono::duration<double>(now - shown_).count(), 1.0};
            model.others().sum(sums);
            const auto done = static_cast<double>(std::max<std::int64_t>(1, iteration - last_shown_));
            const double seconds = std::max(sums[0] / sums[1] / done, 1e-7);
            constexpr double wanted = std::chrono::duration<double>(patience).count();
            next_show_ = iteration + std::max<std::int64_t>(1, static_cast<std::int64_t>(wanted / seconds));
            last_shown_ = iteration;
        }
        shown_ = now;
    }

    // Where the sweeps are extrapolated, the ends of its periods are looked at anyway.
    [[nodiscard]] std::int64_t next_check_after(std::int64_t iteration) const {
        if (check_every_ > 0) return iteration + check_every_;
        if (iteration < 2) return iteration + 1;
        if (!extrapolation_.works()) return iteration + 4 + iteration / 20;
        constexpr int period = Extrapolation::period;
        return (iteration + std::max<std::int64_t>(period, iteration / 20)) / period * period;
    }

    /// records: returns what Model::recorded_sweep returns, else 0.
    double advance(Model& model, bool records) {
        if (jacobi_) {
            model.jacobi_step(rule_, state_, next_);
            return 0.0;
        }
        const auto sweep = [&](Direction direction, bool last) {
            rule_.direction = direction;
            if (last && records) return model.recorded_sweep(rule_, state_);
            model.sweep_in_place(rule_, state_);
            return 0.0;
        };
        const double squares = sweep(Direction::Forward, !symmetric_);
        return symmetric_ ? sweep(Direction::Backward, true) : squares;
    }

    // λ ← that of the state. Where its error would end the solve, v̂ is renewed from λ, which takes out the rounding of
    // all changes so far, and the error is measured again: sharp ones as the host does, since rounding in another order
    // would make a false claim of a true one.
    template <class Measured>
    double confirmed(Model& model, double error, const sdk::Request& request, sdk::Vector& lambda,
                     const Measured& measured) {
        constexpr double sharp = 1e-8;
        model.reactions(state_, lambda);
        if (error > sdk::Monitor::aim * request.tolerance()) return error;
        model.state_of(lambda, state_);
        error = natural(model, model.look(state_, rule_.coulomb));
        if (request.tolerance() > sharp || error > sdk::Monitor::aim * request.tolerance()) return error;
        return measured(lambda);
    }

    bool symmetric_, jacobi_;
    int memory_;  // 0: no acceleration
    std::int64_t check_every_, stall_window_;
    SweepRule rule_;
    bool estimates_ = false;
    double reference_ = 1.0;
    Clock::time_point shown_;
    std::int64_t last_shown_ = 0, next_show_ = 0;
    SweepState state_;
    Extrapolation extrapolation_;
    sdk::Vector next_;
};

}  // namespace delassus::pgs
