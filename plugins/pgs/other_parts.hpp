// SPDX-License-Identifier: BSD-3-Clause
// What the sweeps ask of the other processes where each holds a part of one problem (plugins/pgs_petsc).
#pragma once

#include <span>

namespace delassus::pgs {

/// The parts that others hold. This class is the case of none. All operations are collective.
class OtherParts {
public:
    OtherParts() = default;
    OtherParts(const OtherParts&) = delete;
    OtherParts& operator=(const OtherParts&) = delete;
    virtual ~OtherParts() = default;

    [[nodiscard]] virtual bool exist() const { return false; }
    /// values ← their sums over all parts, the same bits in each.
    virtual void sum([[maybe_unused]] std::span<double> values) const {}
    /// Entries of v̂ that several parts have ← those that belong to the reactions of all of them together.
    virtual void reconcile([[maybe_unused]] std::span<double> state) const {}
};

}  // namespace delassus::pgs
