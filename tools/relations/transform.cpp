// SPDX-License-Identifier: BSD-3-Clause
#include "relations/transform.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "relations/draw.hpp"

namespace delassus::relations {
namespace {

Eigen::Vector3d vector_of(const Json& json) {
    return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

Json json_of(const Eigen::Vector3d& vector) {
    return Json::array({vector[0], vector[1], vector[2]});
}

Eigen::Quaterniond quaternion_of(const Json& json) {
    if (json.is_array())
        return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>(), json[3].get<double>()};
    const double angle = json["angle"].get<double>() * (std::numbers::pi / 180.0);
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector_of(json["axis"]).normalized()));
}

Json json_of(const Eigen::Quaterniond& turn) {
    const Eigen::Quaterniond unit = turn.normalized();
    return Json::array({unit.w(), unit.x(), unit.y(), unit.z()});
}

/// The list of that key, or an empty one.
Json& items(Json& scene, const char* key) {
    static Json none;
    none = Json::array();
    const auto found = scene.find(key);
    return found == scene.end() ? none : *found;
}

/// x → turn x + shift.
struct Place {
    Placement placement;
    [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector3d& x) const { return polar(x) + placement.shift; }
    [[nodiscard]] Eigen::Vector3d polar(const Eigen::Vector3d& v) const { return placement.turn * v; }
    [[nodiscard]] Eigen::Vector3d axial(const Eigen::Vector3d& v) const { return polar(v); }
    [[nodiscard]] Eigen::Quaterniond orientation(const Eigen::Quaterniond& q) const { return placement.turn * q; }
};

