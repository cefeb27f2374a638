// SPDX-License-Identifier: BSD-3-Clause
#include "newton_system.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace delassus::ssn {

using sdk::ProblemView;
using sdk::RowGroup;
using sdk::ScaledProblem;
using sdk::SparseRowsView;

namespace {

using Block = Eigen::Matrix<double, 3, 3>;
using BlockView = Eigen::Map<Block>;
using ConstBlockView = Eigen::Map<const Block>;
using Triplet = Eigen::Triplet<double, std::int32_t>;

constexpr int largest_refinement = 3;
constexpr double refined_enough = 1e-10;

std::vector<std::int32_t> piece_of_row(const std::vector<RowGroup>& groups, Eigen::Index m) {
    std::vector<std::int32_t> piece(static_cast<std::size_t>(m));
    for (std::size_t k = 0; k < groups.size(); ++k)
        for (std::int32_t i = 0; i < groups[k].rows; ++i)
            piece[static_cast<std::size_t>(groups[k].first + i)] = static_cast<std::int32_t>(k);
    return piece;
}

std::int32_t position(const SparseColumns& matrix, Eigen::Index row, Eigen::Index column) {
    const auto* begin = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column];
    const auto* end = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column + 1];
    return static_cast<std::int32_t>(std::lower_bound(begin, end, static_cast<std::int32_t>(row)) -
                                     matrix.innerIndexPtr());
}

bool same_pattern(const SparseColumns& a, const SparseColumns& b) {
    return a.rows() == b.rows() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.cols() + 1, b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}

}  // namespace

void NewtonSystem::factorize(const ProblemView& problem, const ScaledProblem& scaled, bool pattern_is_new) {
    const std::vector<RowGroup> groups = sdk::row_groups(problem.cones);
    if (pattern_is_new) choose_form(problem, groups);
    const SparseColumns before = std::move(matrix_);
    if (velocities_) {
        build_velocities(problem, scaled, groups);
    } else {
        build_rows(problem, scaled, groups);
    }
    // Zeros that are stored in D may make entries of N come and go, though the problem's pattern is the same.
    if (!same_pattern(before, matrix_)) factor_.reset();
}

// The form by velocities where they are fewer than rows. With more velocities than rows N is the smaller matrix, and
// rows are used unless N has too many entries to be formed.
void NewtonSystem::choose_form(const ProblemView& problem, const std::vector<RowGroup>& groups) {
    bool separate = true;
    const std::vector<std::int32_t> piece = piece_of_row(groups, problem.m);
    for (Eigen::Index i = 0; i < problem.m && separate; ++i)
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            separate = separate && piece[static_cast<std::size_t>(i)] == piece[static_cast<std::size_t>(entry.col())];
    const bool possible = problem.n > 0 && separate;
    const bool better = problem.n < problem.m || problem.m > 6000;
    velocities_ = possible && (wanted_ == Form::Velocities || (wanted_ == Form::Automatic && better));
}

