// SPDX-License-Identifier: BSD-3-Clause
#include "relations/relations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "relations/difference.hpp"
#include "relations/motion.hpp"
#include "relations/refused_run.hpp"
#include "relations/transform.hpp"

namespace delassus::relations {
namespace {

// How far apart may two runs be that are the same in truth?
//
// Let d(A, B)(t) be the distance of two motions up to t: of positions as a share of the size of what moves, of
// orientations in radians. A motion answers a disturbance δ of its start by G(t) δ, at least as long as both are small.
// G is measured: P is the scene with positions, orientations and velocities moved at random by the share δ = 1e-10, and
// d(A, P) = G δ. What the method itself makes of an arbitrarily small change (another branch of a step control, say) is
// in d(A, P) as well. P is one direction of many, and the method's branches are a matter of chance: two directions are
// tried, the larger answer counts, and everything that follows is allowed ten times. From where d(A, P) exceeds 1e-6,
// that is G > 1e4, nothing is said: the motion is chaotic, or the method is.
//
// *The same problem, described otherwise* (placed, mirrored, units, order). What differs is rounding, ε ≈ 1e-16 of what
// enters, with a new error in each step; a million times smaller than δ. And a solver goes another way to its
// tolerance: a natural error η_k of step k is an error of the velocities of about η_k times those that reactions
// correct (docs/tolerance.md), at speeds of about size/T for a motion of the length T. Both runs say their η_k. So
//
//     d(A, B)/10 ≤ d(A, P) + G Σ (η_k of A + η_k of B) + G R.
//
// R is there where contacts act, since their gaps have a resolution ρ, 1e-9 of the size and 20 η g h² with the largest
// η (docs/tolerance.md): on which side of it a gap is, is chance. That is a velocity of ρ/h in each step j of k, which
// lasts: R = Σ (k − j + 1) ρ = k (k + 1) ρ/2.
//
// A method that divides its steps by a limit of errors compares it with lengths along the axes and with angles. In
// other units, or turned, it divides them otherwise. Each run is then to be right to the accuracy of 1e-3 a second, and
// 2e-3 t G is added to what is allowed where a scene is placed otherwise, is mirrored or has other units.
//
// *The same motion by another approximation* (coordinates, cut). Each run has an error of its own, e. With fixed steps
// it is measured by half the step, H: e_A is of the size of d(A, H), two times it for order 1, 4/3 for order 2. A
// method with an error limit ℓ in each of N steps is given a small one, 1e-7, and answers for N ℓ G / size. Hence
//
//     d(A, B)/10 ≤ d(A, P) + G Σ (η_k of A + η_k of B) + G R + e_A + e_B,     e = d(A, H) + N ℓ G / size.
//
// *Half the step* (refined), where nothing acts that may begin and end within a step: no contact, no stop, no limit.
// With an error limit, d(A, H) ≤ (N_A + N_H) ℓ G / size. Without one a method of order p ≥ 1 is nearer the truth with a
// quarter of the step, Q, than with half of it: d(H, Q) ≤ d(A, H) + 10 d(A, P), where order p has d(A, H)/2ᵖ.
//
// *Half the step, whatever acts* (told), where fixed steps are divided by their error: each run is right to the
// accuracy of 1e-3 a second, or says by how much it is not, e. That is the error that its steps add, which the motion
// then grows: d(A, H)/10 ≤ d(A, P) + G (2e-3 t + e_A + e_H), up to a tenth. A state may be shown before its step is
// taken again with the one after it: of two states in a row the nearer one counts.
//
// *Another solver.* Both are asked for the natural error τ = 1e-10. Velocities are then known to √τ of those that
// reactions correct where nothing better is known (docs/stability.md, "What a tolerance promises"), in each of N steps
// of h = T/N, at speeds of about size/T: d(A, B)/10 ≤ √τ N G h/T = √τ G.
//
// All is judged as long as what is allowed is below a hundredth: beyond, too little is known.
//
// Joints that contradict one another by less than is noticed: which rows hold is a choice that any change may turn.
// What the others miss by is the drift, which the run reports; it is added where rows were left out.
constexpr double disturbance = 1e-10, chaos = 1e-6, useless = 1e-2, told_useless = 0.1, direction_factor = 10.0;
constexpr double accuracy = 1e-3, small_limit = 1e-7, solver_tolerance = 1e-10;
constexpr double gap_resolution = 1e-9;

// *Sound.* Where nothing supplies energy, more than a thousandth of what can have moved beyond the start's is a motion
// that does not exist; so is a contact deeper than a thousandth of the extent of what moves, twice its size, unless the
// scene begins so.
constexpr double sound_share = 1e-3;

double norm(const Json& vector) {
    return std::hypot(vector[0].get<double>(), vector[1].get<double>(), vector[2].get<double>());
}

struct Judgement {
    Verdict verdict = Verdict::NotJudged;
    std::string detail;
};

/// The scene's integrator and coordinates, named, which no change of the scene then changes; error limits small.
Json with_method(const Json& scene, const Motion& base, double step_factor = 1.0) {
    Json result = scene;
    if (step_factor != 1.0) result["step"] = scene["step"].get<double>() * step_factor;
    result["integrator"] = base.integrator;
    if (base.error_limit > 0.0)
        result["integrator"] = {{"name", base.integrator}, {"options", {{"error_limit", small_limit}}}};
    result["coordinates"] = base.coordinates;
    return result;
}

class Judge {
public:
    Judge(const Json& scene, const Registry& registry, const JudgeOrder& order)
        : scene_(scene), registry_(registry), order_(order), base_(motion(scene)) {
        size_ = size_of(scene, base_);
    }

