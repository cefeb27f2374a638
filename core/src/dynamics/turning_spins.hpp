// SPDX-License-Identifier: BSD-3-Clause
// Bodies that turn by the rule of their free spins (internal).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus {

/// Of the free spins of a step those of bodies that no row of a given set acts on. They turn by FreeSpin::turn and by
/// what else changes their velocities. That differs by O(h³ ω³) from a turn by the mean velocity, on which rows that
/// have to hold at the end of the step rely. The memory serves again.
class TurningSpins {
public:
    void clear() { spins_.clear(); }
    /// spins: of the step, must outlive the use of this; D: its problem's, of which the first `rows` rows count.
    void find(const std::vector<FreeSpin>& spins, const SparseMatrix& D, std::int32_t rows) {
        spins_.clear();
        if (spins.empty()) return;
        held_.assign(static_cast<std::size_t>(D.columns), false);
        const auto entries = rows == 0 ? 0 : static_cast<std::size_t>(D.row_start[static_cast<std::size_t>(rows)]);
        for (std::size_t e = 0; e < entries; ++e) held_[static_cast<std::size_t>(D.column[e])] = true;
        for (const FreeSpin& spin : spins) {
            const auto first = held_.begin() + spin.column;
            if (std::find(first, first + 3, true) == first + 3) spins_.push_back(&spin);
        }
    }
    [[nodiscard]] auto begin() const { return spins_.begin(); }
    [[nodiscard]] auto end() const { return spins_.end(); }

private:
    std::vector<const FreeSpin*> spins_;
    std::vector<bool> held_;  // columns of D
};

}  // namespace delassus
