// SPDX-License-Identifier: BSD-3-Clause
// Equality constraints and actuators of an MJCF model, and what a scene has no counterpart for.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "importers/mjcf_reader.hpp"

namespace delassus::importers {

using mjcf::EqualityType;
using mjcf::Transmission;
using std::abs;

namespace {

/// m, rad: what a loop may be open by where the scene places the bodies.
constexpr double most_gap = 1e-9;

template <class Item>
const Item* named(const std::vector<const Item*>& all, const std::string& name) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Item* one) { return one->name == name; });
    return found == all.end() ? nullptr : *found;
}

}  // namespace

void MjcfReader::read_equalities() {
    if (!spec_.option.equality || !spec_.option.constraint) {
        if (!spec_.equalities.empty())
            model_.without_effect.push_back({"equality constraints", "a flag disables them"});
        return;
    }
    for (const mjcf::Equality& equality : spec_.equalities) {
        const std::string what = fmt::format("equality \"{}\"", equality.name);
        if (!equality.active) {
            model_.without_effect.push_back({what, "it is not active"});
            continue;
        }
        if (equality.type == EqualityType::Other) {
            model_.lose(what, equality.kind == "tendon" ? "tendons"
                              : equality.kind == "distance"
                                  ? "a distance of geoms"
                                  : fmt::format("a constraint of the kind <{}>", equality.kind));
            continue;
        }
        if (!equality.softness.is_usual()) model_.lose(what, "solref and solimp: joints are rigid");
        const std::string name = joint_names_.take(equality.name, "loop");
        if (equality.type == EqualityType::Joint)
            read_joint_equality(equality, name);
        else
            read_loop(equality, name);
    }
}

// A connection holds two points together: sites, or an anchor of the first body where it is at the reference of both. A
// weld holds two frames together, and with a torquescale of 0 two points of them: the anchor in the second body, and
// where it is in the first. The scene starts elsewhere where a keyframe has balls or free bodies elsewhere.
void MjcfReader::read_loop(const mjcf::Equality& equality, const std::string& name) {
    const std::string what = fmt::format("equality \"{}\"", equality.name);
    const std::vector<mjcf::Placed> reference = mjcf::place(spec_, nullptr);
    struct End {
        std::int32_t body = 0;
        mjcf::Frame local = mjcf::Frame::Identity();  // what is held, in the frame of the body
    };
    const auto end_of = [&](const std::string& of) {
        End end;
        for (std::size_t k = 0; k < spec_.bodies.size(); ++k) {
            const mjcf::Body& body = spec_.bodies[k];
            if (!equality.by_sites && body.name == of) end.body = static_cast<std::int32_t>(k);
            for (const mjcf::Site& site : body.sites)
                if (equality.by_sites && site.name == of)
                    end = {static_cast<std::int32_t>(k), mjcf::frame_of(site.position, site.orientation)};
        }
        return end;
    };
    End first = end_of(equality.first), second = equality.second.empty() ? End{} : end_of(equality.second);
    const auto frame_at = [](const std::vector<mjcf::Placed>& where, const End& end) {
        return where[static_cast<std::size_t>(end.body)].frame * end.local;
    };
    const Vector3d anchor(equality.data.data());
    if (!equality.by_sites && equality.type == EqualityType::Connect) {
        first.local.translation() = anchor;
        const Vector3d point = frame_at(reference, first).translation();
        second.local.translation() = reference[static_cast<std::size_t>(second.body)].frame.inverse() * point;
    } else if (!equality.by_sites) {
        // The pose of the second body in the frame of the first: relpose, or else that of the reference.
        const Quaterniond turn(equality.data[6], equality.data[7], equality.data[8], equality.data[9]);
        if (equality.has_pose && turn.norm() > 0.0) {
            // relpose places the anchor, which is in the frame of the second body.
            second.local.translation() = anchor;
            first.local = mjcf::frame_of(Vector3d(equality.data.data() + 3), turn.normalized());
        } else {
            second.local.translation() = anchor;
            first.local = reference[static_cast<std::size_t>(first.body)].frame.inverse() * frame_at(reference, second);
        }
    }
    const double torques = equality.type == EqualityType::Weld ? equality.data[10] : 0.0;
    if (torques != 0.0 && torques != 1.0)
        model_.lose(what, fmt::format("torquescale {:.6g}: the weld is rigid", torques));
    if (!moves(first.body) && !moves(second.body)) return;
    const mjcf::Frame one = frame_at(placed_, first), other = frame_at(placed_, second);
    double gap = (one.translation() - other.translation()).norm();
    if (torques != 0.0) gap = std::max(gap, 2.0 * Quaterniond(one.linear().transpose() * other.linear()).vec().norm());
    if (gap > most_gap)
        return model_.lose(what, fmt::format("the bodies are {:.3g} m or rad from where it holds them", gap));
    if (body_at(first.body).weld == body_at(second.body).weld) return;  // they are one body
    ModelJoint loop;
    loop.closes_loop = true;
    JointParameters& own = loop.parameters;
    own.name = name;
    own.kind = torques == 0.0 ? JointKind::Spherical : JointKind::Fixed;
    own.first = moving_body(first.body);
    own.second = moving_body(second.body);
    own.point = model_import::array(other.translation());
    if (own.second < 0) std::swap(own.first, own.second);
    model_.joints.push_back(std::move(loop));
}