    Judgement sound() const {
        if (base_.end == End::Broken) return {Verdict::Violated, "an exception: " + base_.message};
        if (base_.end == End::TooLong) return {Verdict::TooLong, ""};
        if (!base_.began) return {};
        if (!base_.finite) return {Verdict::Violated, "a state or an energy is not finite"};
        std::string detail;
        const double moved = std::max(base_.available, base_.energy_rounding);
        if (!base_.driven && base_.growth > sound_share * moved)
            detail = fmt::format("the energy grows by {:.3g} J, {:.2g} of what can have moved", base_.growth,
                                 base_.growth / moved);
        const double deeper = base_.penetration - base_.start_penetration;
        if (deeper > sound_share * 2.0 * size_)
            detail += fmt::format("{}bodies go {:.3g} m into one another, {:.2g} of the size of what moves",
                                  detail.empty() ? "" : "; ", deeper, deeper / size_);
        if (detail.empty()) return {Verdict::Held, ""};
        // A run that ends with a sentence has said it.
        return {spoken(base_) ? Verdict::Reported : Verdict::Violated, detail};
    }

    /// One sentence that names something: a body, a joint or another item, or a line of the scene.
    Judgement refusal() const {
        if (base_.end != End::Refused) return {};
        const std::string& text = base_.message;
        if (text.empty() || text.find('\n') != std::string::npos)
            return {Verdict::Violated, "the refusal is not one sentence: " + text};
        if (text.find("nan") != std::string::npos || text.find("inf ") != std::string::npos)
            return {Verdict::Violated, "the refusal shows a number that is none: " + text};
        if (!names_something(text)) return {Verdict::Violated, "the refusal names nothing of the scene: " + text};
        if (order_.still_alive) order_.still_alive();
        const std::string wrong = wrong_with_refusal(scene_, order_.command, order_.scratch, 2.0 * order_.run_limit);
        return {wrong.empty() ? Verdict::Held : Verdict::Violated, wrong};
    }

    Judgement placed_elsewhere() {
        if (const auto gone = not_known()) return *gone;
        if (!can_be_placed(scene_))
            return {Verdict::NotJudged, "it has motions of several forms, or axes of the world"};
        Described described;
        described.placement = {Eigen::Quaterniond(0.62, 0.31, -0.47, 0.55).normalized(),
                               {2.3 * size_, -1.7 * size_, 0.9 * size_}};
        return same_problem(placed(scene_, described.placement), described, rate_of_limits());
    }
    Judgement mirror_image() {
        if (const auto gone = not_known()) return *gone;
        if (!can_be_mirrored(scene_))
            return {Verdict::NotJudged,
                    "it has motions of several forms, axes of the world, a height field, or a screw's springs"};
        return same_problem(mirrored(scene_), {.units = {}, .placement = {}, .mirrored = true}, rate_of_limits());
    }
    Judgement other_units() {
        if (const auto gone = not_known()) return *gone;
        Described described;
        described.units = {1e3, 1e3, 1e3};  // mm, g, ms
        return same_problem(in_units(scene_, described.units), described, rate_of_limits());
    }
    Judgement other_order() { return same_problem(reordered(scene_, 1), {}, base_.divides ? rate_of_limits() : 0.0); }

