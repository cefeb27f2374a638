// SPDX-License-Identifier: BSD-3-Clause
// Where the method that was chosen for a scene cannot go on, another takes its place.
#include <fmt/format.h>

#include <memory>
#include <utility>

#include "delassus/simulation.hpp"
#include "simulation/look_ahead.hpp"
#include "simulation/method_change.hpp"

namespace delassus {

namespace {

constexpr auto of_stiff_forces = "euler_implicit_linearized";

std::string described(const SteppingMethod& method) {
    return fmt::format("{} in {} coordinates", method.integrator,
                       method.coordinates == Coordinates::Joint ? "joint" : "maximal");
}

}  // namespace

std::vector<SteppingMethod> methods_of(const SceneSystem& system) {
    std::vector<SteppingMethod> methods = {{system.integrator, system.integrator_options, system.coordinates}};
    if (system.method_reason.empty() || system.control || system.sleeping) return methods;
    if (system.coordinates == Coordinates::Joint && system.coordinates_chosen && system.system->detects_contacts())
        methods.push_back({system.integrator == of_stiff_forces ? of_stiff_forces : "linearly_implicit_trapezoidal",
                           {},
                           Coordinates::Maximal});
    return methods;
}

void Simulation::change_method(std::size_t number) {
    timestepper_.reset();
    control_.reset();
    ahead_.reset();
    joint_.reset();
    system_->system->assemble();
    now_.totals.method_changes = static_cast<std::int64_t>(number);
    if (method().coordinates == Coordinates::Joint) joint_ = std::make_unique<JointCoordinates>(*system_->system);
    make_method();
}

bool Simulation::go_on(const std::string& why) {
    const auto next = static_cast<std::size_t>(now_.totals.method_changes) + 1;
    if (next >= methods_.size()) return false;
    State bodies = bodies_;
    bodies.t = now_.state.t;
    now_.totals.last_change = fmt::format("from t = {:.6g} s on {} took the place of {}, which could not go on: {}",
                                          bodies.t, described(methods_[next]), described(method()), why);
    change_method(next);
    now_.state = std::move(bodies);
    system_->system->renew_rows(now_.state, 0);
    report_ = {};
    return true;
}

}  // namespace delassus
