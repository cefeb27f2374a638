// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>
#include <fmt/format.h>

#include "delassus/error.hpp"
#include "support/library_location.hpp"
#include "trajectory/trajectory.hpp"

namespace delassus {

std::unique_ptr<TrajectoryWriter> open_trajectory(const std::filesystem::path& file,
                                                  const std::vector<TrajectorySystem>& systems, bool resume) {
    const std::filesystem::path path = library_directory() / "delassus" / "delassus_trajectory.so";
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw InputError(
            fmt::format("trajectories cannot be written: this build has no HDF5 ({} is missing)", path.string()));
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);  // stays loaded, as every module
    if (handle == nullptr) throw InputError(fmt::format("trajectories cannot be written: {}", dlerror()));
    const auto open = reinterpret_cast<DelassusTrajectoryOpen>(dlsym(handle, "delassus_trajectory_open"));
    if (open == nullptr)
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew", path.string()));
    return std::unique_ptr<TrajectoryWriter>(open(file, systems, resume));
}

}  // namespace delassus
