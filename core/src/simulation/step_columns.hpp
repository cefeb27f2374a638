// SPDX-License-Identifier: BSD-3-Clause
// The table of what is known of each step, and that of the totals that steps add up to. Trajectories, checkpoints,
// reports and pictures follow them: a new figure of a step is a member of StepRecord, its computation, and a row.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>

#include "delassus/simulation.hpp"

namespace delassus {

/// How the figures of steps become a total.
enum class Summary { None, Last, Sum, Largest };

struct StepColumn {
    const char* name;         ///< of the dataset in trajectory.h5
    const char* unit;         ///< "1": dimensionless
    const char* description;  ///< one line
    /// Integers and truth values are stored as integers.
    std::variant<double StepRecord::*, std::int64_t StepRecord::*, bool StepRecord::*, Vector3 StepRecord::*> value;
    Summary summary = Summary::None;
    std::variant<std::monostate, double SimulationTotals::*, std::int64_t SimulationTotals::*> total = {};
    const char* plot = nullptr;  ///< its title among the pictures of `delassus view`; null: there is none
    bool stored = true;          ///< in trajectory.h5

    [[nodiscard]] constexpr bool integer() const {
        return std::holds_alternative<std::int64_t StepRecord::*>(value) ||
               std::holds_alternative<bool StepRecord::*>(value);
    }
    [[nodiscard]] constexpr std::size_t width() const {
        return std::holds_alternative<Vector3 StepRecord::*>(value) ? 3 : 1;
    }
};

inline constexpr std::array<StepColumn, 17> step_columns = {{
    {"t", "s", "time at the end of the step; the first row is the initial state", &StepRecord::t},
    {"energy", "J", "kinetic and potential energy", &StepRecord::energy, Summary::Last, &SimulationTotals::energy,
     "energy"},
    {"momentum", "kg m/s", "linear momentum, world frame", &StepRecord::momentum},
    {"angular_momentum", "kg m^2/s", "angular momentum about the origin, world frame", &StepRecord::angular_momentum},
    {"drift", "m, rad", "largest violation of a bilateral constraint", &StepRecord::drift, Summary::Largest,
     &SimulationTotals::worst_drift, "constraint drift"},
    {"penetration", "m", "depth of the deepest contact where the step began", &StepRecord::penetration,
     Summary::Largest, &SimulationTotals::worst_penetration, "penetration"},
    {"contacts", "1", "contacts and other unilateral blocks in the step's problem", &StepRecord::contacts,
     Summary::Largest, &SimulationTotals::most_contacts, "contacts"},
    {"sleeping", "1", "bodies and nodes that sleep", &StepRecord::sleeping},
    {"newton_iterations", "1", "linear or cone problems solved", &StepRecord::newton_iterations, Summary::Sum,
     &SimulationTotals::newton_iterations},
    {"solver_iterations", "1", "iterations of the solver plugin", &StepRecord::solver_iterations, Summary::Sum,
     &SimulationTotals::solver_iterations, "solver iterations"},
    {"natural", "1", "largest natural error of the step's solves", &StepRecord::natural, Summary::Largest,
     &SimulationTotals::worst_natural},
    {"seconds", "s", "wall time of the step", &StepRecord::seconds, Summary::Sum, &SimulationTotals::seconds},
    {"solved", "1", "1 if every solve reached its tolerance", &StepRecord::solved},
    {"linearization", "1", "what the forces of a linearised method were off by, as a share of the velocities",
     &StepRecord::linearization, Summary::Largest, &SimulationTotals::worst_linearization},
    {"error", "1",
     "error of positions that the step is estimated to add, as a share of the size of what moves and in rad; NaN: not "
     "estimated",
     &StepRecord::error, Summary::Sum, &SimulationTotals::error},
    {.name = "rejected",
     .unit = "1",
     .description = "trials of the step control that were thrown away",
     .value = &StepRecord::rejected,
     .summary = Summary::Sum,
     .total = &SimulationTotals::rejected,
     .stored = false},
    {.name = "impact",
     .unit = "1",
     .description = "1 for a short step of the step control, for a contact that closed",
     .value = &StepRecord::impact,
     .summary = Summary::Sum,
     .total = &SimulationTotals::impacts,
     .stored = false},
}};

/// Adds a step to the totals, by the table.
void add_step(const StepRecord& record, SimulationTotals& totals);

struct TotalColumn {
    const char* name;  ///< in checkpoints
    const char* unit;
    const char* description;
    std::variant<double SimulationTotals::*, std::int64_t SimulationTotals::*, std::string SimulationTotals::*> value;
    const char* report = nullptr;  ///< JSON pointer to its place in a system's part of report.json; null: not there
};

inline constexpr std::array<TotalColumn, 49> total_columns = {{
    {"rejected", "1", "trials of the step control that were thrown away", &SimulationTotals::rejected, "/rejected"},
    {"impacts", "1", "short steps for contacts that closed", &SimulationTotals::impacts, "/impacts"},
    {"smallest_step", "s", "of those taken, impacts apart", &SimulationTotals::smallest_step, "/smallest_step"},
    {"largest_step", "s", "of those taken, impacts apart", &SimulationTotals::largest_step, "/largest_step"},
    {"start_energy", "J", "at the start", &SimulationTotals::start_energy, "/energy/start"},
    {"energy", "J", "now", &SimulationTotals::energy, "/energy/end"},
    {"start_overlap", "m", "what is left of the deepest overlap of the start; 0 once it has not shrunk",
     &SimulationTotals::start_overlap},
    {"credit", "J", "rise of the energy while the overlaps of the start shrank", &SimulationTotals::credit},
    {"lowest", "J", "least energy up to now but for what was recovered", &SimulationTotals::lowest},
    {"lowest_before", "J", "the same before the last step", &SimulationTotals::lowest_before},
    {"growth", "J", "largest rise of the energy, above its start and that credit or above the lowest",
     &SimulationTotals::growth, "/energy/growth"},
    {"growth_share", "1", "the largest, of what energy there can have been to move", &SimulationTotals::growth_share,
     "/energy/growth_share"},
    {"recovered", "J", "energy that contacts gave by pushing apart what penetrated", &SimulationTotals::recovered,
     "/energy/recovered"},
    {"damped", "J", "energy that the method took from vibrations", &SimulationTotals::damped, "/energy/damped"},
    {"supplied", "J", "energy that loads, motors and given motions supplied; NaN: not accounted for",
     &SimulationTotals::supplied, "/energy/supplied"},
    {"turnover", "J", "sum of the absolute values of what rows and forces supplied in each step",
     &SimulationTotals::turnover},
    {"doubt", "J", "by how much of it what was supplied may be off", &SimulationTotals::doubt},
    {"work", "J", "energy that contacts, stops and dry friction gave; NaN: not accounted for", &SimulationTotals::work,
     "/energy/work"},
    {"rest", "J", "change of the energy by dampers and the method; NaN: not accounted for", &SimulationTotals::rest,
     "/energy/rest"},
    {"start_kinetic", "J", "kinetic energy at the start", &SimulationTotals::start_kinetic},
    {"potential_drop", "J", "largest fall of the potential energy below its start", &SimulationTotals::potential_drop},
    {"worst_drift", "m, rad", "largest violation of a bilateral constraint", &SimulationTotals::worst_drift,
     "/worst/drift"},
    {"worst_penetration", "m", "depth of the deepest contact", &SimulationTotals::worst_penetration,
     "/worst/penetration"},
    {"worst_natural", "1", "largest natural error of a solve by a plugin", &SimulationTotals::worst_natural,
     "/worst/natural"},
    {"worst_linearization", "1", "largest of the steps", &SimulationTotals::worst_linearization,
     "/worst/linearization"},
    {"most_contacts", "1", "contacts and other unilateral blocks of a step", &SimulationTotals::most_contacts,
     "/most_contacts"},
    {"newton_iterations", "1", "linear or cone problems solved", &SimulationTotals::newton_iterations,
     "/newton_iterations"},
    {"resting_parts", "1", "parts of problems that were left out because their bodies sleep",
     &SimulationTotals::resting_parts, "/sleeping/resting_parts"},
    {"repeated_solves", "1", "solves that `auto` repeated, since the solver that was asked for missed its tolerance",
     &SimulationTotals::repeated_solves, "/repeated_solves"},
    {"failed_solves", "1", "of these, those in which the solver that was asked for failed or made a false claim",
     &SimulationTotals::failed_solves, "/effort/failed_solves"},
    {"first_failure", "", "its sentence in the first of them", &SimulationTotals::first_failure,
     "/effort/first_failure"},
    {"near_goal_solves", "1", "solves that ended somewhat above the tolerance that their steps are worth",
     &SimulationTotals::near_goal_solves, "/effort/near_goal_solves"},
    {"divided_steps", "1", "fixed steps that the method could not take in one", &SimulationTotals::divided_steps,
     "/divided_steps"},
    {"most_substeps", "1", "that one of them was divided into", &SimulationTotals::most_substeps, "/most_substeps"},
    {"refined_steps", "1", "fixed steps that were divided by their error", &SimulationTotals::refined_steps,
     "/refined_steps"},
    {"error", "1", "sum of what steps are estimated to add to the error of positions, as in the trajectory",
     &SimulationTotals::error, "/error"},
    {"inexact_steps", "1", "steps with a part that errs by more than the accuracy asks",
     &SimulationTotals::inexact_steps, "/inexact_steps"},
    {"deep_steps", "1", "steps after which bodies overlap by more than the accuracy allows",
     &SimulationTotals::deep_steps, "/deep_steps"},
    {"first_deep", "", "when and which the first time", &SimulationTotals::first_deep, "/first_deep"},
    {"most_inverted", "1", "solid elements that are turned inside out after a step", &SimulationTotals::most_inverted,
     "/most_inverted"},
    {"first_inverted", "", "when the first time", &SimulationTotals::first_inverted, "/first_inverted"},
    {"method_changes", "1", "methods that were chosen, could not go on, and had another take their place",
     &SimulationTotals::method_changes, "/method_changes"},
    {"last_change", "", "when and why the last time", &SimulationTotals::last_change, "/last_change"},
    {"plugin_solves", "1", "solves by a plugin", &SimulationTotals::plugin_solves, "/effort/solves"},
    {"solver_iterations", "1", "iterations of the solver plugin", &SimulationTotals::solver_iterations,
     "/effort/iterations"},
    {"solver_seconds", "s", "wall time of the solver plugin", &SimulationTotals::solver_seconds, "/effort/seconds"},
    {"unsolved_steps", "1", "steps with a solve that missed its tolerance", &SimulationTotals::unsolved_steps,
     "/effort/unsolved_steps"},
    {"first_unsolved", "", "when and why the first did", &SimulationTotals::first_unsolved, "/effort/first_unsolved"},
    {"seconds", "s", "wall time of all steps", &SimulationTotals::seconds, "/seconds"},
}};

}  // namespace delassus
