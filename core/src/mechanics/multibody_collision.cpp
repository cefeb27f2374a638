// SPDX-License-Identifier: BSD-3-Clause
// The shapes of a multibody system as the collision detector sees them.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "delassus/error.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::vector;

namespace {

/// Half of the smallest extent of a shape; 0 for planes and terrains, which have none.
double size_of(const Shape& shape) {
    switch (shape.kind) {
        case ShapeKind::Plane:
        case ShapeKind::Terrain:
        case ShapeKind::HeightField:
            return 0.0;
        case ShapeKind::Box:
            return std::min({shape.size[0], shape.size[1], shape.size[2]});
        case ShapeKind::Convex: {
            double farthest = 0.0;
            if (!shape.mesh) return 0.0;
            for (const auto& vertex : shape.mesh->vertices)
                farthest = std::max(farthest, (vector(vertex) - vector(shape.mesh->vertices[0])).norm());
            return 0.5 * farthest;
        }
        default:
            return shape.size[0];
    }
}

double largest_extent(const Shape& shape) {
    switch (shape.kind) {
        case ShapeKind::Plane:
        case ShapeKind::Terrain:
        case ShapeKind::HeightField:
            return HUGE_VAL;
        case ShapeKind::Box:
            return 2.0 * std::max({shape.size[0], shape.size[1], shape.size[2]});
        case ShapeKind::Capsule:
            return 2.0 * (shape.size[0] + shape.size[1]);
        case ShapeKind::Cylinder:
            return 2.0 * std::max(shape.size[0], shape.size[1]);
        default:
            return 2.0 * size_of(shape);
    }
}

/// The median size of shapes that have one; 0 if none has.
double median_size(const std::vector<Shape>& shapes) {
    std::vector<double> sizes;
    for (const auto& shape : shapes)
        if (const double size = size_of(shape); size > 0.0) sizes.push_back(size);
    if (sizes.empty()) return 0.0;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return *middle;
}

}  // namespace

std::int32_t MultibodySystem::Implementation::owner_of(std::int32_t shape) const {
    const auto index = static_cast<std::size_t>(shape);
    if (index < shapes.size()) return shapes[index].body;
    const auto count = static_cast<std::int32_t>(bodies.size());
    const std::size_t node = index - shapes.size();
    if (node < node_contacts.size()) return count + node_contacts[node].node;
    return count + first_node_of_surface(node - node_contacts.size());
}

/// Of bodies: a number that welded ones share, 0 of those whose place is given or that are welded to them.
std::vector<std::int32_t> MultibodySystem::Implementation::solids() const {
    std::vector<std::int32_t> parent(bodies.size() + 1);  // the world first
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](BodyIndex body) {
        std::int32_t place = body == world_body ? 0 : body + 1;
        while (parent[static_cast<std::size_t>(place)] != place) place = parent[static_cast<std::size_t>(place)];
        return place;
    };
    const auto join = [&](BodyIndex a, BodyIndex b) {
        const std::int32_t first = root(a), second = root(b);
        parent[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
    };
    for (std::size_t k = 0; k < bodies.size(); ++k)
        if (bodies[k].column < 0) join(world_body, static_cast<BodyIndex>(k));
    for (const auto& joint : joints)
        if (joint.parameters.kind == JointKind::Fixed) join(joint.parameters.first, joint.parameters.second);
    std::vector<std::int32_t> result;
    for (std::size_t k = 0; k < bodies.size(); ++k) result.push_back(root(static_cast<BodyIndex>(k)));
    return result;
}

