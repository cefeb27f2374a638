// SPDX-License-Identifier: BSD-3-Clause
#include "preconditioner.hpp"

#include <algorithm>
#include <cmath>

#include "delassus/sdk/dense_algebra.hpp"

namespace delassus_minres {

using delassus::sdk::DelassusOperator;
using delassus::sdk::NumericalFailure;
using delassus::sdk::SparseColumns;
using delassus::sdk::SparseRows;
using delassus::sdk::SparseRowsView;

namespace {

// Products in D H⁻¹ Dᵀ up to which `auto` forms N: beyond, N is dense or nearly so.
constexpr double kLargestProduct = 5e7;
// Eigenvalues of a block N_cc below this share of the largest are raised to it: Ŝ must be definite.
constexpr double kBlockFloor = 1e-10;
// If a pivot vanishes, because N is singular or because entries are left out, the factorisation is tried again with N +
// shift·1. Eigen doubles the shift ten times; then the next of these values comes.
constexpr double kFirstShifts[] = {1e-6, 2e-3};

}  // namespace

void Preconditioner::analyze(const ProblemView& problem) {
    definite_ = !problem.needs_any(DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_H_INDEFINITE);
    if (definite_) N_.analyze(problem);
    incomplete_.reset();
    ++analyses_;
}

void Preconditioner::factorize(const ProblemView& problem) {
    if (definite_) {
        N_.factorize(problem);
        diagonal_ = N_.diagonal();
    } else {
        stand_in(problem);
    }
    const auto positive = (diagonal_.array() > 0.0).count();
    const double mean = positive > 0 ? diagonal_.sum() / static_cast<double>(positive) : 1.0;
    diagonal_inverse_ = (diagonal_.array() > 0.0).select(diagonal_, mean).cwiseInverse();

    used_ = choice_;
    if (choice_ == Schur::Automatic)
        used_ = products_in_N(problem) <= kLargestProduct ? Schur::IncompleteCholesky : Schur::Blocks;
    if (used_ == Schur::IncompleteCholesky && !factorize_incomplete(problem)) used_ = Schur::Blocks;
    if (used_ == Schur::Blocks) factorize_blocks(problem);
    ++factorizations_;
}

void Preconditioner::stand_in(const ProblemView& problem) {
    Vector diagonal(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i) diagonal[i] = std::abs(problem.H.coeff(i, i));
    const auto positive = (diagonal.array() > 0.0).count();
    const double mean = positive > 0 ? diagonal.sum() / static_cast<double>(positive) : 1.0;
    mass_inverse_ = (diagonal.array() > 0.0).select(diagonal, mean).cwiseInverse();
    diagonal_.setZero(problem.m);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry)
            diagonal_[i] += entry.value() * entry.value() * mass_inverse_[entry.col()];
        diagonal_[i] += problem.E.coeff(i, i);
    }
}

double Preconditioner::products_in_N(const ProblemView& problem) const {
    if (definite_ && N_.inverse().kind() == delassus::sdk::HInverse::Kind::Sparse) {
        // A connected H couples every row with every other; to count exactly would cost as much as to form N.
        const auto m = static_cast<double>(problem.m);
        return m * m * std::max(m, 100.0);
    }
    std::vector<double> count(static_cast<std::size_t>(problem.n), 0.0);
    if (definite_ && problem.n > 0) {
        N_.inverse().for_each_half_solved_row(problem.D,
                                              [&](Eigen::Index, const std::vector<std::int32_t>& reach, const Vector&) {
                                                  for (const auto i : reach) count[static_cast<std::size_t>(i)] += 1.0;
                                              });
    } else {
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry)
                count[static_cast<std::size_t>(entry.col())] += 1.0;
    }
    double products = static_cast<double>(problem.E.nonZeros());
    for (const double c : count) products += c * c;
    return products;
}

SparseRows Preconditioner::formed_N(const ProblemView& problem) const {
    if (definite_) return N_.formed(problem);
    SparseRows scaled = problem.D;
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (SparseRows::InnerIterator entry(scaled, i); entry; ++entry)
            entry.valueRef() *= std::sqrt(mass_inverse_[entry.col()]);
    SparseRows N = scaled * SparseRows(scaled.transpose());
    if (problem.E.nonZeros() > 0) N += problem.E;
    return N;
}

void Preconditioner::factorize_blocks(const ProblemView& problem) {
    blocks_.clear();
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const auto& cone = problem.cones[c];
        const double* entries = definite_ ? N_.block(c) : nullptr;
        if (!entries) continue;  // a large block keeps its diagonal
        const Eigen::Map<const Eigen::MatrixXd> block(entries, cone.rows, cone.rows);
        const delassus::sdk::SymmetricEigen eigen(block);
        const double largest = eigen.values().maxCoeff();
        if (!eigen.found() || !(largest > 0.0)) continue;
        blocks_.push_back({cone.first_row, eigen.with(eigen.values().cwiseMax(kBlockFloor * largest).cwiseInverse())});
    }
}

bool Preconditioner::factorize_incomplete(const ProblemView& problem) {
    if (problem.m == 0) return false;
    // Scaled to the diagonal 1 first, so that the shift means the same for every row.
    const Vector root = diagonal_inverse_.cwiseSqrt();
    SparseColumns N = formed_N(problem);
    for (Eigen::Index j = 0; j < N.cols(); ++j)
        for (SparseColumns::InnerIterator entry(N, j); entry; ++entry) entry.valueRef() *= root[entry.row()] * root[j];
    if (!incomplete_) {
        incomplete_ = std::make_unique<IncompleteCholesky>();
        incomplete_->analyzePattern(N);
    }
    for (const double shift : kFirstShifts) {
        incomplete_->setInitialShift(shift);
        incomplete_->factorize(N);
        if (incomplete_->info() == Eigen::Success) return true;
    }
    return false;
}

void Preconditioner::apply_mass(Vector& v) const {
    if (definite_)
        N_.inverse().apply(v);
    else
        v.array() *= mass_inverse_.array();
}

void Preconditioner::apply_schur(Vector& v) const {
    switch (used_) {
        case Schur::Identity:
            return;
        case Schur::IncompleteCholesky: {
            const Vector root = diagonal_inverse_.cwiseSqrt();
            const Vector scaled = v.cwiseProduct(root);
            v = incomplete_->solve(scaled).cwiseProduct(root);
            return;
        }
        case Schur::Blocks: {
            const Vector before = v;
            v.array() *= diagonal_inverse_.array();
            for (const auto& block : blocks_) {
                const Eigen::Index size = block.inverse.rows();
                v.segment(block.first, size).noalias() = block.inverse * before.segment(block.first, size);
            }
            return;
        }
        default:
            v.array() *= diagonal_inverse_.array();
    }
}

std::string Preconditioner::description() const {
    switch (used_) {
        case Schur::Identity:
            return "identity";
        case Schur::IncompleteCholesky:
            return "incomplete Cholesky of N";
        case Schur::Blocks:
            return "blocks of N";
        default:
            return "diagonal of N";
    }
}

}  // namespace delassus_minres