    Judgement in_pieces() {
        if (const auto gone = not_comparable(base_)) return *gone;
        RunOrder order{order_.run_limit, order_.scratch};
        const Motion other = motion(scene_, order);
        if (other.end == End::TooLong || base_.end == End::TooLong) return {Verdict::TooLong, ""};
        if (other.end == End::Broken) return {Verdict::Violated, "an exception: " + other.message};
        // The same steps, to the last bit: what a run that goes on promises (docs/running.md).
        const std::size_t count = std::min(base_.poses.size(), other.poses.size());
        for (std::size_t k = 0; k < count; ++k)
            if (base_.poses[k] != other.poses[k])
                return {Verdict::Violated, fmt::format("the run that went on differs from t = {:.6g} s on, by {:.3g}",
                                                       base_.t[k], distances(base_, other, {}, size_)[k])};
        if (other.end != base_.end) return only_one(base_, other);
        return {Verdict::Held, ""};
    }

    Judgement refined() {
        if (const auto gone = not_comparable(named())) return *gone;
        const Motion &whole = named(), &half = refinement();
        if (whole.acted || whole.end != End::Reached) return {};
        if (half.end != End::Reached) return only_one(whole, half);
        if (half.acted) return {};
        auto allowed = sensitivity();
        const auto distance = distances(whole, half, {}, size_, 2);
        if (base_.error_limit > 0.0) {
            const double limits = (whole.parts + half.parts) * small_limit / std::min(size_, 1.0);
            for (double& entry : allowed) entry = limits * growth(entry);
            return verdict(whole, half, judge(whole, distance, allowed, useless));
        }
        const Motion quarter = motion(with_method(scene_, base_, 0.25), {4.0 * order_.run_limit, {}});
        if (quarter.end != End::Reached) return only_one(half, quarter);
        if (quarter.acted) return {};
        const auto coarse = largest_so_far(distance);
        for (std::size_t k = 0; k < std::min(allowed.size(), coarse.size()); ++k)
            allowed[k] = coarse[k] + direction_factor * allowed[k];
        std::vector<double> finer = distances(half, quarter, {}, size_, 2), shown;
        for (std::size_t k = 0; k < finer.size(); k += 2) shown.push_back(finer[k]);
        return verdict(half, quarter, judge(whole, shown, allowed, 1.0));
    }

    Judgement told() {
        if (const auto gone = not_comparable(base_)) return *gone;
        if (!base_.divides || !base_.acted) return {};
        Json scene = scene_;
        scene["step"] = 0.5 * scene_["step"].get<double>();
        const Motion half = motion(scene, {2.0 * order_.run_limit, {}});
        if (half.end == End::Refused && !half.began) return only_one(base_, half);
        if (half.integrator != base_.integrator || half.coordinates != base_.coordinates) return {};
        std::vector<double> allowed = sensitivity();
        for (std::size_t k = 0; k < allowed.size() && 2 * k < half.said.size(); ++k) {
            const double errors = 2.0 * accuracy * base_.t[k] + base_.said[k] + half.said[2 * k];
            allowed[k] = direction_factor * (allowed[k] + errors * growth(allowed[k]));
        }
        std::vector<double> distance = distances(base_, half, {}, size_, 2);
        for (std::size_t k = 0; k + 1 < distance.size(); ++k) distance[k] = std::min(distance[k], distance[k + 1]);
        return verdict(base_, half, judge(base_, distance, allowed, told_useless));
    }

    Judgement other_coordinates() {
        if (const auto gone = not_comparable(base_)) return *gone;
        if (!scene_.contains("joints")) return {};
        Motion other = base_;
        other.coordinates = base_.coordinates == "joint" ? "maximal" : "joint";
        return same_motion([&](double step) { return with_method(scene_, other, step); }, true);
    }

    Judgement welded_halves() {
        if (const auto gone = not_comparable(base_)) return *gone;
        const std::string& name = base_.bodies.front();
        const MassOf mass = base_.masses.at(name);
        if (!(mass.mass > 0.0)) return {};
        return same_motion([&](double step) { return cut(with_method(scene_, base_, step), name, mass); }, false);
    }

