// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <unistd.h>

namespace delassus {

/// Opens /dev/null on those of the descriptors 0, 1 and 2 that are closed, so that no file gets one of them and then
/// what is meant for the terminal. What is written to a closed standard output still fails: its loss must be told.
inline void open_standard_descriptors() {
    for (int standard = STDIN_FILENO; standard <= STDERR_FILENO; ++standard) {
        if (fcntl(standard, F_GETFD) != -1) continue;
        // The lowest free descriptor is this one.
        if (open("/dev/null", standard == STDOUT_FILENO ? O_RDONLY : O_RDWR) != standard) return;
    }
}

}  // namespace delassus
