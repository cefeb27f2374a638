// SPDX-License-Identifier: BSD-3-Clause
// Bodies that spin by themselves in a step (internal).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus {

/// Of the free spins of a step those whose body no force but weight and no row of the step's problem acts on: they turn
/// by the rule of DynamicalSystem::free_spins alone. The memory serves again.
class UntouchedSpins {
public:
    void clear() { spins_.clear(); }
    /// spins: of the step, must outlive the use of this; D: the rows of its problem; n: velocities.
    void find(const std::vector<FreeSpin>& spins, const SparseMatrix& D, std::int32_t n) {
        spins_.clear();
        if (spins.empty()) return;
        held_.assign(static_cast<std::size_t>(n), false);
        for (const std::int32_t column : D.column) held_[static_cast<std::size_t>(column)] = true;
        for (const FreeSpin& spin : spins) {
            const auto first = held_.begin() + spin.column;
            if (spin.alone && std::find(first, first + 3, true) == first + 3) spins_.push_back(&spin);
        }
    }
    [[nodiscard]] auto begin() const { return spins_.begin(); }
    [[nodiscard]] auto end() const { return spins_.end(); }

private:
    std::vector<const FreeSpin*> spins_;
    std::vector<bool> held_;  // columns that D touches
};

}  // namespace delassus
