// SPDX-License-Identifier: BSD-3-Clause
#include "output/run_report.hpp"

#include <nlohmann/json.hpp>

#include "support/json_number.hpp"

namespace delassus {

using Json = nlohmann::ordered_json;

std::string run_report_json(const std::string& scene, const Scene& read, std::vector<Simulation>& simulations,
                            const RunOutcome& outcome) {
    Json json = {{"scene", scene},
                 {"title", read.title},
                 {"status", outcome.status},
                 {"message", outcome.message},
                 {"seconds", outcome.seconds},
                 {"systems", Json::array()}};
    for (auto& simulation : simulations) {
        const SceneSystem& system = simulation.system();
        const SimulationTotals& totals = simulation.totals();
        const auto velocities = system.system->n();
        Json bodies = Json::object();
        for (BodyIndex i = 0; i < static_cast<BodyIndex>(system.bodies.size()); ++i) {
            if (system.bodies[static_cast<std::size_t>(i)].fixed) continue;
            const Pose pose = system.system->pose(simulation.state(), i);
            const auto [v, omega] = system.system->velocities(simulation.state(), i);
            bodies[system.bodies[static_cast<std::size_t>(i)].name] = {{"position", pose.position},
                                                                       {"orientation", pose.orientation},
                                                                       {"velocity", v},
                                                                       {"angular_velocity", omega}};
        }
        json["systems"].push_back(
            {{"name", system.name},
             {"integrator", system.integrator},
             {"solver_chosen", system.solver.name.empty() ? Json(nullptr) : Json(system.solver.name)},
             {"solvers_loaded", simulation.solver().loaded()},
             {"velocities", velocities},
             {"constraints", system.system->m()},
             {"step", system.control ? Json(nullptr) : Json(system.step)},
             {"tolerance", system.control
                               ? Json{{"absolute", system.control->absolute}, {"relative", system.control->relative}}
                               : Json(nullptr)},
             {"sleeping", system.sleeping ? Json{{"speed", system.sleeping->speed},
                                                 {"time", system.sleeping->time},
                                                 {"bodies", simulation.record().sleeping},
                                                 {"resting_parts", totals.resting_parts}}
                                          : Json(nullptr)},
             {"end", system.end},
             {"steps", simulation.record().step},
             {"rejected", totals.rejected},
             {"impacts", totals.impacts},
             {"smallest_step", totals.smallest_step},
             {"largest_step", totals.largest_step},
             {"t", simulation.state().t},
             {"energy",
              {{"start", json_number(totals.start_energy)},
               {"end", json_number(totals.energy)},
               {"growth", json_number(totals.growth)},
               {"growth_share", json_number(totals.growth_share)},
               {"recovered", json_number(totals.recovered)}}},
             {"worst",
              {{"drift", totals.worst_drift},
               {"penetration", totals.worst_penetration},
               {"natural", json_number(totals.worst_natural)},
               {"linearization", json_number(totals.worst_linearization)}}},
             {"warnings", simulation.warnings()},
             {"most_contacts", totals.most_contacts},
             {"newton_iterations", totals.newton_iterations},
             {"effort",
              {{"solves", totals.plugin_solves},
               {"iterations", totals.solver_iterations},
               {"seconds", totals.solver_seconds},
               {"unsolved_steps", totals.unsolved_steps},
               {"first_unsolved", totals.first_unsolved}}},
             {"seconds", totals.seconds},
             {"bodies", std::move(bodies)}});
    }
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace delassus