void NewtonSystem::build_velocities(const ProblemView& problem, const ScaledProblem& scaled,
                                    const std::vector<RowGroup>& groups) {
    root_.setOnes(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            if (entry.col() == i) root_[i] = 1.0 / std::sqrt(entry.value());
    cliques_.clear();
    index_.clear();
    value_.clear();
    slot_.clear();
    std::vector<Triplet> entries;
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        entries.emplace_back(static_cast<std::int32_t>(i), static_cast<std::int32_t>(i), 0.0);
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            entries.emplace_back(static_cast<std::int32_t>(i), static_cast<std::int32_t>(entry.col()),
                                 root_[i] * entry.value() * root_[entry.col()]);
    }
    for (const RowGroup& group : groups) {
        Clique clique{group.first, group.rows, 0, index_.size(), value_.size(), slot_.size()};
        for (std::int32_t i = 0; i < group.rows; ++i)
            for (SparseRowsView::InnerIterator entry(problem.D, group.first + i); entry; ++entry)
                index_.push_back(static_cast<std::int32_t>(entry.col()));
        const auto begin = index_.begin() + static_cast<std::ptrdiff_t>(clique.index);
        std::sort(begin, index_.end());
        index_.erase(std::unique(begin, index_.end()), index_.end());
        clique.columns = static_cast<std::int32_t>(index_.size() - clique.index);
        const auto columns = static_cast<std::size_t>(clique.columns);
        value_.resize(clique.value + columns * static_cast<std::size_t>(group.rows), 0.0);
        for (std::int32_t i = 0; i < group.rows; ++i) {
            for (SparseRowsView::InnerIterator entry(problem.D, group.first + i); entry; ++entry) {
                const auto k = std::lower_bound(begin, index_.end(), static_cast<std::int32_t>(entry.col())) - begin;
                value_[clique.value + static_cast<std::size_t>(k * group.rows + i)] =
                    scaled.scaling()[group.first + i] * entry.value() * root_[entry.col()];
            }
        }
        slot_.resize(clique.slot + columns * columns);
        for (std::size_t k = 0; k < columns; ++k)
            for (std::size_t l = 0; l < columns; ++l)
                entries.emplace_back(index_[clique.index + k], index_[clique.index + l], 0.0);
        cliques_.push_back(clique);
    }
    matrix_.resize(problem.n, problem.n);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    for (const Clique& clique : cliques_) {
        const auto columns = static_cast<std::size_t>(clique.columns);
        for (std::size_t l = 0; l < columns; ++l)
            for (std::size_t k = 0; k < columns; ++k)
                slot_[clique.slot + l * columns + k] =
                    position(matrix_, index_[clique.index + k], index_[clique.index + l]);
    }
    compliance_.assign(groups.size(), {});
    for (std::size_t c = 0; c < groups.size(); ++c) {
        for (std::int32_t i = 0; i < groups[c].rows; ++i) {
            for (SparseRowsView::InnerIterator entry(problem.E, groups[c].first + i); entry; ++entry) {
                const auto j = static_cast<std::int32_t>(entry.col()) - groups[c].first;
                compliance_[c][static_cast<std::size_t>(3 * j + i)] =
                    scaled.scaling()[groups[c].first + i] * entry.value() * scaled.scaling()[entry.col()];
            }
        }
    }
    Q_.resize(groups.size());
    inverse_.resize(groups.size());
    constant_ = Eigen::Map<const Vector>(matrix_.valuePtr(), matrix_.nonZeros());
}

void NewtonSystem::build_rows(const ProblemView& problem, const ScaledProblem& scaled,
                              const std::vector<RowGroup>& groups) {
    const sdk::SparseRows N = scaled.unscaled().formed(problem);
    const std::vector<std::int32_t> piece = piece_of_row(groups, problem.m);
    couples_.clear();
    std::vector<Triplet> entries;
    std::vector<std::int32_t> couple_of(groups.size(), -1);  // for the current row of pieces
    for (std::size_t c = 0; c < groups.size(); ++c) {
        const std::size_t begin = couples_.size();
        const auto couple_with = [&](std::int32_t other) -> Couple& {
            auto& index = couple_of[static_cast<std::size_t>(other)];
            if (index < 0) {
                index = static_cast<std::int32_t>(couples_.size());
                couples_.push_back({static_cast<std::int32_t>(c), other, {}, {}});
            }
            return couples_[static_cast<std::size_t>(index)];
        };
        couple_with(static_cast<std::int32_t>(c));
        for (std::int32_t i = 0; i < groups[c].rows; ++i) {
            const Eigen::Index row = groups[c].first + i;
            for (sdk::SparseRows::InnerIterator entry(N, row); entry; ++entry) {
                const std::int32_t other = piece[static_cast<std::size_t>(entry.col())];
                const auto j = static_cast<std::int32_t>(entry.col()) - groups[static_cast<std::size_t>(other)].first;
                couple_with(other).value[static_cast<std::size_t>(3 * j + i)] =
                    scaled.scaling()[row] * entry.value() * scaled.scaling()[entry.col()];
            }
        }
        for (std::size_t k = begin; k < couples_.size(); ++k) {
            const RowGroup& other = groups[static_cast<std::size_t>(couples_[k].column_piece)];
            couple_of[static_cast<std::size_t>(couples_[k].column_piece)] = -1;
            for (std::int32_t j = 0; j < other.rows; ++j)
                for (std::int32_t i = 0; i < groups[c].rows; ++i)
                    entries.emplace_back(groups[c].first + i, other.first + j, 0.0);
        }
    }
    matrix_.resize(problem.m, problem.m);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    for (Couple& couple : couples_) {
        const RowGroup& row = groups[static_cast<std::size_t>(couple.row_piece)];
        const RowGroup& column = groups[static_cast<std::size_t>(couple.column_piece)];
        for (std::int32_t j = 0; j < column.rows; ++j)
            couple.slot[static_cast<std::size_t>(j)] = position(matrix_, row.first, column.first + j);
    }
}

