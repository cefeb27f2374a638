// SPDX-License-Identifier: BSD-3-Clause
#include "problem/structure.hpp"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "delassus/sdk/problem_view.hpp"
#include "problem/parallel_rows.hpp"
#include "problem/symmetry.hpp"

namespace delassus {

std::int32_t BlockPartition::largest() const {
    std::int32_t size = 0;
    for (std::size_t k = 0; k + 1 < start.size(); ++k) size = std::max(size, start[k + 1] - start[k]);
    return size;
}

BlockPartition connected_components(const SparseMatrix& matrix) {
    const auto n = static_cast<std::size_t>(matrix.rows);
    std::vector<std::int32_t> root(n);
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](std::int32_t i) {
        while (root[static_cast<std::size_t>(i)] != i) {
            auto& up = root[static_cast<std::size_t>(i)];
            up = root[static_cast<std::size_t>(up)];
            i = up;
        }
        return i;
    };
    for (std::int32_t i = 0; i < matrix.rows; ++i) {
        for (auto k = matrix.row_start[static_cast<std::size_t>(i)];
             k < matrix.row_start[static_cast<std::size_t>(i) + 1]; ++k) {
            const auto a = find(i);
            const auto b = find(matrix.column[static_cast<std::size_t>(k)]);
            root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
        }
    }
    std::vector<std::int32_t> size(n, 0), block(n, -1);
    for (std::int32_t i = 0; i < matrix.rows; ++i) ++size[static_cast<std::size_t>(find(i))];
    BlockPartition partition;
    partition.index.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        if (root[i] != static_cast<std::int32_t>(i)) continue;
        block[i] = static_cast<std::int32_t>(partition.start.size()) - 1;
        partition.start.push_back(partition.start.back() + size[i]);
    }
    std::vector<std::int32_t> next(partition.start.begin(), partition.start.end() - 1);
    for (std::int32_t i = 0; i < matrix.rows; ++i) {
        const auto k = static_cast<std::size_t>(block[static_cast<std::size_t>(find(i))]);
        partition.index[static_cast<std::size_t>(next[k]++)] = i;
    }
    return partition;
}

Structure structure_by_pattern(const SparseMatrix& H, const BlockPartition& blocks) {
    if (H.rows == 0) return Structure::Reduced;
    if (asymmetry_of(H).relative > symmetry_tolerance) return Structure::Unsymmetric;
    const auto largest = blocks.largest();
    if (largest == 1) return Structure::Diagonal;
    return largest <= largest_inertia_block ? Structure::Blocks : Structure::Definite;
}

namespace {

constexpr double semidefinite_shift = 1e-10;

sdk::SparseColumns with_shifted_diagonal(const SparseMatrix& H) {
    sdk::SparseColumns shifted = Eigen::Map<const sdk::SparseColumns>(
        H.rows, H.columns, H.entries(), H.row_start.data(), H.column.data(), H.value.data());
    double largest = 0.0;
    for (const double value : H.value) largest = std::max(largest, std::abs(value));
    sdk::SparseColumns shift(H.rows, H.rows);
    shift.setIdentity();
    for (std::int32_t i = 0; i < H.rows; ++i) {
        const double entry = std::abs(shifted.coeff(i, i));
        shift.coeffRef(i, i) = semidefinite_shift * (entry > 0.0 ? entry : std::max(largest, 1e-300));
    }
    return shifted + shift;
}

}  // namespace

Structure structure_of_singular(const SparseMatrix& H, const BlockPartition& blocks) {
    if (blocks.largest() <= 1) {
        const bool negative = std::any_of(H.value.begin(), H.value.end(), [](double value) { return value < 0.0; });
        return negative ? Structure::Indefinite : Structure::Semidefinite;
    }
    const Eigen::SimplicialLLT<sdk::SparseColumns> factor(with_shifted_diagonal(H));
    return factor.info() == Eigen::Success ? Structure::Semidefinite : Structure::Indefinite;
}

namespace {

bool is_rigid(const SparseMatrix& E, std::int32_t row) {
    return E.rows == 0 || E.row_start[row] == E.row_start[row + 1];
}

}  // namespace

bool RedundancyCheck::operator()(const SparseMatrix& D, const SparseMatrix& E, bool new_places) {
    if (new_places) certain_by_places_ = by_places(D, E);
    return certain_by_places_ || by_values(D, E);
}

bool RedundancyCheck::by_places(const SparseMatrix& D, const SparseMatrix& E) {
    if (E.entries() == 0 && D.rows > D.columns) return true;
    touched_.assign(static_cast<std::size_t>(D.columns), 0);
    std::int64_t rigid_rows = 0;
    for (std::int32_t row = 0; row < D.rows; ++row) {
        if (!is_rigid(E, row)) continue;
        ++rigid_rows;
        if (D.row_start[row] == D.row_start[row + 1]) return true;
        for (auto k = D.row_start[row]; k < D.row_start[row + 1]; ++k)
            touched_[static_cast<std::size_t>(D.column[k])] = 1;
    }
    return rigid_rows > std::count(touched_.begin(), touched_.end(), 1);
}

bool RedundancyCheck::by_values(const SparseMatrix& D, const SparseMatrix& E) {
    return has_parallel_rows(
        D, [&](std::int32_t row) { return is_rigid(E, row); }, directions_);
}

void Hash::add(const void* data, std::size_t bytes) {
    // Multiply-rotate mixing, eight bytes at a time: identities, not security.
    constexpr std::uint64_t factor = 0xff51afd7ed558ccdu;
    const auto* text = static_cast<const unsigned char*>(data);
    const auto mix = [&](std::uint64_t word) { state_ = std::rotl((state_ ^ word) * factor, 29) + 0x52dce729u; };
    for (; bytes >= 8; bytes -= 8, text += 8) {
        std::uint64_t word;
        std::memcpy(&word, text, 8);
        mix(word);
    }
    std::uint64_t rest = 0;
    if (bytes > 0) std::memcpy(&rest, text, bytes);
    mix(rest ^ (static_cast<std::uint64_t>(bytes) << 56));
}

}  // namespace delassus
