// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "dynamics/path_follower.hpp"
#include "dynamics/relaxation.hpp"
#include "support/pivoted_qr.hpp"

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
        solver_.interrupt_by(cancelled);
        if (!system.leave_out) solver_.leave_nothing_out();
        for (const BodyParameters& body : system.bodies)
            if (body.massless)
                throw Unsupported(fmt::format(
                    "the search for an equilibrium moves bodies by their masses, and the body \"{}\" has none; give it "
                    "a small mass and inertia",
                    body.name));
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
        found.largest_force = largest_entry(loads);
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
        finish(found, lambda);
        return found;
    }

    EquilibriumPath follow(const PathRule& wanted, const PathHook& on_point) {
        EquilibriumPath found;
        found.end.state = mechanics_.initial_state();
        require_rest(mechanics_, found.end.state);
        require_nothing_touches(mechanics_, found.end.state, rows_, 0.0);
        LoadPath path(mechanics_, [this](double factor) { mechanics_.set_load_factor(factor); },
                      {.tolerance = rule_.tolerance});
        const State unloaded = found.end.state;
        LoadPathPoint start = begin_of(path, found.end);
        PathFollower follower(path, {.first_step = 1.0 / rule_.load_steps, .most_points = wanted.most_points});
        follower.goal = goal_of(wanted, unloaded);
        double farthest = 1.0;
        for (const double q : start.state.q) farthest = std::max(farthest, std::abs(q));
        farthest *= 1e6;
        follower.on_point = [&](const LoadPathPoint& point, PathEvent event) {
            if (solver_.interrupted()) throw StepInterrupted("the search was interrupted");
            mechanics_.set_load_factor(point.load);
            require_nothing_touches(mechanics_, point.state, rows_, point.load);
            if (std::any_of(point.state.q.begin(), point.state.q.end(),
                            [&](double q) { return std::abs(q) > farthest; }))
                throw StepFailure(
                    fmt::format("on the path of equilibria something moves away without bound, at {:.4g} of the loads",
                                point.load));
            found.points.push_back(described(point, event, unloaded));
            const PathPoint& last = found.points.back();
            found.end.load_steps.push_back({last.load, 1, last.newton_iterations, last.residual, last.energy});
            found.end.largest_force = std::max(found.end.largest_force, point.reaction);
            if (on_point) on_point(last, point.state);
        };
        LoadPathPoint end;
        const PathStop stop = follower.follow(start, end);
        mechanics_.set_load_factor(end.load);
        found.end.state = end.state;
        finish(found.end, end.lambda);
        found.complete = stop == PathStop::Goal;
        if (stop == PathStop::Points)
            found.ending = fmt::format(
                "the path has {} points, and the load factor is {:.6g} at the last; more points may lead to the goal",
                wanted.most_points, end.load);
        if (stop == PathStop::Stuck)
            found.ending = fmt::format(
                "the path could not be followed beyond the load factor {:.6g} (arc length {:.4g}): Newton's method "
                "leads to no further point, however near; a cable that goes slack, or the end of what the model can "
                "do, may be there",
                end.load, end.arc);
        return found;
    }