// q₁ − q₁(0) = Σ c_k (q₂ − q₂(0))^k; the coordinates of the scene are these differences.
void MjcfReader::read_joint_equality(const mjcf::Equality& equality, const std::string& name) {
    const std::string what = fmt::format("equality \"{}\"", equality.name);
    const mjcf::Joint *first = named(joints_, equality.first),
                      *second = equality.second.empty() ? nullptr : named(joints_, equality.second);
    const auto place = [&](const mjcf::Joint* joint) {
        return joint_[static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), joint) - joints_.begin())];
    };
    if (first == nullptr || mjcf::freedoms_of(first->type) != 1 ||
        (second != nullptr && mjcf::freedoms_of(second->type) != 1))
        return model_.lose(what, "a coupling of balls or free joints");
    const auto& c = equality.data;
    const bool constant = second == nullptr || (c[1] == 0.0 && c[2] == 0.0 && c[3] == 0.0 && c[4] == 0.0);
    if (constant) {
        model_.locks.push_back({force_names_.take(name, "lock"), place(first), c[0]});
        return;
    }
    if (c[0] != 0.0 || c[2] != 0.0 || c[3] != 0.0 || c[4] != 0.0)
        return model_.lose(what, "a coupling of joints that is no ratio");
    if (first->type != second->type) return model_.lose(what, "a coupling of an angle with a slide");
    if (first == second) return model_.lose(what, "a coupling of a joint with itself");
    ModelJoint gear;
    JointParameters& own = gear.parameters;
    own.kind = JointKind::Gear;
    own.name = name;
    own.gear_first = place(second);
    own.gear_second = place(first);
    own.gear_ratio = c[1];
    if (first->type == mjcf::JointType::Hinge) {
        const auto [p, q] = model_import::nearest_fraction(c[1]);
        own.gear_ratio = p / q;
        if (abs(p / q - c[1]) > 1e-9 * abs(c[1]))
            model_.lose(what, fmt::format("its ratio {} becomes {}/{}", c[1], p, q));
    }
    const auto start = [&](const mjcf::Joint* of) {
        const JointParameters& joint = model_.joints[static_cast<std::size_t>(place(of))].parameters;
        return (joint.kind == JointKind::Revolute ? joint.turn : joint.slide).start.value_or(0.0);
    };
    if (abs(start(first) - c[1] * start(second)) > most_gap)
        model_.lose(what, "the start does not keep its ratio: assembly moves the joints to where it holds");
    model_.joints.push_back(std::move(gear));
}

