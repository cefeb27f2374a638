// SPDX-License-Identifier: BSD-3-Clause
// H = LᵀL with a lower triangular L, from the last row to the first: the order in which the mass matrix of a tree fills
// nothing in, where parents come before children (Featherstone 2008, section 6.5). Entries that are zero are skipped.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

class ReverseCholesky {
public:
    /// H: n × n by rows, symmetric; only the lower triangle is read. False if it is not positive definite.
    bool factor(std::vector<double> H, std::size_t n) {
        n_ = n;
        L_ = std::move(H);
        start_.assign(1, 0);
        column_.clear();
        diagonal_.assign(n, 0.0);
        std::vector<std::vector<std::size_t>> left(n);
        for (std::size_t k = n; k-- > 0;) {
            double* row = &L_[k * n];
            if (!(row[k] > 0.0)) return false;
            diagonal_[k] = std::sqrt(row[k]);
            for (std::size_t j = 0; j < k; ++j)
                if (row[j] != 0.0) {
                    row[j] /= diagonal_[k];
                    left[k].push_back(j);
                }
            for (const std::size_t i : left[k])
                for (const std::size_t j : left[k]) {
                    if (j > i) break;
                    L_[i * n + j] -= row[i] * row[j];
                }
        }
        for (const auto& columns : left) {
            column_.insert(column_.end(), columns.begin(), columns.end());
            start_.push_back(column_.size());
        }
        return true;
    }

    /// y ← L⁻ᵀ y.
    void solve_transposed(double* y) const {
        for (std::size_t k = n_; k-- > 0;) {
            if (y[k] == 0.0) continue;
            y[k] /= diagonal_[k];
            for (std::size_t p = start_[k]; p < start_[k + 1]; ++p) y[column_[p]] -= L_[k * n_ + column_[p]] * y[k];
        }
    }
    /// z ← L⁻¹ z.
    void solve(double* z) const {
        for (std::size_t k = 0; k < n_; ++k) {
            for (std::size_t p = start_[k]; p < start_[k + 1]; ++p) z[k] -= L_[k * n_ + column_[p]] * z[column_[p]];
            z[k] /= diagonal_[k];
        }
    }
    /// √(vᵀ H v).
    [[nodiscard]] double norm(const double* v) const {
        double sum = 0.0;
        for (std::size_t k = 0; k < n_; ++k) {
            double entry = diagonal_[k] * v[k];
            for (std::size_t p = start_[k]; p < start_[k + 1]; ++p) entry += L_[k * n_ + column_[p]] * v[column_[p]];
            sum += entry * entry;
        }
        return std::sqrt(sum);
    }

private:
    std::size_t n_ = 0;
    std::vector<double> L_, diagonal_;         // L_ by rows, without its diagonal
    std::vector<std::size_t> start_, column_;  // of the entries left of the diagonal
};
