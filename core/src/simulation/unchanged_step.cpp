// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/unchanged_step.hpp"

#include <cstring>

namespace delassus {
namespace {

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

}  // namespace

void UnchangedStep::note(const State& begin, const std::vector<double>& kept, const State& end, double h,
                         const Timestepper& stepper, const StepReport& report, const SolverEffort& effort) {
    if (h == h_) return;
    h_ = 0.0;
    if (!report.solved || !same_bits(begin.v, end.v) || !same_bits(begin.q, end.q)) return;
    if (system_.depends_on_time() || !same_bits(kept, stepper.save())) return;
    report_ = report;
    effort_ = effort;
    h_ = h;
}

bool UnchangedStep::repeat(State& state, double h, StepReport& report) {
    repeated_ = h == h_;
    if (!repeated_) {
        h_ = 0.0;
        return false;
    }
    report = report_;
    state.t += h;
    return true;
}

}  // namespace delassus