void MjcfReader::read_actuators() {
    if (!spec_.option.actuation) {
        if (!spec_.actuators.empty()) model_.without_effect.push_back({"actuators", "a flag disables them"});
        return;
    }
    for (std::size_t k = 0; k < spec_.actuators.size(); ++k) {
        const mjcf::Actuator& one = spec_.actuators[k];
        const auto& off = spec_.option.disabled_groups;
        if (std::find(off.begin(), off.end(), one.group) != off.end()) {
            model_.without_effect.push_back({fmt::format("actuator \"{}\"", one.name), "its group is disabled"});
            continue;
        }
        const double control = key_ == nullptr || k >= key_->ctrl.size() ? 0.0 : key_->ctrl[k];
        read_actuator(one, control, force_names_.take(one.name, "actuator"));
    }
}

namespace {

/// The range ← what of it lies between two values in either order.
void cut_off(model_import::ModelInput& input, double one, double other) {
    std::array<double, 2> range = input.range.value_or(
        std::array{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()});
    range = {std::max(range[0], std::min(one, other)), std::min(range[1], std::max(one, other))};
    range[1] = std::max(range[0], range[1]);
    input.range = range;
    input.start = std::clamp(input.start, range[0], range[1]);
}

}  // namespace

// With the length L = gear q of the transmission, the force is gain u + bias, both affine in L and L̇, and acts on the
// coordinate by the gear. At a constant control u it is the servo
//
//     τ = gear (b₀ + b₁ L + b₂ L̇) = kp (p − c) + kd (s − ċ),    kp = −gear² b₁,  kd = −gear² b₂
//
// with c = q − reference and what is constant in p, or in s where kp = 0.
void MjcfReader::read_actuator(const mjcf::Actuator& actuator, double control, const std::string& name) {
    const std::string what = fmt::format("actuator \"{}\"", actuator.name);
    const char* const kinds[] = {"nothing",  "a joint", "a joint",           "a slider-crank",
                                 "a tendon", "a site",  "adhesion of a body"};
    if (actuator.joint < 0)
        return model_.lose(what,
                           fmt::format("it acts through {}", kinds[static_cast<std::size_t>(actuator.transmission)]));
    const mjcf::Joint& joint = *joints_[static_cast<std::size_t>(actuator.joint)];
    if (mjcf::freedoms_of(joint.type) != 1) return model_.lose(what, "it acts on a ball or a free joint");
    if (actuator.dynamics != "none") return model_.lose(what, "it has a state of its own (activation)");
    const auto is_known = [](const std::string& law) { return law == "none" || law == "fixed" || law == "affine"; };
    if (!is_known(actuator.gain) || !is_known(actuator.bias)) {
        const bool muscle = actuator.gain == "muscle" || actuator.gain == "user";
        return model_.lose(what, muscle ? "its force is that of a muscle or of a user's code"
                                        : fmt::format("its force has a law that scenes do not have ({})",
                                                      is_known(actuator.gain) ? actuator.bias : actuator.gain));
    }
    if (actuator.delay != 0.0) model_.lose(what, "a delay of its control");
    if (actuator.armature != 0.0 || actuator.damping != 0.0)
        model_.lose(what, "an armature or a damping of the actuator");
    if (actuator.is_control_limited && spec_.option.clamp_control)
        control = std::clamp(control, actuator.control_range[0],
                             std::max(actuator.control_range[0], actuator.control_range[1]));
    std::array<double, 3> b{};
    for (std::size_t i = 0; i < 3; ++i) {
        if (actuator.gain == "affine" || (actuator.gain == "fixed" && i == 0))
            b[i] += control * actuator.gain_parameters[i];
        if (actuator.bias == "affine") b[i] += actuator.bias_parameters[i];
    }
    const double gear = actuator.gear[0], control_gain = actuator.gain_parameters[0];
    std::optional<model_import::ModelInput> input;
    if (inputs_ && gear != 0.0 && control_gain != 0.0) {
        if (actuator.gain == "affine" && (actuator.gain_parameters[1] != 0.0 || actuator.gain_parameters[2] != 0.0)) {
            model_.lose(what, "its stiffness follows its control, which stays as it is");
        } else {
            input.emplace();
            input->name = name;
            input->start = control;
            if (actuator.is_control_limited && spec_.option.clamp_control) input->range = actuator.control_range;
        }
    }
    const std::int32_t number = joint_[static_cast<std::size_t>(actuator.joint)];
    const double reference = joint.reference;
    // What the actuator gives, and what all of a joint may give together (actuatorfrcrange, here of each by itself).
    bool limited = actuator.is_force_limited;
    double low = limited ? actuator.force_range[0] : -std::numeric_limits<double>::infinity(),
           high = limited ? actuator.force_range[1] : -low;
    if (joint.is_force_limited && gear != 0.0) {
        const double ends[2] = {joint.force_range[0] / gear, joint.force_range[1] / gear};
        low = std::max(low, std::min(ends[0], ends[1]));
        high = std::min(high, std::max(ends[0], ends[1]));
        limited = true;
    }
    if (gear == 0.0 || (!input && b[0] == 0.0 && b[1] == 0.0 && b[2] == 0.0)) {
        const JointParameters& own = model_.joints[static_cast<std::size_t>(number)].parameters;
        return model_.lose(what, fmt::format("a motor of the joint \"{}\" whose force is its control times {:.6g}; the "
                                             "control is 0",
                                             own.name, gear * actuator.gain_parameters[0]));
    }
    if (b[1] == 0.0 && b[2] == 0.0) {
        const double force = limited ? std::clamp(b[0], low, std::max(low, high)) : b[0];
        if (input) {
            const double constant = b[0] - control_gain * control;
            input->scale = gear * control_gain;
            input->offset = gear * constant;
            if (limited) cut_off(*input, (low - constant) / control_gain, (high - constant) / control_gain);
        }
        model_.drives.push_back({name, number, gear * force, input});
        return;
    }
    model_import::ModelActuator servo;
    servo.name = name;
    servo.joint = number;
    servo.kp = -gear * gear * b[1];
    servo.kd = -gear * gear * b[2];
    if (servo.kp < 0.0 || servo.kd < 0.0) return model_.lose(what, "it pushes away from its goal, or along the speed");
    const double gain = gear / (servo.kp > 0.0 ? servo.kp : servo.kd), shift = servo.kp > 0.0 ? reference : 0.0;
    (servo.kp > 0.0 ? servo.position : servo.speed) = gain * b[0] - shift;
    if (input) {
        input->scale = gain * control_gain;
        input->offset = gain * (b[0] - control_gain * control) - shift;
        servo.input = input;
    }
    if (limited) {
        servo.limit = abs(gear) * std::max(abs(low), abs(high));
        if (low != -high)
            model_.lose(
                what, fmt::format("limits {:.6g} and {:.6g} of its force that differ: the larger holds both ways", low,
                                  high));
        if (!(servo.limit > 0.0)) return model_.lose(what, "its force is limited to 0");
    }
    model_.actuators.push_back(std::move(servo));
}

void MjcfReader::note_others() {
    for (const mjcf::Tendon& tendon : spec_.tendons) {
        const std::string what = fmt::format("tendon \"{}\"", tendon.name);
        const bool limited = mjcf::limits(tendon.limited, "range", tendon.range, spec_.compilers.front(), what, model_);
        const bool acts = tendon.stiffness[0] != 0.0 || tendon.damping[0] != 0.0 || tendon.friction_loss != 0.0 ||
                          tendon.armature != 0.0 || limited;
        if (acts) {
            model_.lose(what, "its spring, damping, dry friction or limit");
        } else {
            model_.without_effect.push_back({what, "nothing acts in it of itself"});
        }
    }
    std::vector<std::string> keys;
    for (const mjcf::Key& key : spec_.keys)
        if (&key != key_) keys.push_back(key.name);
    if (!keys.empty())
        model_.without_effect.push_back(
            {"keyframes", fmt::format("{} (--keyframe starts at one)", fmt::join(keys, ", "))});
    for (const auto& [kind, names] : spec_.seen)
        model_.without_effect.push_back({kind, fmt::format("{}", fmt::join(names, ", "))});
}

}  // namespace delassus::importers
