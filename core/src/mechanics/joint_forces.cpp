// SPDX-License-Identifier: BSD-3-Clause
// Springs, dampers and dry friction in the coordinates of joints, and the whole turns of angles.
#include <cmath>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::finite_and_not_negative;
using mechanics::refuse_unless;

namespace mechanics {

RowColumns Turn::columns(const Placements& at, bool with_prescribed) const {
    RowColumns result;
    for (const BodyIndex body : {angle.second, angle.first})
        if (at[body].column >= 0 || (with_prescribed && at[body].prescribed())) result.add(body, at[body].column);
    return result;
}

double Turn::value(const Placements& at, double t) const {
    return nearest(angle.value(at), *reference) - offset - (drive ? drive->value(t) : 0.0);
}

void Turn::gradient(const Placements& at, double, const RowColumns& columns, RowVector& result) const {
    result.setZero(6 * columns.bodies);
    for (const bool of_second : {true, false}) {
        const int first = columns.place(at[of_second ? angle.second : angle.first].column);
        if (first >= 0) result.segment<3>(first + 3) = angle.coefficients(at, of_second);
    }
}

void Turn::hessian(const Placements& at, double, const RowColumns& columns, RowMatrix& result) const {
    result.setZero(6 * columns.bodies, 6 * columns.bodies);
    const int row = columns.place(at[angle.second].column);
    if (row < 0) return;
    for (const bool along_second : {true, false}) {
        const int column = columns.place(at[along_second ? angle.second : angle.first].column);
        if (column >= 0) result.block<3, 3>(row + 3, column + 3) = angle.turning(at, along_second);
    }
}

}  // namespace mechanics

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
    refuse_unless(std::abs(joint.turn.start.value_or(0.0)) <= M_PI, "the start of the joint", joint.name,
                  "must lie in [-pi, pi] rad: whole turns do not change where bodies are");
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

const double* MultibodySystem::Implementation::count_turns_of(std::int32_t joint) {
    for (const auto& one : counted)
        if (one.joint == joint) return one.reference.get();
    return counted.emplace_back(CountedAngle{joint, std::make_unique<double>(0.0)}).reference.get();
}

void MultibodySystem::Implementation::add_coordinate_spring(std::int32_t index, bool turns, double stiffness,
                                                            double damping, double rest, const Motion* target,
                                                            bool potential) {
    if (stiffness == 0.0 && damping == 0.0) return;
    const auto& joint = joints[static_cast<std::size_t>(index)];
    if (turns) {
        turn_springs.push_back(
            {{joint.angle, rest, target, count_turns_of(index)}, stiffness, damping, potential, true});
    } else {
        mechanics::RowSpring spring{joint.slide, stiffness, damping, potential, true};
        spring.row.offset = rest;
        spring.row.drive = target;
        springs.push_back(spring);
    }
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

// ---- Whole turns ----
//
// An orientation tells an angle modulo 2π. The angle that counts is the one nearest to a reference, which is the angle
// itself at the end of the last step that was kept. It follows from that state and a whole number, so that a run that
// is resumed has the same bits.

std::vector<double> MultibodySystem::turns(const State& state) const {
    const auto& self = *implementation_;
    std::vector<double> result;
    if (self.counted.empty()) return result;
    self.place(state);
    for (const auto& one : self.counted) {
        const double angle = self.joints[static_cast<std::size_t>(one.joint)].angle.value(self.at);
        result.push_back(std::round((*one.reference - angle) / (2.0 * M_PI)));
    }
    return result;
}

void MultibodySystem::set_turns(const State& state, const std::vector<double>& turns) {
    const auto& self = *implementation_;
    if (!turns.empty() && turns.size() != self.counted.size())
        throw InputError(fmt::format("the turns of {} joints were given; the system counts those of {}", turns.size(),
                                     self.counted.size()));
    if (self.counted.empty()) return;
    self.place(state);
    for (std::size_t k = 0; k < self.counted.size(); ++k) {
        const auto& one = self.counted[k];
        const double angle = self.joints[static_cast<std::size_t>(one.joint)].angle.value(self.at);
        *one.reference = angle + 2.0 * M_PI * (turns.empty() ? 0.0 : turns[k]);
    }
}

std::vector<std::int32_t> MultibodySystem::counted_joints() const {
    std::vector<std::int32_t> joints;
    for (const auto& one : implementation_->counted) joints.push_back(one.joint);
    return joints;
}

void MultibodySystem::follow(const State& state) {
    if (!implementation_->counted.empty()) set_turns(state, turns(state));
}

}  // namespace delassus
