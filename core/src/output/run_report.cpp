// SPDX-License-Identifier: BSD-3-Clause
#include "output/run_report.hpp"

#include <type_traits>
#include <variant>

#include "simulation/step_columns.hpp"
#include "support/json.hpp"
#include "support/json_number.hpp"

namespace delassus {

using Json = nlohmann::ordered_json;

namespace {

/// Puts the totals in their places, except below a key whose value is null.
void add_totals(const SimulationTotals& totals, Json& system) {
    for (const TotalColumn& column : total_columns) {
        if (!column.report) continue;
        const Json::json_pointer place(column.report);
        const Json::json_pointer above = place.parent_pointer();
        if (system.contains(above) && system.at(above).is_null()) continue;
        std::visit(
            [&](auto member) {
                if constexpr (std::is_same_v<decltype(member), double SimulationTotals::*>) {
                    system[place] = json_number(totals.*member);
                } else {
                    system[place] = totals.*member;
                }
            },
            column.value);
    }
}

Json check_json(const RunCheck& check) {
    if (!check.failure.empty()) return {{"failure", check.failure}};
    return {{"position", json_number(check.position)},
            {"rotation", json_number(check.rotation)},
            {"farthest", check.farthest},
            {"extent", check.extent},
            {"error", json_number(check.error)},
            {"on_the_way", json_number(check.on_the_way)},
            {"apart_from", check.apart_from ? Json(*check.apart_from) : Json(nullptr)},
            {"seconds", check.second_seconds},
            {"seconds_for_a_tenth", check.seconds_for(10.0)},
            {"seconds_for_ten_times", check.seconds_for(0.1)}};
}

}  // namespace

std::string_view status_word(RunStatus status) {
    switch (status) {
        case RunStatus::Finished:
            return "finished";
        case RunStatus::Unsolved:
            return "unsolved";
        case RunStatus::Interrupted:
        case RunStatus::TimeLimit:
            return "interrupted";
        case RunStatus::Failed:
        case RunStatus::Unsupported:
            return "failed";
    }
    return "failed";
}

std::string run_report_json(const std::string& scene, const Scene& read, std::vector<Simulation>& simulations,
                            const RunResult& result, const SharesOfSystems& shares,
                            const std::vector<RunCheck>& checks) {
    Json json = {{"scene", scene},
                 {"title", read.title},
                 {"status", status_word(result.status)},
                 {"message", result.message},
                 {"seconds", result.seconds},
                 {"systems", Json::array()}};
    for (auto& simulation : simulations) {
        const SceneSystem& system = simulation.system();
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
        const auto* joints = simulation.joint_coordinates();
        const std::int32_t of_trees = joints ? joints->rows_saved() : 0;
        Json one = {{"name", system.name},
                    {"integrator", simulation.method().integrator},
                    {"solver_chosen", system.solver.name.empty() ? Json(nullptr) : Json(system.solver.name)},
                    {"solvers_loaded", simulation.solver().loaded()},
                    {"velocities", velocities},
                    {"constraints", system.system->constraint_rows()},
                    {"redundant_constraints", system.system->constraint_rows() - of_trees - system.system->m()},
                    {"redundant_joints", system.system->joints_with_rows_left_out()},
                    {"assembly",
                     {{"displacement", json_number(simulation.assembly().displacement)},
                      {"rotation", json_number(simulation.assembly().rotation)},
                      {"velocity", json_number(simulation.assembly().velocity)},
                      {"angular_velocity", json_number(simulation.assembly().angular_velocity)}}},
                    {"step", system.control ? Json(nullptr) : Json(system.step)},
                    {"tolerance", system.control ? Json{{"absolute", system.control->absolute},
                                                        {"relative", system.control->relative}}
                                                 : Json(nullptr)},
                    {"accuracy", system.steps_by_accuracy() ? Json(system.accuracy) : Json(nullptr)},
                    {"sleeping", system.sleeping ? Json{{"speed", system.sleeping->speed},
                                                        {"time", system.sleeping->time},
                                                        {"bodies", simulation.record().sleeping}}
                                                 : Json(nullptr)},
                    {"end", system.end},
                    {"steps", simulation.record().step},
                    {"t", simulation.state().t},
                    {"warnings", simulation.warnings()}};
        add_totals(simulation.totals(), one);
        const std::size_t number = json["systems"].size();
        if (number < shares.size() && !shares[number].empty()) {
            one["divisions"] = simulation.divisions();
            Json& processes = one["processes"] = Json::array();
            for (const Simulation::Share& share : shares[number])
                processes.push_back({{"bodies", share.bodies},
                                     {"ghosts", share.ghosts},
                                     {"rows", share.rows},
                                     {"bytes_sent", share.bytes_sent},
                                     {"peak_memory", share.peak_memory}});
        }
        if (number < checks.size()) one["check"] = check_json(checks[number]);
        one["bodies"] = std::move(bodies);
        json["systems"].push_back(std::move(one));
    }
    return json_text(json, 2) + "\n";
}

}  // namespace delassus
