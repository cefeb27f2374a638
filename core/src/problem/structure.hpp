// SPDX-License-Identifier: BSD-3-Clause
// Finding out what H is, and which rows are redundant for certain.
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/needs.hpp"

namespace delassus {

/// Largest diagonal block for which H counts as block-diagonal: two coupled rigid bodies with room to spare.
inline constexpr std::int32_t largest_inertia_block = 16;

/// The connected components of a symmetric pattern: the rows of block k are index[start[k] … start[k + 1]), ascending;
/// blocks are ordered by their first row.
struct BlockPartition {
    std::vector<std::int32_t> start = {0};
    std::vector<std::int32_t> index;

    [[nodiscard]] std::int32_t largest() const;
};

[[nodiscard]] BlockPartition connected_components(const SparseMatrix& matrix);

/// The structure of H as far as its pattern and symmetry show it: Reduced, Unsymmetric, or a candidate (Diagonal,
/// Blocks or Definite) that still has to be checked for definiteness.
[[nodiscard]] Structure structure_by_pattern(const SparseMatrix& H, const BlockPartition& blocks);

/// Semidefinite or Indefinite, for a symmetric matrix that is not definite: whether H + 1e-10 diag(|H|) is.
[[nodiscard]] Structure structure_of_singular(const SparseMatrix& H, const BlockPartition& blocks);

/// A row, and a hash that parallel rows share as a rule.
struct RowDirection {
    std::uint64_t hash;
    std::int32_t row;
};

/// Whether rows of D without compliance are certain to depend on one another: more of them than columns that they
/// touch, one of them empty, or two of them parallel. A cheap certificate, not a rank: false means "not known". Keeps
/// its scratch arrays from call to call.
class RedundancyCheck {
public:
    /// new_places: whether the entries of D and E stand elsewhere than in the last call; what the places alone tell is
    /// kept.
    [[nodiscard]] bool operator()(const SparseMatrix& D, const SparseMatrix& E, bool new_places);

private:
    [[nodiscard]] bool by_places(const SparseMatrix& D, const SparseMatrix& E);
    [[nodiscard]] bool by_values(const SparseMatrix& D, const SparseMatrix& E);

    bool certain_by_places_ = false;
    std::vector<char> touched_;
    std::vector<RowDirection> directions_;
};

/// Hash of numbers, for the identities of patterns and values, and of content.
class DELASSUS_API Hash {
public:
    void add(const void* data, std::size_t bytes);
    /// A std::vector or an Array of numbers.
    template <class Numbers>
    void add(const Numbers& numbers) {
        add_size(numbers.size());
        add(numbers.data(), numbers.size() * sizeof(typename Numbers::value_type));
    }
    void add_size(std::uint64_t value) { add(&value, sizeof value); }
    [[nodiscard]] std::uint64_t value() const { return state_; }

private:
    std::uint64_t state_ = 0x9e3779b97f4a7c15u;
};

}  // namespace delassus
