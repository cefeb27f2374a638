// SPDX-License-Identifier: BSD-3-Clause
// Energy and momentum of a state of a multibody system.
#include <cmath>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::array;
using mechanics::vector;
using mechanics::Vector3d;

double MultibodySystem::kinetic_energy(const State& state) const {
    const auto& self = *implementation_;
    double energy = 0.0;
    for (const auto& body : self.bodies) {
        if (body.column < 0 || body.mass_of_beams) continue;
        const Eigen::Map<const Vector3d> v(state.v.data() + body.column), omega(state.v.data() + body.column + 3);
        energy += 0.5 * body.parameters.mass * v.squaredNorm() + 0.5 * omega.dot(body.inertia * omega);
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            energy +=
                0.5 * node.parameters.mass * Eigen::Map<const Vector3d>(state.v.data() + node.column).squaredNorm();
    self.place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < self.reduced.size(); ++k) energy += self.modal_dynamics(k).kinetic_energy();
    if (self.beam_inertias.empty() && !self.has_armature) return energy;
    self.place(state);
    energy += self.energy_of_rotors();
    self.for_each_inertia([&](const auto& inertia, const auto& at) { energy += inertia.kinetic_energy(at); });
    return energy;
}

// ½ a ċ² of each coordinate c, and ½ a |ω_second − ω_first|² of a ball joint.
double MultibodySystem::Implementation::energy_of_rotors() const {
    double energy = 0.0;
    for (const auto& joint : joints) {
        const auto &slide = joint.parameters.slide, &turn = joint.parameters.turn;
        if (slide.armature > 0.0) energy += 0.5 * slide.armature * std::pow(rate_of(joint.slide), 2);
        if (turn.armature == 0.0) continue;
        const auto &first = at[joint.parameters.first], &second = at[joint.parameters.second];
        const double square = joint.parameters.kind == JointKind::Spherical
                                  ? (second.A * second.omega - first.A * first.omega).squaredNorm()
                                  : std::pow(rate_of(joint.turn), 2);
        energy += 0.5 * turn.armature * square;
    }
    return energy;
}

double MultibodySystem::Implementation::rate_of(const mechanics::Row& coordinate) const {
    const auto columns = coordinate.columns(at);
    coordinate.gradient(at, columns, gradient);
    double rate = coordinate.rate(at, 0.0);
    for (int k = 0; k < columns.bodies; ++k) {
        const auto& place = at[columns.body[static_cast<std::size_t>(k)]];
        rate += gradient.segment<3>(6 * k).dot(place.v) + gradient.segment<3>(6 * k + 3).dot(place.omega);
    }
    return rate;
}

std::array<Vector3, 2> MultibodySystem::momentum(const State& state) const {
    const auto& self = *implementation_;
    self.place(state);
    Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
    for (std::size_t k = 0; k < self.bodies.size(); ++k) {
        if (self.bodies[k].column < 0 || self.bodies[k].mass_of_beams) continue;
        const auto& place = self.at[static_cast<BodyIndex>(k)];
        const Vector3d p = self.bodies[k].parameters.mass * place.v;
        linear += p;
        angular += place.x.cross(p) + place.A * (self.bodies[k].inertia * place.omega);
    }
    for (const auto& node : self.nodes) {
        if (node.column < 0) continue;
        const Vector3d p = node.parameters.mass * Eigen::Map<const Vector3d>(state.v.data() + node.column);
        linear += p;
        angular += Eigen::Map<const Vector3d>(state.q.data() + node.position).cross(p);
    }
    for (std::size_t k = 0; k < self.reduced.size(); ++k) {
        const auto& place = self.modal_at[k];
        const Vector3d p = self.reduced[k].model.inertia.mass * place.v;
        linear += p;
        angular += place.x.cross(p) + place.A * self.modal_dynamics(k).angular_momentum();
    }
    self.for_each_inertia([&](const auto& inertia, const auto& at) { inertia.momentum(at, linear, angular); });
    return {array(linear), array(angular)};
}

double MultibodySystem::energy(const State& state) const {
    const auto& self = *implementation_;
    self.place(state);
    const Vector3d gravity = self.load_factor * vector(self.gravity);
    double energy = kinetic_energy(state);
    for (std::size_t k = 0; k < self.bodies.size(); ++k)
        if (self.bodies[k].column >= 0 && !self.bodies[k].mass_of_beams)
            energy -= self.bodies[k].parameters.mass * gravity.dot(self.at[static_cast<BodyIndex>(k)].x);
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            energy -= node.parameters.mass * gravity.dot(Eigen::Map<const Vector3d>(state.q.data() + node.position));
    for (std::size_t k = 0; k < self.reduced.size(); ++k)
        energy += self.modal_dynamics(k).elastic_energy() -
                  self.reduced[k].model.inertia.mass * gravity.dot(self.modal_at[k].x);
    self.for_each_inertia([&](const auto& inertia, const auto& at) { energy += inertia.potential(at, gravity); });
    self.for_each_element(state, [&](const auto& element, const auto& at) { energy += element.energy(at); });
    for (const auto& spring : self.springs) {
        if (!spring.potential) continue;
        const double stretch = spring.row.value(self.at, state.t);
        energy += 0.5 * spring.stiffness * stretch * stretch;
    }
    return energy;
}

bool MultibodySystem::is_driven() const {
    return implementation_->driven;
}

bool MultibodySystem::Implementation::find_driven() const {
    const auto is_motor = [](const mechanics::Joint& joint) {
        return std::ranges::any_of(joint.rows, [](const mechanics::Row& row) { return row.drive != nullptr; });
    };
    return !loads.empty() || !prescribed.empty() || !bounded_motors.empty() || !bounded_actuators.empty() ||
           std::ranges::any_of(joints, is_motor) ||
           std::ranges::any_of(springs, [](const auto& spring) { return !spring.potential || spring.row.drive; });
}

std::int64_t MultibodySystem::inverted_solids(const State& state) const {
    const auto& self = *implementation_;
    if (self.solids_count() == 0) return 0;
    self.place(state);
    std::int64_t inverted = 0;
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        if constexpr (requires { element.inverted(at); }) inverted += element.inverted(at) ? 1 : 0;
    });
    return inverted;
}

}  // namespace delassus
