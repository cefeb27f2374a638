// SPDX-License-Identifier: BSD-3-Clause
// The impulses of unilateral blocks, from one step to the next (internal).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/export.hpp"

namespace delassus {

/// What acted in each unilateral block of the last step, found again by the block's key: the start of the next solve.
/// The impulse of a contact is a vector in space, as the tangents of its rows may turn; where they have not, it is the
/// same to the last digit. An impulsive block got part of its impulse from impacts or corrections of gaps: over the
/// size of the step it is no force.
class DELASSUS_API KeptImpulses {
public:
    void clear();

    /// Begins a walk over the blocks of a step; blocks usually come by ascending keys, so that each search begins where
    /// the one before ended.
    void begin_walk() { next_ = 0; }
    struct Start {
        bool pushed = false;  ///< the first row of the block had a positive impulse
        bool impulsive = false;
    };
    /// lambda ← the block's impulse of the last step, in the block's rows; 0 where there was none. contact: the block's
    /// contact, or null.
    Start start(const UnilateralRows::Block& block, const ContactPoint* contact, std::span<double> lambda);

    /// Keeps the impulses of these blocks. contacts: of the last blocks; lambda: of the blocks' rows; impulsive:
    /// whether each is, or empty: none.
    void keep(std::span<const UnilateralRows::Block> blocks, std::span<const ContactPoint> contacts,
              std::span<const double> lambda, std::span<const char> impulsive = {});

    /// For checkpoints: of each block its key in two halves, which a double holds exactly, 1 if it is impulsive, its
    /// normal, its number of rows and its impulses.
    void append_to(std::vector<double>& memory) const;
    /// Forgets the blocks without an impulse: a start without one is the same as one that is not found.
    void drop_zeros();
    /// Takes what append_to() gave. Throws InputError if it ends within a block.
    void load(std::span<const double> memory);

private:
    struct Entry {
        std::uint64_t key;
        std::int32_t first, rows;  ///< in impulses_
        bool impulsive;
        Vector3 normal;  ///< of a contact with three rows; else 0
    };
    void sort();

    std::vector<Entry> entries_;  // by ascending keys
    std::vector<double> impulses_;
    std::size_t next_ = 0;
};

}  // namespace delassus