// Bodies whose motion is prescribed do not touch one another, nor fixed ones.
// For the detector a node is a body that does not turn, after the bodies; its sphere comes after their shapes.
void MultibodySystem::Implementation::make_detector() {
    CollisionSetup setup{shapes, {}, {apart.begin(), apart.end()}, {}, solids()};
    for (const auto& body : bodies) {
        setup.fixed.push_back(body.column < 0 && !body.prescribed);
        setup.group.push_back(prescribed.empty() || body.column >= 0 ? -1 : 1);
        setup.names.push_back(body.parameters.name);
    }
    for (const auto& node : nodes) {
        setup.fixed.push_back(!node.moves());
        setup.group.push_back(0);
        setup.solid.push_back(-1);
    }
    for (const auto& one : attachments)
        setup.apart.emplace_back(one.body, static_cast<std::int32_t>(bodies.size()) + one.node);
    for (const auto& one : modal_attachments)
        for (const auto node : one.nodes)
            setup.apart.emplace_back(one.body, static_cast<std::int32_t>(bodies.size()) +
                                                   reduced[static_cast<std::size_t>(one.reduced)].first_node + node);
    for (const auto& contact : node_contacts) {
        Shape sphere;
        sphere.size[0] = contact.radius;
        sphere.body = static_cast<std::int32_t>(bodies.size()) + contact.node;
        setup.shapes.push_back(sphere);
        shape_material.push_back(contact.material);
    }
    const auto is_moved = [&](const Shape& shape) {
        const auto body = static_cast<std::size_t>(shape.body);
        return shape.body >= 0 && !setup.fixed[body] && (body >= bodies.size() || !bodies[body].prescribed);
    };
    const bool moves = std::any_of(setup.shapes.begin(), setup.shapes.end(), is_moved);
    if (moves) make_mesh_contacts();
    // Where nearly all may touch, the first pairs tell; shapes of bodies that are all kept apart are few.
    const auto meets_another = [&](const Shape& one) {
        return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& other) {
            if (one.body == other.body || (!is_moved(one) && !is_moved(other)) ||
                apart.contains(std::minmax(one.body, other.body)))
                return false;
            const auto material = [&](const Shape& of, const std::vector<Shape>& among) {
                return shape_material[static_cast<std::size_t>(&of - among.data())];
            };
            const bool node = one.body >= static_cast<std::int32_t>(bodies.size());
            return node || material_between(material(one, setup.shapes), material(other, shapes)).touch;
        });
    };
    const bool bodies_touch = moves && std::any_of(setup.shapes.begin(), setup.shapes.end(), meets_another);
    if (bodies_touch || mesh_touching) {
        size = median_size(setup.shapes);
        if (envelope == 0.0) {
            constexpr double share = 0.05;
            envelope = share * size;
            for (const Shape& shape : setup.shapes) {
                const double own = size_of(shape);
                setup.near.push_back(own > 0.0 ? share * own : HUGE_VAL);
            }
        }
    }
    if (!bodies_touch) {
        if (!leaves_out) static_cast<void>(make_collision_detector({}));
        return;
    }
    extents.clear();
    for (const auto& shape : shapes) {
        const double half = size_of(shape);
        extents.push_back({largest_extent(shape), half > 0.0 ? half : HUGE_VAL});
    }
    for (const auto& [pair, material] : material_pairs)
        if (!material.touch) setup.passing.emplace_back(pair);
    if (!setup.passing.empty()) {
        setup.material = shape_material;
        // A node has its contacts whatever its material.
        std::fill(setup.material.begin() + static_cast<std::ptrdiff_t>(shapes.size()), setup.material.end(), -1);
    }
    poses.resize(bodies.size() + nodes.size());
    for (std::size_t k = 0; k < bodies.size(); ++k) poses[k] = bodies[k].parameters.pose;
    detector = make_collision_detector(std::move(setup));
}

void MultibodySystem::be_part_of(const MultibodySystem& whole, PartNumbers numbers) {
    auto& self = *implementation_;
    self.must_be_finished();
    if (numbers.shapes.size() != self.shapes.size() || numbers.joints.size() != self.joints.size() ||
        numbers.motors.size() != self.bounded_motors.size() ||
        numbers.actuators.size() != self.bounded_actuators.size())
        throw InputError("a part of a system needs a number for each shape, joint, bounded motor and bounded actuator");
    self.size = whole.implementation_->size;
    self.envelope = whole.implementation_->envelope;
    self.recovery = whole.recovery_speed();
    self.unilateral_whole = whole.has_unilateral();
    for (auto& body : self.moving)
        if (std::binary_search(numbers.touched.begin(), numbers.touched.end(), body.body)) body.alone = false;
    self.numbers = std::move(numbers);
}

std::optional<double> MultibodySystem::given_envelope() const {
    return implementation_->wanted_envelope;
}

double MultibodySystem::envelope() const {
    return implementation_->envelope;
}
double MultibodySystem::size_of_shapes() const {
    return implementation_->size;
}

double MultibodySystem::extent_of_shapes(BodyIndex body) const {
    double largest = 0.0;
    for (const Shape& shape : shapes()) {
        if (shape.body != body) continue;
        if (const double extent = largest_extent(shape); std::isfinite(extent)) largest = std::max(largest, extent);
    }
    return largest;
}

double MultibodySystem::free_fall() const {
    return vector(implementation_->gravity).norm();
}

double MultibodySystem::gap_resolution() const {
    return 1e-9 * implementation_->size;
}

double MultibodySystem::recovery_speed() const {
    const auto& self = *implementation_;
    if (self.recovery) return *self.recovery;
    if (self.size == 0.0) return DynamicalSystem::recovery_speed();
    constexpr double share = 0.01;
    if (const double g = vector(self.gravity).norm(); g > 0.0) return share * std::sqrt(g * self.size);
    double fastest = 0.0;
    for (const auto& body : self.moving) {
        const auto& start = self.bodies[static_cast<std::size_t>(body.body)].parameters;
        fastest = std::max({fastest, vector(start.velocity).norm(), vector(start.angular_velocity).norm() * self.size});
    }
    return share * (fastest > 0.0 ? fastest : self.size);
}

const std::vector<ContactPoint>& MultibodySystem::Implementation::detect(const sdk::Team& team) {
    const auto same_pose = [](const Pose& a, const Pose& b) {
        return a.position == b.position && a.orientation == b.orientation;
    };
    const auto same_displacement = [](const BodyDisplacement& a, const BodyDisplacement& b) {
        return a.translation == b.translation && a.rotation == b.rotation;
    };
    if (!std::equal(poses.begin(), poses.end(), detected.poses.begin(), detected.poses.end(), same_pose) ||
        !std::equal(displacements.begin(), displacements.end(), detected.displacements.begin(),
                    detected.displacements.end(), same_displacement)) {
        detector->detect(poses, envelope, detected.contacts, team, displacements);
        detected.poses = poses;
        detected.displacements = displacements;
    }
    return detected.contacts;
}

}  // namespace delassus
