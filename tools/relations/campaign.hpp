// SPDX-License-Identifier: BSD-3-Clause
// Many random scenes, their verdicts counted, what fails shrunk and written.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "relations/judge_apart.hpp"
#include "support/output_folder.hpp"

namespace delassus::relations {

struct Campaign {
    ApartSettings settings;
    std::uint64_t seed = 1, first = 0, count = 100;
    double seconds = std::numeric_limits<double>::infinity();  ///< after so many no other scene is begun
    int jobs = 1;                                              ///< scenes that are judged side by side
    double shrink_seconds = 30.0;                              ///< for each failure; 0: it is written as it is
    std::vector<std::string> only;                             ///< relations; empty: all
};

struct CampaignCounts {
    std::uint64_t scenes = 0, violated = 0;  ///< scenes judged; relations violated
    bool interrupted = false;
};

/// Runs it and fills the folder: results.jsonl, a line a scene; failures/*.yaml, the smallest scene found for each
/// violated relation, with a head that says what fails and how to see it; summary.md. told: called after each scene,
/// one call at a time.
CampaignCounts run_campaign(const Campaign& campaign, OutputFolder& output,
                            const std::function<void(const CampaignCounts&)>& told);

/// Judges the scene of a file, and says so line by line. Returns how many relations are violated.
struct FileAnswer {
    std::string text;
    std::uint64_t violated = 0;
};
[[nodiscard]] FileAnswer judge_file(const ApartSettings& settings, const std::filesystem::path& file,
                                    const std::vector<std::string>& only);

}  // namespace delassus::relations
