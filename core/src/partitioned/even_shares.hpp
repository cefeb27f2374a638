// SPDX-License-Identifier: BSD-3-Clause
// Numbers shared out evenly, in their order (internal).
#pragma once

#include <cstdint>

namespace delassus {

/// Process p has the numbers start(p) … start(p + 1) − 1 of 0 … total − 1.
struct EvenShares {
    std::int64_t total;
    int processes;

    [[nodiscard]] std::int64_t start(int process) const {
        return total / processes * process + total % processes * process / processes;
    }
    /// Whose the number is.
    [[nodiscard]] int owner(std::int64_t number) const {
        int process = static_cast<int>(static_cast<double>(number) / static_cast<double>(total) * processes);
        while (process > 0 && number < start(process)) --process;
        while (process + 1 < processes && number >= start(process + 1)) ++process;
        return process;
    }
};

}  // namespace delassus
