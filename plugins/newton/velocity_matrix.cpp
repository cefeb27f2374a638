// SPDX-License-Identifier: BSD-3-Clause
#include "velocity_matrix.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "delassus/sdk/simd.hpp"

namespace delassus::newton {

namespace {

/// The envelope is taken up to so many multiplications: about what the analysis for fronts takes.
constexpr double most_work = 2e5;

}  // namespace

void VelocityMatrix::analyze(const sdk::ProblemView& problem, const std::vector<Piece>& pieces) {
    n_ = static_cast<std::int32_t>(problem.n);
    ++analyses_;
    cliques_.clear();
    index_.clear();
    const auto* start = problem.D.outerIndexPtr();
    const auto* column = problem.D.innerIndexPtr();
    std::size_t values = 0;
    for (const Piece& piece : pieces) {
        Clique clique{piece.first, piece.rows, 0, index_.size(), values};
        for (auto e = start[piece.first + piece.rows]; e > start[piece.first]; --e)
            index_.push_back(n_ - 1 - column[e - 1]);
        const auto begin = index_.begin() + static_cast<std::ptrdiff_t>(clique.index);
        if (piece.rows > 1) {
            std::sort(begin, index_.end());
            index_.erase(std::unique(begin, index_.end()), index_.end());
        }
        clique.columns = static_cast<std::int32_t>(index_.size() - clique.index);
        values += static_cast<std::size_t>(clique.columns) * static_cast<std::size_t>(clique.rows);
        cliques_.push_back(clique);
    }
    value_.resize(values);
    image_.resize(values);
    filled_.resize(static_cast<std::size_t>(n_));

    std::vector<std::int32_t> first(static_cast<std::size_t>(n_));
    const auto* h_start = problem.H.outerIndexPtr();
    for (std::int32_t i = 0; i < n_; ++i) {
        const auto row = n_ - 1 - i;  // its last column comes first in reverse order
        first[static_cast<std::size_t>(i)] =
            h_start[row + 1] > h_start[row] ? std::min(i, n_ - 1 - problem.H.innerIndexPtr()[h_start[row + 1] - 1]) : i;
    }
    for (const Clique& clique : cliques_)
        for (std::int32_t k = 1; k < clique.columns; ++k) {
            auto& least = first[static_cast<std::size_t>(index_[clique.index + static_cast<std::size_t>(k)])];
            least = std::min(least, index_[clique.index]);
        }
    by_envelope_ = EnvelopeFactor::work(first) <= most_work;
    if (by_envelope_) {
        envelope_.analyze(std::move(first));
    } else {
        analyze_sparse(problem);
    }
}

void VelocityMatrix::analyze_sparse(const sdk::ProblemView& problem) {
    const auto n = static_cast<std::size_t>(n_);
    start_of_column_.assign(n + 1, 0);
    for (const std::int32_t j : index_) ++start_of_column_[static_cast<std::size_t>(j) + 1];
    std::partial_sum(start_of_column_.begin(), start_of_column_.end(), start_of_column_.begin());
    clique_of_column_.resize(index_.size());
    place_of_column_.resize(index_.size());
    std::vector<std::size_t> next(start_of_column_.begin(), start_of_column_.end() - 1);
    for (std::size_t c = 0; c < cliques_.size(); ++c)
        for (std::int32_t k = 0; k < cliques_[c].columns; ++k) {
            const auto j = static_cast<std::size_t>(index_[cliques_[c].index + static_cast<std::size_t>(k)]);
            clique_of_column_[next[j]] = c;
            place_of_column_[next[j]++] = static_cast<std::size_t>(k);
        }
    std::vector<std::int32_t> start = {0}, rows, seen(n, -1);
    for (std::int32_t j = 0; j < n_; ++j) {
        const auto put = [&](std::int32_t i) {
            if (i < j || std::exchange(seen[static_cast<std::size_t>(i)], j) == j) return;
            rows.push_back(i);
        };
        put(j);
        for (sdk::SparseRowsView::InnerIterator entry(problem.H, n_ - 1 - j); entry; ++entry)
            put(n_ - 1 - static_cast<std::int32_t>(entry.col()));
        for (auto e = start_of_column_[static_cast<std::size_t>(j)];
             e < start_of_column_[static_cast<std::size_t>(j) + 1]; ++e) {
            const Clique& clique = cliques_[clique_of_column_[e]];
            for (auto k = place_of_column_[e]; k < static_cast<std::size_t>(clique.columns); ++k)
                put(index_[clique.index + k]);
        }
        std::sort(rows.begin() + start.back(), rows.end());
        start.push_back(static_cast<std::int32_t>(rows.size()));
    }
    matrix_.resize(n_, n_);
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(rows.size()));
    std::copy(start.begin(), start.end(), matrix_.outerIndexPtr());
    std::copy(rows.begin(), rows.end(), matrix_.innerIndexPtr());
    work_.assign(n, 0.0);
    factor_.analyze(matrix_, n_);
}

void VelocityMatrix::load(const sdk::ProblemView& problem) {
    const auto* start = problem.D.outerIndexPtr();
    const auto* column = problem.D.innerIndexPtr();
    const auto* value = problem.D.valuePtr();
    for (const Clique& clique : cliques_) {
        double* rows = value_.data() + clique.value;
        if (clique.rows == 1) {
            for (auto e = start[clique.first + 1]; e > start[clique.first]; --e) *rows++ = value[e - 1];
            continue;
        }
        for (std::int32_t k = 0; k < clique.columns; ++k)
            filled_[static_cast<std::size_t>(index_[clique.index + static_cast<std::size_t>(k)])] = k;
        std::fill_n(rows, clique.rows * clique.columns, 0.0);
        for (std::int32_t i = 0; i < clique.rows; ++i, rows += clique.columns)
            for (auto e = start[clique.first + i]; e < start[clique.first + i + 1]; ++e)
                rows[filled_[static_cast<std::size_t>(n_ - 1 - column[e])]] = value[e];
    }
}

