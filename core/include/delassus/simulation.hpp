// SPDX-License-Identifier: BSD-3-Clause
// Running a system of a scene step by step.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/equilibrium.hpp"
#include "delassus/export.hpp"
#include "delassus/joint_coordinates.hpp"
#include "delassus/registry.hpp"
#include "delassus/scene.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

class Sleeping;

/// What is known after a step. Contacts are those that the step's problem was made of: found where the step began.
struct StepRecord {
    std::int64_t step = 0;       ///< steps taken so far
    double t = 0.0;              ///< s
    double energy = 0.0;         ///< J; NaN where the system does not know it
    double kinetic = 0.0;        ///< the kinetic part of it, J
    Vector3 momentum{};          ///< kg m/s
    Vector3 angular_momentum{};  ///< about the origin, kg m²/s
    double drift = 0.0;          ///< largest |C| of all rows of joints and motors, in their own units (m, rad)
    double penetration = 0.0;    ///< of the deepest contact, m; ≥ 0
    std::int64_t contacts = 0;   ///< contacts and other unilateral blocks in the problem
    std::int64_t sleeping = 0;   ///< bodies and nodes that sleep
    std::int64_t newton_iterations = 0;
    std::int64_t solver_iterations = 0;
    double natural = 0.0;       ///< largest natural error of the step's solves by a plugin
    double h = 0.0;             ///< size of the step, s
    std::int64_t substeps = 1;  ///< in which the step was taken
    /// Of positions that the step is estimated to add, as a share of the size of what moves and in rad; NaN: nobody
    /// estimates it.
    double error = 0.0;
    std::int64_t rejected = 0;   ///< trials of the step control that were thrown away
    bool impact = false;         ///< a short step of the step control, for a contact that closed
    double seconds = 0.0;        ///< of wall time, everything included
    bool solved = true;          ///< every solve reached its tolerance
    double linearization = 0.0;  ///< error of the forces of a linearised method (StepReport)
};

/// A contact of the last step, found where the step began; with chosen steps, where its second half began.
struct ContactRecord {
    std::array<std::int32_t, 2> bodies{};  ///< as MultibodySystem::contact_bodies()
    Vector3 point{};                       ///< midway between the two surfaces, world frame, m
    Vector3 normal{};                      ///< unit, from the first surface to the second
    double gap = 0.0;                      ///< m; negative in penetration
    Vector3 force{};                       ///< mean on the second, world frame, N; on the first the opposite
};

