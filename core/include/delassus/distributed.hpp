// SPDX-License-Identifier: BSD-3-Clause
// Runs under an MPI launcher, recognised by its environment. The core itself never talks to MPI.
#pragma once

#include "delassus/export.hpp"

namespace delassus {

/// How many processes were started together; 1 without a launcher.
[[nodiscard]] DELASSUS_API int process_count();

/// The number of this process among them, from 0. By convention number 0 alone prints and writes files.
[[nodiscard]] DELASSUS_API int process_rank();

}  // namespace delassus
