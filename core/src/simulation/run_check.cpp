// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/run_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/timestepper.hpp"
#include "simulation/run_loop.hpp"

namespace delassus {
namespace {

constexpr std::size_t most_numbers = 20'000'000;
constexpr double rounding = 1e-13;

double distance(const Vector3& a, const Vector3& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// The angle of the turn from one unit quaternion to another, exact for small ones.
double angle_between(const Quaternion& a, const Quaternion& b) {
    const double w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    const double x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2];
    const double y = a[0] * b[2] - a[2] * b[0] - a[3] * b[1] + a[1] * b[3];
    const double z = a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1];
    return 2.0 * std::atan2(std::hypot(x, y, z), std::abs(w));
}

Track::Frame frame_of(const Simulation& simulation) {
    const MultibodySystem& system = *simulation.system().system;
    const State& state = simulation.state();
    Track::Frame frame{state.t, {}, {}};
    for (BodyIndex body = 0; body < system.body_count(); ++body) frame.poses.push_back(system.pose(state, body));
    for (std::int32_t node = 0; node < system.node_count(); ++node)
        frame.nodes.push_back(system.node_position(state, node));
    return frame;
}

/// The largest distances of two frames.
struct Apart {
    double position = 0.0, rotation = 0.0;  // m, rad
    double share = 0.0;                     // the larger of both, positions by the extent
    std::string farthest;
};

Apart apart(const Track::Frame& one, const Track::Frame& other, double extent, const SceneSystem& system) {
    Apart result;
    // The comparisons are such that what is not finite counts.
    const auto note = [&](double position, double rotation, const auto& name) {
        if (!(position <= result.position)) result.position = position;
        if (!(rotation <= result.rotation)) result.rotation = rotation;
        const double share = std::max(extent > 0.0 ? position / extent : 0.0, rotation);
        if (share <= result.share) return;
        result.share = share;
        result.farthest = name();
    };
    for (std::size_t i = 0; i < one.poses.size(); ++i)
        note(distance(one.poses[i].position, other.poses[i].position),
             angle_between(one.poses[i].orientation, other.poses[i].orientation),
             [&] { return i < system.bodies.size() ? system.bodies[i].name : fmt::format("body {}", i); });
    for (std::size_t i = 0; i < one.nodes.size(); ++i)
        note(distance(one.nodes[i], other.nodes[i]), 0.0, [&] { return fmt::format("node {}", i); });
    return result;
}

/// By what the error of the refined run is smaller.
double error_factor(const Simulation& refined) {
    const SceneSystem& system = refined.system();
    const bool limited = system.integrator_options.contains("error_limit");
    if (system.control || system.steps_by_accuracy() || limited || refined.totals().most_contacts > 0) return 2.0;
    int order = 1;
    for (const TimestepperInfo& info : timesteppers())
        if (info.name == refined.method().integrator) order = info.order;
    return std::exp2(order);
}

/// Compares the states of a refined run with the first run's where their times meet.
class Comparison {
public:
    Comparison(const Simulation& first, const Track& track) : frames_(track.frames()) {
        check_.extent = track.extent();
        check_.accuracy = first.system().accuracy;
        check_.first_seconds = first.totals().seconds;
    }

    void add(const Simulation& refined) {
        const double t = refined.state().t, near = 1e-3 * refined.record().h;
        while (next_ + 1 < frames_.size() && frames_[next_].t < t - near) ++next_;
        if (next_ >= frames_.size() || std::abs(frames_[next_].t - t) > near) return;
        const Apart now = apart(frames_[next_++], frame_of(refined), check_.extent, refined.system());
        ++met_;
        if (!(now.share <= check_.on_the_way)) check_.on_the_way = now.share;
        if (!(now.share > check_.accuracy)) {
            check_.apart_from.reset();
        } else if (!check_.apart_from) {
            check_.apart_from = t;
        }
        if (!refined.finished()) return;
        check_.position = now.position;
        check_.rotation = now.rotation;
        if (!(now.share <= rounding)) check_.farthest = now.farthest;
        check_.factor = error_factor(refined);
        check_.error = now.share * check_.factor / (check_.factor - 1.0);
    }

    RunCheck result(const Simulation& refined) {
        // Steps of two sizes that meet at the end alone tell nothing of when they parted.
        if (met_ < 2) check_.apart_from.reset();
        check_.second_seconds = refined.totals().seconds;
        return check_;
    }

private:
    const std::vector<Track::Frame>& frames_;
    RunCheck check_;
    std::size_t next_ = 1, met_ = 0;
};

}  // namespace

Track::Track(const Simulation& simulation) {
    for (const BodyParameters& body : simulation.system().bodies) {
        if (body.fixed || body.motion || !(body.mass > 0.0)) continue;
        gyration_ = std::max(gyration_, radius_of_gyration(body));
    }
    add(simulation);
}

void Track::add(const Simulation& simulation) {
    const bool kept = seen_++ % every_ == 0 || simulation.finished();
    if (!kept) return;
    frames_.push_back(frame_of(simulation));
    const Frame& frame = frames_.back();
    const auto& bodies = simulation.system().bodies;
    for (std::size_t i = 0; i < frame.poses.size(); ++i)
        if (i >= bodies.size() || !(bodies[i].fixed || bodies[i].motion)) places_.widen(frame.poses[i].position);
    for (const Vector3& place : frame.nodes) places_.widen(place);
    if (frames_.size() * (7 * frame.poses.size() + 3 * frame.nodes.size()) <= most_numbers) return;
    std::size_t count = 0;
    for (std::size_t i = 0; i < frames_.size(); i += 2) std::swap(frames_[count++], frames_[i]);
    frames_.resize(count);
    every_ *= 2;
}

double Track::extent() const {
    return std::max(places_.half_diagonal(), gyration_);
}

void halve_errors(SceneSystem& system) {
    system.step *= 0.5;
    system.accuracy *= 0.5;
    if (system.control) {
        system.control->absolute *= 0.5;
        system.control->relative *= 0.5;
    }
    constexpr auto key = "error_limit";
    std::string limit = "inf";
    for (const TimestepperInfo& info : timesteppers())
        for (const OptionInfo& option : info.options)
            if (info.name == system.integrator && option.key == key) limit = option.default_value;
    if (const auto given = system.integrator_options.find(key); given != system.integrator_options.end())
        limit = given->second;
    system.integrator_options.erase(key);
    if (const double value = std::stod(limit); std::isfinite(value))
        system.integrator_options[key] = fmt::format("{}", 0.5 * value);
}

double RunCheck::seconds_for(double smaller) const {
    const double growth = std::clamp(second_seconds / first_seconds, 1.0, 8.0);
    return first_seconds * std::pow(growth, std::log(smaller) / std::log(factor));
}

std::vector<RunCheck> check_runs(const std::vector<Simulation>& first, const std::vector<Track>& tracks,
                                 std::vector<Simulation>& refined, const std::function<bool()>& interrupted) {
    std::vector<Comparison> comparisons;
    for (std::size_t i = 0; i < first.size(); ++i) comparisons.emplace_back(first[i], tracks[i]);
    const auto stepped = [&](std::size_t system) { comparisons[system].add(refined[system]); };
    const RunResult result = run_to_end(refined, {stepped, interrupted});
    std::vector<RunCheck> checks;
    if (result.status == RunStatus::Interrupted) return checks;
    for (std::size_t i = 0; i < first.size(); ++i) {
        checks.push_back(comparisons[i].result(refined[i]));
        if (!refined[i].finished()) checks.back().failure = result.message;
    }
    return checks;
}

}  // namespace delassus