    Judgement other_solver() {
        if (const auto gone = not_comparable(base_)) return *gone;
        if (!base_.acted) return {};
        const auto with = [&](const char* name) {
            Json scene = with_method(scene_, base_);
            scene["solver"] = {{"name", name}, {"tolerance", solver_tolerance}};
            return scene;
        };
        const Motion first = motion(with("auto"));
        if (const auto gone = not_comparable(first)) return *gone;
        for (const char* name : {"ipm", "admm", "pgs"}) {
            const Motion second = motion(with(name));
            if (second.end == End::TooLong) return {Verdict::TooLong, ""};
            if (second.end == End::Refused && !second.began) continue;  // it is not there, or cannot take the scene
            auto allowed = sensitivity();
            for (double& entry : allowed) entry *= direction_factor * std::sqrt(solver_tolerance) / disturbance;
            add_drift(allowed, second);
            auto judgement =
                verdict(first, second, judge(first, distances(first, second, {}, size_), allowed, useless));
            if (!judgement.detail.empty()) judgement.detail = fmt::format("{}: {}", name, judgement.detail);
            return judgement;
        }
        return {};
    }

private:
    Motion motion(const Json& scene, const RunOrder& order) const {
        if (order_.still_alive) order_.still_alive();
        return run(scene, registry_, order);
    }
    Motion motion(const Json& scene) const { return motion(scene, {order_.run_limit, {}}); }

    /// What a run says of itself that may excuse it.
    static bool spoken(const Motion& motion) {
        return motion.end == End::Refused || !motion.warnings.empty() || !motion.solved;
    }

    bool names_something(const std::string& text) const {
        if (text.find(", line ") != std::string::npos) return true;
        for (const char* list : {"bodies", "joints", "motors", "actuators", "springs", "bushings", "loads"})
            if (scene_.contains(list))
                for (const auto& item : scene_[list])
                    if (text.find("\"" + item.value("name", std::string("?")) + "\"") != std::string::npos) return true;
        return false;
    }

    /// Why the scene cannot be described otherwise, if so.
    [[nodiscard]] std::optional<Judgement> not_known() const {
        if (is_known(scene_)) return std::nullopt;
        return Judgement{Verdict::NotJudged, "it has elastic bodies, beams or other things beside bodies and joints"};
    }

    /// Why nothing can be compared with this run, if so.
    static std::optional<Judgement> not_comparable(const Motion& motion) {
        if (motion.end == End::TooLong) return Judgement{Verdict::TooLong, ""};
        if (motion.end == End::Broken || motion.bodies.empty()) return Judgement{};
        if (motion.end == End::Refused && !motion.began) return Judgement{};
        return std::nullopt;
    }

    static Judgement only_one(const Motion& base, const Motion& other) {
        if (other.end == End::TooLong || base.end == End::TooLong) return {Verdict::TooLong, ""};
        const bool second = other.end == End::Refused;
        return {Verdict::OnlyOneRefused, fmt::format("only the {} is refused: {}", second ? "second" : "first",
                                                     second ? other.message : base.message)};
    }

    /// d(A, P), the larger of two, at least δ; by step of the base.
    const std::vector<double>& sensitivity() {
        if (!sensitivity_.empty()) return sensitivity_;
        const double T = base_.t.size() > 1 ? scene_["end"].get<double>() : 1.0;
        sensitivity_.assign(base_.poses.size(), disturbance);
        for (const std::uint64_t seed : {1, 2}) {
            const Motion moved = motion(
                disturbed(scene_, disturbance * size_, disturbance * size_ / T, disturbance, disturbance / T, seed));
            auto distance = distances(base_, moved, {}, size_);
            // Where the disturbed run ends early, nothing is known from there on.
            distance.resize(base_.poses.size(), std::numeric_limits<double>::infinity());
            distance = largest_so_far(std::move(distance));
            for (std::size_t k = 0; k < distance.size(); ++k) sensitivity_[k] = std::max(sensitivity_[k], distance[k]);
        }
        return sensitivity_;
    }

    /// 1/s, of the error that two runs together may have by dividing their steps otherwise.
    [[nodiscard]] double rate_of_limits() const {
        return base_.divides || base_.error_limit > 0.0 ? 2.0 * accuracy : 0.0;
    }

    /// G, of an answer to the disturbance.
    static double growth(double answer) {
        return answer <= chaos ? answer / disturbance : std::numeric_limits<double>::infinity();
    }

