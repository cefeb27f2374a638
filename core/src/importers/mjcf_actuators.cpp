// SPDX-License-Identifier: BSD-3-Clause
// Actuators: shortcuts as what they set of the general one, and what follows from the finished model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "importers/mjcf_place.hpp"
#include "importers/mjcf_spec.hpp"

namespace delassus::importers::mjcf {

namespace {

void read_general(const XmlElement& element, Actuator& a) {
    read_switch(element, "ctrllimited", a.control_limited);
    read_switch(element, "forcelimited", a.force_limited);
    read_switch(element, "actlimited", a.state_limited);
    element.read("ctrlrange", a.control_range.data(), 2, 2);
    element.read("forcerange", a.force_range.data(), 2, 2);
    element.read("actrange", a.state_range.data(), 2, 2);
    element.read("group", a.group);
    element.read("armature", a.armature);
    element.read("delay", a.delay);
    if (std::array<double, 3> values{}; element.read("damping", values.data(), 3, 1) > 0) a.damping = values[0];
    if (const std::size_t given = element.read("gear", a.gear.data(), 6, 1); given > 0)
        std::fill(a.gear.begin() + static_cast<std::ptrdiff_t>(given), a.gear.end(), 0.0);
    element.read("dyntype", a.dynamics);
    element.read("gaintype", a.gain);
    element.read("biastype", a.bias);
    element.read("gainprm", a.gain_parameters.data(), 10, 1);
    element.read("biasprm", a.bias_parameters.data(), 10, 1);
    static const std::pair<const char*, Transmission> targets[] = {
        {"joint", Transmission::Joint},   {"jointinparent", Transmission::JointInParent},
        {"tendon", Transmission::Tendon}, {"cranksite", Transmission::SliderCrank},
        {"site", Transmission::Site},     {"body", Transmission::Body}};
    for (const auto& [attribute, transmission] : targets)
        if (element.read(attribute, a.target)) a.transmission = transmission;
}

}  // namespace

bool is_actuator(const std::string& name) {
    static const char* const names[] = {"general",     "motor",    "position", "velocity", "intvelocity",
                                        "damper",      "cylinder", "muscle",   "adhesion", "dcmotor",
                                        "orientation", "pid",      "plugin"};
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

void read_actuator(const XmlElement& element, Actuator& a) {
    a.where = element.where();
    element.read("name", a.name);
    read_general(element, a);
    const std::string& kind = element.name;
    auto &gain = a.gain_parameters, &bias = a.bias_parameters;
    if (kind == "general") return;
    if (kind == "motor") {
        gain[0] = 1.0;
        bias.fill(0.0);
        a.dynamics = "none";
        a.gain = "fixed";
        a.bias = "none";
    } else if (kind == "position" || kind == "intvelocity") {
        element.read("kp", gain[0]);
        bias[1] = -gain[0];
        if (double kv = 0.0; element.read("kv", kv)) bias[2] = -kv;
        if (double ratio = 0.0; element.read("dampratio", ratio))
            bias[2] = ratio;  // finish_actuators() has the inertia
        if (double time = 0.0; element.read("timeconst", time)) a.dynamics = time == 0.0 ? "none" : "filterexact";
        element.read("inheritrange", a.inherit_range);
        a.gain = "fixed";
        a.bias = "affine";
        if (kind == "intvelocity") a.dynamics = "integrator";
    } else if (kind == "velocity") {
        element.read("kv", gain[0]);
        bias = {0.0, 0.0, -gain[0]};
        a.dynamics = "none";
        a.gain = "fixed";
        a.bias = "affine";
    } else if (kind == "damper") {
        double kv = a.gain == "affine" ? -gain[2] : 0.0;
        element.read("kv", kv);
        gain = {0.0, 0.0, -kv};
        bias.fill(0.0);
        a.dynamics = "none";
        a.gain = "affine";
        a.bias = "none";
        a.control_limited = Switch::On;
    } else {
        a.gain = kind;  // a law that scenes do not have
        if (kind == "adhesion") a.transmission = Transmission::Body;
    }
}

void finish_actuators(Spec& spec, model_import::Model& model) {
    const Compiler& compiler = spec.compilers.front();
    std::map<std::string, std::int32_t> joints;
    std::vector<const Joint*> all;
    for (const Body& body : spec.bodies)
        for (const Joint& joint : body.joints) {
            joints.emplace(joint.name, static_cast<std::int32_t>(all.size()));
            all.push_back(&joint);
        }
    std::vector<double> inertias;  // of the freedoms, found once one is asked for
    for (Actuator& a : spec.actuators) {
        if (a.transmission == Transmission::Joint || a.transmission == Transmission::JointInParent)
            if (const auto found = joints.find(a.target); found != joints.end()) a.joint = found->second;
        const Joint* joint = a.joint < 0 ? nullptr : all[static_cast<std::size_t>(a.joint)];
        if (a.inherit_range > 0.0 && joint != nullptr) {
            const double middle = 0.5 * (joint->range[0] + joint->range[1]),
                         radius = 0.5 * (joint->range[1] - joint->range[0]) * a.inherit_range;
            (a.dynamics == "integrator" ? a.state_range : a.control_range) = {middle - radius, middle + radius};
        }
        const std::string what = fmt::format("actuator \"{}\"", a.name);
        a.is_control_limited = limits(a.control_limited, "ctrlrange", a.control_range, compiler, what, model);
        a.is_force_limited = limits(a.force_limited, "forcerange", a.force_range, compiler, what, model);
        // kv = 2 ζ √(kp m), m: what the joint moves where the model is at its reference, seen through the gear
        double& damping = a.bias_parameters[2];
        if (!(damping > 0.0) || a.gain_parameters[0] != -a.bias_parameters[1] || a.bias != "affine") continue;
        if (joint == nullptr || freedoms_of(joint->type) != 1 || a.gear[0] == 0.0) continue;
        if (inertias.empty()) inertias = inertias_at_reference(spec);
        const double mass = inertias[static_cast<std::size_t>(joint->freedom)] / (a.gear[0] * a.gear[0]);
        damping = -damping * 2.0 * std::sqrt(std::max(0.0, a.gain_parameters[0] * mass));
    }
}

}  // namespace delassus::importers::mjcf
