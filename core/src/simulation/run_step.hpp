// SPDX-License-Identifier: BSD-3-Clause
// One step of a run, of a scene or of a system of Python (internal).
#pragma once

#include <memory>
#include <string>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/export.hpp"
#include "delassus/simulation.hpp"
#include "delassus/step_solver.hpp"
#include "simulation/stepping.hpp"

namespace delassus {

/// A step counts as a whole, with its record, its report and the totals, or everything is as it was before. Derived
/// classes say what else is known of their system.
class DELASSUS_API RunStep {
public:
    /// Of a run; memory: for the report of a step that may not count. All outlive this.
    struct Run {
        std::unique_ptr<Stepping>& stepping;
        StepSolver& solver;
        SimulationState& now;
        StepRecord& record;
        AdaptiveStepReport& report;
        AdaptiveStepReport& memory;
    };
    explicit RunStep(const Run& run) : run_(run) {}
    RunStep(const RunStep&) = delete;
    RunStep& operator=(const RunStep&) = delete;
    virtual ~RunStep() = default;

    /// Throws StepFailure, Unsupported or StepInterrupted with the step and its time in the sentence, and what methods
    /// of the system throw.
    void take();

protected:
    /// In the order in which they are called. state: where the step begins.
    virtual void prepare(State& /*state*/) {}
    /// state ← the next one that is shown.
    virtual void advance(State& state, AdaptiveStepReport& report) {
        run_.stepping->advance(state, run_.solver, report);
    }
    /// record ← what the state at the end of the step says; after `step`.
    virtual void measure(State& state, const AdaptiveStepReport& report, StepRecord& record) = 0;
    /// totals ← of the step. Throws StepFailure if it must not count.
    virtual void judge(const AdaptiveStepReport& /*report*/, SimulationTotals& /*totals*/) {}
    /// The step counts. place: which one it is.
    virtual void count(const std::string& /*place*/, SimulationTotals& /*totals*/) {}

    /// The step did not count: what the members above have changed is as before.
    virtual void undo() {}
    /// What a user should know about a step that failed: the end of a sentence.
    [[nodiscard]] virtual std::string what_acts() const { return {}; }
    /// Whether another method takes the step, which failed so.
    virtual bool go_on(const std::string& /*failure*/) { return false; }
    /// Before the number of a step in sentences.
    [[nodiscard]] virtual std::string name() const { return {}; }

    const Run run_;

private:
    [[nodiscard]] std::string place() const;
    /// Whether it was taken; else another method takes it.
    bool try_to_take();
    void add_to_totals(const std::string& place);
};

}  // namespace delassus
