// SPDX-License-Identifier: BSD-3-Clause
// Running a system that is a class of Python, step by step.
#pragma once

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "delassus/adaptive_stepping.hpp"
#include "delassus/registry.hpp"
#include "delassus/simulation.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"
#include "guards.hpp"
#include "python_system.hpp"
#include "scenes.hpp"
#include "simulation/run_step.hpp"
#include "simulation/stepping.hpp"

namespace delassus::python {

/// A PythonSystem with its state, its timestepper and its solver. As with Simulation, a step that throws leaves
/// everything as it was.
class SystemRun {
public:
    /// settings: a scene of one system, of which only integrator, solver, step, tolerance and end count. With the GIL.
    SystemRun(py::object object, const std::shared_ptr<SharedScene>& settings, std::shared_ptr<const Registry> registry)
        : registry_(std::move(registry)),
          settings_(settings),
          set_(settings->scene.systems.front()),
          system_(std::move(object)) {
        const py::gil_scoped_release without_gil;
        solver_ = std::make_unique<StepSolver>(*registry_, set_.solver);
        SolverConfig named = set_.solver;
        if (named.name.empty()) named.name = "auto";
        check_solver(*registry_, named);
        now_.state = system_.initial_state();
        SteppingSettings steps{
            .step = set_.step,
            .end = set_.end,
            .chosen = set_.control,
            .divided = std::nullopt,
            .judged = std::nullopt,
            .accuracy = set_.accuracy,
            .advice = fmt::format("{} cannot follow the motion there; take an implicit method, or "
                                  "euler_implicit_linearized, which is less exact and may go on",
                                  set_.integrator),
        };
        stepping_ = std::make_unique<Stepping>(
            system_, make_timestepper(set_.integrator, system_, set_.integrator_options), std::move(steps));
        measure(now_.state, record_);
    }

    /// What look(run) returns, a value.
    template <typename Look>
    auto look(const Look& look) {
        return in_turn(turn_, [&] { return look(*this); });
    }

    StepRecord step() {
        Interrupts interrupts;
        StepRecord record;
        try {
            record = look([&](SystemRun& self) {
                self.solver_->interrupt_by([&interrupts] { return interrupts.came(); });
                struct Forget {
                    StepSolver& solver;
                    ~Forget() { solver.interrupt_by(nullptr); }
                } const forget{*self.solver_};
                return self.take_step();
            });
        } catch (const StepInterrupted&) {
            interrupts.rethrow();
            throw;
        }
        interrupts.rethrow();
        return record;
    }

    [[nodiscard]] bool finished() const { return stepping_->ends(now_.state.t); }
    [[nodiscard]] const State& state() const { return now_.state; }
    [[nodiscard]] const StepRecord& record() const { return record_; }
    [[nodiscard]] const StepReport& report() const { return report_.step; }
    [[nodiscard]] const std::string& integrator() const { return set_.integrator; }
    [[nodiscard]] std::vector<std::string> warnings() const {
        if (now_.totals.unsolved_steps == 0) return {};
        return {fmt::format("{} of {} steps rest on a solve that missed its tolerance; the first: {}",
                            now_.totals.unsolved_steps, now_.step, now_.totals.first_unsolved)};
    }

private:
    /// The system does not say what momentum is.
    class Step : public RunStep {
    public:
        explicit Step(SystemRun& run)
            : RunStep({run.stepping_, *run.solver_, run.now_, run.record_, run.report_, run.memory_}), system_(run) {}

    private:
        void measure(State& state, const AdaptiveStepReport&, StepRecord& record) override {
            system_.measure(state, record);
        }
        SystemRun& system_;
    };

    const StepRecord& take_step() {
        if (finished())
            throw InputError(
                fmt::format("the simulation has reached its end, {} s: there is no further step", set_.end));
        Step(*this).take();
        return record_;
    }

