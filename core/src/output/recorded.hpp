// SPDX-License-Identifier: BSD-3-Clause
// What trajectory.h5 says of a run, thinned out for a picture of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "output/trajectory_model.hpp"

namespace delassus {

/// A quantity of each step against time. Where there are many steps, each stretch of time keeps the steps with its
/// least and its greatest value.
struct RecordedSeries {
    std::string name, unit, description;
    std::vector<double> t, values;  ///< s; the values may be NaN
};

struct RecordedSystem {
    std::string name, integrator, solver;  ///< solver: empty if none was named
    double step = 0.0;                     ///< s
    TrajectoryModel model;
    std::int64_t steps = 0;   ///< taken
    std::int64_t frames = 0;  ///< in the file

    // The frames that were chosen: evenly among those in the file, the first and the last included.
    std::vector<double> t;                  ///< s
    std::vector<double> poses;              ///< frames × bodies × 7: position, quaternion w x y z
    std::vector<double> nodes;              ///< frames × nodes × 3, m
    std::vector<std::int64_t> contact_end;  ///< of each frame: where its contacts end in `contacts`
    std::vector<double> contacts;           ///< × 3: points, m
    bool contacts_left_out = false;         ///< there were more than the limit; then there is none here

    std::vector<RecordedSeries> series;
};

/// Limits of what is read.
struct RecordingLimits {
    std::int64_t frames = 600;        ///< of each system at most; ≥ 2
    std::int64_t points = 1000;       ///< of each series at most; ≥ 2
    std::int64_t contacts = 500'000;  ///< of each system, in all its chosen frames; all of them or none
};

/// Loads the HDF5 module and reads in a child process, because HDF5 crashes on some damaged files. Of a run that was
/// not finished, or still goes on, it reads what is on disk. Throws InputError for a file that is damaged, is no
/// trajectory, or lacks the model.
DELASSUS_API std::vector<RecordedSystem> read_trajectory(const std::filesystem::path& file,
                                                         const RecordingLimits& limits);

}  // namespace delassus

// The module is built together with the library, so C++ types may cross here.
extern "C" {
using DelassusTrajectoryRead = void (*)(const std::filesystem::path& file, const delassus::RecordingLimits& limits,
                                        std::vector<delassus::RecordedSystem>& systems);
}
