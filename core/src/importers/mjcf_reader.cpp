// SPDX-License-Identifier: BSD-3-Clause
// Bodies, joints and options of an MJCF model.
#include "importers/mjcf_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"

namespace delassus::importers {

using mjcf::JointType;

namespace {

template <class Item>
void give(std::vector<Item>& items, const char* kind) {
    for (std::size_t k = 0; k < items.size(); ++k)
        if (items[k].name.empty()) items[k].name = fmt::format("{}_{}", kind, k);
}

}  // namespace

MjcfReader::MjcfReader(mjcf::Spec& spec, const ImportSettings& settings, Model& model)
    : spec_(spec), model_(model), inputs_(settings.inputs) {
    give_names();
    for (const mjcf::Body& body : spec.bodies) {
        for (const mjcf::Joint& joint : body.joints) joints_.push_back(&joint);
        for (const mjcf::Geom& geom : body.geoms) geoms_.push_back(&geom);
    }
    body_.assign(spec.bodies.size(), -1);
    joint_.assign(joints_.size(), -1);
    class_.assign(geoms_.size(), -1);
    is_shape_.assign(geoms_.size(), 0);
    find_keyframe(settings.keyframe);
}

// Its own name, or its kind with its number.
void MjcfReader::give_names() {
    std::size_t joints = 0, geoms = 0;
    for (std::size_t k = 0; k < spec_.bodies.size(); ++k) {
        mjcf::Body& body = spec_.bodies[k];
        if (body.name.empty()) body.name = fmt::format("body_{}", k);
        for (mjcf::Joint& joint : body.joints) {
            if (joint.name.empty()) joint.name = fmt::format("joint_{}", joints);
            ++joints;
        }
        for (mjcf::Geom& geom : body.geoms) {
            if (geom.name.empty()) geom.name = fmt::format("geom_{}", geoms);
            ++geoms;
        }
    }
    give(spec_.equalities, "equality");
    give(spec_.actuators, "actuator");
    give(spec_.tendons, "tendon");
    give(spec_.keys, "key");
}

void MjcfReader::find_keyframe(const std::string& keyframe) {
    if (keyframe.empty()) return;
    std::vector<std::string> names;
    for (std::size_t k = 0; k < spec_.keys.size(); ++k) {
        names.push_back(spec_.keys[k].name);
        if (names.back() == keyframe || std::to_string(k) == keyframe) key_ = &spec_.keys[k];
    }
    if (key_ == nullptr)
        throw InputError(names.empty()
                             ? fmt::format("it has no keyframes, and so none named \"{}\"", keyframe)
                             : fmt::format("it has no keyframe \"{}\"; it has {}", keyframe, fmt::join(names, ", ")));
    const auto check = [&](const char* attribute, std::size_t given, std::size_t wanted) {
        if (given != 0 && given != wanted)
            throw InputError(fmt::format("{}: {} of the keyframe \"{}\" has {} numbers in place of {}", key_->where,
                                         attribute, key_->name, given, wanted));
    };
    check("qpos", key_->qpos.size(), static_cast<std::size_t>(spec_.coordinates));
    check("qvel", key_->qvel.size(), static_cast<std::size_t>(spec_.freedoms));
    check("ctrl", key_->ctrl.size(), spec_.actuators.size());
    check("mpos", key_->mpos.size(), 3 * static_cast<std::size_t>(spec_.mocaps));
    check("mquat", key_->mquat.size(), 4 * static_cast<std::size_t>(spec_.mocaps));
}

void MjcfReader::read() {
    model_.title = spec_.title;
    placed_ = mjcf::place(spec_, key_);
    read_options();
    ModelBody ground;  // for the shapes of the world
    ground.name = body_names_.take("ground", "");
    ground.fixed = true;
    body_[0] = 0;
    model_.bodies.push_back(ground);
    for (std::size_t body = 1; body < spec_.bodies.size(); ++body) read_body(body);
    find_pairs();
    read_shapes();
    read_equalities();
    read_touching();
    read_materials();
    read_actuators();
    note_others();
}

void MjcfReader::read_options() {
    const mjcf::Option& option = spec_.option;
    model_.step = option.step;
    model_.gravity = option.gravity_on ? option.gravity : Vector3d::Zero();
    if (option.density != 0.0 || option.viscosity != 0.0)
        model_.lose("option density, viscosity", "the forces of a fluid on bodies");
    else if (!option.wind.isZero(0.0))
        model_.without_effect.push_back({"option wind", "there is no fluid"});
    if (!option.filter_parent && option.contact && option.constraint)
        model_.lose("flag filterparent", "bodies with a joint between them never touch in a scene");
}

// The frame of a body in the scene has the axes of the body of MuJoCo, and its origin in the mass centre.
void MjcfReader::read_body(std::size_t index) {
    const mjcf::Body& body = spec_.bodies[index];
    const mjcf::Placed& at = placed_[index];
    const auto own = static_cast<std::int32_t>(index);
    const std::string what = fmt::format("body \"{}\"", body.name);
    ModelBody result;
    result.name = body_names_.take(body.name, "body");
    result.position = at.frame * body.own.centre;
    result.orientation = Quaterniond(at.frame.linear()).normalized();
    result.mass = body.own.mass;
    result.inertia = 0.5 * (body.own.inertia + body.own.inertia.transpose());
    result.fixed = !moves(own);
    if (!result.fixed) {
        result.velocity = at.velocity + at.angular_velocity.cross(result.position - at.frame.translation());
        result.angular_velocity = result.orientation.conjugate() * at.angular_velocity;
        if (body.gravity_compensation != 0.0 && body.own.mass > 0.0 && !model_.gravity.isZero(0.0))
            model_.lose(what, fmt::format("gravcomp: {:.6g} of its weight is held", body.gravity_compensation));
    }
    if (body.mocap) model_.lose(what, "it is moved from outside (mocap): here it stands still");
    const auto number = static_cast<std::int32_t>(model_.bodies.size());
    body_[index] = number;
    model_.bodies.push_back(std::move(result));
    if (!moves(own)) return;
    if (body.joints.empty()) {
        ModelJoint joint;
        joint.parameters.kind = JointKind::Fixed;
        joint.parameters.first = moving_body(body.parent);
        joint.parameters.second = number;
        model_.joints.push_back(std::move(joint));
        return;
    }
    if (body.joints[0].type == JointType::Free) {
        joint_names_.take(body.joints[0].name, "joint");
        lose_of_free_joint(body.joints[0]);
        return;
    }
    // Pieces between joints move with the parent until a ball, whose start may turn, and with the body from then on.
    const auto first =
        static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), &body.joints[0]) - joints_.begin());
    std::vector<ModelJoint> joints;
    std::vector<std::pair<Vector3d, Vector3d>> moving;
    bool with_body = false;
    for (std::size_t k = 0; k < body.joints.size(); ++k) {
        const mjcf::Joint& given = body.joints[k];
        ModelJoint& joint = joints.emplace_back();
        read_joint(given, joint);
        joint_[first + k] = static_cast<std::int32_t>(model_.joints.size() + k);
        with_body = with_body || given.type == JointType::Ball;
        const mjcf::Placed& mover = with_body ? at : placed_[static_cast<std::size_t>(body.parent)];
        const Vector3d point = at.frame * given.position;
        moving.emplace_back(mover.velocity + mover.angular_velocity.cross(point - mover.frame.translation()),
                            mover.angular_velocity);
    }
    model_import::add_chain(model_, moving_body(body.parent), number, std::move(joints), moving);
}