/// Sums and extremes since the start.
struct SimulationTotals {
    double start_energy = 0.0, energy = 0.0;  ///< J
    double start_kinetic = 0.0;               ///< J
    double potential_drop = 0.0;              ///< largest fall of the potential energy below its start, J
    double recovered = 0.0;                   ///< energy that contacts gave by pushing apart what penetrated, J
    double damped = 0.0;                      ///< energy that the method took from vibrations, J
    double supplied = 0.0;  ///< energy that loads, motors and given motions supplied, J; NaN: not accounted for
    double turnover = 0.0;  ///< StepEnergy::turnover, J
    double doubt = 0.0;     ///< by how much of it `supplied` may be off, J
    double work = 0.0;      ///< energy that contacts, stops and dry friction gave, J; < 0: took; NaN: as above
    double rest = 0.0;      ///< change of the energy that neither explains: by dampers and the method, J; NaN: as above
    double start_overlap = 0.0;  ///< what is left of the deepest overlap of the start, m; 0 once it has not shrunk
    double credit = 0.0;         ///< rise of the energy while the overlaps of the start shrank, J
    double lowest = 0.0;         ///< least energy up to now but for `recovered`, J
    double lowest_before = 0.0;  ///< the same before the last step, J
    double growth = 0.0;         ///< largest rise of the energy: above its start and `credit`, or above `lowest`, J
    double growth_share = 0.0;   ///< largest growth over the energy that can have moved (running.md); 0: not judged
    double worst_drift = 0.0, worst_penetration = 0.0, worst_natural = 0.0;
    double worst_linearization = 0.0;
    std::int64_t most_contacts = 0;
    std::int64_t newton_iterations = 0, solver_iterations = 0, plugin_solves = 0;
    std::int64_t resting_parts = 0;     ///< parts of problems that were left out because their bodies sleep
    std::int64_t repeated_solves = 0;   ///< by `auto`, since the solver that was asked for missed its tolerance
    std::int64_t failed_solves = 0;     ///< of these, those in which it failed or made a false claim
    std::string first_failure;          ///< its sentence in the first of them
    std::int64_t near_goal_solves = 0;  ///< that ended somewhat above what their steps are worth (docs/tolerance.md)
    std::int64_t divided_steps = 0;     ///< fixed steps that the method could not take in one
    std::int64_t most_substeps = 0;     ///< that one of them was divided into
    std::int64_t refined_steps = 0;     ///< fixed steps that were divided by their error
    double smallest_step = 0.0, largest_step = 0.0;  ///< s, of those taken; short steps for impacts apart
    std::int64_t rejected = 0, impacts = 0;          ///< of the step control
    double seconds = 0.0, solver_seconds = 0.0;
    std::int64_t unsolved_steps = 0;  ///< steps with a solve that missed its tolerance
    std::string first_unsolved;       ///< when and why the first did
    double error = 0.0;               ///< sum of StepRecord::error
    std::int64_t inexact_steps = 0;   ///< with a part that errs by more than the accuracy asks
    /// Steps after which bodies overlap by more than the accuracy allows, beside what did at the start, or in which
    /// they came to by so much however short their parts; when and which the first time.
    std::int64_t deep_steps = 0;
    std::string first_deep;
    std::int64_t most_inverted = 0;  ///< solid elements that are turned inside out after a step
    std::string first_inverted;      ///< when the first time
    /// How often the method that was chosen could not go on, and the next one took its place; when and why the last
    /// time.
    std::int64_t method_changes = 0;
    std::string last_change;
};

/// What the steps of a system depend on besides its state.
struct SteppingMemory {
    std::vector<double> method;   ///< Timestepper::save(), warm starts included
    std::vector<double> control;  ///< AdaptiveStepping::save(); empty with fixed steps that nothing divides
    std::vector<double> ahead;    ///< where the method is ahead of the state, and how it came there; empty: it is not
};

/// All that a simulation carries from step to step: with equal scenes, going on from it gives the same bits.
struct SimulationState {
    std::int64_t step = 0;
    State state;  ///< in the coordinates of the simulation
    SteppingMemory stepping;
    std::vector<std::int32_t>
        rows_left_out;             ///< of the bilateral constraints (MultibodySystem::kept_rows()); ascending
    std::vector<double> sleeping;  ///< which bodies sleep, how long the others were quiet; empty where none may sleep
    std::vector<double> inputs;    ///< Inputs::save() of the scene's system
    std::vector<std::int32_t> overlapping;  ///< pairs of bodies that come to overlap however short the steps, a then b
    SimulationTotals totals;
};

/// How a simulation steps.
struct SteppingMethod {
    std::string integrator;
    OptionTexts options;
    Coordinates coordinates = Coordinates::Maximal;
    bool by_accuracy = false;  ///< its steps are divided by their error (SceneSystem::division)
};

class EnergyGuard;
class EnergyWatch;
class OverlapWatch;
class SharedRun;
class Stepping;

/// One system of a scene, advanced step by step by its timestepper and its solver.
///
/// Life cycle: the constructor takes the state of the SceneSystem as the start; step() until finished(); in between,
/// save() and load() keep and restore everything that the next steps depend on. run_to_end() does this for several
/// systems in the order of their times.
///
/// Ownership: the simulation owns its state, its StepSolver with the loaded solvers, and its timestepper. It refers to
/// the SceneSystem, which must stay at its address. Two simulations of one SceneSystem may exist, but not step at the
/// same time. References that a simulation returns are valid until its next step() or load(). A simulation can be moved
/// but not copied, and one thread at a time may use it.
///
/// Errors: what step() throws is listed there. A solve that misses its tolerance is not an error: the step counts, and
/// record().solved, totals().unsolved_steps and totals().first_unsolved tell of it.
class Simulation {
public:
    /// system and registry outlive the simulation. Throws InputError or Unsupported for an integrator or a solver that
    /// is not there, cannot take the system, or has other options.
    DELASSUS_API Simulation(SceneSystem& system, const Registry& registry);
    DELASSUS_API ~Simulation();
    DELASSUS_API Simulation(Simulation&&) noexcept;

