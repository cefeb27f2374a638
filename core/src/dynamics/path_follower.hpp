// SPDX-License-Identifier: BSD-3-Clause
// Follows a path of equilibria: the length of its steps, and the points that it must not miss (internal).
#pragma once

#include <functional>
#include <string>

#include "delassus/export.hpp"
#include "dynamics/load_path.hpp"

namespace delassus {

/// What a point is, beside one of the path.
enum class PathEvent {
    None,
    Limit,       ///< the load factor has an extremum
    Bifurcation  ///< a pair of branches crosses the path, or leaves it
};

struct PathFollowerSettings {
    double first_step = 0.1;  ///< of the load factor, by the linear answer at the start
    int most_points = 1000;   ///< the start and marked points not counted
};

/// How a path ended.
enum class PathStop {
    Goal,
    Points,  ///< most_points
    Stuck    ///< no further point was found, however near
};

class DELASSUS_API PathFollower {
public:
    /// path has begun, and outlives it.
    PathFollower(LoadPath& path, PathFollowerSettings settings) : path_(path), settings_(settings) {}

    /// A function of the point that is negative until the end of the path.
    std::function<double(const LoadPathPoint&)> goal;
    /// Called with the start and with each point in the order of the path. What it throws ends the path.
    std::function<void(const LoadPathPoint&, PathEvent)> on_point;

    /// Follows the path from start. point ← its end, the first one where goal is not negative.
    PathStop follow(const LoadPathPoint& start, LoadPathPoint& point);

private:
    struct Found {
        LoadPathPoint point;
        double length = 0.0;
        PathEvent event = PathEvent::None;
    };
    bool root(const LoadPathPoint& from, const LoadPathPoint& to, double length,
              const std::function<double(const LoadPathPoint&)>& function, Found& found);
    bool change_of_count(const LoadPathPoint& from, double length, Found& found);
    std::vector<Found> events(const LoadPathPoint& from, const LoadPathPoint& to, double length);

    LoadPath& path_;
    PathFollowerSettings settings_;
};

}  // namespace delassus
