// SPDX-License-Identifier: BSD-3-Clause
#include "bench/scene_worker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "delassus/simulation.hpp"
#include "problem/structure.hpp"
#include "process/supervision.hpp"
#include "simulation/plan_json.hpp"
#include "simulation/run_loop.hpp"
#include "support/atomic_file.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

Registry registry_of(const Json& request) {
    std::vector<fs::path> folders;
    for (const auto& folder : request.at("plugin_path")) folders.emplace_back(folder.get<std::string>());
    return Registry(folders);
}

SceneOverrides overrides_of(const Json& request) {
    SceneOverrides overrides;
    for (const auto& [path, value] : request.at("settings").items())
        overrides.values.emplace_back(path, value.get<std::string>());
    overrides.solver = request.value("solver", std::string());
    overrides.integrator = request.value("timestepper", std::string());
    if (request.value("step", 0.0) > 0.0) overrides.step = request.at("step").get<double>();
    if (request.value("end", -1.0) >= 0.0) overrides.end = request.at("end").get<double>();
    if (request.value("forced", false)) overrides.leave_out = false;
    return overrides;
}

/// ‖δ‖_M² with the mass at a state; δ: n.
double mass_norm_squared(const DynamicalSystem& system, const State& at, const std::vector<double>& delta) {
    std::vector<double> product(delta.size());
    system.multiply_mass(at, 1.0, delta.data(), product.data());
    double sum = 0.0;
    for (std::size_t i = 0; i < delta.size(); ++i) sum += delta[i] * product[i];
    return std::max(sum, 0.0);
}

/// Largest displacement from the start and largest velocity of a run in the mass norm: what errors are relative to.
struct Extent {
    double displacement = 0.0, speed = 0.0;  // squared while the systems are added up
};

/// The worst over all steps and systems; what bounds are set on.
struct Watch {
    double energy_growth = 0.0, energy_loss = 0.0;  ///< J, against the start
    double momentum = 0.0, angular_momentum = 0.0;  ///< ‖change‖ since the start
    double speed = 0.0;                             ///< largest entry of |v|
    double end_speed = 0.0;                         ///< the same at the end
    /// Largest entry of the difference between the start and the end of the run back, with velocities reversed at the
    /// end; NaN: not asked for.
    double reversal = std::numeric_limits<double>::quiet_NaN();

    /// A NaN is kept.
    static void raise(double& worst, double value) {
        if (std::isnan(value) || value > worst) worst = value;
    }
    void look(const StepRecord& start, const Simulation& simulation) {
        const StepRecord& now = simulation.record();
        const auto change = [](const Vector3& from, const Vector3& to) {
            return std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        };
        raise(energy_growth, now.energy - start.energy);
        raise(energy_loss, start.energy - now.energy);
        raise(momentum, change(start.momentum, now.momentum));
        raise(angular_momentum, change(start.angular_momentum, now.angular_momentum));
        double largest = 0.0;
        for (const double entry : simulation.state().v) raise(largest, std::abs(entry));
        raise(speed, largest);
        if (simulation.finished()) raise(end_speed, largest);
    }
};

struct Run {
    std::string status = "finished", message;
    double setup = 0.0, seconds = 0.0;
    Extent extent;
    Watch watch;
};

std::string status_of(RunStatus status) {
    switch (status) {
        case RunStatus::Finished:
            return "finished";
        case RunStatus::Unsolved:
            return "unsolved";
        case RunStatus::Interrupted:
            return "cancelled";
        case RunStatus::TimeLimit:
            return "time_limit";
        case RunStatus::Failed:
        case RunStatus::Unsupported:
            break;
    }
    return "failed";
}

class SceneRun {
public:
    /// registry outlives it.
    SceneRun(Scene scene, const Registry& registry, double time_limit) : scene_(std::move(scene)), registry_(registry) {
        const auto begin = Clock::now();
        simulations_.reserve(scene_.systems.size());
        for (auto& system : scene_.systems) simulations_.emplace_back(system, registry);
        run_.setup = std::chrono::duration<double>(Clock::now() - begin).count();
        time_limit_ = time_limit;
    }

    /// extent, watch: whether to measure them too, while the clock stands still. reverse: whether to measure
    /// Watch::reversal.
    Run run(bool extent, bool watch, bool reverse) {
        std::vector<State> start;
        std::vector<StepRecord> records;
        for (const auto& simulation : simulations_) {
            start.push_back(simulation.state());
            records.push_back(simulation.record());
        }
        std::vector<Extent> extents(simulations_.size());
        const auto look = [&](std::size_t i) {
            if (extent) widen(extents[i], i, start[i]);
            if (watch) run_.watch.look(records[i], simulations_[i]);
        };
        const RunResult result = run_to_end(simulations_, {look, interrupted, time_limit_});
        if (result.status == RunStatus::Unsupported) throw Unsupported(result.message);
        run_.status = status_of(result.status);
        run_.message = result.status == RunStatus::TimeLimit || result.status == RunStatus::Interrupted
                           ? fmt::format("had come to t = {:.6g} s", reached_time(simulations_))
                           : result.message;
        run_.seconds = result.step_seconds;
        if ((result.status == RunStatus::Finished || result.status == RunStatus::Unsolved) && reverse) go_back(start);
        for (const Extent& own : extents) {
            run_.extent.displacement += own.displacement;
            run_.extent.speed += own.speed;
        }
        run_.extent = {std::sqrt(run_.extent.displacement), std::sqrt(run_.extent.speed)};
        return run_;
    }