    /// The scene's, or the one that took its place (totals().last_change).
    [[nodiscard]] const SteppingMethod& method() const {
        return methods_[static_cast<std::size_t>(now_.totals.method_changes)];
    }

    /// Whether `end` is reached. The last step is shorter where `end` is no multiple of a fixed step.
    [[nodiscard]] DELASSUS_API bool finished() const;

    /// Takes one step. Throws StepFailure, Unsupported or InputError with the time in the sentence, or StepInterrupted
    /// where solver().interrupt_by() asks for it; everything is then as it was before the step. A step beyond the
    /// system's limits is a StepFailure.
    DELASSUS_API const StepRecord& step();

    /// Of the last step; of the initial state before the first.
    [[nodiscard]] const StepRecord& record() const { return record_; }
    /// Of the bodies, as MultibodySystem has it.
    [[nodiscard]] const State& state() const { return joint_ ? bodies_ : now_.state; }
    /// The joint coordinates that it is run in, or null.
    [[nodiscard]] const JointCoordinates* joint_coordinates() const { return joint_.get(); }
    /// In the coordinates that it is run in.
    [[nodiscard]] const State& coordinates() const { return now_.state; }
    [[nodiscard]] const SimulationTotals& totals() const { return now_.totals; }
    [[nodiscard]] const SceneSystem& system() const { return *system_; }
    /// What the last step reported; empty before the first, and where a run goes on. The multipliers are empty where
    /// steps may be longer than those shown: multipliers() has them.
    [[nodiscard]] const StepReport& report() const { return report_.step; }
    /// λ of all rows of joints, motors and attachments (MultibodySystem::joint_rows()) after the last step, forces: 0
    /// in rows that are left out. Empty before the first, and where a run goes on.
    [[nodiscard]] DELASSUS_API std::vector<double> multipliers() const;
    /// The contacts in report(), in their order.
    [[nodiscard]] DELASSUS_API std::vector<ContactRecord> contacts() const;
    [[nodiscard]] StepSolver& solver() { return *solver_; }

    /// The system's input of this name is `value` from now on. Throws InputError as Inputs::set() does.
    DELASSUS_API void set_input(std::string_view name, double value);
    /// Its value now. Throws InputError as Inputs::value() does.
    [[nodiscard]] DELASSUS_API double input(std::string_view name) const;

    /// What a user should know about a run that has not failed so far, one sentence each.
    [[nodiscard]] DELASSUS_API std::vector<std::string> warnings() const;

    [[nodiscard]] const Assembly& assembly() const { return assembly_; }
    /// The equilibrium in which it starts, or null.
    [[nodiscard]] const Equilibrium* equilibrium() const { return equilibrium_.get(); }
    /// How assembly and the search for an equilibrium changed the start: a clause, or nothing where they did not beyond
    /// rounding.
    [[nodiscard]] DELASSUS_API std::string start() const;

    // ---- Several processes ----
    //
    // Where a launcher started several processes, each makes the same simulations and calls the same members in the
    // same order. They share the bodies of a system where the method and the solver can (docs/partitioned.md,
    // "Simulating"); else each computes the whole.

