// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/column_shares.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>

#include "delassus/sdk/column_shares.hpp"
#include "delassus/sdk/compiled_once.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION ColumnShares::ColumnShares(const BlockRows& rows, Eigen::Index columns, int members) {
    const auto count = static_cast<std::size_t>(columns);
    // open[c]: chunks that reach from before column c to c or beyond; begun[c]: chunks that start before c.
    std::vector<std::int64_t> open(count + 1, 0), begun(count + 1, 0);
    for (const BlockRows::Group& group : rows.groups())
        for (int k = 0; k < group.chunks; ++k) {
            const auto start = static_cast<std::size_t>(rows.starts(group)[k]);
            ++open[start + 1];
            --open[start + static_cast<std::size_t>(rows.width())];
            ++begun[start + 1];
        }
    for (std::size_t c = 1; c <= count; ++c) {
        open[c] += open[c - 1];
        begun[c] += begun[c - 1];
    }
    shares_.resize(static_cast<std::size_t>(members));
    std::size_t column = 0;
    for (int member = 0; member < members; ++member) {
        Share& share = shares_[static_cast<std::size_t>(member)];
        share.first = column;
        const std::int64_t goal = begun[count] * (member + 1) / members;
        while (column < count && (member + 1 == members || begun[column] < goal || open[column] != 0)) ++column;
        share.last = column;
        collect(rows, share);
    }
}

DELASSUS_SDK_FUNCTION void ColumnShares::transpose_multiply(const BlockRows& rows, const double* v, double* result,
                                                            int member) const {
    const Share& share = shares_[static_cast<std::size_t>(member)];
    std::fill(result + share.first, result + share.last, 0.0);
    with_width(rows.width(), [&]<int Width>() {
        for (const std::int32_t entry : share.group) {
            const BlockRows::Group& group = rows.groups()[static_cast<std::size_t>(entry >> 1)];
            with_rows(group.rows, [&]<int Rows>() {
                const double* delta = v + group.first;
                bool zero = true;  // open contacts are many
                for (int i = 0; i < Rows; ++i) zero = zero && delta[i] == 0.0;
                if (zero) return;
                const std::int32_t* start = rows.starts(group);
                if ((entry & 1) == 0) {
                    transpose_multiply_group<Rows, Width>(rows.values(group), start, group.chunks, delta, result);
                    return;
                }
                for (int k = 0; k < group.chunks; ++k)
                    if (share.owns(start[k]))
                        transpose_multiply_chunk<Rows, Width>(rows.values(group), start[k], group.chunks, k, delta,
                                                              result);
            });
        }
    });
}

DELASSUS_SDK_FUNCTION void ColumnShares::collect(const BlockRows& rows, Share& share) {
    for (std::size_t k = 0; k < rows.groups().size(); ++k) {
        const BlockRows::Group& group = rows.groups()[k];
        int here = 0;
        for (int c = 0; c < group.chunks; ++c) here += share.owns(rows.starts(group)[c]) ? 1 : 0;
        if (here > 0) share.group.push_back(static_cast<std::int32_t>(2 * k) + (here < group.chunks ? 1 : 0));
    }
}

}  // namespace delassus::sdk
