// SPDX-License-Identifier: BSD-3-Clause
// Bodies that fixed joints hold together become one.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "delassus/error.hpp"
#include "model_import/model.hpp"

namespace delassus::model_import {

void add_chain(Model& model, std::int32_t parent, std::int32_t body, std::vector<ModelJoint> joints,
               const std::vector<std::pair<Vector3d, Vector3d>>& moving) {
    for (std::size_t k = 0; k < joints.size(); ++k) {
        std::int32_t to = body;
        if (k + 1 < joints.size()) {
            const ModelBody& end = model.bodies[static_cast<std::size_t>(body)];
            ModelBody piece;
            piece.name = fmt::format("{} after {}", end.name, joints[k].parameters.name);
            piece.position = Eigen::Map<const Vector3d>(joints[k].parameters.point.data());
            piece.orientation = end.orientation;
            piece.velocity = moving[k].first;
            piece.angular_velocity = piece.orientation.conjugate() * moving[k].second;
            to = static_cast<std::int32_t>(model.bodies.size());
            model.bodies.push_back(std::move(piece));
        }
        joints[k].parameters.first = parent;
        joints[k].parameters.second = to;
        model.joints.push_back(std::move(joints[k]));
        parent = to;
    }
}

namespace {

/// Sets of bodies, each named by the least number among its members; −1, the world, is less than all.
class Groups {
public:
    explicit Groups(std::size_t bodies) : leader_(bodies) { std::iota(leader_.begin(), leader_.end(), 0); }
    [[nodiscard]] std::int32_t of(std::int32_t body) const {
        while (body >= 0 && leader_[static_cast<std::size_t>(body)] != body)
            body = leader_[static_cast<std::size_t>(body)];
        return body;
    }
    void join(std::int32_t a, std::int32_t b) {
        a = of(a);
        b = of(b);
        if (a == b) return;
        leader_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }

private:
    std::vector<std::int32_t> leader_;
};

/// The moments about another point are greater by m (|d|² 1 − d dᵀ).
Matrix3d moved(const Matrix3d& inertia, double mass, const Vector3d& d) {
    return inertia + mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
}

void add_to(ModelBody& whole, const ModelBody& part) {
    const double mass = whole.mass + part.mass;
    if (part.mass > 0.0) {
        const Vector3d centre = (whole.mass * whole.position + part.mass * part.position) / mass;
        const Matrix3d A = whole.orientation.toRotationMatrix();
        const Matrix3d to_whole = A.transpose() * part.orientation.toRotationMatrix();
        const Vector3d own = A.transpose() * (whole.position - centre),
                       other = A.transpose() * (part.position - centre);
        whole.inertia = moved(whole.inertia, whole.mass, own) +
                        moved(to_whole * part.inertia * to_whole.transpose(), part.mass, other);
        whole.velocity += (A * whole.angular_velocity).cross(centre - whole.position);
        whole.position = centre;
        whole.mass = mass;
    }
    whole.shapes.insert(whole.shapes.end(), part.shapes.begin(), part.shapes.end());
}

/// Renumbers what the model says of bodies and joints. −1: gone; of bodies world_body stays.
void renumber(Model& model, const std::vector<std::int32_t>& body, const std::vector<char>& keep_joint) {
    const auto to = [&](std::int32_t old) { return old < 0 ? old : body[static_cast<std::size_t>(old)]; };
    std::vector<std::int32_t> joint(model.joints.size(), -1);
    std::vector<ModelJoint> joints;
    for (const bool gears : {false, true})  // gears name others, and nothing names them: they come last
        for (std::size_t k = 0; k < model.joints.size(); ++k) {
            JointParameters& own = model.joints[k].parameters;
            if (keep_joint[k] == 0 || (own.kind == JointKind::Gear) != gears) continue;
            joint[k] = static_cast<std::int32_t>(joints.size());
            own.first = to(own.first);
            own.second = to(own.second);
            joints.push_back(model.joints[k]);
        }
    const auto joint_of = [&](std::int32_t old) { return old < 0 ? old : joint[static_cast<std::size_t>(old)]; };
    const auto is_gear = [](const ModelJoint& one) { return one.parameters.kind == JointKind::Gear; };
    for (ModelJoint& one : joints) {
        if (!is_gear(one)) continue;
        one.parameters.gear_first = joint_of(one.parameters.gear_first);
        one.parameters.gear_second = joint_of(one.parameters.gear_second);
    }
    std::erase_if(joints, [&](const ModelJoint& one) {
        return is_gear(one) && (one.parameters.gear_first < 0 || one.parameters.gear_second < 0);
    });
    model.joints = std::move(joints);
    const auto keep = [&](auto& items) {
        for (auto& item : items) item.joint = joint_of(item.joint);
        std::erase_if(items, [](const auto& item) { return item.joint < 0; });
    };
    keep(model.actuators);
    keep(model.drives);
    keep(model.locks);
    for (auto& [a, b] : model.apart) {
        a = to(a);
        b = to(b);
        if (a > b) std::swap(a, b);
    }
    std::erase_if(model.apart, [](const auto& pair) { return pair[0] < 0 || pair[0] == pair[1]; });
    std::sort(model.apart.begin(), model.apart.end());
    model.apart.erase(std::unique(model.apart.begin(), model.apart.end()), model.apart.end());
}

/// Bodies without mass at the end of a branch, with their joints.
void drop_empty_ends(Model& model) {
    for (bool found = true; found;) {
        found = false;
        for (std::size_t k = 0; k < model.bodies.size() && !found; ++k) {
            const ModelBody& body = model.bodies[k];
            if (body.fixed || body.mass > 0.0) continue;
            std::vector<char> keep(model.joints.size(), 1);
            int joints = 0;
            for (std::size_t j = 0; j < model.joints.size(); ++j) {
                const JointParameters& own = model.joints[j].parameters;
                if (own.kind == JointKind::Gear) continue;
                if (own.first == static_cast<std::int32_t>(k) || own.second == static_cast<std::int32_t>(k)) {
                    ++joints;
                    keep[j] = 0;
                }
            }
            if (joints > 1) continue;
            found = true;
            model.lose(fmt::format("body \"{}\"", body.name),
                       joints == 0 ? "it has no mass, and nothing holds it: left out"
                                   : "it has no mass and carries none: left out, with its joint");
            std::vector<std::int32_t> number(model.bodies.size());
            for (std::size_t i = 0; i < number.size(); ++i)
                number[i] = i == k ? -1 : static_cast<std::int32_t>(i - (i > k ? 1 : 0));
            model.bodies.erase(model.bodies.begin() + static_cast<std::ptrdiff_t>(k));
            renumber(model, number, keep);
        }
    }
}

}  // namespace

void merge_fixed(Model& model) {
    Groups groups(model.bodies.size());
    for (std::size_t k = 0; k < model.bodies.size(); ++k)
        if (model.bodies[k].fixed) model.bodies[k].mass = 0.0;
    const auto is_fixed = [&](std::int32_t body) {
        return body < 0 || model.bodies[static_cast<std::size_t>(body)].fixed;
    };
    // What the world holds stays a body of its own, for its shapes, and becomes fixed.
    for (bool changed = true; changed;) {
        changed = false;
        for (const ModelJoint& joint : model.joints) {
            const auto [a, b] = std::pair(joint.parameters.first, joint.parameters.second);
            if (joint.parameters.kind != JointKind::Fixed || joint.closes_loop || is_fixed(a) == is_fixed(b)) continue;
            ModelBody& body = model.bodies[static_cast<std::size_t>(is_fixed(a) ? b : a)];
            body.fixed = changed = true;
            body.mass = 0.0;
        }
    }
    for (const ModelJoint& joint : model.joints) {
        const auto [a, b] = std::pair(joint.parameters.first, joint.parameters.second);
        if (joint.parameters.kind == JointKind::Fixed && !joint.closes_loop && !is_fixed(a)) groups.join(a, b);
    }
    std::vector<std::int32_t> number(model.bodies.size(), -1);
    std::vector<ModelBody> bodies;
    for (std::size_t k = 0; k < model.bodies.size(); ++k) {
        const auto own = static_cast<std::int32_t>(k), leader = groups.of(own);
        ModelBody& body = model.bodies[k];
        if (leader == own) {
            if (body.fixed && body.shapes.empty()) continue;  // the world does
            number[k] = static_cast<std::int32_t>(bodies.size());
            bodies.push_back(body);
        } else {
            number[k] = number[static_cast<std::size_t>(leader)];
            add_to(bodies[static_cast<std::size_t>(number[k])], body);
        }
    }
    std::vector<char> keep(model.joints.size(), 1);
    for (std::size_t k = 0; k < model.joints.size(); ++k) {
        const JointParameters& own = model.joints[k].parameters;
        if (own.kind == JointKind::Gear) continue;
        const bool still = is_fixed(own.first) && is_fixed(own.second);
        if (still || (own.first >= 0 && own.second >= 0 && groups.of(own.first) == groups.of(own.second))) keep[k] = 0;
    }
    std::erase_if(model.apart, [&](const auto& pair) { return is_fixed(pair[0]) && is_fixed(pair[1]); });
    renumber(model, number, keep);
    model.bodies = std::move(bodies);
    drop_empty_ends(model);
    for (const ModelBody& body : model.bodies)
        if (!body.fixed && body.mass > 0.0) return;
    std::string lost;
    for (const NotCarriedOver& one : grouped(model.lost))
        lost += fmt::format("{}{}: {}", lost.empty() ? "; not carried over: " : "; ", one.what, one.why);
    throw InputError("nothing in the model moves that has mass" + lost);
}

}  // namespace delassus::model_import
