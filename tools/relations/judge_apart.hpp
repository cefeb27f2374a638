// SPDX-License-Identifier: BSD-3-Clause
// Scenes judged in processes of their own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "relations/scene_document.hpp"

namespace delassus::relations {

struct ApartSettings {
    std::filesystem::path command;                   ///< the program `delassus`
    std::vector<std::filesystem::path> plugin_path;  ///< absolute
    std::filesystem::path scratch;                   ///< a folder that all processes may write into, absolute
    double run_limit = 5.0;                          ///< wall seconds of a run
    std::function<bool()> cancelled;                 ///< asked about twenty times a second, from several threads
};

/// What a process said of a scene.
struct Told {
    std::string relation, verdict, detail;
};

struct ScenesAnswer {
    std::uint64_t number = 0;
    double seconds = 0.0;
    std::vector<Told> outcomes;
};

/// Judges random scenes of these counters, or the given documents (whose numbers are their places). A process that
/// crashes, hangs or leaves is a violation of "sound" of the scene at work, and another process goes on with the next.
/// hear: takes each answer; false: nothing more is wanted. Throws Error if no process can be started, or if one fails
/// with a sentence.
void judge_random(const ApartSettings& settings, std::uint64_t seed, std::vector<std::uint64_t> numbers,
                  const std::vector<std::string>& only, const std::function<bool(const ScenesAnswer&)>& hear);
void judge_documents(const ApartSettings& settings, const std::vector<Json>& documents,
                     const std::vector<std::string>& only, const std::function<bool(const ScenesAnswer&)>& hear);

}  // namespace delassus::relations
