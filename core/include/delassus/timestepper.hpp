// SPDX-License-Identifier: BSD-3-Clause
// One step of a dynamical system in time, and the table of the methods that can take it (integrators/, one file each).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "delassus/plugin_info.hpp"
#include "delassus/step_solver.hpp"

namespace delassus {

/// What acted in a unilateral block of a step's problem.
struct BlockReaction {
    std::uint64_t key = 0;          ///< of the block
    std::array<double, 3> force{};  ///< in its first rows, the mean over the step; 0 beyond its rows
};

/// What a step does to the energy, J.
struct StepEnergy {
    double recovered = 0.0;  ///< contacts gave it by pushing apart what penetrated; ≥ 0
    double damped = 0.0;     ///< the method took it from vibrations; < 0: gave
    // Where Timestepper::accounts():
    double supplied = 0.0;  ///< by loads, motors and given motions; < 0: they took
    double turnover = 0.0;  ///< sum of the absolute values of what their forces and rows supplied, each by itself
    double doubt = 0.0;     ///< by how much of it `supplied` may be off
    double work = 0.0;      ///< contacts, stops and dry friction gave it; < 0: took

    /// Adds so many times what others do.
    DELASSUS_API void add(const StepEnergy& other, double times = 1.0);
};

/// What a step did, and what acted in it.
struct StepReport {
    std::int32_t newton_iterations = 0;  ///< linear or cone problems solved
    std::int32_t unilateral_blocks = 0;  ///< contacts and other unilateral blocks that were in the problem
    std::int32_t active_blocks = 0;      ///< of these, blocks with a reaction
    bool solved = true;                  ///< false if the step rests on a solve that missed its tolerance; it is taken
    std::string message;                 ///< why not
    double natural = 0.0;                ///< largest natural error that a solve of the step left
    // Of the fastest contact or stop that closed, that is, one that pushed in this step and not in the one before:
    double impact_speed = 0.0;  ///< with which it closed, in its unit a second; 0: none
    double impact_time = 0.0;   ///< when, after the beginning of the step
    /// The largest speed by which a contact may be wrong after impacts of the step: where one follows another one on
    /// its bodies, of which the method knew no meeting, or one at another speed, or where a contact that pushes gave
    /// more than its impulse at the impact could be; 0: nowhere.
    double doubtful_speed = 0.0;
    /// When, after the beginning, to cut the step between an impact and the first one that follows it in such a way; 0:
    /// nowhere.
    double second_impact_cut = 0.0;
    /// The same for the first that has more than a hundredth of the kinetic energy.
    double cut = 0.0;
    /// The error of a linearised method's forces at the end of the step, as a share of the velocities
    /// (docs/integrators.md); 0 where forces are linear, or where it is not measured.
    double linearization = 0.0;
    double linearization_rounding = 0.0;  ///< what the last digits of positions may make of it; not part of it
    StepEnergy energy;
    std::vector<BlockReaction> reactions;  ///< one for each unilateral block of the problem, in its order
    std::vector<ContactPoint> contacts;    ///< UnilateralRows::contacts(): the last of these blocks are theirs
    std::vector<double> multipliers;       ///< λ of the bilateral constraints at the end of the step, forces; m
    /// Where Timestepper::estimates_error(): what the step errs by along increments of the positions, n, as the last
    /// steps show it; empty where none before it says anything, as after an impact.
    std::vector<double> error;

    /// Counts a solve of the step; whether it was solved.
    DELASSUS_API bool take(const StepAnswer& answer);
    /// Back to the beginning; the memory stays.
    DELASSUS_API void clear();
    /// Of a part of a step ← of the step so far, of which `before` is the rest: sums and extremes of both. Reactions,
    /// contacts, multipliers and the error stay those of this part.
    DELASSUS_API void follow(const StepReport& before);
};

/// A step that cannot be taken: Newton's method does not converge, a state is not finite. The state is as before it.
class DELASSUS_API StepFailure : public Error {
public:
    using Error::Error;
};

/// One that the method cannot take at this length, and that it would take well in parts.
class DELASSUS_API StepTooLong : public StepFailure {
public:
    using StepFailure::StepFailure;
};

/// An estimate of the error of a step, along increments of the positions and in the velocities; n each.
struct EmbeddedError {
    std::span<const double> positions, velocities;
};

struct ContinuousExtension;
struct StepMemory;

/// A method, made for one system. It keeps what belongs to the method (accelerations, multipliers) from step to step.
class DELASSUS_API Timestepper {
public:
    virtual ~Timestepper();

    /// Advances state (in the system's sizes) from t to t + h, h > 0. Throws StepFailure, or Unsupported if the solver
    /// cannot take the step's problems.
    StepReport step(State& state, double h, StepSolver& solver);
    /// The same in a report whose memory serves again. After an exception it says nothing.
    void step(State& state, double h, StepSolver& solver, StepReport& report);