void NewtonSystem::assemble_velocities(const NaturalMap& map) {
    double* values = matrix_.valuePtr();
    std::copy_n(constant_.data(), constant_.size(), values);
    Eigen::Matrix<double, 3, Eigen::Dynamic> image;  // Q D̂ of a piece
    for (std::size_t c = 0; c < cliques_.size(); ++c) {
        const Piece& piece = map.pieces()[c];
        const Clique& clique = cliques_[c];
        if (piece.active == 0) continue;
        const auto active = piece.active, rows = piece.rows;
        const ConstBlockView A(piece.A.data()), B(piece.B.data());
        Block M = ConstBlockView(piece.M.data());
        M.topLeftCorner(active, active) += A.topLeftCorner(active, rows) *
                                           ConstBlockView(compliance_[c].data()).topLeftCorner(rows, rows) *
                                           B.topLeftCorner(rows, active);
        for (Eigen::Index k = active; k < 3; ++k) {
            M.row(k).setZero();
            M.col(k).setZero();
            M(k, k) = 1.0;
        }
        BlockView inverse(inverse_[c].data());
        inverse = M.inverse();
        BlockView Q(Q_[c].data());
        Q.setZero();
        Q.topLeftCorner(rows, rows) =
            B.topLeftCorner(rows, active) * inverse.topLeftCorner(active, active) * A.topLeftCorner(active, rows);
        const Eigen::Map<const Eigen::MatrixXd> D(value_.data() + clique.value, rows, clique.columns);
        image.resize(3, clique.columns);
        image.topRows(rows).noalias() = Q.topLeftCorner(rows, rows) * D;
        const std::int32_t* slot = slot_.data() + clique.slot;
        for (std::int32_t l = 0; l < clique.columns; ++l)
            for (std::int32_t k = 0; k < clique.columns; ++k, ++slot) {
                double sum = 0.0;
                for (std::int32_t i = 0; i < rows; ++i) sum += D(i, k) * image(i, l);
                values[*slot] += sum;
            }
    }
}

void NewtonSystem::assemble_rows(const NaturalMap& map) {
    double* values = matrix_.valuePtr();
    Block product;
    for (const Couple& couple : couples_) {
        const Piece& left = map.pieces()[static_cast<std::size_t>(couple.row_piece)];
        const Piece& right = map.pieces()[static_cast<std::size_t>(couple.column_piece)];
        product.setZero();
        if (left.active > 0 && right.active > 0)
            product.noalias() = ConstBlockView(left.A.data()) *
                                ConstBlockView(couple.value.data()).lazyProduct(ConstBlockView(right.B.data()));
        // A and B keep old values beyond the active rows and columns.
        for (std::int32_t j = 0; j < right.rows; ++j)
            for (std::int32_t i = 0; i < left.rows; ++i) {
                double value = i < left.active && j < right.active ? product(i, j) : 0.0;
                if (&left == &right) {
                    if (i < left.active && j < left.active) value += left.M[static_cast<std::size_t>(3 * j + i)];
                    if (i == j && i >= left.active) value = 1.0;
                }
                values[couple.slot[static_cast<std::size_t>(j)] + i] = value;
            }
    }
}

