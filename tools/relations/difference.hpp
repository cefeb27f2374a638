// SPDX-License-Identifier: BSD-3-Clause
// How far two motions are from one another, and how far they may be.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "relations/motion.hpp"

namespace delassus::relations {

/// The size of what moves, m, > 0: of the bodies' shapes, of the arms on which joints hold them, and of half the box
/// in which they move.
[[nodiscard]] double size_of(const Json& scene, const Motion& motion);

/// How a motion was described: its lengths and times are `units` of the base's, and it was placed elsewhere; or it was
/// mirrored.
struct Described {
    Units units;
    Placement placement;
    bool mirrored = false;
};

/// For each common time, up to where the last steps share what remains, the largest distance of a body that both have:
/// of its position, as a share of size, and of its orientation, in radians. The second motion is taken back to how the
/// first is described; it may have `every` as many steps.
[[nodiscard]] std::vector<double> distances(const Motion& base, const Motion& other, const Described& described,
                                            double size, std::size_t every = 1);

/// The largest so far, of one or of the sum of several.
[[nodiscard]] std::vector<double> largest_so_far(std::vector<double> values);

/// Where a distance was judged, and whether it was ever beyond what is allowed.
struct Judged {
    bool beyond = false;
    bool chaotic = false;                           ///< not judged to the end: from some time on, too little is known
    std::size_t steps = 0;                          ///< judged
    double distance = 0.0, allowed = 0.0, t = 0.0;  ///< where it was first beyond
};

/// Judges as long as `allowed` is at most `most`, and both motions have steps.
[[nodiscard]] Judged judge(const Motion& base, const std::vector<double>& distance, const std::vector<double>& allowed,
                           double most);

}  // namespace delassus::relations