    /// Forgets what was kept from step to step: call it when the state was changed from outside.
    virtual void restart() = 0;
    /// The same where nothing but forces has changed, with a jump: guesses of reactions may stay. Default: restart().
    virtual void forces_jumped() { restart(); }

    /// Order of convergence for smooth systems, with the options chosen.
    [[nodiscard]] virtual int order() const = 0;
    /// Whether a motion of infinite frequency is gone after a step: then results of different steps may be
    /// extrapolated.
    [[nodiscard]] virtual bool damps_at_once() const { return false; }

    /// Whether it estimates its own errors, by a method of one order less that it has in it. Default: no.
    [[nodiscard]] virtual bool has_embedded_error() const { return false; }
    /// The order of that method: the estimate falls with this power of h and one more. Default: order() − 1.
    [[nodiscard]] virtual int embedded_order() const { return order() - 1; }
    /// The estimate for the last step; valid until the next. Empty by default.
    [[nodiscard]] virtual EmbeddedError embedded_error() const { return {}; }
    /// Whether StepReport::error says what a step errs by, which costs no solve. Default: no.
    [[nodiscard]] virtual bool estimates_error() const { return false; }
    /// Whether StepReport::energy says what the step was supplied with, and what contacts took. Default: no.
    [[nodiscard]] virtual bool accounts() const { return false; }
    /// The tolerance, as StepControl::absolute, by which steps of a fixed size are to be taken in parts, or several at
    /// once where the method has an extension. Infinity by default: every step is one.
    [[nodiscard]] virtual double error_limit() const { return std::numeric_limits<double>::infinity(); }

    /// Whether extend() describes the way of a step, nearly as exactly as the method finds its end. Default: no.
    [[nodiscard]] virtual bool has_extension() const { return false; }
    /// way ← that of the last step, until the next one, whatever load() and restart() did since; its degree is 0 where
    /// there is none, the default. DenseOutput (delassus/continuous_extension.hpp) finds states on it.
    virtual void extend(ContinuousExtension& way) const;

    /// By what factor a step multiplies errors of the reactions of joints; below 1 they decay. Default: 0.
    [[nodiscard]] virtual double reaction_growth() const { return 0.0; }
    /// Says that the next steps are parts of one that was cut (StepReport::cut), or no longer: what velocities change
    /// by in so short a time says nothing of accelerations. Default: nothing.
    virtual void follow_impacts(bool /*follow*/) {}
    /// Says that steps of sizes follow that a tolerance chooses (StepControl::absolute), infinite: no longer. What
    /// the method lets depend on h besides its error, as the height at which a sliding contact of the associated law
    /// floats, has to go, and what it leaves of its iterations may follow the tolerance. Default: nothing.
    virtual void choose_steps(double /*tolerance*/) {}

    /// The memory of the method by what it belongs to, where TimestepperInfo::shared (dynamics/step_memory.hpp).
    /// Throws Unsupported elsewhere.
    [[nodiscard]] virtual StepMemory memory() const;
    virtual void set_memory(StepMemory&& memory);

    /// The numbers that make up the memory of the method, for checkpoints; load() takes what save() gave, and forgets
    /// all else.
    [[nodiscard]] virtual std::vector<double> save() const;
    virtual void load(const std::vector<double>& memory);

protected:
    /// What step() does, with an empty report.
    virtual void take_step(State& state, double h, StepSolver& solver, StepReport& report) = 0;

    std::vector<double> multipliers_;  ///< λ of the bilateral constraints at the end of the last step, or empty
};

/// A row of the table of methods.
struct TimestepperInfo {
    std::string name;         ///< lower_snake_case
    std::string description;  ///< one line
    std::vector<OptionInfo> options;
    bool constraints = false;  ///< takes bilateral constraints
    bool unilateral = false;   ///< takes contacts, stops and bounded motors
    bool sleeping = false;     ///< one problem a step for velocities: parts that stand still may be left out
    bool shared = false;       ///< several processes may each step their bodies of a system (docs/partitioned.md)
    int order = 1;             ///< of convergence, for smooth systems and the default options
    /// system outlives the stepper; the values are checked, one for each option.
    std::unique_ptr<Timestepper> (*make)(DynamicalSystem& system, const std::vector<OptionValue>& values) = nullptr;
};

/// All methods, by name.
[[nodiscard]] DELASSUS_API const std::vector<TimestepperInfo>& timesteppers();

/// Makes the method of that name. Throws InputError on an unknown name or option (with the nearest), Unsupported if the
/// method cannot take the system's constraints or contacts, naming those that can.
[[nodiscard]] DELASSUS_API std::unique_ptr<Timestepper> make_timestepper(std::string_view name, DynamicalSystem& system,
                                                                         const OptionTexts& options = {});

/// Adds a row to the table; for a static object in the file of a method:
///     const RegisterTimestepper row{{.name = "rk4", …}};
struct RegisterTimestepper {
    DELASSUS_API explicit RegisterTimestepper(TimestepperInfo info);
};

}  // namespace delassus
