// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/domains.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace delassus {

namespace {

double norm(const Vector3& v) {
    return std::hypot(v[0], v[1], v[2]);
}

/// The distance of a shape's farthest point from the origin of its body; negative for those without an end.
double reach_of(const Shape& shape) {
    const double offset = norm(shape.pose.position);
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return offset + shape.size[0];
        case ShapeKind::Box:
            return offset + norm(shape.size);
        case ShapeKind::Capsule:
            return offset + shape.size[0] + shape.size[1];
        case ShapeKind::Cylinder:
            return offset + std::hypot(shape.size[0], shape.size[1]);
        case ShapeKind::Convex: {
            double farthest = 0.0;
            for (const Vector3& vertex : shape.mesh->vertices) farthest = std::max(farthest, norm(vertex));
            return offset + farthest;
        }
        default:
            return -1.0;
    }
}

/// A box with edges along the axes; empty at first.
struct Bounds {
    Vector3 lower, upper;
    Bounds() {
        lower.fill(std::numeric_limits<double>::infinity());
        upper.fill(-std::numeric_limits<double>::infinity());
    }
    void add(const Reach& ball) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], ball.centre[k] - ball.radius);
            upper[k] = std::max(upper[k], ball.centre[k] + ball.radius);
        }
    }
    [[nodiscard]] bool meets(const Reach& ball) const {
        double squares = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double beyond = std::max({lower[k] - ball.centre[k], ball.centre[k] - upper[k], 0.0});
            squares += beyond * beyond;
        }
        return squares <= ball.radius * ball.radius;
    }
};

/// What is given to one process as a whole.
struct Item {
    Vector3 centre{};
    double weight = 0.0;
    std::vector<std::int32_t> bodies;
};

/// Gives items to the processes first … first + count − 1.
void bisect(std::span<Item*> items, std::int32_t first, std::int32_t count, std::vector<std::int32_t>& owners) {
    if (count == 1 || items.empty()) {
        for (const Item* item : items)
            for (const std::int32_t body : item->bodies) owners[static_cast<std::size_t>(body)] = first;
        return;
    }
    Bounds box;
    for (const Item* item : items) box.add({item->centre, 0.0});
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (box.upper[k] - box.lower[k] > box.upper[axis] - box.lower[axis]) axis = k;
    std::sort(items.begin(), items.end(), [axis](const Item* a, const Item* b) {
        return a->centre[axis] != b->centre[axis] ? a->centre[axis] < b->centre[axis]
                                                  : a->bodies.front() < b->bodies.front();
    });
    const std::int32_t left = count / 2;
    const double all = std::accumulate(items.begin(), items.end(), 0.0,
                                       [](double sum, const Item* item) { return sum + item->weight; });
    const double share = all * left / count;
    double sum = 0.0;
    std::size_t cut = 0;
    // The item at the cut goes to the side that comes nearer to its share.
    while (cut < items.size() && sum + 0.5 * items[cut]->weight < share) sum += items[cut++]->weight;
    bisect(items.first(cut), first, left, owners);
    bisect(items.subspan(cut), first + left, count - left, owners);
}

}  // namespace

