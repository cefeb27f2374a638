// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "relations/scene_document.hpp"

namespace delassus::relations {

/// Runs a scene that is refused by the command `delassus run -o`, as a user does. What is wrong with how it ends, as a
/// clause: a signal, an exit code other than 2, 3 or 4, no sentence on standard error, or a file in the folder that
/// .delassus there does not list. Empty: nothing, or it took longer than `seconds`. command: the program; scratch: a
/// folder.
[[nodiscard]] std::string wrong_with_refusal(const Json& scene, const std::filesystem::path& command,
                                             const std::filesystem::path& scratch, double seconds);

}  // namespace delassus::relations
