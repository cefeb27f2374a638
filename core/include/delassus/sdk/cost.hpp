// SPDX-License-Identifier: BSD-3-Clause
// What a solve cost one process: seconds by phase and bytes sent.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "delassus/plugin.h"

namespace delassus::sdk {

/// Of one call of solve. NaN, and −1, where the solver does not measure.
struct Cost {
    static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    std::array<double, DELASSUS_PHASE_COUNT> seconds = {unknown, unknown, unknown, unknown, unknown, unknown};
    std::int64_t bytes_sent = -1;

    /// Into the fields of an outcome, as far as its host has them.
    void write(delassus_outcome& outcome) const {
        constexpr std::size_t end = offsetof(delassus_outcome, bytes_sent) + sizeof outcome.bytes_sent;
        if (outcome.struct_size < end) return;
        for (std::size_t k = 0; outcome.phase_seconds && k < seconds.size(); ++k)
            if (static_cast<std::int32_t>(k) < outcome.phase_count) outcome.phase_seconds[k] = seconds[k];
        outcome.bytes_sent = bytes_sent;
    }
};

/// Adds up the seconds of phases. One phase runs at a time: a Span inside another one's life takes the time from it.
/// Each Span reads the clock twice, 40 ns or so. Where iterations are shorter than some microseconds, one in `stride`
/// is timed by phases. Its shares then stand for those of all iterations, whose time as a whole is always taken: so the
/// phases never add up to more than what the iterations took.
class PhaseClock {
public:
    using Clock = std::chrono::steady_clock;

    class Span {
    public:
        Span(PhaseClock& clock, delassus_phase phase) : clock_(clock), outer_(clock.phase_) { clock.turn_to(phase); }
        ~Span() { clock_.turn_to(outer_); }
        Span(const Span&) = delete;
        Span& operator=(const Span&) = delete;

    private:
        PhaseClock& clock_;
        int outer_;
    };

    /// Forgets everything; no Span may live. stride ≥ 1.
    void reset(std::int64_t stride) {
        *this = {};
        stride_ = stride;
    }
    /// An iteration begins, and the one before it ends; no Span may live.
    void next_iteration() {
        const bool on = iterations_++ % stride_ == 0;
        if (stride_ > 1 && (!inside_ || on_ || on)) {
            const auto now = Clock::now();
            if (inside_ && on_) timed_ += now - iteration_begin_;
            if (!inside_) first_begin_ = now;
            iteration_begin_ = now;
        }
        inside_ = true;
        on_ = on;
    }
    /// What follows belongs to no iteration; no Span may live.
    void end_iterations() {
        if (stride_ > 1 && inside_) {
            const auto now = Clock::now();
            if (on_) timed_ += now - iteration_begin_;
            all_ += now - first_begin_;
        }
        inside_ = false;
        on_ = true;
    }
    [[nodiscard]] bool is_on() const { return on_; }  ///< whether Spans take the time now
    [[nodiscard]] bool is_in_iteration() const { return inside_; }

    /// Seconds that were taken as one phase's, inside or outside iterations, were another's.
    void move(delassus_phase from, delassus_phase to, double seconds, bool in_iteration) {
        auto& taken = in_iteration ? inside_seconds_ : outside_seconds_;
        taken[from] -= seconds;
        taken[to] += seconds;
    }
    /// Of all that has ended: iterations count from end_iterations() on.
    [[nodiscard]] std::array<double, DELASSUS_PHASE_COUNT> seconds() const {
        const double each = timed_ > Clock::duration::zero() ? std::chrono::duration<double>(all_) / timed_ : 1.0;
        auto all = outside_seconds_;
        for (std::size_t k = 0; k < all.size(); ++k) all[k] += each * inside_seconds_[k];
        return all;
    }

private:
    static constexpr int none = -1;

    void turn_to(int phase) {
        if (!on_) return;
        const auto now = Clock::now();
        if (phase_ != none)
            (inside_ ? inside_seconds_ : outside_seconds_)[static_cast<std::size_t>(phase_)] +=
                std::chrono::duration<double>(now - begin_).count();
        begin_ = now;
        phase_ = phase;
    }

    std::array<double, DELASSUS_PHASE_COUNT> inside_seconds_ = {}, outside_seconds_ = {};
    std::int64_t stride_ = 1, iterations_ = 0;
    int phase_ = none;
    bool inside_ = false, on_ = true;
    Clock::time_point begin_, iteration_begin_, first_begin_;
    Clock::duration all_ = {}, timed_ = {};  // of iterations, and of those that were timed by phases
};

}  // namespace delassus::sdk