void MjcfReader::lose_of_free_joint(const mjcf::Joint& joint) {
    const auto lose = [&](const char* what) { model_.lose(fmt::format("joint \"{}\"", joint.name), what); };
    if (joint.armature != 0.0) lose("armature of a free joint");
    if (joint.damping[0] != 0.0 && spec_.option.damper) lose("damping of a free joint");
    if (joint.friction_loss != 0.0 && spec_.option.friction_loss) lose("dry friction of a free joint");
    if (joint.stiffness[0] != 0.0 && spec_.option.spring) lose("spring of a free joint");
}

void MjcfReader::read_joint(const mjcf::Joint& joint, ModelJoint& result) {
    JointParameters& own = result.parameters;
    const mjcf::Placed& at = placed_[static_cast<std::size_t>(joint.body)];
    own.name = joint_names_.take(joint.name, "joint");
    own.point = model_import::array(at.frame * joint.position);
    own.axis = model_import::array(at.frame.linear() * joint.axis);
    const std::string what = fmt::format("joint \"{}\"", joint.name);
    const mjcf::Option& option = spec_.option;
    if (joint.damping[1] != 0.0 || joint.damping[2] != 0.0 || joint.stiffness[1] != 0.0 || joint.stiffness[2] != 0.0)
        model_.lose(what, "the part of its spring or damper that is not linear");
    if (joint.type != JointType::Ball) {
        own.kind = joint.type == JointType::Hinge ? JointKind::Revolute : JointKind::Prismatic;
        read_coordinate(joint, what, own);
        return;
    }
    own.kind = JointKind::Spherical;
    own.turn.armature = std::max(0.0, joint.armature);
    if (option.damper) own.turn.damping = std::max(0.0, joint.damping[0]);
    if (option.spring && joint.stiffness[0] != 0.0) model_.lose(what, "spring of a ball joint");
    if (joint.is_limited && option.limit && option.constraint) model_.lose(what, "limit of a ball joint");
    if (joint.friction_loss != 0.0 && option.friction_loss && option.constraint)
        model_.lose(what, "dry friction of a ball joint");
}

