// SPDX-License-Identifier: BSD-3-Clause
#include "relations/shrink.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>

namespace delassus::relations {
namespace {

/// Removes the items of a list for which it says so, and an empty list.
template <class Says>
void remove_items(Json& scene, const char* key, const Says& says) {
    if (!scene.contains(key)) return;
    Json rest = Json::array();
    for (const auto& item : scene[key])
        if (!says(item)) rest.push_back(item);
    if (rest.empty() && std::string_view(key) != "bodies") {
        scene.erase(key);
    } else {
        scene[key] = rest;
    }
}

bool names(const Json& item, std::initializer_list<const char*> keys, const std::string& name) {
    return std::any_of(keys.begin(), keys.end(),
                       [&](const char* key) { return item.contains(key) && item[key] == name; });
}

void remove_joint(Json& scene, const std::string& name) {
    const auto of_it = [&](const Json& item) { return names(item, {"name", "gear_first", "gear_second"}, name); };
    remove_items(scene, "joints", of_it);
    for (const char* list : {"motors", "actuators"})
        remove_items(scene, list, [&](const Json& item) { return names(item, {"joint"}, name); });
}

void remove_body(Json& scene, const std::string& name) {
    std::vector<std::string> joints;
    if (scene.contains("joints"))
        for (const auto& joint : scene["joints"])
            if (names(joint, {"first", "second"}, name)) joints.push_back(joint["name"]);
    for (const auto& joint : joints) remove_joint(scene, joint);
    for (const char* list : {"springs", "bushings", "loads"})
        remove_items(scene, list, [&](const Json& item) { return names(item, {"first", "second", "body"}, name); });
    remove_items(scene, "bodies", [&](const Json& item) { return names(item, {"name"}, name); });
}

bool is_zero(const Json& vector) {
    return std::all_of(vector.begin(), vector.end(), [](const Json& entry) { return entry == 0.0; });
}

/// Each with one optional key less, or with a vector that is nought.
void without_options(const Json& scene, std::vector<Json>& all) {
    for (const char* key : {"solver", "integrator", "coordinates"})
        if (scene.contains(key)) {
            all.push_back(scene);
            all.back().erase(key);
        }
    for (const auto& [list, keys] : {std::pair<const char*, std::vector<const char*>>{
                                         "joints", {"spring", "damping", "lower", "upper", "friction", "start_rate"}},
                                     {"motors", {"force_limit", "speed"}},
                                     {"actuators", {"limit", "kd"}},
                                     {"springs", {"damping"}},
                                     {"loads", {"torque", "follower"}},
                                     {"bushings", {"turn_stiffness"}}}) {
        if (!scene.contains(list)) continue;
        for (std::size_t i = 0; i < scene[list].size(); ++i)
            for (const char* key : keys) {
                if (!scene[list][i].contains(key)) continue;
                all.push_back(scene);
                all.back()[list][i].erase(key);
            }
    }
    for (std::size_t i = 0; i < scene["bodies"].size(); ++i) {
        const Json& body = scene["bodies"][i];
        for (const char* key : {"velocity", "angular_velocity"})
            if (body.contains(key) && !is_zero(body[key])) {
                all.push_back(scene);
                all.back()["bodies"][i][key] = {0.0, 0.0, 0.0};
            }
        if (const Json none = {{"axis", {0.0, 0.0, 1.0}}, {"angle", 0}};
            body.contains("orientation") && body["orientation"] != none) {
            all.push_back(scene);
            all.back()["bodies"][i]["orientation"] = none;
        }
        if (!body.contains("shapes")) continue;
        for (std::size_t k = 0; k < body["shapes"].size(); ++k)
            if (body["shapes"][k].contains("material")) {
                all.push_back(scene);
                all.back()["bodies"][i]["shapes"][k].erase("material");
            }
    }
    if (!is_zero(scene["gravity"])) {
        all.push_back(scene);
        all.back()["gravity"] = {0.0, 0.0, 0.0};
        if (scene["gravity"] != Json({0.0, 0.0, -9.81})) {
            all.push_back(scene);
            all.back()["gravity"] = {0.0, 0.0, -9.81};
        }
    }
}

void without_shapes(const Json& scene, std::vector<Json>& all) {
    for (std::size_t i = 0; i < scene["bodies"].size(); ++i) {
        const Json& body = scene["bodies"][i];
        // What has its mass from its shapes keeps them.
        if (!body.contains("shapes") || body.contains("density")) continue;
        all.push_back(scene);
        all.back()["bodies"][i].erase("shapes");
        if (body["shapes"].size() < 2) continue;
        for (std::size_t k = 0; k < body["shapes"].size(); ++k) {
            all.push_back(scene);
            all.back()["bodies"][i]["shapes"].erase(k);
        }
    }
}

}  // namespace

std::vector<Json> smaller_scenes(const Json& scene) {
    std::vector<Json> all;
    std::size_t moving = 0;
    for (const auto& body : scene["bodies"]) moving += moves(body) ? 1 : 0;
    for (const auto& body : scene["bodies"]) {
        if (moves(body) && moving < 2) continue;
        all.push_back(scene);
        remove_body(all.back(), body["name"]);
    }
    if (scene.contains("joints"))
        for (const auto& joint : scene["joints"]) {
            all.push_back(scene);
            remove_joint(all.back(), joint["name"]);
        }
    for (const char* list : {"motors", "actuators", "springs", "bushings", "loads"}) {
        if (!scene.contains(list)) continue;
        for (const auto& item : scene[list]) {
            all.push_back(scene);
            const std::string name = item["name"];
            remove_items(all.back(), list, [&](const Json& other) { return names(other, {"name"}, name); });
        }
    }
    without_shapes(scene, all);
    const double step = scene["step"].get<double>(), end = scene["end"].get<double>();
    if (end > 4.0 * step) {
        all.push_back(scene);
        all.back()["end"] = 0.5 * end;
    }
    without_options(scene, all);
    return all;
}

Shrunk shrunk(const ApartSettings& settings, const Json& scene, const Told& told, double seconds) {
    const auto begin = std::chrono::steady_clock::now();
    const auto over = [&] {
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
        return taken.count() > seconds || (settings.cancelled && settings.cancelled());
    };
    ApartSettings limited = settings;
    limited.cancelled = over;
    Shrunk smallest{scene, told.detail};
    for (bool smaller = true; smaller && !over();) {
        smaller = false;
        const auto candidates = smaller_scenes(smallest.scene);
        judge_documents(limited, candidates, {told.relation}, [&](const ScenesAnswer& answer) {
            for (const auto& now : answer.outcomes) {
                if (smaller || now.relation != told.relation || now.verdict != told.verdict) continue;
                smaller = true;
                smallest = {candidates[answer.number], now.detail};
            }
            return !smaller;
        });
    }
    return smallest;
}

}  // namespace delassus::relations