// solution ← (A N B + M)⁻¹ g by the factors; both local.
void NewtonSystem::solve_local(const NaturalMap& map, const Vector& g, Vector& solution) {
    if (!velocities_) {
        solution = g;
        factor_.solve(solution);
        return;
    }
    velocity_.setZero(matrix_.rows());
    const auto times_inverse = [this](std::size_t c, const Piece& piece, const double* v) {
        std::array<double, 3> result{};
        for (std::size_t k = 0; k < static_cast<std::size_t>(piece.active); ++k)
            for (std::size_t l = 0; l < static_cast<std::size_t>(piece.active); ++l)
                result[k] += inverse_[c][3 * l + k] * v[l];
        return result;
    };
    for (std::size_t c = 0; c < cliques_.size(); ++c) {
        const Piece& piece = map.pieces()[c];
        if (piece.active == 0) continue;
        const std::array<double, 3> v = times_inverse(c, piece, g.data() + piece.first);
        std::array<double, 3> w{};
        for (std::int32_t i = 0; i < piece.rows; ++i)
            for (std::int32_t k = 0; k < piece.active; ++k)
                w[static_cast<std::size_t>(i)] +=
                    piece.B[static_cast<std::size_t>(3 * k + i)] * v[static_cast<std::size_t>(k)];
        const Clique& clique = cliques_[c];
        const double* value = value_.data() + clique.value;
        for (std::int32_t k = 0; k < clique.columns; ++k)
            for (std::int32_t i = 0; i < piece.rows; ++i)
                velocity_[index_[clique.index + static_cast<std::size_t>(k)]] +=
                    *value++ * w[static_cast<std::size_t>(i)];
    }
    factor_.solve(velocity_);
    solution.setZero(g.size());
    for (std::size_t c = 0; c < cliques_.size(); ++c) {
        const Piece& piece = map.pieces()[c];
        if (piece.active == 0) continue;
        const Clique& clique = cliques_[c];
        const double* value = value_.data() + clique.value;
        std::array<double, 3> w{}, rest{};
        for (std::int32_t k = 0; k < clique.columns; ++k)
            for (std::int32_t i = 0; i < piece.rows; ++i)
                w[static_cast<std::size_t>(i)] +=
                    *value++ * velocity_[index_[clique.index + static_cast<std::size_t>(k)]];
        for (std::int32_t k = 0; k < piece.active; ++k) {
            double sum = g[piece.first + k];
            for (std::int32_t i = 0; i < piece.rows; ++i)
                sum -= piece.A[static_cast<std::size_t>(3 * i + k)] * w[static_cast<std::size_t>(i)];
            rest[static_cast<std::size_t>(k)] = sum;
        }
        const std::array<double, 3> v = times_inverse(c, piece, rest.data());
        for (std::int32_t k = 0; k < piece.active; ++k) solution[piece.first + k] = v[static_cast<std::size_t>(k)];
    }
}

bool NewtonSystem::solve(const ScaledProblem& scaled, const NaturalMap& map, double tau, const Vector& normal,
                         const Vector& local, Vector& step, Vector& product) {
    if (velocities_) {
        assemble_velocities(map);
    } else {
        assemble_rows(map);
    }
    ++factorizations_;
    if (!factor_.factorize(matrix_, map.law() == 0.0)) return false;

    // g = local − A (N + τ) δ_⊥; the step is δ_⊥ + B δ_B, and the residual of the equation g − (A N B + M) δ_B.
    step = normal;
    scaled.multiply(step, product);
    expanded_ = product + tau * step;
    map.contract(expanded_, residual_);
    residual_ = local - residual_;
    const double size = residual_.norm();
    double last = size;
    const Vector g = residual_;
    Vector solution = Vector::Zero(local.size());
    for (int k = 0; k <= largest_refinement; ++k) {
        solve_local(map, residual_, correction_);
        if (!correction_.allFinite()) return false;
        work_ = solution + correction_;
        map.expand(work_, expanded_);
        scaled.multiply(expanded_, product);
        map.contract(product, residual_);
        map.add_diagonal(work_, residual_);
        residual_ = g - residual_;
        const double rest = residual_.norm();
        if (k > 0 && !(rest < 0.5 * last)) break;  // refinement no longer gains
        solution = work_;
        step = normal + expanded_;
        last = rest;
        if (rest <= refined_enough * size) break;
    }
    scaled.multiply(step, product);
    return true;
}

}  // namespace delassus::ssn
