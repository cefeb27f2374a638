// SPDX-License-Identifier: BSD-3-Clause
#include "relations/difference.hpp"

#include <algorithm>
#include <cmath>

namespace delassus::relations {
namespace {

Eigen::Vector3d point_in(const Json& json) {
    return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

Eigen::Quaterniond orientation_of(const double* pose) {
    return {pose[3], pose[4], pose[5], pose[6]};
}

/// The angle between two orientations, exact for small ones.
double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
    const Eigen::Quaterniond d = a.conjugate() * b;
    return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

}  // namespace

double size_of(const Json& scene, const Motion& motion) {
    double size = 0.0;
    for (const auto& body : scene["bodies"])
        if (moves(body)) size = std::max(size, radius_of(body));
    if (scene.contains("joints"))
        for (const auto& joint : scene["joints"])
            for (const char* side : {"first", "second"}) {
                if (!joint.contains(side) || !joint.contains("point")) continue;
                const Json* body = find_named(scene, "bodies", joint[side]);
                if (body && moves(*body))
                    size = std::max(size, (point_in((*body)["position"]) - point_in(joint["point"])).norm());
            }
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& poses : motion.poses)
        for (std::size_t i = 0; i < poses.size(); i += 7) {
            const Eigen::Map<const Eigen::Array3d> position(poses.data() + i);
            low = low.min(position);
            high = high.max(position);
        }
    if ((low <= high).all()) size = std::max(size, 0.5 * (high - low).matrix().norm());
    return size > 0.0 ? size : 1.0;
}

std::vector<double> distances(const Motion& base, const Motion& other, const Described& described, double size,
                              std::size_t every) {
    const Eigen::Quaterniond back = described.placement.turn.conjugate();
    std::vector<std::size_t> place;
    for (const auto& name : base.bodies)
        place.push_back(
            static_cast<std::size_t>(std::find(other.bodies.begin(), other.bodies.end(), name) - other.bodies.begin()));
    std::vector<double> result;
    for (std::size_t k = 0; k < base.poses.size() && k * every < other.poses.size(); ++k) {
        const double t = base.t[k] * described.units.time;
        if (std::abs(t - other.t[k * every]) > 1e-9 * t) break;
        double largest = 0.0;
        for (std::size_t i = 0; i < base.bodies.size(); ++i) {
            if (place[i] == other.bodies.size()) continue;
            const double *a = base.poses[k].data() + 7 * i, *b = other.poses[k * every].data() + 7 * place[i];
            Eigen::Vector3d position =
                back * (Eigen::Map<const Eigen::Vector3d>(b) / described.units.length - described.placement.shift);
            Eigen::Quaterniond orientation = back * orientation_of(b);
            if (described.mirrored) {
                position.x() *= -1.0;
                orientation.y() *= -1.0;
                orientation.z() *= -1.0;
            }
            const double apart = (position - Eigen::Map<const Eigen::Vector3d>(a)).norm() / size;
            const double turned = angle_between(orientation_of(a), orientation);
            if (!(apart <= largest)) largest = apart;
            if (!(turned <= largest)) largest = turned;
        }
        result.push_back(largest);
    }
    return result;
}

std::vector<double> largest_so_far(std::vector<double> values) {
    for (std::size_t k = 1; k < values.size(); ++k)
        if (!(values[k] >= values[k - 1])) values[k] = values[k - 1];
    return values;
}

Judged judge(const Motion& base, const std::vector<double>& distance, const std::vector<double>& allowed, double most) {
    Judged result;
    const std::size_t count = std::min(distance.size(), allowed.size());
    for (std::size_t k = 0; k < count; ++k) {
        if (!(allowed[k] <= most)) {
            result.chaotic = true;
            return result;
        }
        result.steps = k;
        if (distance[k] <= allowed[k]) continue;
        result.beyond = true;
        result.distance = distance[k];
        result.allowed = allowed[k];
        result.t = base.t[k];
        return result;
    }
    return result;
}

}  // namespace delassus::relations
