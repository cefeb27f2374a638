// SPDX-License-Identifier: BSD-3-Clause
// Adding elements to a multibody system.
#include <cmath>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::finite;
using mechanics::refuse_unless;
using mechanics::vector;
using mechanics::Vector3d;

void mechanics::check_material(const ElasticMaterial& material) {
    if (!(material.young > 0.0 && std::isfinite(material.young)) ||
        !(material.density > 0.0 && std::isfinite(material.density)))
        throw InputError(fmt::format("Young's modulus is {} Pa and the density {} kg/m³; both must be positive",
                                     material.young, material.density));
    if (!(material.poisson > -1.0 && material.poisson < 0.5))
        throw InputError(fmt::format("Poisson's ratio is {}; it must lie between -1 and 0.5", material.poisson));
    if (!(material.damping_time >= 0.0))
        throw InputError(fmt::format("the damping time is {} s; it must not be negative", material.damping_time));
    if (!(material.damping_rate >= 0.0 && std::isfinite(material.damping_rate)))
        throw InputError(
            fmt::format("the damping rate is {} 1/s; it must be finite and not negative", material.damping_rate));
}

void MultibodySystem::Implementation::check_node(std::int32_t node, std::string_view what) const {
    if (node < 0 || node >= static_cast<std::int32_t>(nodes.size()))
        throw InputError(fmt::format("{} names the node {}; there are {}", what, node, nodes.size()));
}

template <std::size_t Nodes>
std::array<Vector3d, Nodes> MultibodySystem::Implementation::positions_of(const std::array<std::int32_t, Nodes>& named,
                                                                          std::string_view what) const {
    std::array<Vector3d, Nodes> positions;
    for (std::size_t k = 0; k < Nodes; ++k) {
        check_node(named[k], what);
        must_have_columns(named[k], what);
        positions[k] = vector(nodes[static_cast<std::size_t>(named[k])].parameters.position);
    }
    return positions;
}

template <class Element>
void MultibodySystem::Implementation::share_mass(const Element& element) {
    for (std::size_t k = 0; k < element.nodes().size(); ++k)
        nodes[static_cast<std::size_t>(element.nodes()[k])].parameters.mass += element.mass(k);
}

template <class Element, class ShapeOf>
void MultibodySystem::Implementation::add_solid(std::vector<Element>& elements, ShapeOf shape_of, std::string_view what,
                                                const std::array<std::int32_t, Element::size>& named,
                                                const ElasticMaterial& material, ElementModel model) {
    must_not_be_finished();
    mechanics::check_material(material);
    share_mass(elements.emplace_back(named, shape_of(named, positions_of(named, what)), material, model));
}

void MultibodySystem::add_tetrahedron(const std::array<std::int32_t, 4>& nodes, const ElasticMaterial& material,
                                      ElementModel model) {
    auto& self = *implementation_;
    self.add_solid(self.linear_tetrahedra, mechanics::linear_tetrahedron, "a tetrahedron", nodes, material, model);
    mechanics::append_sides(nodes, self.element_sides);
}

void MultibodySystem::add_quadratic_tetrahedron(const std::array<std::int32_t, 10>& nodes,
                                                const ElasticMaterial& material, ElementModel model) {
    auto& self = *implementation_;
    self.add_solid(self.quadratic_tetrahedra, mechanics::quadratic_tetrahedron, "a tetrahedron", nodes, material,
                   model);
    mechanics::append_sides(nodes, self.element_sides);
}

void MultibodySystem::add_brick(const std::array<std::int32_t, 8>& nodes, const ElasticMaterial& material,
                                ElementModel model) {
    auto& self = *implementation_;
    self.add_solid(self.bricks, mechanics::brick, "a brick", nodes, material, model);
    for (const auto& [i, j, k, l] : mechanics::brick_tetrahedra)
        mechanics::append_sides(std::array{nodes[i], nodes[j], nodes[k], nodes[l]}, self.element_sides);
}

