// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>
#include <fmt/format.h>

#include "delassus/error.hpp"
#include "support/library_location.hpp"
#include "trajectory/recorded.hpp"
#include "trajectory/trajectory.hpp"

namespace delassus {

namespace {

/// The function of that name in the module, which stays loaded.
template <class Function>
Function from_module(const char* name) {
    const std::filesystem::path path = library_directory() / "delassus" / "delassus_trajectory.so";
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw InputError(fmt::format("trajectories cannot be written or read: this build has no HDF5 ({} is missing)",
                                     path.string()));
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) throw InputError(fmt::format("trajectories cannot be written or read: {}", dlerror()));
    const auto function = reinterpret_cast<Function>(dlsym(handle, name));
    if (function == nullptr)
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew", path.string()));
    return function;
}

}  // namespace

std::unique_ptr<TrajectoryWriter> open_trajectory(const std::filesystem::path& file,
                                                  const std::vector<TrajectorySystem>& systems, bool resume) {
    const auto open = from_module<DelassusTrajectoryOpen>("delassus_trajectory_open");
    return std::unique_ptr<TrajectoryWriter>(open(file, systems, resume));
}

std::vector<RecordedSystem> read_trajectory(const std::filesystem::path& file, const RecordingLimits& limits) {
    std::vector<RecordedSystem> systems;
    from_module<DelassusTrajectoryRead>("delassus_trajectory_read")(file, limits, systems);
    return systems;
}

}  // namespace delassus
