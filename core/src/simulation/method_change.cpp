// SPDX-License-Identifier: BSD-3-Clause
// The method of a simulation, and the one that takes its place where it cannot go on.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/simulation.hpp"
#include "dynamics/substeps.hpp"
#include "simulation/method_change.hpp"
#include "simulation/shared_run.hpp"
#include "simulation/sizes_of_motion.hpp"
#include "simulation/stepping.hpp"

namespace delassus {

namespace {

constexpr auto of_stiff_forces = "euler_implicit_linearized";

/// Of a step: in which an impact happens by itself. What lands flat lands on all its corners in it, though rounding
/// tilts it.
constexpr double shortest_impact = 1e-4;
/// Of an accuracy: what solves may err by.
constexpr double share_of_solves = 0.1;
/// In which positions may err by a chosen accuracy, where the scene has no time of its own.
constexpr double steps_of_time = 200.0;

std::string described(const SteppingMethod& method) {
    return fmt::format("{} in {} coordinates", method.integrator,
                       method.coordinates == Coordinates::Joint ? "joint" : "maximal");
}

}  // namespace

std::vector<SteppingMethod> methods_of(const SceneSystem& system) {
    std::vector<SteppingMethod> methods = {
        {system.integrator, system.integrator_options, system.coordinates, system.steps_by_accuracy()}};
    if (system.method_reason.empty() || system.control || system.sleeping) return methods;
    const bool leaves_joints =
        system.coordinates == Coordinates::Joint && system.coordinates_chosen && system.system->detects_contacts();
    const bool given = system.division == StepDivision::ToAccuracy;
    if (leaves_joints) {
        methods.push_back({system.integrator == of_stiff_forces ? of_stiff_forces : "linearly_implicit_trapezoidal",
                           {},
                           Coordinates::Maximal,
                           given});
    } else if (system.division == StepDivision::ToChosenAccuracy) {
        methods.push_back(methods.front());
        methods.back().by_accuracy = false;
    }
    return methods;
}

void Simulation::make_method() {
    stepping_.reset();
    revision_ = system_->system->revision();
    auto timestepper = make_timestepper(method().integrator, dynamics(), method().options);
    SteppingSettings settings{
        .step = system_->step,
        .end = system_->end,
        .chosen = system_->control,
        .divided = std::nullopt,
        .judged = std::nullopt,
        .accuracy = system_->accuracy,
        .advice = fmt::format("{} cannot follow the motion there, as where a mechanism jams or branches; "
                              "euler_implicit_linearized with \"coordinates: maximal\" is less exact and may go on",
                              method().integrator),
        .restitutes = restitutes_};
    solver_->bound_errors({});
    if (!std::isfinite(timestepper->error_limit())) {
        if (method().by_accuracy) {
            settings.divided = control_of_accuracy();
            std::vector<double> bounds = settings.divided->sizes;
            for (double& bound : bounds) bound *= share_of_solves * settings.divided->absolute / settings.divided->unit;
            solver_->bound_errors(std::move(bounds));
        } else if (!shared_) {
            settings.judged = control_of_accuracy();
            settings.refines = system_->division == StepDivision::WhileCheap;
        }
    }
    stepping_ = std::make_unique<Stepping>(dynamics(), std::move(timestepper), std::move(settings), shared_.get());
    if (shared_) {
        shared_->restart();
        gathered_ = stepping_->timestepper()->save();
        gathered_at_ = now_.step;
    }
    if (stepping_->timestepper()->has_extension() && stepping_->has_limit() && system_->system->foreseeable())
        stepping_->look_ahead(std::make_unique<LookAhead>(dynamics(), *system_->system, joint_.get(), system_->step,
                                                          shortest_substep * system_->step));
}

StepControl Simulation::control_of_accuracy() {
    SizesOfMotion sizes = sizes_of_motion(*system_, joint_.get());
    StepControl control = StepControl::within(system_->accuracy, system_->step);
    control.sizes = std::move(sizes.of_velocities);
    if (system_->division != StepDivision::ToAccuracy)
        control.unit = sizes.time > 0.0 ? sizes.time : steps_of_time * system_->step;
    control.slow = control.absolute * sizes.least / control.unit;
    if (dynamics().has_unilateral()) control.smallest = shortest_impact * system_->step;
    return control;
}

void Simulation::change_method(std::size_t number) {
    stepping_.reset();
    const Coordinates before = method().coordinates;
    now_.totals.method_changes = static_cast<std::int64_t>(number);
    if (method().coordinates != before) {
        joint_.reset();
        system_->system->assemble();
        if (method().coordinates == Coordinates::Joint) joint_ = std::make_unique<JointCoordinates>(*system_->system);
    }
    make_method();
}

bool Simulation::go_on(const std::string& why) {
    const auto next = static_cast<std::size_t>(now_.totals.method_changes) + 1;
    if (next >= methods_.size()) return false;
    State bodies = state();
    bodies.t = now_.state.t;
    const Coordinates before = method().coordinates;
    now_.totals.last_change =
        methods_[next].integrator == method().integrator && methods_[next].coordinates == before
            ? fmt::format("from t = {:.6g} s on steps are not divided by their error, which could not go on: {}",
                          bodies.t, why)
            : fmt::format("from t = {:.6g} s on {} took the place of {}, which could not go on: {}", bodies.t,
                          described(methods_[next]), described(method()), why);
    change_method(next);
    if (method().coordinates != before) {
        now_.state = std::move(bodies);
        system_->system->renew_rows(now_.state, 0);
    }
    report_ = {};
    return true;
}

}  // namespace delassus
