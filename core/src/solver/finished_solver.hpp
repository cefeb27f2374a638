// SPDX-License-Identifier: BSD-3-Clause
// `finish:`, an option that every solver has: another solver takes over from its result.
#pragma once

#include <string>

#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace delassus {

/// The options of the framework, which are taken out of a solver's own.
struct FinishOptions {
    std::string solver;       ///< name or path; empty: no finish
    double tolerance = 1e-4;  ///< natural error at which it takes over
};

/// Takes the keys "finish" and "finish_at" out of the options. Throws InputError on a bad value, or on finish_at alone.
[[nodiscard]] FinishOptions take_finish(OptionTexts& options);

/// A solver in three stages: `main` down to the finish's tolerance, the finish down to the requested one, and, if that
/// failed, `main` again from the best iterate of both. chosen: all options as the user wrote them.
[[nodiscard]] Solver make_finished(Solver main, Solver finish, double finish_at, OptionTexts chosen);

}  // namespace delassus
