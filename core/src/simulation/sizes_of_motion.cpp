// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/sizes_of_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "simulation/extent.hpp"

namespace delassus {
namespace {

/// Bodies, and all nodes as one more, by the mechanisms that they belong to.
class Mechanisms {
public:
    explicit Mechanisms(const SceneSystem& scene)
        : scene_(scene), system_(*scene.system), root_(static_cast<std::size_t>(system_.body_count()) + 1) {
        std::iota(root_.begin(), root_.end(), std::size_t{0});
        for (const JointParameters& joint : scene.joints) unite(joint.first, joint.second);
        for (const auto& beam : scene.beams) unite(beam[0], beam[1]);
        for (const AttachmentParameters& attachment : scene.attachments)
            if (moves(attachment.body)) root_[find(static_cast<std::size_t>(attachment.body))] = find(root_.size() - 1);
        sizes_.resize(root_.size());
        measure();
    }

    /// Of the mechanism of a body, m; 0: nothing says.
    [[nodiscard]] double size_with(BodyIndex body) const { return size_of(static_cast<std::size_t>(body)); }
    [[nodiscard]] double size_with_nodes() const { return size_of(root_.size() - 1); }

private:
    struct Size {
        Extent places;
        double least = 0.0;
    };

    [[nodiscard]] bool moves(BodyIndex body) const { return body != world_body && system_.body_column(body) >= 0; }
    [[nodiscard]] std::size_t find(std::size_t one) const {
        while (root_[one] != one) one = root_[one];
        return one;
    }
    void unite(BodyIndex one, BodyIndex other) {
        if (moves(one) && moves(other))
            root_[find(static_cast<std::size_t>(one))] = find(static_cast<std::size_t>(other));
    }
    Size& of(BodyIndex body) { return sizes_[find(static_cast<std::size_t>(body))]; }
    [[nodiscard]] double size_of(std::size_t one) const {
        const auto& [places, least] = sizes_[find(one)];
        return std::max(places.half_diagonal(), least);
    }

    void measure() {
        const State start = system_.initial_state();
        for (BodyIndex body = 0; body < system_.body_count(); ++body) {
            if (!moves(body)) continue;
            Size& size = of(body);
            size.places.widen(system_.pose(start, body).position);
            size.least = std::max(size.least, 0.5 * system_.extent_of_shapes(body));
            const BodyParameters& given = system_.body(body);
            if (!given.massless) size.least = std::max(size.least, radius_of_gyration(given));
        }
        for (const JointParameters& joint : scene_.joints) {
            const auto widen = [&](BodyIndex body, const Vector3& place) {
                if (moves(body)) of(body).places.widen(place);
            };
            if (joint.kind == JointKind::Gear) continue;
            widen(joint.first, joint.point);
            widen(joint.second, joint.kind == JointKind::Distance ? joint.second_point : joint.point);
        }
        for (std::int32_t node = 0; node < system_.node_count(); ++node)
            sizes_[find(root_.size() - 1)].places.widen(system_.node_position(start, node));
    }

    const SceneSystem& scene_;
    const MultibodySystem& system_;
    std::vector<std::size_t> root_;
    std::vector<Size> sizes_;
};

/// How many of a joint's velocities are lengths; they come first.
std::int32_t slides(const SceneSystem& scene, const TreeJoint& joint) {
    if (joint.joint < 0) return 3;
    switch (scene.joints[static_cast<std::size_t>(joint.joint)].kind) {
        case JointKind::Prismatic:
        case JointKind::Cylindrical:
            return 1;
        case JointKind::Planar:
            return 2;
        default:
            return 0;
    }
}

/// SizesOfMotion::time for the size L.
double time_of_motion(const MultibodySystem& system, double L) {
    constexpr double times = 3.0;
    const State start = system.initial_state();
    const auto& g = system.gravity();
    double rate = std::sqrt(std::hypot(g[0], g[1], g[2]) / L);
    const auto note = [&](std::int32_t column) {
        if (column < 0) return;
        const double* v = start.v.data() + column;
        rate = std::max(rate, std::hypot(v[0], v[1], v[2]) / L);
    };
    for (BodyIndex body = 0; body < system.body_count(); ++body) note(system.body_column(body));
    for (std::int32_t node = 0; node < system.node_count(); ++node) note(system.node_column(node));
    return rate > 0.0 ? times / rate : 0.0;
}

}  // namespace

SizesOfMotion sizes_of_motion(const SceneSystem& scene, const JointCoordinates* joints) {
    const MultibodySystem& system = *scene.system;
    const Mechanisms mechanisms(scene);
    SizesOfMotion sizes{std::vector<double>(static_cast<std::size_t>(joints ? joints->n() : system.n()), 1.0),
                        HUGE_VAL};
    double largest = 0.0;
    const auto set = [&](std::int32_t column, std::int32_t count, double size) {
        if (!(size > 0.0)) return;
        sizes.least = std::min(sizes.least, size);
        largest = std::max(largest, size);
        std::fill_n(sizes.of_velocities.begin() + column, count, size);
    };
    if (joints) {
        for (const TreeJoint& joint : joints->joints())
            set(joint.column, std::min(slides(scene, joint), joint.freedoms), mechanisms.size_with(joint.body));
    } else {
        for (BodyIndex body = 0; body < system.body_count(); ++body)
            if (const std::int32_t column = system.body_column(body); column >= 0)
                set(column, 3, mechanisms.size_with(body));
        for (std::int32_t node = 0; node < system.node_count(); ++node)
            if (const std::int32_t column = system.node_column(node); column >= 0)
                set(column, 3, mechanisms.size_with_nodes());
    }
    if (!std::isfinite(sizes.least)) sizes.least = 1.0;
    sizes.time = time_of_motion(system, largest > 0.0 ? largest : 1.0);
    return sizes;
}

}  // namespace delassus
