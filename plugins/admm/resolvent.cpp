// SPDX-License-Identifier: BSD-3-Clause
#include "resolvent.hpp"

#include <algorithm>
#include <vector>

namespace delassus::admm {

using delassus_cholmod::Cholesky;
using sdk::SparseColumns;
using sdk::SparseRows;

namespace {

/// matrix with all of its diagonal in the pattern.
SparseColumns with_diagonal(const SparseColumns& matrix) {
    SparseColumns identity(matrix.rows(), matrix.cols());
    identity.setIdentity();
    SparseColumns result = matrix + 0.0 * identity;
    result.makeCompressed();
    return result;
}

void add_to_diagonal(SparseColumns& matrix, double value) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
        for (SparseColumns::InnerIterator entry(matrix, j); entry; ++entry)
            if (entry.row() == j) entry.valueRef() += value;
}

bool is_diagonal(const sdk::SparseRowsView& matrix) {
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
        for (sdk::SparseRowsView::InnerIterator entry(matrix, i); entry; ++entry)
            if (entry.col() != i) return false;
    return true;
}

}  // namespace

void Resolvent::load_matrices(const sdk::ProblemView& problem, const RowScaling& scaling) {
    scale_ = scaling.scale();
    penalty_ = 0.0;
    if (problem.n > 0) {
        H_ = with_diagonal(problem.H);
        D_ = scale_.asDiagonal() * SparseColumns(problem.D);
    }
    diagonal_compliance_ = is_diagonal(problem.E);
    if (pattern_is_new_) choose_form(problem, scaling);
    if (primal()) {
        rows_ = sdk::BlockRows(problem.D, sdk::row_groups(problem.cones), scale_.data(), nullptr);
        if (diagonal_compliance_) {
            compliance_.resize(problem.m);
            for (Eigen::Index i = 0; i < problem.m; ++i) compliance_[i] = problem.E.coeff(i, i) * scale_[i] * scale_[i];
        } else {
            E_ = with_diagonal(scale_.asDiagonal() * SparseColumns(problem.E) * scale_.asDiagonal());
        }
        square_.resize(0, 0);
    } else {
        const SparseColumns N = scaling.N().formed(problem);
        square_ = with_diagonal(scale_.asDiagonal() * N * scale_.asDiagonal());
    }
}

// The dual form is taken where even a dense factor of N is no larger than that of the primal matrix.
void Resolvent::choose_form(const sdk::ProblemView& problem, const RowScaling& scaling) {
    compliance_factor_.reset();
    form_ = problem.n == 0 ? Form::Dual : scaling.definite() ? wanted_ : Form::Primal;
    if (form_ != Form::Automatic) return;
    form_ = Form::Primal;
    if (problem.m >= problem.n) return;
    const auto m = static_cast<double>(problem.m);
    const double of_N = 0.5 * m * (m + 1.0);
    // H + ρDᵀD has H's pattern and more: where the factor of H, whose analysis outlives changes of D, is large enough,
    // nothing else is analysed.
    if (of_N > static_cast<double>(scaling.N().inverse().factor_entries())) {
        factor_.analyze(SparseColumns(H_ + SparseColumns(D_.transpose() * D_)));
        if (of_N > factor_.entries()) return;
    }
    form_ = Form::Dual;
}

void Resolvent::set_penalty(double penalty) {
    if (penalty == penalty_) return;
    const SparseColumns matrix = primal() ? primal_matrix(penalty) : dual_matrix(penalty);
    if (pattern_is_new_) {
        factor_.analyze(matrix);
        pattern_is_new_ = false;
        ++analyses_;
    }
    ++factorizations_;
    penalty_ = 0.0;
    if (!factor_.factorize(matrix))
        throw sdk::NumericalFailure(
            primal() ? "the Cholesky factorisation of H + ρDᵀD failed: H is singular in a direction "
                       "that no row of D holds, or the values span too many decades"
                     : "the Cholesky factorisation of N + 1/ρ failed: N is not positive semidefinite");
    penalty_ = penalty;
}

SparseColumns Resolvent::primal_matrix(double penalty) {
    if (!diagonal_compliance_) {
        SparseColumns inverse_of_V = E_;
        add_to_diagonal(inverse_of_V, 1.0 / penalty);
        if (pattern_is_new_) {
            compliance_factor_ = std::make_unique<Cholesky>(
                Cholesky::Kind::Definite, delassus_cholmod::Ordering::Automatic, delassus_cholmod::Method::Automatic);
            compliance_factor_->analyze(inverse_of_V);
        }
        if (!compliance_factor_->factorize(inverse_of_V))
            throw sdk::NumericalFailure("the Cholesky factorisation of E + 1/ρ failed: E is not positive semidefinite");
        // V = Lᵀ⁻¹L⁻¹ up to the order of the rows, so that D̂ᵀ V D̂ = ZᵀZ with Z = L⁻¹ D̂.
        std::vector<Eigen::Triplet<double, std::int32_t>> entries;
        compliance_factor_->half_solve(SparseRows(D_.transpose()),
                                       [&](Eigen::Index column, const auto& reach, const sdk::Vector& values) {
                                           for (const auto i : reach)
                                               entries.emplace_back(i, static_cast<std::int32_t>(column), values[i]);
                                       });
        SparseColumns Z(D_.rows(), D_.cols());
        Z.setFromTriplets(entries.begin(), entries.end());
        return H_ + SparseColumns(Z.transpose() * Z);
    }
    V_ = (compliance_.array() + 1.0 / penalty).inverse();
    if (!compliance_.isZero(0.0)) return H_ + SparseColumns(D_.transpose() * V_.asDiagonal() * D_);
    if (square_.cols() == 0) square_ = D_.transpose() * D_;
    return H_ + penalty * square_;
}

SparseColumns Resolvent::dual_matrix(double penalty) const {
    SparseColumns matrix = square_;
    add_to_diagonal(matrix, 1.0 / penalty);
    return matrix;
}

void Resolvent::load(const sdk::ProblemView& problem, const sdk::Vector& r) {
    a_ = problem.a;
    b_ = scale_.cwiseProduct(primal() ? sdk::Vector(problem.b) : r);
    x_.resize(problem.n);
    padded_.setZero(problem.n + sdk::chunk_padding);
    work_.resize(problem.m);
}

void Resolvent::apply_V(sdk::Vector& v) const {
    if (diagonal_compliance_) {
        v.array() *= V_.array();
    } else {
        compliance_factor_->solve(v);
    }
}

void Resolvent::apply(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u) {
    mu = w / penalty_ - b_;
    if (primal()) {
        work_ = mu;
        apply_V(work_);
        padded_.head(a_.size()) = a_;
        rows_.transpose_multiply_add(work_.data(), padded_.data());
        x_ = padded_.head(a_.size());
        factor_.solve(x_);
        padded_.head(a_.size()) = x_;
        work_.setZero();
        rows_.multiply_add(padded_.data(), work_.data());
        mu -= work_;
        apply_V(mu);
    } else {
        factor_.solve(mu);
    }
    u = (w - mu) / penalty_;
}

}  // namespace delassus::admm