/// x → S x with S = diag(−1, 1, 1), what turns S R S: a vector that says how something turns goes to −S v. Of bodies
/// and shapes too, whose own axes are mirrored with them.
struct Mirror {
    [[nodiscard]] static Eigen::Vector3d point(const Eigen::Vector3d& x) { return polar(x); }
    [[nodiscard]] static Eigen::Vector3d polar(const Eigen::Vector3d& v) { return {-v.x(), v.y(), v.z()}; }
    [[nodiscard]] static Eigen::Vector3d axial(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
    [[nodiscard]] static Eigen::Quaterniond orientation(const Eigen::Quaterniond& q) {
        return {q.w(), q.x(), -q.y(), -q.z()};
    }
};

/// item[key] ← change of the vector that is there, if there is one.
template <class Change>
void change_vector(Json& item, const char* key, const Change& change) {
    if (item.contains(key)) item[key] = json_of(change(vector_of(item[key])));
}

template <class Motion>
void change_orientation(Json& item, const Motion& motion) {
    item["orientation"] = json_of(motion.orientation(item.contains("orientation") ? quaternion_of(item["orientation"])
                                                                                  : Eigen::Quaterniond::Identity()));
}

/// Three motions of one form, whose amplitudes are a vector.
template <class Change>
void change_motions(Json& three, const Change& change) {
    if (three[0].is_number()) {
        three = json_of(change(vector_of(three)));
        return;
    }
    for (const auto& [form, key] : {std::pair("sine", "amplitude"), std::pair("linear", "rate")}) {
        if (!three[0].contains(form)) continue;
        Eigen::Vector3d vector;
        for (int i = 0; i < 3; ++i) {
            const Json& amplitude = three[static_cast<std::size_t>(i)][form][key];
            vector[i] = amplitude.get<double>();
        }
        vector = change(vector);
        for (int i = 0; i < 3; ++i) three[static_cast<std::size_t>(i)][form][key] = vector[i];
    }
}

/// What is given in the world, moved.
template <class Motion>
Json moved(const Json& scene, const Motion& motion) {
    const auto point = [&](const Eigen::Vector3d& x) { return motion.point(x); };
    const auto polar = [&](const Eigen::Vector3d& v) { return motion.polar(v); };
    const auto axial = [&](const Eigen::Vector3d& v) { return motion.axial(v); };
    Json result = scene;
    change_vector(result, "gravity", polar);
    for (auto& body : items(result, "bodies")) {
        change_vector(body, "position", point);
        change_vector(body, "velocity", polar);
        change_orientation(body, motion);
        if (!body.contains("motion")) continue;
        auto& given = body["motion"];
        if (given.contains("translation")) change_motions(given["translation"], polar);
        if (given.contains("rotation")) {
            change_vector(given["rotation"], "axis", axial);
            change_vector(given["rotation"], "point", point);
        }
    }
    for (auto& joint : items(result, "joints")) {
        // The axes about which, or along which, coordinates count.
        const bool turns = joint["kind"] == "revolute" || joint["kind"] == "universal";
        for (const char* key : {"point", "second_point"}) change_vector(joint, key, point);
        for (const char* key : {"axis", "second_axis"})
            change_vector(joint, key, [&](const Eigen::Vector3d& v) { return turns ? axial(v) : polar(v); });
    }
    for (auto& spring : items(result, "springs"))
        for (const char* key : {"first_point", "second_point"}) change_vector(spring, key, point);
    for (auto& bushing : items(result, "bushings")) change_vector(bushing, "point", point);
    for (auto& load : items(result, "loads")) {
        change_vector(load, "point", point);
        if (load.value("follower", false)) continue;
        if (load.contains("force")) change_motions(load["force"], polar);
        if (load.contains("torque")) change_motions(load["torque"], axial);
    }
    return result;
}

void mirror_shape(Json& shape) {
    change_vector(shape, "position", Mirror::polar);
    change_orientation(shape, Mirror());
    if (shape.contains("convex"))
        for (auto& point : shape["convex"]["points"]) point = json_of(Mirror::polar(vector_of(point)));
}

void scale(Json& value, double factor) {
    if (value.is_number()) value = value.get<double>() * factor;
    if (value.is_array())
        for (auto& entry : value) scale(entry, factor);
}

void scale(Json& item, const char* key, double factor) {
    if (item.contains(key)) scale(item[key], factor);
}

void scale_motion(Json& motion, double value, double time) {
    if (motion.is_number()) {
        scale(motion, value);
        return;
    }
    for (auto& [form, parts] : motion.items()) {
        if (form == "constant") scale(parts, value);
        if (form == "linear") {
            scale(parts, "start", value);
            scale(parts, "rate", value / time);
        } else if (form == "sine") {
            scale(parts, "amplitude", value);
            scale(parts, "offset", value);
            scale(parts, "frequency", 1.0 / time);
        } else if (form == "ramp") {
            for (const char* key : {"from", "to"}) scale(parts, key, value);
            for (const char* key : {"start", "duration"}) scale(parts, key, time);
        } else if (form == "input") {
            if (parts.is_string()) parts = {{"name", parts}};
            parts["scale"] = value * parts.value("scale", 1.0);
            scale(parts, "offset", value);
        } else if (form == "table") {
            scale(parts, "values", value);
            scale(parts, "times", time);
        }
    }
}

void scale_shape(Json& shape, double length) {
    for (const char* key : {"sphere", "box", "capsule", "cylinder", "convex", "height_field"})
        if (shape.contains(key))
            for (const char* of : {"radius", "size", "length", "points", "heights"}) scale(shape[key], of, length);
    for (const char* key : {"position", "margin"}) scale(shape, key, length);
}

void scale_body(Json& body, const Units& units) {
    const double L = units.length, M = units.mass, T = units.time;
    scale(body, "mass", M);
    scale(body, "density", M / (L * L * L));
    if (body.contains("inertia"))
        for (auto& [name, moment] : body["inertia"].items()) scale(moment, M * L * L);
    scale(body, "position", L);
    scale(body, "velocity", L / T);
    scale(body, "angular_velocity", 1.0 / T);
    if (body.contains("shapes"))
        for (auto& shape : body["shapes"]) scale_shape(shape, L);
    if (!body.contains("motion")) return;
    auto& motion = body["motion"];
    if (motion.contains("translation"))
        for (auto& component : motion["translation"]) scale_motion(component, L, T);
    if (motion.contains("rotation")) {
        scale_motion(motion["rotation"]["angle"], 1.0, T);
        scale(motion["rotation"], "point", L);
    }
}

/// The unit of a joint's coordinate.
double coordinate_unit(const Json& joint, const Units& units) {
    return joint["kind"] == "prismatic" ? units.length : 1.0;
}

void scale_joint(Json& joint, const Units& units) {
    for (const char* key : {"point", "second_point"}) scale(joint, key, units.length);
    const double c = coordinate_unit(joint, units), T = units.time;
    // Energy over the coordinate is the force along it.
    const double force = units.mass * units.length * units.length / (T * T) / c;
    for (const char* key : {"lower", "upper", "start"}) scale(joint, key, c);
    scale(joint, "start_rate", c / T);
    scale(joint, "friction", force);
    scale(joint, "damping", force * T / c);
    if (joint.contains("spring")) {
        scale(joint["spring"], "stiffness", force / c);
        scale(joint["spring"], "rest", c);
    }
}

void scale_drives(Json& scene, const Json& original, const Units& units) {
    const double T = units.time;
    const auto unit_of = [&](const Json& drive) {
        return coordinate_unit(*find_named(original, "joints", drive["joint"]), units);
    };
    for (auto& motor : items(scene, "motors")) {
        const double c = unit_of(motor);
        scale_motion(motor["motion"], motor.value("speed", false) ? c / T : c, T);
        scale(motor, "force_limit", units.mass * units.length * units.length / (T * T) / c);
    }
    for (auto& servo : items(scene, "actuators")) {
        const double c = unit_of(servo), force = units.mass * units.length * units.length / (T * T) / c;
        if (servo.contains("position")) scale_motion(servo["position"], c, T);
        if (servo.contains("speed")) scale_motion(servo["speed"], c / T, T);
        scale(servo, "kp", force / c);
        scale(servo, "kd", force * T / c);
        scale(servo, "limit", force);
    }
}

/// Whether three motions are numbers, or sines or linear ones that differ in their amplitudes only.
bool can_be_turned(const Json& three) {
    if (std::all_of(three.begin(), three.end(), [](const Json& one) { return one.is_number(); })) return true;
    Json form;
    for (Json one : three) {
        if (!one.is_object() || !(one.contains("sine") || one.contains("linear"))) return false;
        for (const auto& [name, key] : {std::pair("sine", "amplitude"), std::pair("linear", "rate")})
            if (one.contains(name)) one[name].erase(key);
        if (!form.is_null() && form != one) return false;
        form = one;
    }
    return form.dump().find("offset") == std::string::npos && form.dump().find("start") == std::string::npos;
}

}  // namespace