Domains::Domains(const SceneSystem& system) {
    const MultibodySystem& mechanics = *system.system;
    std::vector<std::int32_t> number(static_cast<std::size_t>(mechanics.body_count()), -1);
    for (BodyIndex body = 0; body < mechanics.body_count(); ++body) {
        if (mechanics.body_column(body) < 0) continue;
        number[static_cast<std::size_t>(body)] = static_cast<std::int32_t>(moving_.size());
        moving_.push_back(body);
    }
    const auto number_of = [&](BodyIndex body) { return body < 0 ? -1 : number[static_cast<std::size_t>(body)]; };

    radii_.assign(moving_.size(), -1.0);
    for (const Shape& shape : mechanics.shapes())
        if (const auto body = number_of(shape.body); body >= 0) {
            double& radius = radii_[static_cast<std::size_t>(body)];
            radius = std::max(radius, reach_of(shape));
        }
    constexpr double times = 4.0;
    std::vector<double> sizes;
    for (const double radius : radii_)
        if (radius >= 0.0) sizes.push_back(radius);
    large_.assign(moving_.size(), false);
    if (!sizes.empty()) {
        const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
        std::nth_element(sizes.begin(), middle, sizes.end());
        for (std::size_t k = 0; k < radii_.size(); ++k) large_[k] = radii_[k] > times * *middle;
    }

    const auto link = [&](BodyIndex first, BodyIndex second) {
        const auto a = number_of(first), b = number_of(second);
        if (a >= 0 && b >= 0 && a != b) links_.emplace_back(std::min(a, b), std::max(a, b));
    };
    for (const JointParameters& joint : system.joints) {
        if (joint.kind != JointKind::Gear) {
            link(joint.first, joint.second);
            continue;
        }
        const auto& one = system.joints[static_cast<std::size_t>(joint.gear_first)];
        const auto& other = system.joints[static_cast<std::size_t>(joint.gear_second)];
        const std::array bodies = {one.first, one.second, other.first, other.second};
        for (std::size_t i = 0; i < bodies.size(); ++i)
            for (std::size_t k = 0; k < i; ++k) link(bodies[i], bodies[k]);
    }
    for (const auto& spring : system.springs) link(spring.first, spring.second);
    for (const auto& bushing : system.bushings) link(bushing.first, bushing.second);

    cluster_.resize(moving_.size());
    std::iota(cluster_.begin(), cluster_.end(), 0);
    const auto root = [&](std::int32_t body) {
        while (cluster_[static_cast<std::size_t>(body)] != body) {
            auto& parent = cluster_[static_cast<std::size_t>(body)];
            parent = cluster_[static_cast<std::size_t>(parent)];
            body = parent;
        }
        return body;
    };
    for (const auto& [a, b] : links_) {
        const auto first = root(a), second = root(b);
        cluster_[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
    }
    for (std::size_t k = 0; k < cluster_.size(); ++k) cluster_[k] = root(static_cast<std::int32_t>(k));
}

std::vector<std::int32_t> Domains::owners(std::span<const Vector3> centres, std::span<const double> weights,
                                          int processes) const {
    const std::size_t count = moving_.size();
    std::vector<double> heavy(count, 0.0);
    double all = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
        heavy[static_cast<std::size_t>(cluster_[k])] += weights[k];
        all += weights[k];
    }
    const double most = 0.5 * all / processes;
    std::vector<Item> items;
    std::vector<std::size_t> item_of(count);
    for (std::size_t k = 0; k < count; ++k) {
        const auto first = static_cast<std::size_t>(cluster_[k]);
        const bool alone = first == k || heavy[first] > most;
        item_of[k] = alone ? items.size() : item_of[first];
        if (alone) items.emplace_back();
        Item& item = items[item_of[k]];
        item.bodies.push_back(static_cast<std::int32_t>(k));
        item.weight += weights[k];
        for (std::size_t i = 0; i < 3; ++i) item.centre[i] += weights[k] * centres[k][i];
    }
    std::vector<Item*> order;
    for (Item& item : items) {
        for (double& coordinate : item.centre) coordinate /= item.weight;
        order.push_back(&item);
    }
    std::vector<std::int32_t> result(count, 0);
    bisect(order, 0, processes, result);
    return result;
}

// A contact of a small body and a large one falls to the small one's process, so that one with a large body does not
// need all that lies on it. The small ones of a process, and all of its own, lie in a box each.
std::vector<bool> Domains::needed(std::span<const std::int32_t> owners, std::span<const Reach> reach,
                                  std::int32_t process) const {
    Bounds small, any;
    for (std::size_t k = 0; k < moving_.size(); ++k) {
        if (owners[k] != process || reach[k].radius < 0.0) continue;
        any.add(reach[k]);
        if (!large_[k]) small.add(reach[k]);
    }
    std::vector<bool> result(moving_.size(), false);
    for (std::size_t k = 0; k < moving_.size(); ++k)
        result[k] = owners[k] == process || (reach[k].radius >= 0.0 && (large_[k] ? any : small).meets(reach[k]));
    for (const auto& [a, b] : links_) {
        const auto first = static_cast<std::size_t>(a), second = static_cast<std::size_t>(b);
        if (owners[first] == process) result[second] = true;
        if (owners[second] == process) result[first] = true;
    }
    return result;
}

}  // namespace delassus