    /// record ← what is known of a state; those values are still 0.
    void measure(const State& state, StepRecord& record) {
        constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
        record.t = state.t;
        record.energy = system_.energy(state);
        std::vector<double> momentum;
        record.kinetic = kinetic_energy(system_, state, state.v, momentum);
        record.momentum = record.angular_momentum = {unknown, unknown, unknown};
        std::vector<double> C(static_cast<std::size_t>(system_.m()), 0.0);
        system_.constraint(state, C.data());
        for (const double value : C) record.drift = std::max(record.drift, std::abs(value));
        if (!system_.has_unilateral()) return;
        system_.collect_unilateral(state, set_.step, rows_);
        std::size_t row = 0;
        for (const auto& block : rows_.blocks()) {
            if (block.cone.kind == ConeKind::Friction || block.cone.kind == ConeKind::Nonnegative)
                record.penetration = std::max(record.penetration, -rows_.rows()[row].gap);
            row += static_cast<std::size_t>(block.cone.rows);
        }
    }

    std::shared_ptr<const Registry> registry_;
    std::shared_ptr<SharedScene> settings_;
    const SceneSystem& set_;
    PythonSystem system_;
    Turn turn_;
    std::unique_ptr<StepSolver> solver_;
    std::unique_ptr<Stepping> stepping_;
    SimulationState now_;
    StepRecord record_;
    AdaptiveStepReport report_, memory_;  // of the last step, and for the next
    UnilateralRows rows_;
};

/// The unilateral blocks of the last step.
inline py::dict reactions_of(SystemRun& self) {
    const std::vector<BlockReaction> reactions = self.look([](const SystemRun& run) { return run.report().reactions; });
    std::vector<std::uint64_t> keys;
    std::vector<double> forces;
    for (const BlockReaction& one : reactions) {
        keys.push_back(one.key);
        forces.insert(forces.end(), one.force.begin(), one.force.end());
    }
    const auto count = static_cast<py::ssize_t>(reactions.size());
    py::dict result;
    result["key"] = array_of(std::move(keys));
    result["force"] = array_of(std::move(forces), {count, 3});
    return result;
}

inline py::list timestepper_rows() {
    py::list methods;
    for (const TimestepperInfo& info : timesteppers()) {
        py::dict row, options;
        for (const OptionInfo& option : info.options) options[py::str(option.key)] = option.default_value;
        row["name"] = info.name;
        row["description"] = info.description;
        row["order"] = info.order;
        row["constraints"] = info.constraints;
        row["unilateral"] = info.unilateral;
        row["options"] = options;
        methods.append(row);
    }
    return methods;
}

inline void bind_system_runs(py::module_& module) {
    using namespace py::literals;

    const auto look = [](auto what) { return [what](SystemRun& self) { return self.look(what); }; };
    py::class_<SystemRun>(module, "SystemRun")
        .def(py::init<py::object, const std::shared_ptr<SharedScene>&, std::shared_ptr<const Registry>>(), "system"_a,
             "settings"_a, "registry"_a)
        .def("step", &SystemRun::step)
        .def_property_readonly("finished", look([](const SystemRun& run) { return run.finished(); }))
        .def_property_readonly("time", look([](const SystemRun& run) { return run.state().t; }))
        .def_property_readonly(
            "positions",
            [](SystemRun& self) {
                return array_of(self.look([](const SystemRun& run) { return std::vector(run.state().q); }));
            })
        .def_property_readonly(
            "velocities",
            [](SystemRun& self) {
                return array_of(self.look([](const SystemRun& run) { return std::vector(run.state().v); }));
            })
        .def_property_readonly("record", look([](const SystemRun& run) { return run.record(); }))
        .def_property_readonly(
            "multipliers",
            [](SystemRun& self) {
                return array_of(self.look([](const SystemRun& run) { return std::vector(run.report().multipliers); }));
            })
        .def_property_readonly("integrator", [](const SystemRun& self) { return self.integrator(); })
        .def("contacts", &reactions_of)
        .def("warnings", look([](const SystemRun& run) { return run.warnings(); }));

    module.def("_timesteppers", &timestepper_rows);
}

}  // namespace delassus::python
