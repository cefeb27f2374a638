// SPDX-License-Identifier: BSD-3-Clause
// The file checkpoint.json of a run: everything that is needed to go on with the same bits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"

namespace delassus {

struct CheckpointedSystem {
    std::string name;
    SimulationState simulation;
    std::vector<double> frame_times;       ///< of the frames written so far, s
    std::vector<double> picture_times{};   ///< of those that were written for ParaView too, s
    std::vector<std::uint64_t> written{};  ///< TrajectoryWriter::written() of the rows up to here
};

struct Checkpoint {
    std::string scene;  ///< Scene::canonical
    std::vector<CheckpointedSystem> systems;
    // What else shapes the output.
    bool contact_forces = false;  ///< whether the frames have them
    std::int64_t every = 1;       ///< steps from frame to frame
    std::int64_t pictures = 0;    ///< about how many frames are written for ParaView too
    std::optional<std::int64_t> dump =
        {};  ///< steps from one whose problems are written to the next; none: no problems
};

/// Replaces the file, or leaves the old one: never a half of one.
DELASSUS_API void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& file);

/// Throws InputError if the file is absent or of another format, or if a character is not what it was written as.
DELASSUS_API Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace delassus
