// SPDX-License-Identifier: BSD-3-Clause
// H⁻¹ where H couples processes, through the module delassus_petsc_inverse.
#pragma once

#include <cstdint>
#include <memory>

#include "delassus/export.hpp"
#include "delassus/plugin.h"

namespace delassus {

/// The factors of a symmetric matrix of which each process has rows. Everything is collective.
class DELASSUS_API CoupledInverse {
public:
    virtual ~CoupledInverse();
    /// Pivots of A = L Δ Lᵀ below zero, and those that are zero to working precision; of all processes together.
    [[nodiscard]] virtual std::int64_t negative_pivots() const = 0;
    [[nodiscard]] virtual std::int64_t null_pivots() const = 0;
    /// columns ← A⁻¹ columns; own rows, column-major, n × count. Only without null pivots.
    virtual void apply(double* columns, std::int32_t count) const = 0;
};

}  // namespace delassus

// The module is built together with the library, so C++ types may cross here. rows: the own ones, with a diagonal of
// ±1 or zero. first: the number of the first. Throws InputError with one sentence, on all processes.
extern "C" {
using DelassusCoupledInverse = void (*)(std::int32_t communicator, const delassus_local_matrix& rows,
                                        std::int64_t first, std::unique_ptr<delassus::CoupledInverse>& inverse);
}
