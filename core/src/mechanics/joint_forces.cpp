// SPDX-License-Identifier: BSD-3-Clause
// Springs, dampers and dry friction in the coordinates of joints, and the whole turns of angles.
#include <fmt/format.h>

#include <cmath>

#include "delassus/error.hpp"
#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::finite_and_not_negative;
using mechanics::refuse_unless;

namespace {

bool given(const JointCoordinate& forces) {
    return forces.damping != 0.0 || forces.stiffness != 0.0 || forces.rest != 0.0 || forces.friction != 0.0 ||
           forces.armature != 0.0 || forces.start || forces.start_rate;
}

}  // namespace

void mechanics::check_joint_forces(const JointParameters& joint) {
    const auto kind = joint.kind;
    for (const auto* forces : {&joint.slide, &joint.turn})
        refuse_unless(
            finite_and_not_negative({forces->damping, forces->stiffness, forces->friction, forces->armature}) &&
                std::isfinite(forces->rest),
            "damping, stiffness, friction and armature of the joint", joint.name, "must be finite and not negative");
    for (const auto* coordinate : {&joint.slide, &joint.turn})
        refuse_unless(
            std::isfinite(coordinate->start.value_or(0.0)) && std::isfinite(coordinate->start_rate.value_or(0.0)),
            "the start of the joint", joint.name, "is not finite");
    const auto& start = (kind == JointKind::Prismatic ? joint.slide : joint.turn).start;
    refuse_unless(!start || (!(*start < joint.lower) && !(*start > joint.upper)), "the start of the joint", joint.name,
                  "lies beyond its limits");
    const bool slides = kind == JointKind::Prismatic || kind == JointKind::Cylindrical;
    const bool turns = kind == JointKind::Revolute || kind == JointKind::Cylindrical;
    const bool turns_freely = kind == JointKind::Spherical || kind == JointKind::Universal;
    refuse_unless(slides || !given(joint.slide), "the joint", joint.name,
                  "has no slide for a spring, damping, friction, armature or start: prismatic and cylindrical joints "
                  "have");
    refuse_unless(turns || turns_freely || !given(joint.turn), "the joint", joint.name,
                  "has no angle for a spring, damping, friction, armature or start: revolute and cylindrical joints "
                  "have, and spherical and universal ones take damping");
    refuse_unless(kind != JointKind::Universal || joint.turn.armature == 0.0, "the joint", joint.name,
                  "is universal and has an armature; revolute, prismatic, cylindrical and spherical joints take one");
    refuse_unless(
        turns || (joint.turn.stiffness == 0.0 && joint.turn.rest == 0.0 && joint.turn.friction == 0.0 &&
                  !joint.turn.start && !joint.turn.start_rate),
        "the joint", joint.name,
        "has no single angle for a spring, friction or start: spherical and universal joints take damping alone");
}

void MultibodySystem::Implementation::add_coordinate_spring(std::int32_t index, bool turns, double stiffness,
                                                            double damping, double rest, const Motion* target,
                                                            bool potential) {
    if (stiffness == 0.0 && damping == 0.0) return;
    if (turns) count_turns_of(index);
    const auto& joint = joints[static_cast<std::size_t>(index)];
    mechanics::RowSpring spring{turns ? joint.turn : joint.slide, stiffness, damping, potential, true};
    spring.row.offset = rest;
    spring.row.drive = target;
    springs.push_back(spring);
}

void MultibodySystem::Implementation::add_joint_forces(std::int32_t index) {
    const JointParameters& joint = joints[static_cast<std::size_t>(index)].parameters;
    has_armature = has_armature || joint.slide.armature > 0.0 || joint.turn.armature > 0.0;
    if (joint.kind == JointKind::Spherical || joint.kind == JointKind::Universal) {
        if (joint.turn.damping > 0.0) turn_dampers.push_back({joint.first, joint.second, joint.turn.damping});
        return;
    }
    for (const bool turns : {false, true}) {
        const JointCoordinate& forces = turns ? joint.turn : joint.slide;
        add_coordinate_spring(index, turns, forces.stiffness, forces.damping, forces.rest, nullptr, true);
        if (forces.friction > 0.0) frictions.push_back({index, turns, mechanics::box_of(forces.friction)});
    }
}

// ---- Whole turns (angle.hpp) ----

void MultibodySystem::Implementation::count_turns_of(std::int32_t joint) {
    std::int32_t& number = joints[static_cast<std::size_t>(joint)].turn.angle->counted;
    if (number >= 0) return;
    number = static_cast<std::int32_t>(counted.size());
    counted.push_back(joint);
}

std::int32_t MultibodySystem::angle_position(std::int32_t index) const {
    const auto& self = *implementation_;
    self.must_be_finished();
    static_cast<void>(joint(index));
    const auto& angle = self.joints[static_cast<std::size_t>(index)].turn.angle;
    return angle && angle->counted >= 0 ? self.first_angle + angle->counted : -1;
}

std::array<double, 2> MultibodySystem::joint_coordinate(const State& state, std::int32_t index) const {
    const auto& self = *implementation_;
    self.must_be_finished();
    const JointKind kind = joint(index).kind;
    if (kind != JointKind::Revolute && kind != JointKind::Cylindrical && kind != JointKind::Prismatic)
        throw InputError(
            fmt::format("the joint \"{}\" has no single coordinate: it is neither revolute, cylindrical nor "
                        "prismatic",
                        joint(index).name));
    self.place(state);
    const auto& one = self.joints[static_cast<std::size_t>(index)];
    const mechanics::Row& row = kind == JointKind::Prismatic ? one.slide : one.turn;
    return {row.value(self.at, 0.0), self.rate_of(row) + row.rate(self.at, 0.0)};
}

// Where a motion is prescribed, its time is not known here, and the sum stands as it is.
void MultibodySystem::add_turns(const double* q, const double* delta, double* result) const {
    const auto& self = *implementation_;
    const auto turn_of = [&](BodyIndex body) -> mechanics::Vector3d {
        const std::int32_t column = self.at[body].column;
        return column < 0 ? mechanics::Vector3d::Zero()
                          : mechanics::Vector3d(Eigen::Map<const mechanics::Vector3d>(delta + column + 3));
    };
    const auto orientation_of = [&](BodyIndex body) -> mechanics::Matrix3d {
        if (self.at[body].column < 0) return self.at[body].A;
        const double* from = result + self.bodies[static_cast<std::size_t>(body)].position;
        return mechanics::Quaterniond(from[3], from[4], from[5], from[6]).toRotationMatrix();
    };
    for (std::size_t k = 0; k < self.counted.size(); ++k) {
        const auto& angle = *self.joints[static_cast<std::size_t>(self.counted[k])].turn.angle;
        const auto place = static_cast<std::size_t>(self.first_angle) + k;
        const double sum = q[place] + angle.change(turn_of(angle.first), turn_of(angle.second));
        const bool known = !self.at[angle.first].prescribed() && !self.at[angle.second].prescribed();
        result[place] = known ? mechanics::Angle::nearest(
                                    angle.within_a_turn(orientation_of(angle.first), orientation_of(angle.second)), sum)
                              : sum;
    }
}

void MultibodySystem::settle_turns(State& state) const {
    const auto& self = *implementation_;
    if (self.counted.empty()) return;
    self.place(state);
    for (std::size_t k = 0; k < self.counted.size(); ++k) {
        const auto& angle = *self.joints[static_cast<std::size_t>(self.counted[k])].turn.angle;
        state.q[static_cast<std::size_t>(self.first_angle) + k] = angle.value(self.at) - angle.prescribed_turn(self.at);
    }
}

}  // namespace delassus
