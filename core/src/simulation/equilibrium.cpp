// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "dynamics/relaxation.hpp"

namespace delassus {
namespace {

void require_rest(const MultibodySystem& mechanics, const State& start) {
    if (std::any_of(start.v.begin(), start.v.end(), [](double v) { return v != 0.0; }))
        throw InputError(
            "a static equilibrium begins at rest, and something has a velocity at t = 0; leave velocities and motors "
            "that move at t = 0 out of the scene");
    std::vector<double> rate(static_cast<std::size_t>(mechanics.m()), 0.0);
    if (!rate.empty()) mechanics.constraint_rate(start, rate.data());
    if (std::any_of(rate.begin(), rate.end(), [](double r) { return r != 0.0; }))
        throw InputError("a static equilibrium has no motor that moves at t = 0; give its motion as a constant");
}

/// Throws Unsupported if a contact or a stop would have to act at a state, or a motor has a force limit.
void require_nothing_touches(MultibodySystem& mechanics, const State& state, UnilateralRows& rows, double load) {
    if (!mechanics.has_unilateral()) return;
    constexpr double moment = 1e-9;  // s
    mechanics.collect_unilateral(state, moment, rows);
    std::size_t row = 0;
    for (const auto& block : rows.blocks()) {
        if (block.cone.kind == ConeKind::Box)
            throw Unsupported(
                "the search for an equilibrium takes no motors and actuators with a limit and no friction in joints; "
                "leave them out of the scene, or give motors and actuators no limit");
        if (rows.rows()[row].gap < -mechanics.gap_resolution())
            throw Unsupported(fmt::format(
                "under {:.4g} of the loads a contact or a stop closes, and the search for an equilibrium takes none; "
                "let the scene come to rest with damping in a run instead",
                load));
        row += static_cast<std::size_t>(block.cone.rows);
    }
}

class Search {
public:
    Search(SceneSystem& system, const Registry& registry, const std::function<bool()>& cancelled)
        : mechanics_(*system.system),
          rule_(system.equilibrium.value_or(EquilibriumRule{})),
          solver_(registry, system.solver),
          relaxation_(*system.system, {.tolerance = rule_.tolerance}) {
        solver_.cancelled = cancelled;
        if (!system.leave_out) solver_.leave_nothing_out();
    }
    ~Search() { mechanics_.set_load_factor(1.0); }
    Search(const Search&) = delete;
    Search& operator=(const Search&) = delete;

    Equilibrium run(const LoadStepHook& on_step) {
        Equilibrium found;
        found.state = mechanics_.initial_state();
        require_rest(mechanics_, found.state);
        require_nothing_touches(mechanics_, found.state, rows_, 0.0);
        Vector loads = Vector::Zero(mechanics_.n()), lambda = Vector::Zero(mechanics_.m());
        mechanics_.add_force(found.state, 1.0, loads.data());
        if (loads.size() > 0) found.largest_force = loads.lpNorm<Eigen::Infinity>();
        double load = 0.0;
        int divided = 0;
        for (int step = 1; step <= rule_.load_steps;) {
            const double goal = static_cast<double>(step) / rule_.load_steps;
            const double next = divided == 0 ? goal : load + std::ldexp(1.0 / rule_.load_steps, -divided);
            mechanics_.set_load_factor(next >= goal ? goal : next);
            State state = found.state;
            RelaxationReport effort;
            try {
                effort = relaxation_.run(state, lambda, solver_);
            } catch (const StepFailure& error) {
                if (++divided <= most_divided) continue;
                throw StepFailure(fmt::format("under {:.4g} of the loads {}", next, error.what()));
            }
            load = std::min(next, goal);
            require_nothing_touches(mechanics_, state, rows_, load);
            found.state = state;
            found.largest_force = std::max(found.largest_force, effort.reaction);
            found.load_steps.push_back(
                {load, effort.steps, effort.newton_iterations, effort.residual, mechanics_.energy(state)});
            if (on_step) on_step(found.load_steps.back(), state);
            if (load >= goal) {
                ++step;
                divided = 0;
            }
        }
        found.multipliers.assign(lambda.begin(), lambda.end());
        found.smallest_eigenvalue = relaxation_.smallest_eigenvalue(found.state, lambda);
        return found;
    }

private:
    static constexpr int most_divided = 5;

    MultibodySystem& mechanics_;
    EquilibriumRule rule_;
    StepSolver solver_;
    Relaxation relaxation_;
    UnilateralRows rows_;
};

}  // namespace

Equilibrium find_equilibrium(SceneSystem& system, const Registry& registry, const LoadStepHook& on_step,
                             const std::function<bool()>& cancelled) {
    const auto here = [&](const Error& error) { return fmt::format("system \"{}\": {}", system.name, error.what()); };
    try {
        system.system->assemble();
        return Search(system, registry, cancelled).run(on_step);
    } catch (const InputError& error) {
        throw InputError(here(error));
    } catch (const Unsupported& error) {
        throw Unsupported(here(error));
    } catch (const StepFailure& error) {
        throw StepFailure(here(error));
    }
}

}  // namespace delassus
