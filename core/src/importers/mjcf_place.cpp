// SPDX-License-Identifier: BSD-3-Clause
#include "importers/mjcf_place.hpp"

namespace delassus::importers::mjcf {

namespace {

Quaterniond unit(const double* q) {
    const Quaterniond given(q[0], q[1], q[2], q[3]);
    return given.norm() < 1e-14 ? Quaterniond::Identity() : given.normalized();
}

}  // namespace

std::vector<Placed> place(const Spec& spec, const Key* key) {
    std::vector<Placed> placed(spec.bodies.size());
    std::size_t mocap = 0;
    for (std::size_t k = 1; k < placed.size(); ++k) {
        const Body& body = spec.bodies[k];
        const Placed& parent = placed[static_cast<std::size_t>(body.parent)];
        Placed& own = placed[k];
        own.frame = parent.frame * frame_of(body.position, body.orientation);
        if (body.mocap && key != nullptr) {
            if (3 * (mocap + 1) <= key->mpos.size()) own.frame.translation() = Vector3d(key->mpos.data() + 3 * mocap);
            if (4 * (mocap + 1) <= key->mquat.size())
                own.frame.linear() = unit(key->mquat.data() + 4 * mocap).toRotationMatrix();
        }
        mocap += body.mocap ? 1 : 0;
        own.angular_velocity = parent.angular_velocity;
        own.velocity =
            parent.velocity + parent.angular_velocity.cross(own.frame.translation() - parent.frame.translation());
        if (key == nullptr) continue;
        const auto has = [](const std::vector<double>& values, std::int32_t at, int count) {
            return values.size() >= static_cast<std::size_t>(at + count);
        };
        for (const Joint& joint : body.joints) {
            const double* q = key->qpos.data() + joint.coordinate;
            const double* v = key->qvel.data() + joint.freedom;
            if (joint.type == JointType::Free) {
                if (has(key->qpos, joint.coordinate, 7)) own.frame = frame_of(Vector3d(q), unit(q + 3));
                if (!has(key->qvel, joint.freedom, 6)) continue;
                own.velocity = Vector3d(v);
                own.angular_velocity = own.frame.linear() * Vector3d(v + 3);
            } else if (joint.type == JointType::Ball) {
                const Vector3d anchor = own.frame * joint.position;
                const Vector3d moves = own.velocity + own.angular_velocity.cross(anchor - own.frame.translation());
                if (has(key->qpos, joint.coordinate, 4))
                    own.frame.linear() = (own.frame.linear() * unit(q).toRotationMatrix()).eval();
                own.frame.translation() = anchor - own.frame.linear() * joint.position;
                if (has(key->qvel, joint.freedom, 3)) own.angular_velocity += own.frame.linear() * Vector3d(v);
                own.velocity = moves + own.angular_velocity.cross(own.frame.translation() - anchor);
            }
        }
    }
    return placed;
}

// With the mass, mass centre and moments of all that a joint carries, about the centre: a hinge moves
// aᵀ (J + m (|r|² 1 − r rᵀ)) a with r from its anchor to the centre, a slide m, and both their armature.
std::vector<double> inertias_at_reference(const Spec& spec) {
    const std::vector<Placed> placed = place(spec, nullptr);
    const std::size_t count = spec.bodies.size();
    std::vector<MassProperties> carried(count);
    for (std::size_t k = 1; k < count; ++k) carried[k] = moved(spec.bodies[k].own, placed[k].frame);
    for (std::size_t k = count; k-- > 1;) {
        MassProperties& parent = carried[static_cast<std::size_t>(spec.bodies[k].parent)];
        parent = sum_of({parent, carried[k]});
    }
    std::vector<double> result(static_cast<std::size_t>(spec.freedoms), 0.0);
    for (std::size_t k = 1; k < count; ++k)
        for (const Joint& joint : spec.bodies[k].joints) {
            const auto at = static_cast<std::size_t>(joint.freedom);
            const MassProperties& all = carried[k];
            const Vector3d arm = all.centre - placed[k].frame * joint.position;
            const Matrix3d about =
                all.inertia + all.mass * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
            const auto turning = [&](const Vector3d& axis) { return axis.dot(about * axis) + joint.armature; };
            if (joint.type == JointType::Slide) result[at] = all.mass + joint.armature;
            if (joint.type == JointType::Hinge) result[at] = turning(placed[k].frame.linear() * joint.axis);
            const std::size_t turns = at + (joint.type == JointType::Free ? 3 : 0);
            if (joint.type == JointType::Free)
                for (std::size_t i = 0; i < 3; ++i) result[at + i] = all.mass + joint.armature;
            if (joint.type == JointType::Free || joint.type == JointType::Ball)
                for (int i = 0; i < 3; ++i)
                    result[turns + static_cast<std::size_t>(i)] = turning(placed[k].frame.linear().col(i));
        }
    return result;
}

}  // namespace delassus::importers::mjcf
