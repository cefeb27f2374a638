// SPDX-License-Identifier: BSD-3-Clause
// Bodies, joints and options of an MJCF model.
#include "importers/mjcf_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"

namespace delassus::importers {

MjcfReader::MjcfReader(const mjModel& m, const std::string& keyframe, Model& model)
    : m_(m),
      model_(model),
      data_(mj_makeData(&m), mj_deleteData),
      body_(static_cast<std::size_t>(m.nbody), -1),
      joint_(static_cast<std::size_t>(m.njnt), -1),
      reference_(static_cast<std::size_t>(m.njnt), 0.0),
      class_(static_cast<std::size_t>(m.ngeom), -1),
      is_shape_(static_cast<std::size_t>(m.ngeom), 0) {
    if (!data_) throw InputError("libmujoco has no memory for the model");
    find_keyframe(keyframe);
}

void MjcfReader::find_keyframe(const std::string& keyframe) {
    if (keyframe.empty()) return;
    std::vector<std::string> names;
    for (int k = 0; k < m_.nkey; ++k) {
        names.push_back(name_of(mjOBJ_KEY, k));
        if (names.back() == keyframe || std::to_string(k) == keyframe) key_ = k;
    }
    if (key_ < 0)
        throw InputError(names.empty()
                             ? fmt::format("it has no keyframes, and so none named \"{}\"", keyframe)
                             : fmt::format("it has no keyframe \"{}\"; it has {}", keyframe, fmt::join(names, ", ")));
}

std::string MjcfReader::name_of(mjtObj kind, int index) const {
    const char* name = mj_id2name(&m_, kind, index);
    if (name != nullptr && *name != '\0') return name;
    const char* word = mju_type2Str(kind);
    return fmt::format("{}_{}", word != nullptr ? word : "item", index);
}

std::string MjcfReader::item(const char* kind, mjtObj type, int index) const {
    return fmt::format("{} \"{}\"", kind, name_of(type, index));
}

void MjcfReader::read() {
    place();
    read_options();
    ModelBody ground;  // for the shapes of the world
    ground.name = body_names_.take("ground", "");
    ground.fixed = true;
    body_[0] = 0;
    model_.bodies.push_back(ground);
    for (int body = 1; body < m_.nbody; ++body) read_body(body);
    read_materials();
    read_shapes();
    read_touching();
    read_equalities();
    read_actuators();
    note_others();
}

void MjcfReader::place() {
    mjData& d = *data_;
    mju_copy(d.qpos, m_.qpos0, m_.nq);
    for (int j = 0; j < m_.njnt; ++j) {
        const int type = m_.jnt_type[j], at = m_.jnt_qposadr[j], dof = m_.jnt_dofadr[j];
        reference_[static_cast<std::size_t>(j)] = m_.qpos0[at];
        if (key_ < 0 || type == mjJNT_HINGE || type == mjJNT_SLIDE) continue;
        const bool free = type == mjJNT_FREE;
        mju_copy(d.qpos + at, m_.key_qpos + key_ * m_.nq + at, free ? 7 : 4);
        mju_copy(d.qvel + dof, m_.key_qvel + key_ * m_.nv + dof, free ? 6 : 3);
    }
    mj_fwdPosition(&m_, &d);
    mj_fwdVelocity(&m_, &d);
}

void MjcfReader::read_options() {
    const mjOption& option = m_.opt;
    model_.step = option.timestep;
    model_.gravity = disabled(mjDSBL_GRAVITY) ? Vector3d(Vector3d::Zero()) : Vector3d(option.gravity);
    if (option.density != 0.0 || option.viscosity != 0.0)
        model_.lose("option density, viscosity", "the forces of a fluid on bodies");
    else if (!Vector3d(option.wind).isZero(0.0))
        model_.without_effect.push_back({"option wind", "there is no fluid"});
    if (disabled(mjDSBL_FILTERPARENT) && !disabled(mjDSBL_CONTACT))
        model_.lose("flag filterparent", "bodies with a joint between them never touch in a scene");
}

// The frame of a body in the scene has the axes of the body of MuJoCo, and its origin in the mass centre.
void MjcfReader::read_body(int body) {
    const mjData& d = *data_;
    ModelBody result;
    result.name = body_names_.take(name_of(mjOBJ_BODY, body), "body");
    result.position = vector_at(d.xipos, body);
    result.orientation = quaternion_at(d.xquat, body).normalized();
    result.mass = m_.body_mass[body];
    const Matrix3d turn = quaternion_at(m_.body_iquat, body).normalized().toRotationMatrix();
    result.inertia = turn * vector_at(m_.body_inertia, body).asDiagonal() * turn.transpose();
    result.inertia = (0.5 * (result.inertia + result.inertia.transpose())).eval();
    result.fixed = !moves(body);
    std::array<mjtNum, 6> velocity{};
    mj_objectVelocity(&m_, &d, mjOBJ_BODY, body, velocity.data(), 0);
    if (!result.fixed) {
        result.velocity = Vector3d(velocity.data() + 3);
        result.angular_velocity = result.orientation.conjugate() * Vector3d(velocity.data());
    }
    if (m_.body_mocapid[body] >= 0)
        model_.lose(item("body", mjOBJ_BODY, body), "it is moved from outside (mocap): here it stands still");
    const auto number = static_cast<std::int32_t>(model_.bodies.size());
    body_[static_cast<std::size_t>(body)] = number;
    model_.bodies.push_back(std::move(result));
    if (!moves(body)) return;

    const int parent = m_.body_parentid[body], first = m_.body_jntadr[body], count = m_.body_jntnum[body];
    if (count == 0) {
        ModelJoint joint;
        joint.parameters.kind = JointKind::Fixed;
        joint.parameters.first = moving_body(parent);
        joint.parameters.second = number;
        model_.joints.push_back(std::move(joint));
        return;
    }
    if (m_.jnt_type[first] == mjJNT_FREE) {
        joint_names_.take(name_of(mjOBJ_JOINT, first), "joint");
        const int dof = m_.jnt_dofadr[first];
        const auto any = [&](const mjtNum* values) {
            return std::any_of(values + dof, values + dof + 6, [](mjtNum value) { return value != 0.0; });
        };
        const auto lose = [&](const char* what) { model_.lose(item("joint", mjOBJ_JOINT, first), what); };
        if (any(m_.dof_armature)) lose("armature of a free joint");
        if (any(m_.dof_damping) && !disabled(mjDSBL_PASSIVE)) lose("damping of a free joint");
        if (any(m_.dof_frictionloss) && !disabled(mjDSBL_FRICTIONLOSS)) lose("dry friction of a free joint");
        if (m_.jnt_stiffness[first] != 0.0 && !disabled(mjDSBL_PASSIVE)) lose("spring of a free joint");
        return;
    }
    // Pieces between joints move with the parent until a ball, whose start may turn, and with the body from then on.
    std::vector<ModelJoint> joints;
    std::vector<std::pair<Vector3d, Vector3d>> moving;
    bool with_body = false;
    for (int k = 0; k < count; ++k) {
        const int j = first + k;
        ModelJoint& joint = joints.emplace_back();
        read_joint(j, joint);
        joint_[static_cast<std::size_t>(j)] = static_cast<std::int32_t>(model_.joints.size()) + k;
        with_body = with_body || m_.jnt_type[j] == mjJNT_BALL;
        const int mover = with_body ? body : parent;
        mj_objectVelocity(&m_, &d, mjOBJ_BODY, mover, velocity.data(), 0);
        const Vector3d omega(velocity.data()), arm = vector_at(d.xanchor, j) - vector_at(d.xipos, mover);
        moving.emplace_back(Vector3d(velocity.data() + 3) + omega.cross(arm), omega);
    }
    add_chain(model_, moving_body(parent), number, std::move(joints), moving);
}

void MjcfReader::read_joint(int j, ModelJoint& result) {
    JointParameters& own = result.parameters;
    own.name = joint_names_.take(name_of(mjOBJ_JOINT, j), "joint");
    own.point = model_import::array(vector_at(data_->xanchor, j));
    own.axis = model_import::array(vector_at(data_->xaxis, j));
    const int dof = m_.jnt_dofadr[j];
    const bool passive = !disabled(mjDSBL_PASSIVE), limited = m_.jnt_limited[j] != 0 && !disabled(mjDSBL_LIMIT);
    const std::string what = item("joint", mjOBJ_JOINT, j);
    if (m_.jnt_type[j] != mjJNT_BALL) {
        own.kind = m_.jnt_type[j] == mjJNT_HINGE ? JointKind::Revolute : JointKind::Prismatic;
        read_coordinate(j, what, own);
        return;
    }
    own.kind = JointKind::Spherical;
    own.turn.armature = m_.dof_armature[dof];
    if (passive) own.turn.damping = m_.dof_damping[dof];
    if (passive && m_.jnt_stiffness[j] != 0.0) model_.lose(what, "spring of a ball joint");
    if (limited) model_.lose(what, "limit of a ball joint");
    if (m_.dof_frictionloss[dof] != 0.0 && !disabled(mjDSBL_FRICTIONLOSS))
        model_.lose(what, "dry friction of a ball joint");
}

void MjcfReader::read_coordinate(int j, const std::string& what, JointParameters& own) {
    const bool turns = own.kind == JointKind::Revolute;
    JointCoordinate& coordinate = turns ? own.turn : own.slide;
    const int dof = m_.jnt_dofadr[j], at = m_.jnt_qposadr[j];
    const double reference = reference_[static_cast<std::size_t>(j)];
    coordinate.armature = m_.dof_armature[dof];
    if (!disabled(mjDSBL_PASSIVE)) {
        coordinate.damping = m_.dof_damping[dof];
        coordinate.stiffness = m_.jnt_stiffness[j];
        if (coordinate.stiffness > 0.0) coordinate.rest = m_.qpos_spring[at] - reference;
    }
    if (coordinate.damping < 0.0 || coordinate.stiffness < 0.0) {
        model_.lose(what, "negative damping or stiffness");
        coordinate.damping = std::max(coordinate.damping, 0.0);
        coordinate.stiffness = std::max(coordinate.stiffness, 0.0);
    }
    if (!disabled(mjDSBL_FRICTIONLOSS)) coordinate.friction = m_.dof_frictionloss[dof];
    if (m_.jnt_limited[j] != 0 && !disabled(mjDSBL_LIMIT)) {
        own.lower = m_.jnt_range[2 * j] - reference;
        own.upper = m_.jnt_range[2 * j + 1] - reference;
        if (!std::equal(usual_solref.begin(), usual_solref.end(), m_.jnt_solref + mjNREF * j) ||
            !std::equal(usual_solimp.begin(), usual_solimp.end(), m_.jnt_solimp + mjNIMP * j))
            model_.lose(what, "solref and solimp of the limit: stops are rigid");
        if (m_.jnt_margin[j] != 0.0) model_.lose(what, "margin of the limit: stops act where they are");
    }
    const double start = key_ < 0 ? 0.0 : m_.key_qpos[key_ * m_.nq + at] - reference;
    const double within = std::clamp(start, std::isfinite(own.lower) ? own.lower : start,
                                     std::isfinite(own.upper) ? std::max(own.upper, own.lower) : start);
    if (within != start)
        model_.lose(what, fmt::format("it starts at its limit, not {:.3g} {} beyond it", std::abs(within - start),
                                      turns ? "rad" : "m"));
    if (within != 0.0) coordinate.start = within;
    if (key_ >= 0 && m_.key_qvel[key_ * m_.nv + dof] != 0.0) coordinate.start_rate = m_.key_qvel[key_ * m_.nv + dof];
}

}  // namespace delassus::importers