    /// Whether this and other processes share the system's bodies.
    [[nodiscard]] bool shared() const { return shared_ != nullptr; }
    /// What a process had in the last step, and cost.
    struct Share {
        std::int64_t bodies = 0, ghosts = 0, rows = 0;
        std::int64_t bytes_sent = 0, peak_memory = 0;  ///< bytes, since the start
    };
    /// How often the bodies were shared out so far; 0 where they are not shared.
    [[nodiscard]] DELASSUS_API std::int64_t divisions() const;
    /// By rank; empty where nothing is shared. Collective.
    [[nodiscard]] DELASSUS_API std::vector<Share> shares() const;
    /// Brings together what save() needs; before each save() where bodies are shared. Collective.
    DELASSUS_API void gather();
    /// Has contacts() know all contacts of the last step on process 0; before, and elsewhere, each process knows its
    /// own. Call it once after a step. Collective.
    DELASSUS_API void gather_contacts();

    /// Throws InputError where bodies are shared and gather() was not called since the last step.
    [[nodiscard]] DELASSUS_API SimulationState save() const;
    /// Throws InputError if the sizes are not the system's.
    DELASSUS_API void load(SimulationState state);

private:
    class Step;
    /// record ← what is known of a state of the bodies; those values are still 0.
    void measure(const State& state, StepRecord& record);
    /// What the timestepper steps.
    [[nodiscard]] DynamicalSystem& dynamics();
    /// The bodies at a state of dynamics(); `memory` holds them where the coordinates are others.
    [[nodiscard]] const State& bodies_at(const State& state, State& memory) const;
    /// totals ← with the energy and the drift in record_ after a step. Throws StepFailure where they are beyond limits.
    void judge(const AdaptiveStepReport& taken, SimulationTotals& totals) const;
    /// force += what contacts, stops and bounded motors did to the bodies in the last step; columns of the bodies.
    void add_unilateral_forces(std::vector<double>& force) const;
    /// What takes the steps of method().
    void make_method();
    /// How its steps are divided by the accuracy; the solver is told.
    [[nodiscard]] StepControl control_of_accuracy();
    /// Another of methods_, with its coordinates; the state stays to be set.
    void change_method(std::size_t number);
    /// The next of methods_ goes on from the state shown, if there is one. why: a sentence.
    bool go_on(const std::string& why);
    /// Shares the bodies with the other processes, where there are any and the system, its method and solver allow it.
    void share(const Registry& registry);
    /// Has the system choose anew which rows to keep where it must; the method then starts anew. steps: so far. Returns
    /// whether it did.
    bool renew_rows(State& state, std::int64_t steps);
    /// The same where the method has come to.
    void renew_rows_ahead();
    void settle_turns(State& state) const;
    /// Begins anew if the system was changed since.
    void notice_changes();
    /// Forgets what is ahead of the state shown, and forces of before: what acts on the bodies has jumped.
    void begin_anew();

    SceneSystem* system_;
    std::vector<SteppingMethod> methods_;  // the scene's, and those that may take its place
    std::unique_ptr<StepSolver> solver_;
    std::uint64_t revision_ = 0;          // of the system, that the method knows
    std::unique_ptr<Sleeping> sleeping_;  // empty where none may sleep
    Assembly assembly_;
    std::string beyond_stops_;  // at the start, a warning; or empty
    std::shared_ptr<const Equilibrium> equilibrium_;
    std::unique_ptr<JointCoordinates> joint_;  // empty in maximal coordinates
    SimulationState now_;
    State bodies_, next_bodies_;  // in joint coordinates: now, and memory for the next step
    StepRecord record_;
    AdaptiveStepReport report_, next_report_;  // of the last step, and memory for the next
    std::vector<double> constraint_;
    std::unique_ptr<EnergyGuard> guard_;
    std::unique_ptr<EnergyWatch> energy_;     // empty where the scene names the method, or processes share bodies
    std::unique_ptr<OverlapWatch> overlaps_;  // empty where bodies cannot touch, or processes share them
    bool restitutes_ = false;                 // MultibodySystem::restitutes()
    std::unique_ptr<SharedRun> shared_;       // empty where this process steps all bodies
    std::unique_ptr<Stepping> stepping_;
    std::vector<double> gathered_;  // the memory of the method for all bodies, after step gathered_at_
    std::int64_t gathered_at_ = -1;
};

}  // namespace delassus
