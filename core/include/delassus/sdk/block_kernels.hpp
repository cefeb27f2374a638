// SPDX-License-Identifier: BSD-3-Clause
// The products of a few rows that share their columns, with those columns covered by chunks of equal width: inner loops
// have a fixed length and need no index per entry (a rigid body's six velocities are one chunk).
//
// Coefficients stand chunk by chunk, within a chunk row by row; of chunks of six, two by two, so that the twelve
// coefficients of a row are three Quads. A vector over the columns has `chunk_padding` entries beyond its last, which a
// chunk may reach with zero coefficients.
#pragma once

#include <cstddef>
#include <cstdint>

#include "delassus/sdk/simd.hpp"

namespace delassus::sdk {

inline constexpr int chunk_padding = 6;

/// Where chunk k of a row starts among the coefficients of a group.
constexpr std::size_t place_of_chunk(int width, int rows, int chunks, int k, int row) {
    const int first = width == 6 && (k | 1) < chunks ? (k - k % 2) * rows + 2 * row + k % 2 : k * rows + row;
    return static_cast<std::size_t>(first) * static_cast<std::size_t>(width);
}

/// u ← A v + offset; Rows values, offset may be u itself. start: first column of each chunk.
template <int Rows, int Width>
inline void multiply_group(const double* value, const std::int32_t* start, int chunks, const double* v,
                           const double* offset, double* u) {
    Quad total[Rows] = {};
    Quad a = {}, b = {};
    int k = 0;
    if constexpr (Width == 6) {
        if (chunks == 2) {  // two bodies: what most contacts are
            const double *first = v + start[0], *second = v + start[1];
            Quad middle = {}, last = {}, c = {}, d = {};
            load(first, b);
            load(first + 4, second, middle);
            load(second + 2, last);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * 12, a);
                load(value + i * 12 + 4, c);
                load(value + i * 12 + 8, d);
                u[i] = sum(a * b + c * middle + d * last) + offset[i];
            }
            return;
        }
        for (; k + 1 < chunks; k += 2, value += Rows * 12) {
            const double *first = v + start[k], *second = v + start[k + 1];
            Quad middle = {}, last = {};
            load(first, b);
            load(first + 4, second, middle);
            load(second + 2, last);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * 12, a);
                total[i] += a * b;
                load(value + i * 12 + 4, a);
                total[i] += a * middle;
                load(value + i * 12 + 8, a);
                total[i] += a * last;
            }
        }
    }
    Pair rest[Rows] = {};
    for (; k < chunks; ++k, value += Rows * Width) {
        const double* vk = v + start[k];
        if constexpr (Width >= 4) {
            load(vk, b);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * Width, a);
                total[i] += a * b;
            }
        }
        if constexpr (Width != 4) {
            constexpr int last = Width - 2;
            Pair c = {}, d = {};
            load(vk + last, d);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * Width + last, c);
                rest[i] += c * d;
            }
        }
    }
#pragma GCC unroll 6
    for (int i = 0; i < Rows; ++i) {
        u[i] = sum(total[i], rest[i]) + offset[i];
    }
}

/// v += Aᵀ δ; δ has Rows values.
template <int Rows, int Width>
inline void transpose_multiply_group(const double* value, const std::int32_t* start, int chunks, const double* delta,
                                     double* v) {
    Quad a = {}, b = {};
    int k = 0;
    if constexpr (Width == 6) {
        for (; k + 1 < chunks; k += 2, value += Rows * 12) {
            double *first = v + start[k], *second = v + start[k + 1];
            Quad middle = {}, last = {};
            load(first, b);
            load(first + 4, second, middle);
            load(second + 2, last);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * 12, a);
                b += a * delta[i];
                load(value + i * 12 + 4, a);
                middle += a * delta[i];
                load(value + i * 12 + 8, a);
                last += a * delta[i];
            }
            store(first, b);
            store(first + 4, second, middle);
            store(second + 2, last);
        }
    }
    for (; k < chunks; ++k, value += Rows * Width) {
        double* vk = v + start[k];
        if constexpr (Width >= 4) {
            load(vk, b);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * Width, a);
                b += a * delta[i];
            }
            store(vk, b);
        }
        if constexpr (Width != 4) {
            constexpr int last = Width - 2;
            Pair c = {}, e = {};
            load(vk + last, c);
#pragma GCC unroll 6
            for (int i = 0; i < Rows; ++i) {
                load(value + i * Width + last, e);
                c += e * delta[i];
            }
            store(vk + last, c);
        }
    }
}

/// As transpose_multiply_group, for chunk k alone; the same bits there.
template <int Rows, int Width>
inline void transpose_multiply_chunk(const double* value, std::int32_t start, int chunks, int k, const double* delta,
                                     double* v) {
    for (int i = 0; i < Rows; ++i) {
        const double* row = value + place_of_chunk(Width, Rows, chunks, k, i);
        for (int j = 0; j < Width; ++j) v[start + j] += row[j] * delta[i];
    }
}

/// Calls `body.template operator()<Rows>()` for a group's number of rows, 1 to 6: largest_block_rows.
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

/// Calls `body.template operator()<Width>()`, compiled for the best instructions of this machine.
template <class Body>
inline void with_width(int width, Body&& body) {
    switch (width) {
        case 2:
            return with_best_instructions([&] { body.template operator()<2>(); });
        case 4:
            return with_best_instructions([&] { body.template operator()<4>(); });
        default:
            return with_best_instructions([&] { body.template operator()<6>(); });
    }
}

}  // namespace delassus::sdk