bool is_known(const Json& scene) {
    for (const auto& [key, value] : scene.items())
        if (value.is_array() && !value.empty() && value.front().is_object() &&
            std::find(list_keys.begin(), list_keys.end(), key) == list_keys.end())
            return false;
    return true;
}

bool can_be_placed(const Json& scene) {
    const auto items_of = [&](const char* key) { return scene.contains(key) ? scene[key] : Json::array(); };
    for (const auto& body : items_of("bodies"))
        if (body.contains("motion") && body["motion"].contains("translation") &&
            !can_be_turned(body["motion"]["translation"]))
            return false;
    for (const auto& bushing : items_of("bushings"))
        if (bushing.value("first", std::string("world")) == "world") return false;
    for (const auto& load : items_of("loads"))
        for (const char* key : {"force", "torque"})
            if (!load.value("follower", false) && load.contains(key) && !can_be_turned(load[key])) return false;
    return true;
}

Json placed(const Json& scene, const Placement& placement) {
    return moved(scene, Place{placement});
}

bool can_be_mirrored(const Json& scene) {
    if (!can_be_placed(scene)) return false;
    const auto items_of = [&](const char* key) { return scene.contains(key) ? scene[key] : Json::array(); };
    for (const auto& body : items_of("bodies"))
        if (body.contains("shapes"))
            for (const auto& shape : body["shapes"])
                if (shape.contains("height_field")) return false;
    for (const auto& joint : items_of("joints"))
        if (joint["kind"] == "cylindrical" && joint.contains("spring")) return false;
    return true;
}

Json mirrored(const Json& scene) {
    Json result = moved(scene, Mirror());
    for (auto& body : items(result, "bodies")) {
        change_vector(body, "angular_velocity", Mirror::axial);
        if (body.contains("inertia"))
            for (const char* product : {"xy", "xz"})
                if (body["inertia"].contains(product))
                    body["inertia"][product] = -body["inertia"][product].get<double>();
        if (body.contains("shapes"))
            for (auto& shape : body["shapes"]) mirror_shape(shape);
    }
    for (auto& load : items(result, "loads")) {
        if (!load.value("follower", false)) continue;
        if (load.contains("force")) change_motions(load["force"], Mirror::polar);
        if (load.contains("torque")) change_motions(load["torque"], Mirror::axial);
    }
    return result;
}

