// SPDX-License-Identifier: BSD-3-Clause
#include "rank_update.hpp"

#include <algorithm>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__)
#define DELASSUS_AVX2 1
#include <immintrin.h>
#else
#define DELASSUS_AVX2 0
#endif

namespace delassus::ipm {

namespace {

using Eigen::Index;

#if DELASSUS_AVX2

constexpr Index width = 4;        // rows of a strip, one register
constexpr Index tile = 3;         // strips of a tile, which is 12 × 4: 12 accumulators of the 16 registers
constexpr Index depth = 256;      // columns of A at a time: a tile's strips are 24 KiB
constexpr Index worthwhile = 24;  // rows; below that packing costs more than it gains

// A tile of A Aᵀ costs 12 fused products of four for 3 loads and 4 broadcasts. A is packed in strips of four rows,
// padded with zeros, so that all of these are in sequence.
__attribute__((target("avx2,fma"))) void subtract_square_avx2(
    Eigen::MatrixXd& C, const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& A) {
    const Index rows = A.rows(), strips = (rows + width * tile - 1) / (width * tile) * tile;
    thread_local std::vector<double> packed;
    for (Index first = 0; first < A.cols(); first += depth) {
        const Index k = std::min(depth, A.cols() - first);
        packed.assign(static_cast<std::size_t>(strips * width * k), 0.0);
        for (Index c = 0; c < k; ++c)
            for (Index i = 0; i < rows; ++i)
                packed[static_cast<std::size_t>((i / width * k + c) * width + i % width)] = A(i, first + c);
        const auto strip = [&](Index s) { return packed.data() + s * width * k; };
        for (Index s = 0; s * width < rows; ++s) {
            for (Index t = s / tile * tile; t < strips; t += tile) {
                __m256d sum[tile][width];
                for (auto& one : sum)
                    for (auto& column : one) column = _mm256_setzero_pd();
                const double *right = strip(s), *left0 = strip(t), *left1 = strip(t + 1), *left2 = strip(t + 2);
                for (Index c = 0; c < k * width; c += width) {
                    const __m256d a0 = _mm256_loadu_pd(left0 + c), a1 = _mm256_loadu_pd(left1 + c),
                                  a2 = _mm256_loadu_pd(left2 + c);
                    for (Index j = 0; j < width; ++j) {
                        const __m256d b = _mm256_broadcast_sd(right + c + j);
                        sum[0][j] = _mm256_fmadd_pd(a0, b, sum[0][j]);
                        sum[1][j] = _mm256_fmadd_pd(a1, b, sum[1][j]);
                        sum[2][j] = _mm256_fmadd_pd(a2, b, sum[2][j]);
                    }
                }
                for (Index j = 0; j < std::min(width, rows - s * width); ++j) {
                    double* column = C.data() + (s * width + j) * C.rows();
                    for (Index l = 0; l < tile; ++l) {
                        alignas(32) double values[width];
                        _mm256_store_pd(values, sum[l][j]);
                        const Index start = (t + l) * width;
                        for (Index i = std::max(start, s * width + j); i < std::min(start + width, rows); ++i)
                            column[i] -= values[i - start];
                    }
                }
            }
        }
    }
}

#endif

}  // namespace

void subtract_square(Eigen::MatrixXd& C, const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& A) {
#if DELASSUS_AVX2
    static const bool possible = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (possible && A.rows() >= worthwhile) return subtract_square_avx2(C, A);
#endif
    C.selfadjointView<Eigen::Lower>().rankUpdate(A, -1.0);
}

}  // namespace delassus::ipm
