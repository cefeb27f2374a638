// SPDX-License-Identifier: BSD-3-Clause
// The file checkpoint.json of a run: everything that is needed to go on with the same bits.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"

namespace delassus {

struct CheckpointedSystem {
    std::string name;
    SimulationState simulation;
    std::vector<double> frame_times;      ///< of the frames written so far, s
    std::vector<double> picture_times{};  ///< of those that were written for ParaView too, s
};

struct Checkpoint {
    std::string scene;  ///< Scene::canonical
    std::vector<CheckpointedSystem> systems;
    bool contact_forces = false;  ///< whether the frames have them
};

/// Replaces the file, or leaves the old one: never a half of one.
DELASSUS_API void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& file);

/// Throws InputError if the file is absent, damaged, or of another format.
DELASSUS_API Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace delassus
