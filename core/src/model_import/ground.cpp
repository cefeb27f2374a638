// SPDX-License-Identifier: BSD-3-Clause
// A ground for models that have none, and a base that holds what floats.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"
#include "model_import/model.hpp"

namespace delassus::model_import {

namespace {

/// Where the starts of joints of trees take bodies from where these are placed.
std::vector<Eigen::Isometry3d> starts_of(const Model& model) {
    std::vector<Eigen::Isometry3d> moved(model.bodies.size(), Eigen::Isometry3d::Identity());
    for (const ModelJoint& joint : model.joints) {  // parents come first
        const JointParameters& own = joint.parameters;
        if (own.kind == JointKind::Gear || joint.closes_loop || own.second < 0) continue;
        Eigen::Isometry3d by =
            own.first < 0 ? Eigen::Isometry3d::Identity() : moved[static_cast<std::size_t>(own.first)];
        const Vector3d point(own.point.data()), axis = Vector3d(own.axis.data()).normalized();
        if (own.kind == JointKind::Revolute)
            by = by * Eigen::Translation3d(point) * Eigen::AngleAxisd(own.turn.start.value_or(0.0), axis) *
                 Eigen::Translation3d(-point);
        if (own.kind == JointKind::Prismatic) by.translate(own.slide.start.value_or(0.0) * axis);
        moved[static_cast<std::size_t>(own.second)] = by;
    }
    return moved;
}

/// How far a shape reaches along −up from its origin, after a rotation; ∞ for one that is not bounded.
double reach_below(const ModelShape& shape, const Matrix3d& turn, const Vector3d& up) {
    const Vector3d own = turn.transpose() * up;
    const auto of_points = [&](const auto& points, double scale) {
        double reach = 0.0;
        bool any = false;
        for (const auto& point : points) {
            const double below = -scale * own.dot(Vector3d(point.data()));
            reach = any ? std::max(reach, below) : below;
            any = true;
        }
        return reach;
    };
    const double r = shape.size.x(), along = 0.5 * shape.size.y() * std::abs(own.z());
    switch (shape.form) {
        case Form::Sphere:
            return r;
        case Form::Box:
            return 0.5 * shape.size.dot(own.cwiseAbs());
        case Form::Capsule:
            return r + along;
        case Form::Cylinder:
            return r * std::hypot(own.x(), own.y()) + along;
        case Form::Hull:
            return of_points(shape.points, 1.0);
        case Form::MeshFile: {
            double reach = -std::numeric_limits<double>::infinity();
            for (const Mesh& part : read_surface_mesh(shape.file))
                reach = std::max(reach, of_points(part.vertices, shape.scale));
            return reach;
        }
        default:
            return -std::numeric_limits<double>::infinity();
    }
}

}  // namespace

void hold_base(Model& model) {
    std::vector<char> carried(model.bodies.size(), 0), carries(model.bodies.size(), 0);
    for (const ModelJoint& joint : model.joints) {
        const JointParameters& own = joint.parameters;
        if (own.kind == JointKind::Gear || joint.closes_loop) continue;
        if (own.second >= 0) carried[static_cast<std::size_t>(own.second)] = 1;
        if (own.first >= 0) carries[static_cast<std::size_t>(own.first)] = 1;
    }
    bool found = false;
    for (std::size_t k = 0; k < model.bodies.size(); ++k) {
        ModelBody& body = model.bodies[k];
        if (body.fixed || carried[k] != 0 || carries[k] == 0) continue;
        body.fixed = found = true;
        body.mass = 0.0;
        body.velocity.setZero();
        body.angular_velocity.setZero();
    }
    if (!found) throw InputError("no mechanism of the model floats, and so none has a base to be held");
}

void add_ground(Model& model, double height) {
    const Vector3d up =
        model.gravity.norm() > 0.0 ? Vector3d(-model.gravity.normalized()) : Vector3d(Vector3d::UnitZ());
    std::vector<char> joined(model.bodies.size(), 0);
    for (const ModelJoint& joint : model.joints)
        for (const auto body : {joint.parameters.first, joint.parameters.second})
            if (body >= 0 && joint.parameters.kind != JointKind::Gear) joined[static_cast<std::size_t>(body)] = 1;
    const auto moved = starts_of(model);
    double lowest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < model.bodies.size(); ++k) {
        if (model.bodies[k].fixed && joined[k] == 0) continue;
        for (const ModelShape& shape : model.bodies[k].shapes) {
            const Matrix3d turn = moved[k].linear() * shape.orientation.toRotationMatrix();
            lowest = std::min(lowest, up.dot(moved[k] * shape.position) - reach_below(shape, turn, up));
        }
    }
    if (!std::isfinite(lowest)) throw InputError("nothing of the model has a shape that could lie on a ground");
    const Vector3d by = (height - lowest) * up;
    for (ModelBody& body : model.bodies) {
        body.position += by;
        for (ModelShape& shape : body.shapes) shape.position += by;
    }
    for (ModelJoint& joint : model.joints)
        for (auto* point : {&joint.parameters.point, &joint.parameters.second_point})
            Eigen::Map<Vector3d>(point->data()) += by;
    Names names;
    for (const ModelBody& body : model.bodies) names.take(body.name, "body");
    ModelBody ground;
    ground.name = names.take("added ground", "");
    ground.fixed = true;
    ModelShape plane;
    plane.name = ground.name;
    plane.form = Form::Plane;
    plane.orientation = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up);
    plane.material = static_cast<std::int32_t>(model.materials.size());
    for (std::int32_t k = 0; k < plane.material; ++k)
        model.material_pairs.push_back({k, plane.material, model.materials[static_cast<std::size_t>(k)].friction,
                                        model.materials[static_cast<std::size_t>(k)].restitution});
    model.materials.push_back({"added ground", 1.0, 0.0});
    ground.shapes.push_back(std::move(plane));
    model.bodies.push_back(std::move(ground));
}

void part_bodies(Model& model, const std::vector<std::array<std::string, 2>>& pairs) {
    for (const auto& pair : pairs) {
        std::array<std::int32_t, 2> found = {-1, -1};
        for (std::size_t k = 0; k < model.bodies.size(); ++k)
            for (std::size_t side = 0; side < 2; ++side)
                if (model.bodies[k].name == pair[side]) found[side] = static_cast<std::int32_t>(k);
        for (std::size_t side = 0; side < 2; ++side)
            if (found[side] < 0)
                throw InputError(fmt::format("there is no body \"{}\" to be kept apart from another", pair[side]));
        model.apart.push_back(found);
    }
}

}  // namespace delassus::model_import