    /// By the same method, its error limit small, or in whole steps: a chosen one is divided where it gains energy.
    const Motion& named() {
        const bool whole = base_.parts + 1.0 <= static_cast<double>(base_.t.size());
        if (base_.error_limit == 0.0 && !base_.divides && whole) return base_;
        if (!named_) named_ = std::make_unique<Motion>(motion(with_method(scene_, base_)));
        return *named_;
    }
    /// The same with half the step.
    const Motion& refinement() {
        if (!half_)
            half_ = std::make_unique<Motion>(motion(with_method(scene_, base_, 0.5), {2.0 * order_.run_limit, {}}));
        return *half_;
    }

    /// G Σ η_k of both runs, and G R.
    std::vector<double> error_of_solves(const Motion& one, const Motion& other) {
        std::vector<double> error = sensitivity();
        const double step = scene_["step"].get<double>();
        const double fall = step * step * norm(scene_["gravity"]) / size_;
        double sum = 0.0, largest = 0.0;
        for (std::size_t k = 0; k < error.size(); ++k) {
            for (const Motion* motion : {&one, &other}) {
                if (k >= motion->natural.size()) continue;
                sum += motion->natural[k];
                largest = std::max(largest, motion->natural[k]);
            }
            const double resolution = one.acted || other.acted ? gap_resolution + 20.0 * largest * fall : 0.0;
            const auto steps = static_cast<double>(k);
            error[k] = (sum + 0.5 * steps * (steps + 1.0) * resolution) * growth(error[k]);
        }
        return error;
    }

    /// e of a run and the one with half its step.
    std::vector<double> error_of(const Motion& whole, const Motion& half) {
        auto error = largest_so_far(distances(whole, half, {}, size_, 2));
        const auto& sensitive = sensitivity();
        error.resize(std::min(error.size(), sensitive.size()));
        const double limits = whole.parts * whole.error_limit / std::min(size_, 1.0);
        for (std::size_t k = 0; k < error.size(); ++k)
            if (limits > 0.0) error[k] += limits * growth(sensitive[k]);
        return error;
    }

    void add_drift(std::vector<double>& allowed, const Motion& other) const {
        if (!base_.rows_left_out && !other.rows_left_out) return;
        const double drift = std::max(base_.drift, other.drift) / std::min(size_, 1.0);
        for (double& entry : allowed) entry += direction_factor * drift;
    }

    static Judgement verdict(const Motion& base, const Motion& other, const Judged& judged) {
        if (judged.beyond)
            return {
                spoken(base) || spoken(other) || base.inexact || other.inexact ? Verdict::Reported : Verdict::Violated,
                fmt::format("apart by {:.3g} at t = {:.6g} s, where {:.3g} is allowed", judged.distance, judged.t,
                            judged.allowed)};
        if (judged.chaotic) return {Verdict::Chaotic, ""};
        if (base.end != other.end) return only_one(base, other);
        return {Verdict::Held, ""};
    }

    /// rate: of the error that both runs together may have, 1/s, beside that of solves.
    Judgement same_problem(const Json& scene, const Described& described, double rate) {
        if (base_.end == End::TooLong) return {Verdict::TooLong, ""};
        if (base_.end == End::Broken) return {};
        const Motion other = motion(scene);
        if (other.end == End::Broken) return {Verdict::Violated, "an exception: " + other.message};
        if (other.end == End::TooLong) return {Verdict::TooLong, ""};
        if (!base_.began || !other.began)
            return base_.began == other.began ? Judgement{Verdict::Held, ""} : only_one(base_, other);
        if (base_.integrator != other.integrator || base_.coordinates != other.coordinates)
            return {Verdict::Violated,
                    fmt::format("one runs by {} in {} coordinates, the other by {} in {} ones", base_.integrator,
                                base_.coordinates, other.integrator, other.coordinates)};
        if (base_.bodies.empty()) return {};
        auto allowed = error_of_solves(base_, other);
        for (std::size_t k = 0; k < allowed.size(); ++k) {
            const double sensitive = sensitivity()[k];
            allowed[k] = direction_factor * (allowed[k] + sensitive);
            if (rate > 0.0) allowed[k] += rate * base_.t[k] * growth(sensitive);
        }
        add_drift(allowed, other);
        return verdict(base_, other, judge(base_, distances(base_, other, described, size_), allowed, useless));
    }