    /// Place of the mass centre of a body of the first system that has it, m. Throws InputError if none has.
    [[nodiscard]] Vector3 place(const std::string& body) const {
        for (std::size_t i = 0; i < simulations_.size(); ++i) {
            const MultibodySystem& system = *scene_.systems[i].system;
            if (const BodyIndex index = system.find_body(body); index != world_body)
                return system.pose(simulations_[i].state(), index).position;
        }
        throw InputError(fmt::format("the scene has no body \"{}\"", body));
    }

    [[nodiscard]] const std::vector<Simulation>& simulations() const { return simulations_; }

    /// Has run() look for the largest number of rows of a problem.
    void count_rows() {
        for (auto& simulation : simulations_)
            simulation.solver().watch([this](const Problem& problem) { rows_ = std::max(rows_, problem.m()); });
    }
    [[nodiscard]] std::int32_t rows() const { return rows_; }

    /// The systems' states at the end, with the extents.
    [[nodiscard]] Json state() const {
        Json systems = Json::array();
        for (const auto& simulation : simulations_)
            systems.push_back({{"q", simulation.state().q}, {"v", simulation.state().v}});
        return {{"displacement", run_.extent.displacement}, {"speed", run_.extent.speed}, {"systems", systems}};
    }

    /// Distance of the end from the reference's in positions and velocities, in the mass norm, relative to the
    /// reference's extents.
    [[nodiscard]] Json error(const Json& reference) const {
        double position = 0.0, velocity = 0.0;
        for (std::size_t i = 0; i < simulations_.size(); ++i) {
            const MultibodySystem& system = *scene_.systems[i].system;
            State best;
            best.t = simulations_[i].state().t;
            best.q = reference.at("systems").at(i).at("q").get<std::vector<double>>();
            best.v = reference.at("systems").at(i).at("v").get<std::vector<double>>();
            std::vector<double> delta(best.v.size());
            system.difference(best.q.data(), simulations_[i].state().q.data(), delta.data());
            position += mass_norm_squared(system, best, delta);
            for (std::size_t k = 0; k < delta.size(); ++k) delta[k] = simulations_[i].state().v[k] - best.v[k];
            velocity += mass_norm_squared(system, best, delta);
        }
        const auto relative = [](double squared, double extent) {
            return json_number(extent > 0.0 ? std::sqrt(squared) / extent : std::sqrt(squared));
        };
        return {{"position", relative(position, reference.at("displacement").get<double>())},
                {"velocity", relative(velocity, reference.at("speed").get<double>())}};
    }

private:
    void widen(Extent& extent, std::size_t index, const State& start) const {
        const MultibodySystem& system = *scene_.systems[index].system;
        const State& now = simulations_[index].state();
        std::vector<double> delta(now.v.size());
        system.difference(start.q.data(), now.q.data(), delta.data());
        extent.displacement = std::max(extent.displacement, mass_norm_squared(system, now, delta));
        extent.speed = std::max(extent.speed, mass_norm_squared(system, now, now.v));
    }

    /// Runs as long again from the end with all velocities reversed. Without damping, and without forces that depend on
    /// time or velocity, this leads back to the start.
    void go_back(const std::vector<State>& start) {
        run_.watch.reversal = 0.0;
        for (std::size_t i = 0; i < simulations_.size(); ++i) {
            std::vector<Simulation> back;
            back.emplace_back(scene_.systems[i], registry_);
            SimulationState turned = back[0].save();
            turned.state.q = simulations_[i].state().q;
            turned.state.v = simulations_[i].state().v;
            for (double& entry : turned.state.v) entry = -entry;
            back[0].load(std::move(turned));
            const RunResult result = run_to_end(back, {});
            if (result.status == RunStatus::Unsupported) throw Unsupported(result.message);
            if (result.status == RunStatus::Failed) {
                run_.status = "failed";
                run_.message = "on the way back, " + result.message;
                return;
            }
            std::vector<double> delta(start[i].v.size());
            scene_.systems[i].system->difference(start[i].q.data(), back[0].state().q.data(), delta.data());
            for (const double entry : delta) Watch::raise(run_.watch.reversal, std::abs(entry));
        }
    }

    Scene scene_;
    const Registry& registry_;
    std::vector<Simulation> simulations_;
    Run run_;
    double time_limit_ = 0.0;
    std::int32_t rows_ = 0;
};

