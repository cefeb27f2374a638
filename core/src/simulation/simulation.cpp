// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "delassus/communicator.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "simulation/energy_guard.hpp"
#include "simulation/method_change.hpp"
#include "simulation/overlap_watch.hpp"
#include "simulation/run_step.hpp"
#include "simulation/shared_run.hpp"
#include "simulation/sleeping.hpp"
#include "simulation/stepping.hpp"
#include "simulation/stops_at_start.hpp"
#include "simulation/touching.hpp"
#include "simulation/watched_step.hpp"
#include "simulation/what_acts.hpp"
#include "solver/auto_solver.hpp"
#include "support/frames.hpp"
#include "support/trace.hpp"

namespace delassus {
namespace {

/// Throws Unsupported if the system's timestepper solves for more than the velocities of one step.
void require_sleeping(const SceneSystem& system) {
    std::vector<std::string> able;
    for (const TimestepperInfo& one : timesteppers()) {
        if (one.sleeping && one.name == system.integrator) return;
        if (one.sleeping) able.push_back(one.name);
    }
    throw Unsupported(fmt::format("{} cannot leave out bodies that sleep. Can: {}; or remove \"sleeping\"",
                                  system.integrator, fmt::join(able, ", ")));
}

/// Throws Unsupported if the solver that the scene names does not know the law of its friction: said here, as the first
/// contact may come late.
void require_law(const SceneSystem& system, const Registry& registry, Law law) {
    const std::string& name = system.solver.name;
    if (name.empty() || name == auto_name || !Touching(system).friction()) return;
    const bool coulomb = law == Law::Coulomb;
    const PluginInfo info = is_library_path(name) ? registry.load(name)->info() : solver_info(registry, name);
    const std::uint64_t needs = DELASSUS_CAN_FRICTION | (coulomb ? DELASSUS_CAN_COULOMB : DELASSUS_CAN_ASSOCIATED);
    const bool knows_other = info.missing(DELASSUS_CAN_FRICTION) == 0 && info.missing(needs) != 0;
    if (!knows_other) return;
    throw Unsupported(
        fmt::format("{} does not know {}, which {}; write \"law: {}\" in \"solver\", or name auto or one of {}",
                    info.name, coulomb ? "exact Coulomb friction" : "the associated law of friction",
                    system.solver.law ? "the scene asks for" : "is the law of scenes that name none",
                    coulomb ? "associated" : "coulomb", fmt::join(registry.capable(needs), ", ")));
}

std::vector<std::string> methods_to_share() {
    std::vector<std::string> names;
    for (const TimestepperInfo& one : timesteppers())
        if (one.shared) names.push_back(one.name);
    return names;
}

bool can_be_shared(const std::string& method) {
    const auto names = methods_to_share();
    return std::find(names.begin(), names.end(), method) != names.end();
}

/// Whether the solver that the scene names takes problems in parts; auto does.
bool takes_parts(const SceneSystem& system, const Registry& registry) {
    const std::string& name = system.solver.name;
    if (name.empty() || name == auto_name) return true;
    const PluginInfo info = is_library_path(name) ? registry.load(name)->info() : solver_info(registry, name);
    return (info.capabilities & DELASSUS_CAN_PARTITIONED) != 0;
}

std::vector<std::string> solvers_in_parts(const Registry& registry) {
    std::vector<std::string> names = {std::string(auto_name)};
    for (const PluginInfo& plugin : registry.plugins())
        if ((plugin.capabilities & DELASSUS_CAN_PARTITIONED) != 0 && (plugin.flags & DELASSUS_FLAG_PEER) == 0)
            names.push_back(plugin.name);
    return names;
}

/// Whether several processes share the bodies of a system. Smooth systems whose method they cannot share are computed
/// whole by each, as linear solvers for several processes ask.
bool shares_bodies(const SceneSystem& system, const Registry& registry) {
    if (process_count() == 1 || !SharedRun::obstacle(system).empty() || !takes_parts(system, registry)) return false;
    return can_be_shared(system.integrator) || system.system->has_unilateral();
}

/// Where bodies are shared: the scene's method, or one that can be shared where the scene names none.
SteppingMethod method_to_share(const SceneSystem& system) {
    if (can_be_shared(system.integrator) || system.method_reason.empty())
        return {system.integrator, system.integrator_options, system.coordinates,
                system.division == StepDivision::ToAccuracy};
    return {.integrator = methods_to_share().front(),
            .options = {},
            .coordinates = system.coordinates_chosen ? Coordinates::Maximal : system.coordinates};
}

/// Of the energy that can have moved: a change that a plot would show.
constexpr double visible_share = 0.05;

std::string describe(const Assembly& change) {
    return fmt::format(
        "bodies were moved by up to {:.3g} m and {:.3g} rad, and their velocities changed by up to {:.3g} "
        "m/s and {:.3g} rad/s",
        change.displacement, change.rotation, change.velocity, change.angular_velocity);
}

}  // namespace

Simulation::Simulation(SceneSystem& system, const Registry& registry)
    : system_(&system), solver_(std::make_unique<StepSolver>(registry, system.solver)) {
    now_.inputs = system.inputs.at_start();
    system.inputs.load(now_.inputs);
    if (!system.leave_out) solver_->leave_nothing_out();
    methods_ = methods_of(system);
    if (shares_bodies(system, registry)) methods_ = {method_to_share(system)};
    const bool in_joints = method().coordinates == Coordinates::Joint;
    const auto with_name = [&](const auto& make) {
        try {
            make();
        } catch (const InputError& error) {
            throw InputError(fmt::format("system \"{}\": {}", system.name, error.what()));
        } catch (const Unsupported& error) {
            throw Unsupported(fmt::format("system \"{}\": {}", system.name, error.what()));
        }
    };
    with_name([&] {
        if (const std::string what = system.system->needs_joint_coordinates(); !in_joints && !what.empty())
            throw Unsupported(what + ", which joint coordinates alone take; give coordinates: joint");
        // Checked here without loading the plugin, which may never be needed.
        SolverConfig solver = system.solver;
        if (solver.name.empty()) solver.name = auto_name;
        check_solver(registry, solver);
        require_law(system, registry, solver_->law());
        restitutes_ = system.system->restitutes();
        assembly_ = system.system->assemble();
        share(registry);
        if (!in_joints) make_method();
        if (system.sleeping) {
            if (in_joints)
                throw Unsupported("bodies cannot sleep in joint coordinates; remove \"sleeping\" or \"coordinates\"");
            require_sleeping(system);
            if (system.control || system.steps_by_accuracy())
                throw InputError(
                    fmt::format("bodies may sleep with a fixed step only; {}",
                                system.control ? "give a \"step\" instead of a \"tolerance\"" : "remove \"accuracy\""));
            sleeping_ = std::make_unique<Sleeping>(*system.system, *system.sleeping);
            solver_->let_rest(sleeping_.get());
        }
    });
    if (system.equilibrium) {
        equilibrium_ = std::make_shared<const Equilibrium>(find_equilibrium(system, registry));
        system.system->set_start(equilibrium_->state);
    }
    if (in_joints)
        with_name([&] {
            joint_ = std::make_unique<JointCoordinates>(*system.system);
            make_method();
        });
    now_.state = dynamics().initial_state();
    if (LookAhead* ahead = stepping_->ahead()) ahead->begin(now_.state);
    if (joint_) joint_->bodies_of(now_.state, bodies_);
    constraint_.resize(static_cast<std::size_t>(system.system->constraint_rows()));
    beyond_stops_ = beyond_stops(*system.system, bodies_at(now_.state, next_bodies_));
    guard_ = std::make_unique<EnergyGuard>(system);
    if (!shared_ && !system.method_reason.empty())
        energy_ = std::make_unique<EnergyWatch>(*guard_, system, system.accuracy);
    if (!shared_ && system.system->size_of_shapes() > 0.0)
        overlaps_ = std::make_unique<OverlapWatch>(*system.system, system.accuracy, bodies_at(now_.state, next_bodies_),
                                                   system.step);
    measure(state(), record_);
    now_.totals.start_energy = now_.totals.energy = record_.energy;
    now_.totals.lowest = now_.totals.lowest_before = record_.energy;
    now_.totals.start_kinetic = record_.kinetic;
    now_.totals.worst_drift = record_.drift;
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

void Simulation::share(const Registry& registry) {
    if (process_count() == 1) return;
    const auto refuse = [](const std::string& what, const std::string& advice) {
        throw Unsupported(fmt::format("several processes cannot share a system {}; {}start one process", what, advice));
    };
    if (!shares_bodies(*system_, registry)) {
        if (!system_->system->has_unilateral()) return;
        if (const std::string obstacle = SharedRun::obstacle(*system_); !obstacle.empty())
            refuse("with contacts or stops that has " + obstacle, "");
        throw Unsupported(
            fmt::format("several processes cannot share contacts and stops with {}; name {}, or start one "
                        "process",
                        system_->solver.name, fmt::join(solvers_in_parts(registry), ", ")));
    }
    if (!can_be_shared(method().integrator))
        refuse(fmt::format("with the integrator {}", method().integrator),
               fmt::format("name {}, or ", fmt::join(methods_to_share(), " or ")));
    if (method().coordinates == Coordinates::Joint) refuse("in joint coordinates", "remove \"coordinates\", or ");
    if (system_->sleeping) refuse("in which bodies sleep", "remove \"sleeping\", or ");
    if (system_->control) refuse("with steps chosen by a tolerance", "give a fixed \"step\", or ");
    if (method().by_accuracy) refuse("with steps that follow from an accuracy", "remove \"accuracy\", or ");
    if (!system_->leave_out) refuse("of which nothing is left out", "");
    shared_ = std::make_unique<SharedRun>(*system_, method(), communicator_of_run(), registry, *solver_);
}

DynamicalSystem& Simulation::dynamics() {
    if (joint_) return *joint_;
    return *system_->system;
}

const State& Simulation::bodies_at(const State& state, State& memory) const {
    if (!joint_) return state;
    joint_->bodies_of(state, memory);
    return memory;
}

void Simulation::settle_turns(State& state) const {
    if (joint_) return joint_->settle_turns(state);
    system_->system->settle_turns(state);
}

void Simulation::begin_anew() {
    stepping_->begin_anew(now_.state);
}

void Simulation::notice_changes() {
    system_->inputs.load(now_.inputs);
    if (revision_ == system_->system->revision()) return;
    revision_ = system_->system->revision();
    begin_anew();
}

// Another simulation of the system may have set its inputs since.
void Simulation::set_input(std::string_view name, double value) {
    system_->inputs.load(now_.inputs);
    system_->inputs.set(name, value, now_.state.t);
    now_.inputs = system_->inputs.save();
    begin_anew();
}

double Simulation::input(std::string_view name) const {
    system_->inputs.load(now_.inputs);
    return system_->inputs.value(name);
}

void Simulation::renew_rows_ahead() {
    LookAhead::Memory memory = stepping_->ahead()->memory();
    if (!renew_rows(memory.way.end, memory.advances)) return;
    memory.way.degree = 0;
    memory.way.multipliers.clear();
    stepping_->ahead()->put_back(std::move(memory));
}

bool Simulation::renew_rows(State& state, std::int64_t steps) {
    /// MultibodySystem::renew_rows() does nothing in other steps, as long as nothing has drifted further.
    constexpr std::int64_t every = 10;
    constexpr double drifted = 1e-4;
    MultibodySystem& mechanics = *system_->system;
    const std::int32_t held = joint_ ? joint_->rows_saved() : 0;
    if (mechanics.m() + held == mechanics.constraint_rows() || (steps % every != 0 && record_.drift < drifted))
        return false;
    if (joint_ ? !joint_->renew_rows(state, steps) : !mechanics.renew_rows(state, steps)) return false;
    const std::unique_ptr<Stepping> before = std::move(stepping_);
    make_method();
    stepping_->keep_control_of(*before);
    return true;
}

bool Simulation::finished() const {
    return stepping_->ends(now_.state.t);
}

void Simulation::measure(const State& state, StepRecord& record) {
    const MultibodySystem& mechanics = *system_->system;
    record.t = state.t;
    record.energy = mechanics.energy(state);
    record.kinetic = mechanics.kinetic_energy(state);
    const auto momentum = mechanics.momentum(state);
    record.momentum = momentum[0];
    record.angular_momentum = momentum[1];
    if (!constraint_.empty()) mechanics.all_constraints(state, constraint_.data());
    for (const double C : constraint_) record.drift = std::max(record.drift, std::abs(C));
    record.sleeping = sleeping_ ? sleeping_->count() : 0;
}

void Simulation::judge(const AdaptiveStepReport& taken, SimulationTotals& totals) const {
    const RunLimits& limits = system_->limits;
    if (record_.drift > limits.drift)
        throw StepFailure(
            fmt::format("the constraints have drifted by {:.3g}, where limits.drift is {:.3g}: the step of {:.3g} s is "
                        "too long for {}",
                        record_.drift, limits.drift, taken.h, method().integrator));
    totals.damped += taken.step.energy.damped;
    const bool accounts = stepping_->timestepper()->accounts();
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    if (system_->system->is_driven()) {
        totals.supplied += accounts ? taken.step.energy.supplied : unknown;
        totals.turnover += taken.step.energy.turnover;
        totals.doubt += taken.step.energy.doubt;
    }
    totals.work += accounts ? taken.step.energy.work : unknown;
    totals.rest = record_.energy - totals.start_energy - totals.supplied - totals.work;
    if (!EnergyGuard::watches(totals)) return;
    const double energy = record_.energy - totals.supplied - totals.doubt;
    const double start_potential = totals.start_energy - totals.start_kinetic;
    totals.potential_drop = std::max(totals.potential_drop, start_potential - (record_.energy - record_.kinetic));
    totals.recovered += taken.step.energy.recovered;
    const double left = record_.penetration;
    const bool overlapped = now_.step == 0 && (!overlaps_ || overlaps_->any_at_start());
    totals.start_overlap = overlapped || left < totals.start_overlap ? left : 0.0;
    if (totals.start_overlap > 0.0) {
        totals.credit = std::max(totals.credit, energy - totals.start_energy);
        totals.lowest = energy - totals.recovered;
    }
    const double growth = EnergyGuard::growth(totals, energy, 0.0, taken.again);
    if (taken.again) totals.lowest = totals.lowest_before;
    totals.lowest_before = totals.lowest;
    totals.lowest = std::min(totals.lowest, energy - totals.recovered);
    const double scale = guard_->scale(totals, std::max(totals.largest_step, taken.h));
    totals.growth = std::max(totals.growth, growth);
    if (growth > 0.0) totals.growth_share = std::max(totals.growth_share, growth / scale);
    if (energy - totals.start_energy - totals.recovered > limits.energy_growth * scale)
        throw StepFailure(
            fmt::format("the energy has grown from {:.6g} J at the start to {:.6g} J {} (what can have moved at all is "
                        "{:.3g} J): the step of {:.3g} s is too long for {}; take shorter steps or a method that "
                        "damps (limits.energy_growth: {:.3g})",
                        totals.start_energy, record_.energy, EnergyGuard::though(totals), scale, taken.h,
                        method().integrator, limits.energy_growth));
}

// What a step of a scene has beside that of any system.
class Simulation::Step : public RunStep {
public:
    explicit Step(Simulation& run)
        : RunStep({run.stepping_, *run.solver_, run.now_, run.record_, run.report_, run.next_report_}), all_(run) {
        if (all_.sleeping_) sleeping_ = all_.sleeping_->save();
    }

private:
    void prepare(State& state) override {
        LookAhead* ahead = run_.stepping->ahead();
        if (!ahead) {
            all_.renew_rows(state, run_.now.step);
        } else if (!ahead->reaches(run_.stepping->next(state.t).end)) {
            all_.renew_rows_ahead();
        }
        if (all_.shared_) all_.shared_->prepare(state, run_.stepping->next(state.t).h, run_.stepping->timestepper());
    }

    void advance(State& state, AdaptiveStepReport& report) override {
        if (all_.sleeping_) all_.sleeping_->begin_step(run_.stepping->next(state.t).h);
        WatchedStep watch(*all_.system_->system, all_.joint_.get(), run_.solver,
                          {all_.overlaps_.get(), all_.energy_.get(), &run_.now.totals}, !all_.restitutes_,
                          all_.next_bodies_);
        run_.stepping->advance(state, run_.solver, report, &watch);
        deep_ = watch.deep();
        if (all_.sleeping_) all_.sleeping_->end_step(run_.now.state, state);
    }

    void measure(State& state, const AdaptiveStepReport& report, StepRecord& record) override {
        if (!run_.stepping->ahead()) all_.settle_turns(state);
        all_.measure(all_.bodies_at(state, all_.next_bodies_), record);
        for (const auto& contact : report.step.contacts)
            record.penetration = std::max(record.penetration, -contact.gap);
        if (all_.shared_) record.penetration = all_.shared_->penetration();
        if (all_.overlaps_ && deep_.empty()) deep_ = all_.overlaps_->too_deep(report.step.contacts);
    }

    void judge(const AdaptiveStepReport& report, SimulationTotals& totals) override { all_.judge(report, totals); }

    void count(const std::string& place, SimulationTotals& totals) override {
        std::swap(all_.bodies_, all_.next_bodies_);
        if (!deep_.empty()) {
            ++totals.deep_steps;
            if (totals.first_deep.empty()) totals.first_deep = fmt::format("{}: {}", place, deep_);
        }
        const std::int64_t inverted = all_.system_->system->inverted_solids(all_.state());
        totals.most_inverted = std::max(totals.most_inverted, inverted);
        if (inverted > 0 && totals.first_inverted.empty()) totals.first_inverted = place;
    }

    void undo() override {
        if (all_.sleeping_) all_.sleeping_->load(sleeping_);
    }
    [[nodiscard]] std::string what_acts() const override {
        if (all_.overlaps_ && run_.now.step == 0 && !all_.overlaps_->at_start().empty())
            return "; " + all_.overlaps_->at_start();
        return delassus::what_acts(*all_.system_, all_.state());
    }
    bool go_on(const std::string& failure) override { return all_.go_on(failure); }
    [[nodiscard]] std::string name() const override { return fmt::format("system \"{}\", ", all_.system_->name); }

    Simulation& all_;
    std::vector<double> sleeping_;  // Sleeping::save() before the step
    std::string deep_;              // what overlaps by more than the accuracy allows; or empty
};

const StepRecord& Simulation::step() {
    TraceSpan span("step", "step");
    span.say("system", system_->name);
    span.say("number", static_cast<double>(now_.step + 1));
    span.say("t", now_.state.t);
    if (joint_ && now_.totals.growth_share > visible_share)
        go_on(fmt::format("the energy rose by {:.3g} J, {:.2g} % of what can have moved, {}", now_.totals.growth,
                          100.0 * now_.totals.growth_share, EnergyGuard::though(now_.totals)));
    notice_changes();
    Step(*this).take();
    return record_;
}

std::vector<double> Simulation::multipliers() const {
    MultibodySystem& mechanics = *system_->system;
    if (record_.h == 0.0) return {};
    const std::vector<double> kept = stepping_->multipliers(coordinates(), *solver_, report());
    std::vector<double> all = mechanics.all_multipliers(kept);
    if (!joint_) return all;
    std::vector<double> force(static_cast<std::size_t>(mechanics.n()), 0.0);
    mechanics.add_force(state(), 1.0, force.data());
    MatrixAssembler rows;
    rows.begin(mechanics.m(), mechanics.n());
    mechanics.add_constraint_jacobian(state(), 0, rows);
    rows.finish().transpose_multiply_add(1.0, kept.data(), force.data());
    add_unilateral_forces(force);
    const std::vector<double> carried = joint_->tree_reactions(coordinates(), force);
    for (std::size_t i = 0; i < carried.size(); ++i)
        all[static_cast<std::size_t>(joint_->rows_of_trees()[i])] = carried[i];
    return all;
}

// Where contacts and stops are now; what acted in them in the step.
void Simulation::add_unilateral_forces(std::vector<double>& force) const {
    MultibodySystem& mechanics = *system_->system;
    if (!mechanics.has_unilateral()) return;
    std::map<std::uint64_t, std::array<double, 3>> acted;
    for (const BlockReaction& one : report().reactions) acted[one.key] = one.force;
    UnilateralRows now;
    mechanics.collect_unilateral(state(), record_.h, now);
    std::size_t row = 0;
    for (const auto& block : now.blocks()) {
        const auto found = acted.find(block.key);
        for (std::int32_t i = 0; i < block.cone.rows; ++i, ++row) {
            if (found == acted.end() || i > 2) continue;
            for (auto k = static_cast<std::size_t>(now.row_start()[row]);
                 k < static_cast<std::size_t>(now.row_start()[row + 1]); ++k)
                force[static_cast<std::size_t>(now.column()[k])] +=
                    now.value()[k] * found->second[static_cast<std::size_t>(i)];
        }
    }
}

std::vector<ContactRecord> Simulation::contacts() const {
    std::vector<ContactRecord> contacts;
    contacts.reserve(report().contacts.size());
    auto reaction = report().reactions.end() - static_cast<std::ptrdiff_t>(report().contacts.size());
    for (const ContactPoint& contact : report().contacts) {
        const Eigen::Vector3d rows((reaction++)->force.data());
        const Eigen::Vector3d force = contact_frame(Eigen::Vector3d(contact.normal.data())) * rows;
        ContactRecord& record = contacts.emplace_back();
        record.bodies = system_->system->contact_bodies(contact);
        for (std::size_t k = 0; k < 3; ++k) record.point[k] = 0.5 * (contact.point_a[k] + contact.point_b[k]);
        record.normal = contact.normal;
        record.gap = contact.gap;
        record.force = {force[0], force[1], force[2]};
    }
    return contacts;
}

std::vector<std::string> Simulation::warnings() const {
    /// Of the size of a mechanism or its speed: more than coordinates of few digits explain.
    constexpr double large_assembly = 1e-3;
    std::vector<std::string> sentences;
    const SimulationTotals& totals = now_.totals;
    if (totals.growth_share > system_->accuracy)
        sentences.push_back(fmt::format(
            "system \"{}\": the energy rose by up to {:.3g} J, {:.2g} % of what can have moved, {}: the steps are "
            "long for {} (accuracy: {:.3g})",
            system_->name, totals.growth, 100.0 * totals.growth_share, EnergyGuard::though(totals), method().integrator,
            system_->accuracy));
    const double scale = guard_->scale(totals, totals.largest_step), loss = guard_->loss(totals);
    if (loss > visible_share * scale) {
        const bool in_trees = !joint_ && !system_->joints.empty() && system_->system->node_count() == 0;
        const std::string of =
            fmt::format("system \"{}\": the energy fell by {:.3g} J, {:.0f} % of what can have moved, ", system_->name,
                        loss, 100.0 * loss / scale);
        sentences.push_back(
            system_->system->has_unilateral()
                ? of + fmt::format("beyond what contacts and dry friction take: the steps are long for {}; take "
                                   "shorter ones, or an \"accuracy\"",
                                   method().integrator)
                : of + fmt::format("though nothing takes any: {} damps in steps as long as these; take shorter ones "
                                   "or a method of higher order, {}",
                                   method().integrator,
                                   in_trees ? "such as rk4 with \"coordinates: joint\"" : "such as generalized_alpha"));
    } else if (totals.damped > visible_share * scale) {
        sentences.push_back(
            fmt::format("system \"{}\": {} took {:.3g} J, {:.0f} % of what can have moved, from vibrations that are "
                        "too fast for its steps; shorter ones follow them",
                        system_->name, method().integrator, totals.damped, 100.0 * totals.damped / scale));
    }
    if (totals.most_inverted > 0)
        sentences.push_back(fmt::format(
            "{}: solid elements are turned inside out, up to {} at once, which no material can be: it is hit too hard "
            "for its stiffness, or needs smaller elements or shorter steps",
            totals.first_inverted, totals.most_inverted));
    if (totals.method_changes > 0)
        sentences.push_back(fmt::format("system \"{}\": {}", system_->name, totals.last_change));
    if (totals.failed_solves > 0)
        sentences.push_back(
            fmt::format("system \"{}\": solver {} failed in {} solves, which auto repeated; the first time: {}",
                        system_->name, system_->solver.name, totals.failed_solves, totals.first_failure));
    if (overlaps_ && !overlaps_->at_start().empty())
        sentences.push_back(fmt::format("system \"{}\": {}", system_->name, overlaps_->at_start()));
    if (!beyond_stops_.empty()) sentences.push_back(fmt::format("system \"{}\": {}", system_->name, beyond_stops_));
    if (method().by_accuracy && totals.inexact_steps > 0)
        sentences.push_back(fmt::format(
            "system \"{}\": {} of {} steps are less exact than accuracy: {:.3g} asks, however short their parts: what "
            "touches there comes and goes by rounding",
            system_->name, totals.inexact_steps, now_.step, system_->accuracy));
    if (totals.deep_steps > 0)
        sentences.push_back(fmt::format(
            "system \"{}\": {} of {} steps leave bodies in one another by more than \"accuracy\" allows; the "
            "first: {}",
            system_->name, totals.deep_steps, now_.step, totals.first_deep));
    if (shared_ && method().integrator != system_->integrator)
        sentences.push_back(
            fmt::format("system \"{}\": several processes cannot share {}; {} took its place, which is less exact",
                        system_->name, system_->integrator, method().integrator));
    if (equilibrium_ && equilibrium_->smallest_eigenvalue < 0.0)
        sentences.push_back(fmt::format(
            "system \"{}\": the equilibrium in which the run begins is unstable (smallest eigenvalue {:.3g} "
            "rad²/s²)",
            system_->name, equilibrium_->smallest_eigenvalue));
    if (std::max(assembly_.position_share, assembly_.velocity_share) > large_assembly)
        sentences.push_back(
            fmt::format("system \"{}\": the start does not fit the joints and motors and was changed: {}",
                        system_->name, describe(assembly_)));
    return sentences;
}

std::string Simulation::start() const {
    /// Below this share of size and speed, nobody needs to know.
    constexpr double rounding_of_assembly = 1e-9;
    const bool moved = std::max(assembly_.position_share, assembly_.velocity_share_of_all) > rounding_of_assembly;
    std::string clause = moved ? describe(assembly_) : std::string();
    if (equilibrium_) {
        const LoadStep& last = equilibrium_->load_steps.back();
        clause += fmt::format("{}static equilibrium after {} load steps, unbalanced force {:.1e}", moved ? "; " : "",
                              equilibrium_->load_steps.size(), last.residual);
    }
    return clause;
}

void Simulation::gather() {
    if (!shared_ || gathered_at_ == now_.step) return;
    gathered_ = flat(shared_->memory(*stepping_->timestepper()));
    gathered_at_ = now_.step;
}

void Simulation::gather_contacts() {
    if (shared_) shared_->collect_contacts(report_.step);
}

std::int64_t Simulation::divisions() const {
    return shared_ ? shared_->divisions() : 0;
}

std::vector<Simulation::Share> Simulation::shares() const {
    return shared_ ? shared_->shares() : std::vector<Share>{};
}

SimulationState Simulation::save() const {
    SimulationState result = now_;
    const MultibodySystem& mechanics = *system_->system;
    const auto& kept = mechanics.kept_rows();
    result.rows_left_out.clear();
    auto next = kept.begin();
    for (std::int32_t row = 0; row < mechanics.constraint_rows(); ++row)
        if (next != kept.end() && *next == row)
            ++next;
        else
            result.rows_left_out.push_back(row);
    if (shared_ && gathered_at_ != now_.step)
        throw InputError("the processes did not bring together what a checkpoint needs: call gather() before save()");
    result.stepping = stepping_->save();
    if (shared_) result.stepping.method = gathered_;
    if (sleeping_) result.sleeping = sleeping_->save();
    if (overlaps_) result.overlapping = overlaps_->given_up();
    return result;
}

void Simulation::load(SimulationState state) {
    const auto number = static_cast<std::size_t>(state.totals.method_changes);
    if (number >= methods_.size())
        throw InputError(fmt::format("the checkpoint of system \"{}\" is of method {}; the system has {}",
                                     system_->name, number + 1, methods_.size()));
    if (state.totals.method_changes != now_.totals.method_changes) {
        change_method(number);
        now_.state = dynamics().initial_state();
    }
    if (state.state.q.size() != now_.state.q.size() || state.state.v.size() != now_.state.v.size())
        throw InputError(fmt::format(
            "the checkpoint of system \"{}\" has {} positions and {} velocities; the system "
            "has {} and {}",
            system_->name, state.state.q.size(), state.state.v.size(), now_.state.q.size(), now_.state.v.size()));
    std::vector<std::int32_t> kept;
    auto left_out = state.rows_left_out.begin();
    for (std::int32_t row = 0; row < system_->system->constraint_rows(); ++row)
        if (left_out != state.rows_left_out.end() && *left_out == row)
            ++left_out;
        else
            kept.push_back(row);
    if (left_out != state.rows_left_out.end())
        throw InputError(fmt::format("the checkpoint of system \"{}\" leaves out rows that the system does not have",
                                     system_->name));
    system_->system->keep_rows(kept);
    if (joint_) joint_->bodies_of(state.state, bodies_);
    make_method();
    stepping_->load(state.stepping, state.state);
    if (shared_) {
        shared_->set_memory(stepping_->timestepper()->memory());
        gathered_ = state.stepping.method;
        gathered_at_ = state.step;
    }
    if (sleeping_) sleeping_->load(state.sleeping);
    if (overlaps_) overlaps_->set_given_up(state.overlapping);
    system_->inputs.load(state.inputs);
    now_ = std::move(state);
    now_.stepping = {};
    now_.rows_left_out.clear();
    now_.sleeping.clear();
    now_.overlapping.clear();
    record_ = {};
    record_.step = now_.step;
    report_ = {};
    measure(this->state(), record_);
}

}  // namespace delassus