    template <class MakeScene>
    Judgement same_motion(const MakeScene& scene, bool may_be_refused) {
        const Motion& whole = named();
        if (const auto gone = not_comparable(whole)) return *gone;
        const Motion other = motion(scene(1.0));
        if (other.end == End::Broken) return {Verdict::Violated, "an exception: " + other.message};
        if (other.end == End::TooLong) return {Verdict::TooLong, ""};
        if (other.end == End::Refused && !other.began && may_be_refused) return {};
        if (other.end == End::Refused && !other.began) return only_one(whole, other);
        const Motion half = motion(scene(0.5), {2.0 * order_.run_limit, {}});
        if (half.end == End::TooLong || refinement().end == End::TooLong) return {Verdict::TooLong, ""};
        auto allowed = error_of_solves(whole, other);
        const auto first = error_of(whole, refinement()), second = error_of(other, half);
        allowed.resize(std::min({allowed.size(), first.size(), second.size()}));
        for (std::size_t k = 0; k < allowed.size(); ++k)
            allowed[k] = direction_factor * (allowed[k] + sensitivity()[k] + first[k] + second[k]);
        add_drift(allowed, other);
        return verdict(whole, other, judge(whole, distances(whole, other, {}, size_), allowed, useless));
    }

    const Json& scene_;
    const Registry& registry_;
    const JudgeOrder& order_;
    Motion base_;
    double size_ = 1.0;
    std::vector<double> sensitivity_;
    std::unique_ptr<Motion> named_, half_;
};

}  // namespace

std::string_view meaning_of(std::string_view relation) {
    static constexpr std::array<std::pair<std::string_view, std::string_view>, 12> meanings = {{
        {"sound",
         "no crash, no state that is not finite, no energy from nothing, no shape inside another, unless said"},
        {"refusal", "a refusal is one sentence that names what it is about"},
        {"placed", "the scene turned and moved as a whole, gravity with it, moves alike"},
        {"mirrored", "the mirror image of the scene moves as the mirror image of its motion"},
        {"units", "the scene in mm, g and ms moves alike"},
        {"order", "bodies, joints and all else in another order move alike"},
        {"pieces", "a run that is stopped, written, read and gone on with has the same bits"},
        {"refined", "smooth motion with half the step is as near as the method promises"},
        {"told", "with half the step the motion is as near as both runs say"},
        {"coordinates", "in joint and in maximal coordinates the motion is the same within the method's error"},
        {"cut", "a body as two welded halves moves alike within the method's error"},
        {"solver", "with another solver the motion is the same within what a tolerance promises"},
    }};
    for (const auto& [name, meaning] : meanings)
        if (name == relation) return meaning;
    return "";
}

std::string_view name_of(Verdict verdict) {
    static constexpr std::array<std::string_view, 7> names = {
        "held", "chaotic", "reported", "violated", "only one refused", "not judged", "too long"};
    return names[static_cast<std::size_t>(verdict)];
}

std::vector<Outcome> judge_scene(const Json& scene, const Registry& registry, const JudgeOrder& order) {
    using Member = Judgement (*)(Judge&);
    static constexpr std::array<Member, 12> members = {
        [](Judge& judge) { return judge.sound(); },
        [](Judge& judge) { return judge.refusal(); },
        [](Judge& judge) { return judge.placed_elsewhere(); },
        [](Judge& judge) { return judge.mirror_image(); },
        [](Judge& judge) { return judge.other_units(); },
        [](Judge& judge) { return judge.other_order(); },
        [](Judge& judge) { return judge.in_pieces(); },
        [](Judge& judge) { return judge.refined(); },
        [](Judge& judge) { return judge.told(); },
        [](Judge& judge) { return judge.other_coordinates(); },
        [](Judge& judge) { return judge.welded_halves(); },
        [](Judge& judge) { return judge.other_solver(); },
    };
    Judge judge(scene, registry, order);
    std::vector<Outcome> outcomes;
    for (std::size_t k = 0; k < relation_names.size(); ++k) {
        if (!order.only.empty() && !order.only.contains(std::string(relation_names[k]))) continue;
        if (order.interrupted && order.interrupted()) break;
        const Judgement judgement = members[k](judge);
        outcomes.push_back({relation_names[k], judgement.verdict, judgement.detail});
    }
    return outcomes;
}

}  // namespace delassus::relations
