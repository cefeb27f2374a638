// SPDX-License-Identifier: BSD-3-Clause
// Equality constraints and actuators of an MJCF model, and what a scene has no counterpart for.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "delassus/error.hpp"
#include "importers/mjcf_reader.hpp"

namespace delassus::importers {

using std::abs;

namespace {

/// m, rad: what a loop may be open by where the scene places the bodies.
constexpr double most_gap = 1e-9;

}  // namespace

void MjcfReader::read_equalities() {
    const mjData& d = *data_;
    if (disabled(mjDSBL_EQUALITY) || disabled(mjDSBL_CONSTRAINT)) {
        if (m_.neq > 0) model_.without_effect.push_back({"equality constraints", "a flag disables them"});
        return;
    }
    for (int e = 0; e < m_.neq; ++e) {
        const int type = m_.eq_type[e], first = m_.eq_obj1id[e], second = m_.eq_obj2id[e];
        const std::string what = item("equality", mjOBJ_EQUALITY, e);
        if (m_.eq_active[e] == 0) {
            model_.without_effect.push_back({what, "it is not active"});
            continue;
        }
        if (type == mjEQ_TENDON || type == mjEQ_DISTANCE) {
            model_.lose(what, type == mjEQ_TENDON ? "tendons" : "a distance of geoms");
            continue;
        }
        if (!std::equal(usual_solref.begin(), usual_solref.end(), m_.eq_solref + mjNREF * e) ||
            !std::equal(usual_solimp.begin(), usual_solimp.end(), m_.eq_solimp + mjNIMP * e))
            model_.lose(what, "solref and solimp: joints are rigid");
        const std::string name = joint_names_.take(name_of(mjOBJ_EQUALITY, e), "loop");
        if (type == mjEQ_JOINT) {
            read_joint_equality(e, name);
            continue;
        }
        if (!moves(first) && !moves(second)) continue;
        double gap = 0.0;
        for (int row = 0; row < d.nefc; ++row)
            if (d.efc_type[row] == mjCNSTR_EQUALITY && d.efc_id[row] == e) gap = std::max(gap, abs(d.efc_pos[row]));
        if (gap > most_gap) {
            model_.lose(what, fmt::format("the bodies are {:.3g} m or rad from where it holds them", gap));
            continue;
        }
        if (m_.body_weldid[first] == m_.body_weldid[second]) continue;  // they are one body
        ModelJoint loop;
        loop.closes_loop = true;
        JointParameters& own = loop.parameters;
        own.name = name;
        own.kind = type == mjEQ_CONNECT ? JointKind::Spherical : JointKind::Fixed;
        own.first = moving_body(first);
        own.second = moving_body(second);
        const Vector3d place = vector_at(d.xpos, first);
        const Quaterniond turn = quaternion_at(d.xquat, first).normalized();
        // The anchor of a connection is in the frame of the first body. Any point does for a weld.
        own.point =
            model_import::array(type == mjEQ_CONNECT ? Vector3d(place + turn * Vector3d(m_.eq_data + mjNEQDATA * e))
                                                     : vector_at(d.xpos, second));
        if (own.second < 0) std::swap(own.first, own.second);
        model_.joints.push_back(std::move(loop));
        if (own.first < 0) continue;
        for (int a = 0; a < m_.ngeom; ++a)
            for (int b = 0; b < m_.ngeom; ++b)
                if (is_shape_[static_cast<std::size_t>(a)] != 0 && is_shape_[static_cast<std::size_t>(b)] != 0 &&
                    m_.body_weldid[m_.geom_bodyid[a]] == m_.body_weldid[first] &&
                    m_.body_weldid[m_.geom_bodyid[b]] == m_.body_weldid[second] && touches(a, b)) {
                    model_.lose(what, "its bodies may touch: bodies with a joint between them never do in a scene");
                    a = b = m_.ngeom;
                }
    }
}

// q₁ − q₁(0) = Σ c_k (q₂ − q₂(0))^k; the coordinates of the scene are these differences.
void MjcfReader::read_joint_equality(int e, const std::string& name) {
    const int first = m_.eq_obj1id[e], second = m_.eq_obj2id[e];
    const mjtNum* c = m_.eq_data + mjNEQDATA * e;
    const std::string what = item("equality", mjOBJ_EQUALITY, e);
    const auto place = [&](int j) { return joint_[static_cast<std::size_t>(j)]; };
    const bool constant = second < 0 || (c[1] == 0.0 && c[2] == 0.0 && c[3] == 0.0 && c[4] == 0.0);
    if (constant) {
        model_.locks.push_back({force_names_.take(name, "lock"), place(first), c[0]});
        return;
    }
    if (c[0] != 0.0 || c[2] != 0.0 || c[3] != 0.0 || c[4] != 0.0)
        return model_.lose(what, "a coupling of joints that is no ratio");
    if (m_.jnt_type[first] != m_.jnt_type[second]) return model_.lose(what, "a coupling of an angle with a slide");
    ModelJoint gear;
    JointParameters& own = gear.parameters;
    own.kind = JointKind::Gear;
    own.name = name;
    own.gear_first = place(second);
    own.gear_second = place(first);
    own.gear_ratio = c[1];
    if (m_.jnt_type[first] == mjJNT_HINGE) {
        const auto [p, q] = model_import::nearest_fraction(c[1]);
        own.gear_ratio = p / q;
        if (abs(p / q - c[1]) > 1e-9 * abs(c[1]))
            model_.lose(what, fmt::format("its ratio {} becomes {}/{}", c[1], p, q));
    }
    const auto start = [&](int j) {
        const JointParameters& joint = model_.joints[static_cast<std::size_t>(place(j))].parameters;
        return (joint.kind == JointKind::Revolute ? joint.turn : joint.slide).start.value_or(0.0);
    };
    if (abs(start(first) - c[1] * start(second)) > most_gap)
        model_.lose(what, "the start does not keep its ratio: assembly moves the joints to where it holds");
    model_.joints.push_back(std::move(gear));
}

void MjcfReader::read_actuators() {
    if (disabled(mjDSBL_ACTUATION)) {
        if (m_.nu > 0) model_.without_effect.push_back({"actuators", "a flag disables them"});
        return;
    }
    for (int k = 0; k < m_.nu; ++k) read_actuator(k, force_names_.take(name_of(mjOBJ_ACTUATOR, k), "actuator"));
}

// With the length L = gear q of the transmission, the force is gain u + bias, both affine in L and L̇, and acts on the
// coordinate by the gear. At a constant control u it is the servo
//
//     τ = gear (b₀ + b₁ L + b₂ L̇) = kp (p − c) + kd (s − ċ),    kp = −gear² b₁,  kd = −gear² b₂
//
// with c = q − reference and what is constant in p, or in s where kp = 0.
void MjcfReader::read_actuator(int k, const std::string& name) {
    const std::string what = item("actuator", mjOBJ_ACTUATOR, k);
    const int transmission = m_.actuator_trntype[k], joint = m_.actuator_trnid[2 * k];
    const char* const kinds[] = {"", "", "a slider-crank", "a tendon", "a site", "adhesion of a body"};
    if (transmission != mjTRN_JOINT && transmission != mjTRN_JOINTINPARENT)
        return model_.lose(what,
                           fmt::format("it acts through {}", transmission <= mjTRN_BODY ? kinds[transmission] : "?"));
    if (m_.jnt_type[joint] != mjJNT_HINGE && m_.jnt_type[joint] != mjJNT_SLIDE)
        return model_.lose(what, "it acts on a ball or a free joint");
    const int gain = m_.actuator_gaintype[k], bias = m_.actuator_biastype[k];
    if (m_.actuator_dyntype[k] != mjDYN_NONE) return model_.lose(what, "it has a state of its own (activation)");
    if (gain == mjGAIN_MUSCLE || gain == mjGAIN_USER || bias == mjBIAS_MUSCLE || bias == mjBIAS_USER)
        return model_.lose(what, "its force is that of a muscle or of a user's code");
    double control = key_ < 0 ? 0.0 : m_.key_ctrl[key_ * m_.nu + k];
    if (m_.actuator_ctrllimited[k] != 0 && !disabled(mjDSBL_CLAMPCTRL))
        control = std::clamp(control, m_.actuator_ctrlrange[2 * k], m_.actuator_ctrlrange[2 * k + 1]);
    std::array<double, 3> b{};
    for (int i = 0; i < 3; ++i) {
        if (gain == mjGAIN_AFFINE || (gain == mjGAIN_FIXED && i == 0))
            b[static_cast<std::size_t>(i)] += control * m_.actuator_gainprm[mjNGAIN * k + i];
        if (bias == mjBIAS_AFFINE) b[static_cast<std::size_t>(i)] += m_.actuator_biasprm[mjNBIAS * k + i];
    }
    const double gear = m_.actuator_gear[6 * k];
    const std::int32_t number = joint_[static_cast<std::size_t>(joint)];
    const bool limited = m_.actuator_forcelimited[k] != 0;
    const double low = m_.actuator_forcerange[2 * k], high = m_.actuator_forcerange[2 * k + 1];
    if (gear == 0.0 || (b[0] == 0.0 && b[1] == 0.0 && b[2] == 0.0)) {
        const JointParameters& own = model_.joints[static_cast<std::size_t>(number)].parameters;
        return model_.lose(what, fmt::format("a motor of the joint \"{}\" whose force is its control times {:.6g}; the "
                                             "control is 0",
                                             own.name, gear * m_.actuator_gainprm[mjNGAIN * k]));
    }
    if (b[1] == 0.0 && b[2] == 0.0) {
        const double force = limited ? std::clamp(b[0], low, high) : b[0];
        model_.drives.push_back({name, number, gear * force});
        return;
    }
    model_import::ModelActuator servo;
    servo.name = name;
    servo.joint = number;
    servo.kp = -gear * gear * b[1];
    servo.kd = -gear * gear * b[2];
    if (servo.kp < 0.0 || servo.kd < 0.0) return model_.lose(what, "it pushes away from its goal, or along the speed");
    const double reference = reference_[static_cast<std::size_t>(joint)];
    if (servo.kp > 0.0) {
        servo.position = gear * b[0] / servo.kp - reference;
    } else {
        servo.speed = gear * b[0] / servo.kd;
    }
    if (limited) {
        servo.limit = abs(gear) * std::max(abs(low), abs(high));
        if (low != -high)
            model_.lose(
                what, fmt::format("limits {:.6g} and {:.6g} of its force that differ: the larger holds both ways", low,
                                  high));
    }
    model_.actuators.push_back(std::move(servo));
}

void MjcfReader::note_others() {
    for (int k = 0; k < m_.ntendon; ++k) {
        const bool acts = m_.tendon_stiffness[k] != 0.0 || m_.tendon_damping[k] != 0.0 ||
                          m_.tendon_frictionloss[k] != 0.0 || m_.tendon_limited[k] != 0;
        const std::string what = item("tendon", mjOBJ_TENDON, k);
        if (acts) {
            model_.lose(what, "its spring, damping, dry friction or limit");
        } else {
            model_.without_effect.push_back({what, "nothing acts in it of itself"});
        }
    }
    const std::array<std::pair<const char*, std::pair<mjtObj, int>>, 10> kinds = {
        {{"sites", {mjOBJ_SITE, m_.nsite}},
         {"sensors", {mjOBJ_SENSOR, m_.nsensor}},
         {"cameras", {mjOBJ_CAMERA, m_.ncam}},
         {"lights", {mjOBJ_LIGHT, m_.nlight}},
         {"textures", {mjOBJ_TEXTURE, m_.ntex}},
         {"materials of looks", {mjOBJ_MATERIAL, m_.nmat}},
         {"skins", {mjOBJ_SKIN, m_.nskin}},
         {"numbers", {mjOBJ_NUMERIC, m_.nnumeric}},
         {"texts", {mjOBJ_TEXT, m_.ntext}},
         {"tuples", {mjOBJ_TUPLE, m_.ntuple}}}};
    for (const auto& [kind, which] : kinds) {
        std::vector<std::string> names;
        for (int k = 0; k < which.second; ++k) names.push_back(name_of(which.first, k));
        if (!names.empty()) model_.without_effect.push_back({kind, fmt::format("{}", fmt::join(names, ", "))});
    }
    std::vector<std::string> keys;
    for (int k = 0; k < m_.nkey; ++k)
        if (k != key_) keys.push_back(name_of(mjOBJ_KEY, k));
    if (!keys.empty())
        model_.without_effect.push_back(
            {"keyframes", fmt::format("{} (--keyframe starts at one)", fmt::join(keys, ", "))});
}

}  // namespace delassus::importers
