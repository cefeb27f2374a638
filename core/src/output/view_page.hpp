// SPDX-License-Identifier: BSD-3-Clause
// The page that plays the motion of a run (docs/viewing.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "output/recorded.hpp"

namespace delassus {

/// What a run folder holds that a page shows.
struct RecordedRun {
    std::string title;            ///< of the scene; may be empty
    std::string status, message;  ///< as in report.json; status "unfinished" where there is no report yet
    std::vector<RecordedSystem> systems;
};

/// Reads the folder of `delassus run -o`. Throws InputError if it holds no trajectory, or none that can be shown.
DELASSUS_API RecordedRun read_run(const std::filesystem::path& folder, const RecordingLimits& limits);

/// The page, whole in one file. Throws InputError if a part of it is missing, e.g. three.js.
DELASSUS_API std::string view_page(const RecordedRun& run);

}  // namespace delassus
