// SPDX-License-Identifier: BSD-3-Clause
// What a solve costs each process: seconds by phase, and bytes sent.
//
// A call that all processes make together (a reduction, an exchange) holds each of them until the last has come. The
// last to come waits for nobody, and so is the first to be through, counted from its own arrival: the least time that
// any process spends in the call is the call itself, and what another spends beyond that is its waiting. No barrier is
// needed. The times of a thousand calls are compared by one reduction.
#pragma once

#include <petscksp.h>

#include <chrono>
#include <cstdint>
#include <vector>

#include "delassus/sdk/cost.hpp"

namespace delassus::petsc {

class CostMeter {
public:
    explicit CostMeter(MPI_Comm communicator, int processes) : communicator_(communicator), processes_(processes) {}

    /// A solve begins. rows: of all processes together. Where a process has less than `few` of them, one iteration in
    /// 32 is timed and stands for the others: reading the clock must not count.
    void begin(std::int64_t rows, std::int64_t few);
    /// What it has cost this process since begin(). Collective.
    [[nodiscard]] sdk::Cost end();

    [[nodiscard]] sdk::PhaseClock& clock() { return clock_; }
    /// Until the result's life ends, the phase is this one.
    [[nodiscard]] sdk::PhaseClock::Span span(delassus_phase phase) { return {clock_, phase}; }

    /// A call that all processes make together, as long as this lives. Collective.
    class Together {
    public:
        Together(CostMeter& meter, delassus_phase phase)
            : meter_(meter),
              phase_(phase),
              span_(meter.clock_, phase),
              begin_(meter.clock_.is_on() ? Clock::now() : Clock::time_point()) {}
        ~Together() {
            if (meter_.clock_.is_on()) meter_.note(phase_, std::chrono::duration<float>(Clock::now() - begin_).count());
        }
        Together(const Together&) = delete;
        Together& operator=(const Together&) = delete;

    private:
        using Clock = sdk::PhaseClock::Clock;
        CostMeter& meter_;
        delassus_phase phase_;
        sdk::PhaseClock::Span span_;  // begins before begin_ and ends after what is noted: no more is moved than it has
        Clock::time_point begin_;
    };

    /// Bytes of a reduction, which PETSc does not count.
    void add_bytes(std::size_t bytes) { reduced_ += static_cast<std::int64_t>(bytes); }

private:
    struct Call {
        delassus_phase phase;
        bool in_iteration;
    };
    static constexpr std::size_t batch = 1024;

    void note(delassus_phase phase, float seconds);
    void compare();

    MPI_Comm communicator_;
    int processes_;
    sdk::PhaseClock clock_;
    std::vector<float> seconds_, least_;  // of calls that have not been compared yet
    std::vector<Call> calls_;
    double bytes_before_ = 0.0;
    std::int64_t reduced_ = 0;
};

}  // namespace delassus::petsc
