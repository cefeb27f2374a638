// SPDX-License-Identifier: BSD-3-Clause
#include "support/module.hpp"
#include "trajectory/trajectory.hpp"

namespace delassus {

std::unique_ptr<TrajectoryWriter> open_trajectory(const std::filesystem::path& file,
                                                  const std::vector<TrajectorySystem>& systems, bool resume) {
    const auto open = reinterpret_cast<DelassusTrajectoryOpen>(
        module_symbol("delassus_trajectory", "delassus_trajectory_open", "trajectories cannot be written", "HDF5"));
    return std::unique_ptr<TrajectoryWriter>(open(file, systems, resume));
}

}  // namespace delassus
