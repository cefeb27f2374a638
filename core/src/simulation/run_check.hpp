// SPDX-License-Identifier: BSD-3-Clause
// How wrong a run is, by a second one with half of what may be wrong in each step.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"
#include "simulation/extent.hpp"

namespace delassus {

/// Where the bodies and nodes of a system were at the times of its steps. Where that is more than some 20 million
/// numbers, every second, fourth, … step is kept, and the last.
class DELASSUS_API Track {
public:
    /// Keeps the start. The simulation is none of several that share its bodies.
    explicit Track(const Simulation& simulation);
    /// Keeps the state after a step of the same simulation.
    void add(const Simulation& simulation);

    struct Frame {
        double t = 0.0;              ///< s
        std::vector<Pose> poses;     ///< of each body
        std::vector<Vector3> nodes;  ///< m
    };
    [[nodiscard]] const std::vector<Frame>& frames() const { return frames_; }
    /// Half the diagonal of the box of all places, or the largest radius of gyration of a body, m; 0: nothing moves.
    [[nodiscard]] double extent() const;

private:
    std::vector<Frame> frames_;
    std::size_t every_ = 1, seen_ = 0;
    Extent places_;
    double gyration_ = 0.0;
};

/// Halves what may be wrong in each step of a system: its step, its tolerance, an `error_limit`, and its `accuracy`.
/// The method stays.
DELASSUS_API void halve_errors(SceneSystem& system);

/// How far a second run is from the first.
struct RunCheck {
    double extent = 0.0;                    ///< of what moves, m (Track::extent())
    double accuracy = 0.0;                  ///< of the first run, a share of the extent, or rad
    double position = 0.0, rotation = 0.0;  ///< at the end, the largest of all bodies and nodes, m and rad
    std::string farthest;  ///< the body, or "node N", that is farthest off; empty: none is beyond rounding
    /// Of the first run at its end, a share of the extent or rad: its distance d from the second, whose error is
    /// smaller by the factor q, is (1 − 1/q) of it.
    double error = 0.0;
    double on_the_way = 0.0;           ///< the largest distance where times of both met, a share of the extent or rad
    double factor = 2.0;               ///< q: 2ᵖ for a method of order p, 2 over contacts, or with a tolerance
    std::optional<double> apart_from;  ///< s: from when on they are farther apart than the accuracy; none: never seen
    double first_seconds = 0.0, second_seconds = 0.0;
    std::string failure;  ///< why the second run did not come to the end; empty: it did

    /// Errors beyond this share say that the end is not known.
    static constexpr double unknown = 0.3;

    /// What a run would take whose error is smaller by this factor, s: from the growth of the time by halving.
    [[nodiscard]] DELASSUS_API double seconds_for(double smaller) const;
};

/// Runs the systems of `refined` to their ends and compares each with that of `first`, after halve_errors(). Nothing
/// where `interrupted` says so. Throws what run_to_end() throws.
DELASSUS_API std::vector<RunCheck> check_runs(const std::vector<Simulation>& first, const std::vector<Track>& tracks,
                                              std::vector<Simulation>& refined,
                                              const std::function<bool()>& interrupted);

}  // namespace delassus
