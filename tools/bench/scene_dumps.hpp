// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bench/suite.hpp"
#include "support/output_folder.hpp"

namespace delassus::bench {

/// Runs the scenes whose steps' problems the suite asks for with `delassus run --dump-problems`, each into a folder of
/// its own in `output`, and adds the problems to the suite. A folder that is complete is used again. Throws InputError
/// with the place in the suite if a scene cannot be run to its end, or gives no problem.
void add_dumped_problems(const WorkerSettings& worker, OutputFolder& output, Suite& suite);

}  // namespace delassus::bench