void MjcfReader::read_coordinate(const mjcf::Joint& joint, const std::string& what, JointParameters& own) {
    const bool turns = own.kind == JointKind::Revolute;
    JointCoordinate& coordinate = turns ? own.turn : own.slide;
    const mjcf::Option& option = spec_.option;
    coordinate.armature = joint.armature;
    if (option.damper) coordinate.damping = joint.damping[0];
    if (option.spring) coordinate.stiffness = joint.stiffness[0];
    if (joint.spring_damper[0] > 0.0 && joint.spring_damper[1] > 0.0) {
        // Of the oscillator k, b with the mass m: b = 2 m/T, k = m/(T ζ)².
        const double mass = mjcf::inertias_at_reference(spec_)[static_cast<std::size_t>(joint.freedom)];
        const double time = joint.spring_damper[0], ratio = joint.spring_damper[1];
        coordinate.stiffness = mass / std::pow(time * ratio, 2);
        coordinate.damping = 2.0 * mass / time;
    }
    if (coordinate.stiffness > 0.0) coordinate.rest = joint.spring_reference - joint.reference;
    if (coordinate.damping < 0.0 || coordinate.stiffness < 0.0 || coordinate.armature < 0.0) {
        model_.lose(what, "a negative damping, stiffness or armature");
        coordinate.damping = std::max(coordinate.damping, 0.0);
        coordinate.stiffness = std::max(coordinate.stiffness, 0.0);
        coordinate.armature = std::max(coordinate.armature, 0.0);
    }
    if (option.friction_loss && option.constraint) coordinate.friction = std::max(0.0, joint.friction_loss);
    if (joint.is_limited && option.limit && option.constraint) {
        own.lower = joint.range[0] - joint.reference;
        own.upper = joint.range[1] - joint.reference;
        if (!joint.limit.is_usual()) model_.lose(what, "solref and solimp of the limit: stops are rigid");
        if (joint.margin != 0.0) model_.lose(what, "margin of the limit: stops act where they are");
    }
    const auto of_key = [&](const std::vector<double> mjcf::Key::*values, std::int32_t place, double otherwise) {
        return key_ == nullptr || (key_->*values).empty() ? otherwise
                                                          : (key_->*values)[static_cast<std::size_t>(place)];
    };
    const double start = of_key(&mjcf::Key::qpos, joint.coordinate, joint.reference) - joint.reference;
    const double within = std::clamp(start, std::isfinite(own.lower) ? own.lower : start,
                                     std::isfinite(own.upper) ? std::max(own.upper, own.lower) : start);
    if (within != start)
        model_.lose(what, fmt::format("it starts at its limit, not {:.3g} {} beyond it", std::abs(within - start),
                                      turns ? "rad" : "m"));
    if (within != 0.0) coordinate.start = within;
    if (const double rate = of_key(&mjcf::Key::qvel, joint.freedom, 0.0); rate != 0.0) coordinate.start_rate = rate;
}

}  // namespace delassus::importers
