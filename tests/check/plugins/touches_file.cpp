// SPDX-License-Identifier: BSD-3-Clause
// Writes a file when it is loaded, so that a test can see whether it was.
#include <cstdio>
#include <cstdlib>

#include "sweeps.hpp"

namespace {
[[maybe_unused]] const bool touched = [] {
    const char* path = std::getenv("DELASSUS_TEST_LOADED_FILE");
    std::FILE* file = path ? std::fopen(path, "w") : nullptr;
    if (file) std::fclose(file);
    return file != nullptr;
}();
}  // namespace

FIXTURE_PLUGIN("touches_file", "writes a file when it is loaded", static_cast<void>(descriptor))