private:
    static constexpr int most_divided = 5;

    void finish(Equilibrium& found, const Vector& lambda) {
        found.multipliers.assign(lambda.begin(), lambda.end());
        found.smallest_eigenvalue = relaxation_.smallest_eigenvalue(found.state, lambda);
    }

    /// The equilibrium without loads; where the loads move something that nothing holds yet, that under a small part.
    LoadPathPoint begin_of(LoadPath& path, Equilibrium& found) {
        Vector loads = Vector::Zero(mechanics_.n());
        mechanics_.set_load_factor(1.0);
        mechanics_.add_force(found.state, 1.0, loads.data());
        found.largest_force = largest_entry(loads);
        LoadPathPoint start;
        start.lambda = Vector::Zero(mechanics_.m());
        start.state = found.state;
        int divided = 0;
        for (double part = 0.0;;) {
            mechanics_.set_load_factor(part);
            try {
                relaxation_.run(start.state, start.lambda, solver_);
            } catch (const StepFailure& error) {
                if (part == 0.0 || ++divided > most_divided)
                    throw StepFailure(fmt::format("under {:.4g} of the loads {}", part, error.what()));
                part *= 0.5;
                continue;
            }
            start.load = part;
            if (path.begin(start)) return start;
            if (part > 0.0) break;
            part = 1.0 / rule_.load_steps;
        }
        throw StepFailure("the path of equilibria has no beginning: the loads move something that nothing holds");
    }

    std::function<double(const LoadPathPoint&)> goal_of(const PathRule& wanted, const State& start) {
        if (!wanted.displacement) return [load = wanted.load](const LoadPathPoint& at) { return at.load - load; };
        const PathDisplacement& aim = *wanted.displacement;
        const auto axis = static_cast<std::size_t>(aim.axis);
        const auto place = [this, aim, axis](const State& state) {
            return aim.node >= 0 ? mechanics_.node_position(state, aim.node)[axis]
                                 : mechanics_.pose(state, aim.body).position[axis];
        };
        return [place, aim, from = place(start)](const LoadPathPoint& at) {
            return (place(at.state) - from) / aim.value - 1.0;
        };
    }

    PathPoint described(const LoadPathPoint& point, PathEvent event, const State& start) const {
        double square = 0.0;
        const auto count = [&](const Vector3& now, const Vector3& before) {
            double sum = 0.0;
            for (std::size_t i = 0; i < 3; ++i) sum += (now[i] - before[i]) * (now[i] - before[i]);
            square = std::max(square, sum);
        };
        for (BodyIndex i = 0; i < mechanics_.body_count(); ++i)
            count(mechanics_.pose(point.state, i).position, mechanics_.pose(start, i).position);
        for (std::int32_t i = 0; i < mechanics_.node_count(); ++i)
            count(mechanics_.node_position(point.state, i), mechanics_.node_position(start, i));
        return {.load = point.load,
                .arc = point.arc,
                .displacement = std::sqrt(square),
                .energy = mechanics_.energy(point.state),
                .negative_eigenvalues = point.negative,
                .newton_iterations = point.newton_iterations,
                .residual = point.residual,
                .mark = event == PathEvent::Limit         ? PathMark::Limit
                        : event == PathEvent::Bifurcation ? PathMark::Bifurcation
                                                          : PathMark::None};
    }

    MultibodySystem& mechanics_;
    EquilibriumRule rule_;
    StepSolver solver_;
    Relaxation relaxation_;
    UnilateralRows rows_;
};

/// What search(…) returns, with the name of the system in what it throws.
template <class Work>
auto of_system(SceneSystem& system, Work&& work) {
    const auto here = [&](const Error& error) { return fmt::format("system \"{}\": {}", system.name, error.what()); };
    try {
        system.system->assemble();
        return work();
    } catch (const InputError& error) {
        throw InputError(here(error));
    } catch (const Unsupported& error) {
        throw Unsupported(here(error));
    } catch (const StepFailure& error) {
        throw StepFailure(here(error));
    }
}

}  // namespace

Equilibrium find_equilibrium(SceneSystem& system, const Registry& registry, const LoadStepHook& on_step,
                             const std::function<bool()>& cancelled) {
    return of_system(system, [&] {
        Search search(system, registry, cancelled);
        if (!system.equilibrium || system.equilibrium->method == EquilibriumMethod::LoadSteps)
            return search.run(on_step);
        EquilibriumPath path = search.follow({}, [&](const PathPoint& point, const State& state) {
            if (on_step) on_step({point.load, 1, point.newton_iterations, point.residual, point.energy}, state);
        });
        if (!path.complete) throw StepFailure(path.ending);
        return std::move(path.end);
    });
}

EquilibriumPath follow_equilibria(SceneSystem& system, const Registry& registry, const PathRule& rule,
                                  const PathHook& on_point, const std::function<bool()>& cancelled) {
    if (!(rule.load > 0.0) || !std::isfinite(rule.load))
        throw InputError(fmt::format("the path's last load factor is {}; it must be positive and finite", rule.load));
    if (rule.most_points < 1)
        throw InputError(fmt::format("the path is to have {} points; it must have at least one", rule.most_points));
    if (rule.displacement && (rule.displacement->value == 0.0 || !std::isfinite(rule.displacement->value)))
        throw InputError("the displacement at which the path ends must be finite and not 0");
    return of_system(system, [&] { return Search(system, registry, cancelled).follow(rule, on_point); });
}

}  // namespace delassus
