// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "output/trajectory_model.hpp"
#include "trajectory/datasets.hpp"

namespace delassus::trajectory {

/// Bytes that a new system takes of the file before its first step, at most.
std::uint64_t largest_size(const TrajectoryModel& model);

/// Puts the group `model` into that of a system (docs/running.md lists its datasets).
void write_model(hid_t system, const TrajectoryModel& model, const std::string& file);

/// Reads what write_model() wrote, the bodies' names included. Throws InputError if it is not there, if an index points
/// nowhere, or a number is not finite.
TrajectoryModel read_model(const hdf5::Group& system);

}  // namespace delassus::trajectory
