// SPDX-License-Identifier: BSD-3-Clause
// Trajectories of a run in HDF5 (docs/running.md). The writer lives in a module of its own, delassus_trajectory.so, so
// that nothing but a run that writes one maps HDF5.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "delassus/collision.hpp"
#include "delassus/simulation.hpp"
#include "output/trajectory_model.hpp"

namespace delassus {

/// What the file contains once for each system.
struct TrajectorySystem {
    std::string name, integrator, solver;
    std::int32_t positions = 0, velocities = 0;  ///< sizes of q and v
    double step = 0.0;                           ///< s
    TrajectoryModel model;
    bool contact_forces = false;         ///< whether frames have the forces of contacts
    std::int64_t steps = 0, frames = 0;  ///< rows to keep of a file that is there; 0: a new file
    std::vector<std::uint64_t> written;  ///< of these rows
};

class TrajectoryWriter {
public:
    virtual ~TrajectoryWriter() = default;
    /// system: its place in the list that the writer was made with.
    virtual void add_step(std::size_t system, const StepRecord& record) = 0;
    /// poses: of all bodies. contacts: of the step that led here.
    virtual void add_frame(std::size_t system, const State& state, const std::vector<Pose>& poses,
                           const std::vector<ContactRecord>& contacts) = 0;
    /// A checksum of the rows of each growing dataset of the system so far.
    [[nodiscard]] virtual std::vector<std::uint64_t> written(std::size_t system) const = 0;
    /// Puts everything on disk. Throws InputError if that fails, e.g. on a full disk.
    virtual void flush() = 0;
};

/// Loads the module and makes the file; continues the one that is there if `resume`. Throws InputError where this
/// build has no HDF5, or if the file cannot be made or continued, e.g. because the rows to keep are not what was
/// written. A file that is there stays as it is until the first call that adds something or flushes.
std::unique_ptr<TrajectoryWriter> open_trajectory(const std::filesystem::path& file,
                                                  const std::vector<TrajectorySystem>& systems, bool resume);

}  // namespace delassus

// The module is built together with the library, so C++ types may cross here.
extern "C" {
using DelassusTrajectoryOpen = delassus::TrajectoryWriter* (*)(const std::filesystem::path& file,
                                                               const std::vector<delassus::TrajectorySystem>& systems,
                                                               bool resume);
}