bool VelocityMatrix::factorize(const sdk::ProblemView& problem, const Linearisation& at) {
    make_images(at);
    if (by_envelope_) {
        assemble_envelope(problem, at);
        return envelope_.factorize();
    }
    assemble_sparse(problem, at);
    return factor_.factorize(matrix_);
}

namespace {

bool is_active(Piece::State state) {
    return state == Piece::State::Inside || state == Piece::State::Sliding;
}

}  // namespace

void VelocityMatrix::make_images(const Linearisation& at) {
    for (std::size_t c = 0; c < cliques_.size(); ++c) {
        if (!is_active(at.state[c])) continue;
        const Clique& clique = cliques_[c];
        const auto& W = at.W[c];
        const double* D = value_.data() + clique.value;
        double* image = image_.data() + clique.value;
        const std::int32_t columns = clique.columns;
        for (std::int32_t i = 0; i < clique.rows; ++i, image += columns) {
            const double* w = W.data() + 3 * i;
            for (std::int32_t k = 0; k < columns; ++k) image[k] = w[0] * D[k];
            for (std::int32_t l = 1; l < clique.rows; ++l)
                for (std::int32_t k = 0; k < columns; ++k) image[k] += w[l] * D[l * columns + k];
        }
    }
}

void VelocityMatrix::assemble_envelope(const sdk::ProblemView& problem, const Linearisation& at) {
    std::fill(envelope_.values().begin(), envelope_.values().end(), 0.0);
    const auto* start = problem.H.outerIndexPtr();
    const auto* column = problem.H.innerIndexPtr();
    const auto* value = problem.H.valuePtr();
    for (std::int32_t i = 0; i < n_; ++i) {
        const auto row = n_ - 1 - i;
        double* own = envelope_.row(i);
        for (auto e = start[row + 1]; e > start[row] && column[e - 1] >= row; --e)
            own[n_ - 1 - column[e - 1]] = value[e - 1];
    }
    sdk::with_best_instructions([&] {
        for (std::size_t c = 0; c < cliques_.size(); ++c) {
            if (!is_active(at.state[c])) continue;
            const Clique& clique = cliques_[c];
            const std::int32_t* index = index_.data() + clique.index;
            const std::int32_t columns = clique.columns;
            // Columns mostly follow one another: in runs the loop has no indices.
            for (std::int32_t begin = 0; begin < columns;) {
                std::int32_t end = begin + 1;
                while (end < columns && index[end] == index[end - 1] + 1) ++end;
                for (std::int32_t k = begin; k < columns; ++k) {
                    double* own = envelope_.row(index[k]) + index[begin];
                    const std::int32_t count = std::min(end, k + 1) - begin;
                    const double* D = value_.data() + clique.value + k;
                    const double* image = image_.data() + clique.value + begin;
                    for (std::int32_t i = 0; i < clique.rows; ++i, D += columns, image += columns) {
                        const double d = *D;
                        if (d == 0.0) continue;
                        for (std::int32_t l = 0; l < count; ++l) own[l] += d * image[l];
                    }
                }
                begin = end;
            }
        }
    });
}

void VelocityMatrix::assemble_sparse(const sdk::ProblemView& problem, const Linearisation& at) {
    double* value = matrix_.valuePtr();
    for (std::int32_t j = 0; j < n_; ++j) {
        for (sdk::SparseRowsView::InnerIterator entry(problem.H, n_ - 1 - j); entry; ++entry)
            work_[static_cast<std::size_t>(n_ - 1 - entry.col())] = entry.value();
        for (auto e = start_of_column_[static_cast<std::size_t>(j)];
             e < start_of_column_[static_cast<std::size_t>(j) + 1]; ++e) {
            const std::size_t c = clique_of_column_[e];
            if (!is_active(at.state[c])) continue;
            const Clique& clique = cliques_[c];
            const auto place = static_cast<std::int32_t>(place_of_column_[e]);
            const double* D = value_.data() + clique.value;
            const double* image = image_.data() + clique.value;
            for (std::int32_t i = 0; i < clique.rows; ++i, D += clique.columns, image += clique.columns) {
                const double d = image[place];
                if (d == 0.0) continue;
                for (std::int32_t k = place; k < clique.columns; ++k)
                    work_[static_cast<std::size_t>(index_[clique.index + static_cast<std::size_t>(k)])] += d * D[k];
            }
        }
        for (auto e = matrix_.outerIndexPtr()[j]; e < matrix_.outerIndexPtr()[j + 1]; ++e)
            *value++ = std::exchange(work_[static_cast<std::size_t>(matrix_.innerIndexPtr()[e])], 0.0);
        for (sdk::SparseRowsView::InnerIterator entry(problem.H, n_ - 1 - j); entry; ++entry)
            work_[static_cast<std::size_t>(n_ - 1 - entry.col())] = 0.0;
    }
}

void VelocityMatrix::solve(sdk::Vector& v) {
    reversed_ = v.reverse();
    if (by_envelope_) {
        envelope_.solve(reversed_);
    } else {
        factor_.solve(reversed_);
    }
    v = reversed_.reverse();
}

}  // namespace delassus::newton
