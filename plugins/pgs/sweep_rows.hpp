// SPDX-License-Identifier: BSD-3-Clause
// The rows that a sweep reads, block by block, contiguous and in the order of the sweep.
//
// A sweep needs u_c = A_c z + offset_c for a few rows at a time, where either
//   velocities: z = v̂, A = D̂ and a change of λ_c is followed by z += A_cᵀ Δλ_c;
//   operator:   z = λ, A = N and a change of λ_c is written to z.
// The columns that a block touches are covered by chunks of equal width, so that inner loops have a fixed length and
// need no index per entry: a rigid body's six velocities are one chunk.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::pgs {

/// Two doubles, one vector register of every x86-64 and AArch64 machine.
using Pair = double __attribute__((vector_size(16)));

inline Pair load(const double* from) {
    Pair result;
    std::memcpy(&result, from, sizeof result);
    return result;
}
inline void store(double* to, Pair pair) {
    std::memcpy(to, &pair, sizeof pair);
}

/// Rows of a matrix that are read together.
struct Block {
    std::int32_t first_row = 0;
    std::int32_t rows = 0;
    std::int32_t chunks = 0;
    std::int32_t cone = 0;     ///< index of the problem's cone that the rows belong to
    std::ptrdiff_t value = 0;  ///< first coefficient: chunk by chunk, within it row by row
    std::ptrdiff_t chunk = 0;  ///< first entry in chunk_start
};

/// Largest number of rows of a block.
inline constexpr int largest_block = 6;
/// What z must have beyond its last entry: a chunk may reach past it with zero coefficients.
inline constexpr int padding = 6;

class SweepRows {
public:
    /// matrix: its rows are covered by blocks (first_row, rows and cone set, rows ≤ largest_block); the rest is filled.
    void build(const sdk::SparseRows& matrix, std::vector<Block> blocks) {
        blocks_ = std::move(blocks);
        width_ = cheapest_width(matrix);
        value_.clear();
        chunk_start_.clear();
        for (Block& block : blocks_) {
            block.value = static_cast<std::ptrdiff_t>(value_.size());
            block.chunk = static_cast<std::ptrdiff_t>(chunk_start_.size());
            cover(matrix, block, width_);
            block.chunks = static_cast<std::int32_t>(start_.size());
            chunk_start_.insert(chunk_start_.end(), start_.begin(), start_.end());
            value_.resize(value_.size() + start_.size() * static_cast<std::size_t>(block.rows * width_), 0.0);
            for (int i = 0; i < block.rows; ++i) {
                std::size_t k = 0;
                for (sdk::SparseRows::InnerIterator entry(matrix, block.first_row + i); entry; ++entry) {
                    while (entry.col() >= start_[k] + width_) ++k;
                    value_[static_cast<std::size_t>(block.value) +
                           (k * static_cast<std::size_t>(block.rows) + static_cast<std::size_t>(i)) *
                               static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(entry.col() - start_[k])] = entry.value();
                }
            }
        }
    }

    [[nodiscard]] std::span<const Block> blocks() const { return blocks_; }
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] const double* values(const Block& block) const { return value_.data() + block.value; }
    [[nodiscard]] const std::int32_t* chunk_starts(const Block& block) const {
        return chunk_start_.data() + block.chunk;
    }

    /// Visits the coefficients of a block: visit(row within the block, column, coefficient), zeros of the cover too.
    template <class Visitor>
    void for_each(const Block& block, Visitor&& visit) const {
        const double* value = values(block);
        for (int k = 0; k < block.chunks; ++k)
            for (int i = 0; i < block.rows; ++i)
                for (int j = 0; j < width_; ++j) visit(i, chunk_starts(block)[k] + j, *value++);
    }

private:
    // Chunks of this width from the first column that is not yet covered, left to right, into start_.
    void cover(const sdk::SparseRows& matrix, const Block& block, int width) {
        column_.clear();
        for (int i = 0; i < block.rows; ++i)
            for (sdk::SparseRows::InnerIterator entry(matrix, block.first_row + i); entry; ++entry)
                column_.push_back(static_cast<std::int32_t>(entry.col()));
        std::sort(column_.begin(), column_.end());
        start_.clear();
        for (const std::int32_t column : column_)
            if (start_.empty() || column >= start_.back() + width) start_.push_back(column);
    }

    // A chunk costs about as much as two coefficients more than it holds.
    int cheapest_width(const sdk::SparseRows& matrix) {
        int best = 2;
        double least = -1.0;
        for (const int width : {2, 4, 6}) {
            double cost = 0.0;
            for (const Block& block : blocks_) {
                cover(matrix, block, width);
                cost += static_cast<double>(start_.size()) * (width + 2);
            }
            if (least < 0.0 || cost < least) {
                least = cost;
                best = width;
            }
        }
        return best;
    }

    std::vector<Block> blocks_;
    int width_ = 2;
    std::vector<double> value_;
    std::vector<std::int32_t> chunk_start_;
    std::vector<std::int32_t> column_, start_;  // work space of cover()
};

/// u ← A_c z + offset; Rows values. Costs Rows · Width · chunks products.
template <int Rows, int Width>
inline void velocity_of_block(const double* value, const std::int32_t* start, int chunks, const double* z,
                              const double* offset, double* u) {
    Pair sum[Rows] = {};
    for (int k = 0; k < chunks; ++k) {
        const double* zk = z + start[k];
        for (int j = 0; j < Width; j += 2) {
            const Pair pair = load(zk + j);
            for (int i = 0; i < Rows; ++i) sum[i] += load(value + i * Width + j) * pair;
        }
        value += Rows * Width;
    }
    for (int i = 0; i < Rows; ++i) u[i] = sum[i][0] + sum[i][1] + offset[i];
}

/// z += A_cᵀ δ; δ has Rows values.
template <int Rows, int Width>
inline void add_impulse_of_block(const double* value, const std::int32_t* start, int chunks, const double* delta,
                                 double* z) {
    Pair d[Rows];
    for (int i = 0; i < Rows; ++i) d[i] = Pair{delta[i], delta[i]};
    for (int k = 0; k < chunks; ++k) {
        double* zk = z + start[k];
        for (int j = 0; j < Width; j += 2) {
            Pair pair = load(zk + j);
            for (int i = 0; i < Rows; ++i) pair += load(value + i * Width + j) * d[i];
            store(zk + j, pair);
        }
        value += Rows * Width;
    }
}

/// Calls body.template operator()<Rows>() for the block's number of rows, 1 to largest_block.
template <class Body>
inline void with_rows(int rows, Body&& body) {
    switch (rows) {
        case 1:
            return body.template operator()<1>();
        case 2:
            return body.template operator()<2>();
        case 3:
            return body.template operator()<3>();
        case 4:
            return body.template operator()<4>();
        case 5:
            return body.template operator()<5>();
        case 6:
            return body.template operator()<6>();
        default:
            return;
    }
}

}  // namespace delassus::pgs
