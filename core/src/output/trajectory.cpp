// SPDX-License-Identifier: BSD-3-Clause
#include "output/trajectory.hpp"
#include "output/recorded.hpp"
#include "support/module.hpp"

namespace delassus {

namespace {

void* symbol(const char* name) {
    return module_symbol("delassus_trajectory", name, "trajectories cannot be written or read", "HDF5");
}

}  // namespace

std::unique_ptr<TrajectoryWriter> open_trajectory(const std::filesystem::path& file,
                                                  const std::vector<TrajectorySystem>& systems, bool resume) {
    const auto open = reinterpret_cast<DelassusTrajectoryOpen>(symbol("delassus_trajectory_open"));
    return std::unique_ptr<TrajectoryWriter>(open(file, systems, resume));
}

std::vector<RecordedSystem> read_trajectory(const std::filesystem::path& file, const RecordingLimits& limits) {
    std::vector<RecordedSystem> systems;
    reinterpret_cast<DelassusTrajectoryRead>(symbol("delassus_trajectory_read"))(file, limits, systems);
    return systems;
}

}  // namespace delassus
