// SPDX-License-Identifier: BSD-3-Clause
// Entries of a vector that other processes own.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/partitioned.hpp"

namespace delassus {

/// For a vector of which each process owns a contiguous range: the entries of others that this process needs, its
/// ghosts, and who needs which of its own. Local vectors hold the own entries, then the ghosts by ascending number.
class DELASSUS_API Halo {
public:
    Halo() = default;
    /// start: of the ranges, processes + 1. wanted: numbers through all processes, in any order, repeated or not; own
    /// ones are left out. Collective.
    Halo(const Communicator& communicator, const std::vector<std::int64_t>& start, std::vector<std::int64_t> wanted);

    [[nodiscard]] std::int64_t own() const { return own_; }
    [[nodiscard]] std::int64_t ghosts() const { return static_cast<std::int64_t>(ghost_.size()); }
    /// Own entries and ghosts.
    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(own_) + ghost_.size(); }
    [[nodiscard]] bool is_own(std::int64_t number) const { return number >= first_ && number < first_ + own_; }
    /// Where a number, own or wanted, stands in a local vector.
    [[nodiscard]] std::size_t place(std::int64_t number) const {
        return is_own(number) ? static_cast<std::size_t>(number - first_) : place_of_ghost(number);
    }
    /// The process that owns a number.
    [[nodiscard]] std::size_t owner(std::int64_t number) const;

    /// Fills the ghosts of a local vector, whose own entries are in place. Collective.
    void fetch(const Communicator& communicator, std::vector<double>& local) const;
    /// Adds the ghosts of local vectors to their owners' entries, in the order of the processes. Collective.
    void add(const Communicator& communicator, std::vector<double>& local) const;

private:
    [[nodiscard]] std::size_t place_of_ghost(std::int64_t number) const;

    std::int64_t first_ = 0, own_ = 0;
    std::vector<std::int64_t> start_;
    std::vector<std::int64_t> ghost_;                   // numbers, ascending: hence by owner
    std::vector<std::size_t> ghost_start_;              // of each owner's among them, processes + 1
    std::vector<std::vector<std::int64_t>> needed_by_;  // own places, by process
};

/// The columns of these matrices that other processes own, ascending, without repetition. start: of the ranges of all
/// processes, processes + 1. Takes memory for them alone. Not collective.
[[nodiscard]] std::vector<std::int64_t> foreign_numbers(const Communicator& communicator,
                                                        const std::vector<std::int64_t>& start,
                                                        std::initializer_list<const LocalMatrix*> matrices);

}  // namespace delassus