Json in_units(const Json& scene, const Units& units) {
    Json result = scene;
    const double L = units.length, M = units.mass, T = units.time;
    for (const char* key : {"step", "end"}) scale(result, key, T);
    scale(result, "gravity", L / (T * T));
    for (auto& body : items(result, "bodies")) scale_body(body, units);
    for (auto& joint : items(result, "joints"))
        if (joint["kind"] != "gear") scale_joint(joint, units);
    scale_drives(result, scene, units);
    for (auto& spring : items(result, "springs")) {
        for (const char* key : {"first_point", "second_point", "rest_length"}) scale(spring, key, L);
        scale(spring, "stiffness", M / (T * T));
        scale(spring, "damping", M / T);
    }
    for (auto& bushing : items(result, "bushings")) {
        scale(bushing, "point", L);
        scale(bushing, "stiffness", M / (T * T));
        scale(bushing, "damping", M / T);
        scale(bushing, "turn_stiffness", M * L * L / (T * T));
        scale(bushing, "turn_damping", M * L * L / T);
    }
    for (auto& load : items(result, "loads")) {
        scale(load, "point", L);
        scale(load, "force", M * L / (T * T));
        scale(load, "torque", M * L * L / (T * T));
    }
    return result;
}

Json reordered(const Json& scene, std::uint64_t seed) {
    Json result = scene;
    Draw draw(seed, 0);
    for (const auto key : list_keys) {
        const auto list = result.find(std::string(key));
        if (list == result.end() || key == "material_pairs") continue;
        for (std::size_t i = list->size(); i > 1; --i)
            std::swap((*list)[i - 1], (*list)[static_cast<std::size_t>(draw.below(static_cast<int>(i)))]);
        // Two items are as likely to stay as not; the last place is what an order is most often noticed by.
        if (list->size() == 2) std::swap((*list)[0], (*list)[1]);
    }
    return result;
}

Json disturbed(const Json& scene, double length, double speed, double angle, double rate, std::uint64_t seed) {
    Json result = scene;
    const generating::CountedRandom random(seed);
    std::uint64_t number = 0;
    for (auto& body : items(result, "bodies")) {
        ++number;
        if (!moves(body)) continue;
        const auto vector = [&](std::uint64_t place) {
            return Eigen::Vector3d(random.symmetric(number, place), random.symmetric(number, place + 1),
                                   random.symmetric(number, place + 2));
        };
        const auto add = [&](const char* key, double amplitude, std::uint64_t place) {
            const Eigen::Vector3d before =
                body.contains(key) ? vector_of(body[key]) : Eigen::Vector3d(Eigen::Vector3d::Zero());
            body[key] = json_of(before + amplitude * vector(place));
        };
        add("position", length, 0);
        add("velocity", speed, 3);
        add("angular_velocity", rate, 6);
        const Eigen::Quaterniond before =
            body.contains("orientation") ? quaternion_of(body["orientation"]) : Eigen::Quaterniond::Identity();
        const Eigen::Vector3d half = 0.5 * angle * vector(9);
        body["orientation"] = json_of(before * Eigen::Quaterniond(1.0, half[0], half[1], half[2]));
    }
    return result;
}

Json cut(const Json& scene, const std::string& name, const MassOf& mass) {
    Json result = scene, half;
    for (auto& body : result["bodies"]) {
        if (body["name"] != name) continue;
        body.erase("density");
        body["mass"] = 0.5 * mass.mass;
        const auto& J = mass.inertia;
        body["inertia"] = {{"xx", 0.5 * J[0]}, {"yy", 0.5 * J[1]}, {"zz", 0.5 * J[2]},
                           {"xy", 0.5 * J[3]}, {"xz", 0.5 * J[4]}, {"yz", 0.5 * J[5]}};
        half = body;
    }
    half["name"] = name + "_half";
    half.erase("shapes");
    result["bodies"].push_back(half);
    result["joints"].push_back({{"name", name + "_weld"},
                                {"kind", "fixed"},
                                {"first", name},
                                {"second", name + "_half"},
                                {"point", half["position"]}});
    return result;
}

}  // namespace delassus::relations
