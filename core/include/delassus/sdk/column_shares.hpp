// SPDX-License-Identifier: BSD-3-Clause
// Products with the transpose of BlockRows by several threads, with the bits of one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "delassus/sdk/block_rows.hpp"

namespace delassus::sdk {

/// Each member owns a range of the columns, cut where no chunk is, and adds to them what all groups contribute, in the
/// order of the groups: the order in which one thread adds to a column.
class ColumnShares {
public:
    ColumnShares() = default;

    /// columns: of the vectors, padding included. The shares hold about the same number of chunks, as far as the
    /// chunks leave places to cut; a member may be left without a share.
    ColumnShares(const BlockRows& rows, Eigen::Index columns, int members);

    [[nodiscard]] int members() const { return static_cast<int>(shares_.size()); }

    /// The member's columns of result ← matrixᵀ · v. v: rows; result: columns, padded.
    void transpose_multiply(const BlockRows& rows, const double* v, double* result, int member) const;

private:
    struct Share {
        std::size_t first = 0, last = 0;  // columns
        std::vector<std::int32_t> group;  // twice the number of each group that has chunks here; odd: elsewhere too

        [[nodiscard]] bool owns(std::int32_t start) const {
            return static_cast<std::size_t>(start) >= first && static_cast<std::size_t>(start) < last;
        }
    };

    static void collect(const BlockRows& rows, Share& share);

    std::vector<Share> shares_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/column_shares_bodies.hpp"
#endif
