// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/plan_json.hpp"

#include "support/json.hpp"

namespace delassus {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const std::vector<PlanLine>& lines) {
    Json json = Json::array();
    for (const auto& line : lines) json.push_back({{"what", line.what}, {"reason", line.reason}});
    return json;
}

}  // namespace

std::string plan_json(std::string_view scene, const std::vector<SystemPlan>& plans) {
    Json json = {{"scene", scene}, {"systems", Json::array()}};
    for (const auto& one : plans)
        json["systems"].push_back({{"name", one.name},
                                   {"velocities", one.velocities},
                                   {"constraints", one.constraints},
                                   {"parts", one.parts},
                                   {"kept", json_of(one.kept)},
                                   {"left_out", json_of(one.left_out)},
                                   {"solvers", one.solvers},
                                   {"later_solvers", one.later_solvers},
                                   {"libraries", one.libraries}});
    return json_text(json, 2);
}

}  // namespace delassus