/// Sums and extremes over the systems.
Json totals_of(const std::vector<Simulation>& simulations) {
    std::int64_t steps = 0, newton = 0, iterations = 0, unsolved = 0, contacts = 0;
    double start = 0.0, end = 0.0, drift = 0.0, penetration = 0.0, natural = 0.0, solver_seconds = 0.0;
    for (const auto& simulation : simulations) {
        const SimulationTotals& totals = simulation.totals();
        steps += simulation.record().step;
        newton += totals.newton_iterations;
        iterations += totals.solver_iterations;
        unsolved += totals.unsolved_steps;
        contacts = std::max(contacts, totals.most_contacts);
        start += totals.start_energy;
        end += totals.energy;
        drift = std::max(drift, totals.worst_drift);
        penetration = std::max(penetration, totals.worst_penetration);
        natural = std::max(natural, totals.worst_natural);
        solver_seconds += totals.solver_seconds;
    }
    return {{"steps", steps},
            {"newton_iterations", newton},
            {"solver_iterations", iterations},
            {"unsolved_steps", unsolved},
            {"most_contacts", contacts},
            {"energy", {json_number(start), json_number(end)}},
            {"drift", json_number(drift)},
            {"penetration", json_number(penetration)},
            {"natural", json_number(natural)},
            {"solver_seconds", solver_seconds}};
}

/// The measures of scenes; totals: those of the run.
Json watched(const Watch& watch, const Json& totals) {
    return {{"energy_growth", json_number(watch.energy_growth)},
            {"energy_loss", json_number(watch.energy_loss)},
            {"momentum", json_number(watch.momentum)},
            {"angular_momentum", json_number(watch.angular_momentum)},
            {"speed", json_number(watch.speed)},
            {"end_speed", json_number(watch.end_speed)},
            {"drift", totals.at("drift")},
            {"penetration", totals.at("penetration")},
            {"natural", totals.at("natural")},
            {"reversal", json_number(watch.reversal)}};
}

}  // namespace

void send_plan(const Channel& channel, const Json& request) {
    const fs::path file = request.at("scene").get<std::string>();
    Scene scene = read_scene(file, overrides_of(request));
    Hash hash;
    hash.add(std::vector<char>(scene.canonical.begin(), scene.canonical.end()));
    double end = 0.0;
    for (const auto& system : scene.systems) end = std::max(end, system.end);
    const Json facts = {{"hash", fmt::format("{:016x}", hash.value())},
                        {"title", scene.title},
                        {"step", scene.systems.front().step},
                        {"integrator", scene.systems.front().integrator},
                        {"end", end}};
    channel.send("scene", facts);
    const Registry registry = registry_of(request);
    channel.send("plan", parse_ordered_json(plan_json(file.filename().string(), make_plan(scene, registry))));
}

void simulate(const Channel& channel, const Json& request) {
    const fs::path file = request.at("scene").get<std::string>();
    const double time_limit = request.at("time_limit");
    const Registry registry = registry_of(request);
    const auto prepare = [&] {
        Scene scene = read_scene(file, overrides_of(request));
        // A solve longer than the whole run may last is ended, so that the run can say where it was.
        for (auto& system : scene.systems)
            if (!system.solver.time_limit) system.solver.time_limit = time_limit;
        channel.send("begin");
        return SceneRun(std::move(scene), registry, time_limit);
    };
    const auto state_file = request.at("state").get<std::string>();
    try {
        SceneRun first = prepare();
        const auto body = request.at("body").get<std::string>();
        if (!body.empty()) static_cast<void>(first.place(body));
        first.count_rows();
        const Run run =
            first.run(!state_file.empty(), request.at("watch").get<bool>(), request.at("reverse").get<bool>());
        Json answer = totals_of(first.simulations());
        answer["most_rows"] = first.rows();
        answer["status"] = run.status;
        answer["message"] = run.message;
        answer["setup"] = run.setup;
        answer["seconds"] = run.seconds;
        answer["watched"] = watched(run.watch, answer);
        if (!body.empty()) answer["watched"]["place"] = first.place(body);
        const bool complete = run.status == "finished" || run.status == "unsolved";
        if (complete && !state_file.empty()) write_file_atomically(state_file, json_text(first.state()));
        if (const auto reference = request.at("reference").get<std::string>(); complete && !reference.empty())
            answer["error"] = first.error(parse_ordered_json(read_file(reference)));
        channel.send("recorded", answer);
        if (!complete) return;
        for (int k = 0; k < request.at("repeats").get<int>() && !interrupted(); ++k) {
            SceneRun again = prepare();
            const Run repeated = again.run(false, false, false);
            channel.send("repeat", {{"setup", repeated.setup}, {"seconds", repeated.seconds}});
        }
    } catch (const Unsupported& refusal) {
        channel.send("refused", {{"message", refusal.what()}});
    }
}

}  // namespace delassus::bench