void MultibodySystem::add_cable(const CableParameters& cable) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const auto positions = self.positions_of(cable.nodes, fmt::format("the cable \"{}\"", cable.name));
    const double distance = (positions[1] - positions[0]).norm();
    refuse_unless(distance > 0.0, "the nodes of the cable", cable.name, "coincide");
    refuse_unless(!(cable.rest_length <= 0.0), "the rest length of the cable", cable.name, "must be positive");
    refuse_unless(cable.young > 0.0 && cable.area > 0.0 && cable.density >= 0.0 && cable.damping_time >= 0.0 &&
                      std::isfinite(cable.young * cable.area * cable.density * cable.damping_time),
                  "the modulus, area, density and damping of the cable", cable.name, "must be positive and finite");
    self.cables.emplace_back(cable.nodes, positions, cable);
    self.share_mass(self.cables.back());
}

void MultibodySystem::add_beam(const BeamParameters& beam) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    self.check_body(beam.first, beam.name);
    self.check_body(beam.second, beam.name);
    refuse_unless(beam.first != beam.second, "the beam", beam.name, "joins a body to itself");
    refuse_unless(finite(beam.section_y), "the y axis of the section of the beam", beam.name, "is not finite");
    mechanics::check_material(beam.material);
    const auto& section = beam.section;
    for (const double value : {section.area, section.inertia_y, section.inertia_z, section.torsion})
        refuse_unless(value > 0.0 && std::isfinite(value), "the area and moments of the section of the beam", beam.name,
                      "must be positive and finite");
    refuse_unless(section.shear_area_y > 0.0 && section.shear_area_z > 0.0, "the shear areas of the beam", beam.name,
                  "must be positive");
    self.beams.emplace_back(beam, self.initial_placements());
    keep_apart(beam.first, beam.second);
}

// Each element gives half of its mass ρ A ℓ and of its section's inertia ρ ℓ (I_y + I_z, I_y, I_z) to the body at each
// end. The mass does so as a point: stiffness is exact for loads at the nodes, and this keeps M diagonal. With a
// consistent mass the bodies have the same, for all that asks for a body's mass, but the elements act.
BodyIndex MultibodySystem::add_elastic_beam(const ElasticBeamParameters& beam) {
    BeamParameters element{beam.name, 0, 0, beam.from, beam.to, beam.section_y, beam.section, beam.material};
    const mechanics::Matrix3d axes = mechanics::Beam::axes(element);
    refuse_unless(beam.elements >= 1, "the beam", beam.name,
                  fmt::format("has {} elements; it needs at least one", beam.elements));
    mechanics::check_material(beam.material);
    const Vector3d from = vector(beam.from), span = vector(beam.to) - from;
    const Vector3d velocity = vector(beam.velocity), turning = vector(beam.angular_velocity);
    const mechanics::Quaterniond orientation(axes);
    const double share = beam.material.density * span.norm() / beam.elements;
    const auto first = body_count();
    for (std::int32_t k = 0; k <= beam.elements; ++k) {
        const bool start = k == 0, end = k == beam.elements;
        const double length = start || end ? 0.5 * share : share;
        const Vector3d offset = static_cast<double>(k) / beam.elements * span;
        BodyParameters body;
        body.name = fmt::format("{}_{}", beam.name, k);
        body.mass = length * beam.section.area;
        body.inertia = {length * (beam.section.inertia_y + beam.section.inertia_z), length * beam.section.inertia_y,
                        length * beam.section.inertia_z};
        body.pose.position = mechanics::array(from + offset);
        body.pose.orientation = {orientation.w(), orientation.x(), orientation.y(), orientation.z()};
        body.fixed = (start && beam.fixed_from) || (end && beam.fixed_to);
        if (!body.fixed) {
            body.velocity = mechanics::array(velocity + turning.cross(offset));
            body.angular_velocity = mechanics::array(axes.transpose() * turning);
        }
        element.second = add_body(body);
        auto& self = *implementation_;
        self.bodies[static_cast<std::size_t>(element.second)].mass_of_beams = beam.mass == BeamMass::Consistent;
        element.second_point = body.pose.position;
        if (k > 0) add_beam(element);
        if (k > 0 && beam.mass == BeamMass::Consistent)
            self.beam_inertias.emplace_back(beam, span.norm() / beam.elements,
                                            std::array{element.first, element.second});
        element.first = element.second;
        element.first_point = element.second_point;
    }
    return first;
}

bool MultibodySystem::has_consistent_mass() const {
    return !implementation_->beam_inertias.empty();
}

}  // namespace delassus
