// SPDX-License-Identifier: BSD-3-Clause
// What a method carries from step to step, by what it belongs to (internal).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "dynamics/kept_impulses.hpp"

namespace delassus {

/// The memory of a method of one problem a step. A process that steps some bodies of a system has its part of it: the
/// columns of these bodies, the rows of their joints, the impulses in their contacts.
struct StepMemory {
    std::vector<double> numbers;                  ///< of the system as a whole
    std::vector<std::vector<double>> of_columns;  ///< each of n numbers, or empty: not known yet
    std::vector<std::vector<double>> of_rows;     ///< of the bilateral constraints; each of m, or empty
    KeptImpulses impulses;
};

/// One array, for checkpoints.
[[nodiscard]] DELASSUS_API std::vector<double> flat(const StepMemory& memory);

/// Back from one array. shape: a memory of the same method with as many numbers, columns and rows. n, m: of the
/// system. Throws InputError, which names the owner, where the array is too short.
[[nodiscard]] DELASSUS_API StepMemory unflattened(std::span<const double> all, const StepMemory& shape, std::size_t n,
                                                  std::size_t m, std::string_view owner);

}  // namespace delassus
