// SPDX-License-Identifier: BSD-3-Clause
#include "relations/motion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <optional>

#include "delassus/error.hpp"
#include "delassus/simulation.hpp"
#include "simulation/checkpoint.hpp"

namespace delassus::relations {
namespace {

using Clock = std::chrono::steady_clock;

class TimeIsOver {};

/// A simulation of the scene's only system.
struct Running {
    Scene scene;
    Simulation simulation;

    Running(const std::string& text, const Registry& registry)
        : scene(parse_scene(text, "scene")), simulation(scene.systems.at(0), registry) {}
};

double error_limit_of(const SceneSystem& system) {
    for (const auto& [key, value] : system.integrator_options)
        if (key == "error_limit") return std::strtod(value.c_str(), nullptr);
    // The default of the only method that has one without being told.
    return system.integrator == "switching" ? 1e-4 : 0.0;
}

void describe(const SceneSystem& scene, Motion& motion) {
    motion.integrator = scene.integrator;
    motion.coordinates = scene.coordinates == Coordinates::Joint ? "joint" : "maximal";
    motion.error_limit = error_limit_of(scene);
    motion.divides = scene.division != StepDivision::None;
    motion.driven = !scene.motors.empty() || !scene.actuators.empty() || !scene.loads.empty();
    const auto& gravity = scene.system->gravity();
    const double fall = scene.step * std::hypot(gravity[0], gravity[1], gravity[2]);
    for (const auto& body : scene.bodies) {
        motion.driven = motion.driven || body.motion.has_value();
        if (body.fixed || body.motion) continue;
        motion.bodies.push_back(body.name);
        const auto& J = body.inertia;
        motion.masses[body.name] = {body.mass, {J.xx, J.yy, J.zz, J.xy, J.xz, J.yz}};
        // A step cannot tell from rest what gravity does in two of them, nor the last digits of a position
        // (docs/running.md).
        const auto& position = body.pose.position;
        const double digits = 1e-10 * std::hypot(position[0], position[1], position[2]) / scene.step;
        motion.energy_rounding += body.mass * (2.0 * fall * fall + digits * digits);
    }
}

/// Notes the state after a step.
class Notes {
public:
    Notes(const SceneSystem& scene, Motion& motion) : motion_(motion) {
        for (const auto& name : motion.bodies) bodies_.push_back(scene.system->find_body(name));
    }

    void add(const Simulation& simulation) {
        const StepRecord& record = simulation.record();
        const MultibodySystem& system = *simulation.system().system;
        std::vector<double> poses;
        for (const BodyIndex body : bodies_) {
            const Pose pose = system.pose(simulation.state(), body);
            poses.insert(poses.end(), pose.position.begin(), pose.position.end());
            poses.insert(poses.end(), pose.orientation.begin(), pose.orientation.end());
        }
        motion_.finite = motion_.finite && std::isfinite(record.energy) &&
                         std::all_of(poses.begin(), poses.end(), [](double entry) { return std::isfinite(entry); });
        motion_.t.push_back(record.t);
        motion_.poses.push_back(std::move(poses));
        motion_.natural.push_back(record.natural);
        motion_.said.push_back((motion_.said.empty() ? 0.0 : motion_.said.back()) + record.error);
        if (motion_.t.size() == 1) {
            start_ = record.energy;
            start_kinetic_ = record.kinetic;
            motion_.energy_rounding += 1e-10 * std::abs(start_);
        }
        const double potential = record.energy - record.kinetic;
        fall_ = std::max(fall_, start_ - start_kinetic_ - potential);
        motion_.growth = std::max(motion_.growth, record.energy - start_);
        motion_.available = start_kinetic_ + fall_;
        motion_.penetration = std::max(motion_.penetration, record.penetration);
        // A record has the contacts that were there where its step began.
        if (motion_.t.size() <= 2) motion_.start_penetration = std::max(motion_.start_penetration, record.penetration);
        motion_.drift = std::max(motion_.drift, record.drift);
        motion_.acted = motion_.acted || record.contacts > 0;
        motion_.solved = motion_.solved && record.solved;
    }

private:
    Motion& motion_;
    std::vector<BodyIndex> bodies_;
    double start_ = 0.0, start_kinetic_ = 0.0, fall_ = 0.0;
};

void go(const std::string& text, const Registry& registry, const RunOrder& order, Motion& motion) {
    const auto deadline = Clock::now() + std::chrono::duration<double>(order.time_limit);
    const auto late = [deadline] { return Clock::now() > deadline; };
    std::optional<Running> running(std::in_place, text, registry);
    describe(running->scene.systems[0], motion);
    motion.began = true;
    Notes notes(running->scene.systems[0], motion);
    running->simulation.solver().interrupt_by(late);
    notes.add(running->simulation);
    const double middle = 0.5 * running->scene.systems[0].end;
    bool whole = order.checkpoint.empty();
    while (!running->simulation.finished()) {
        if (late()) throw TimeIsOver();
        running->simulation.step();
        notes.add(running->simulation);
        if (whole || running->simulation.record().t < middle || running->simulation.finished()) continue;
        whole = true;
        const auto file = order.checkpoint / "checkpoint.json";
        write_checkpoint({running->scene.canonical, {{"main", running->simulation.save(), {}}}}, file);
        running.emplace(text, registry);
        running->simulation.load(read_checkpoint(file).systems.at(0).simulation);
        running->simulation.solver().interrupt_by(late);
    }
    motion.warnings = running->simulation.warnings();
    const auto& totals = running->simulation.totals();
    motion.inexact = totals.inexact_steps > 0;
    motion.parts = static_cast<double>(motion.t.size() - 1) +
                   static_cast<double>(totals.divided_steps) * static_cast<double>(totals.most_substeps);
    motion.rows_left_out = !running->simulation.save().rows_left_out.empty();
}

}  // namespace

Motion run(const Json& scene, const Registry& registry, const RunOrder& order) {
    Motion motion;
    const auto refused = [&](End end, const char* message) {
        motion.end = end;
        motion.message = message;
    };
    try {
        go(scene_yaml(scene), registry, order, motion);
    } catch (const TimeIsOver&) {
        refused(End::TooLong, "");
    } catch (const StepInterrupted&) {
        refused(End::TooLong, "");
    } catch (const InputError& error) {
        refused(End::Refused, error.what());
    } catch (const Unsupported& error) {
        refused(End::Refused, error.what());
    } catch (const StepFailure& error) {
        refused(End::Refused, error.what());
    } catch (const std::exception& error) {
        refused(End::Broken, error.what());
    }
    return motion;
}

}  // namespace delassus::relations
