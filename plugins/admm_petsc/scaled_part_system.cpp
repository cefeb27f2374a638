// SPDX-License-Identifier: BSD-3-Clause
#include "scaled_part_system.hpp"

#include <Eigen/LU>

#include "row_scaling.hpp"

namespace delassus::petsc {

void ScaledPartSystem::analyze(const sdk::LocalProblemView& problem) {
    PartSystem::analyze(Processes(*problem.raw), problem);
    groups_ = coupled_rows(problem);
    krylov_.reset();
    matrix_.reset();
}

void ScaledPartSystem::factorize(const sdk::LocalProblemView& problem) {
    problem_ = &problem;
    PartSystem::factorize(problem);
    scale_ = admm::scale_of(problem.cones, diagonal());
    penalty_ = 0.0;
}

void ScaledPartSystem::load(const sdk::LocalProblemView& problem) {
    problem_ = &problem;
    PartSystem::load(problem);
    law_.load(rows(), scale_);
    b_ = scale_.cwiseProduct(problem.b);
}

void ScaledPartSystem::find_V() {
    diagonal_V_.resize(scale_.size());
    for (Eigen::Index i = 0; i < scale_.size(); ++i)
        diagonal_V_[i] = 1.0 / (scale_[i] * E().coeff(i, i) * scale_[i] + 1.0 / penalty_);
    blocks_V_.clear();
    bool diagonal = true;
    for (Eigen::Index i = 0; i < scale_.size(); ++i)
        for (sdk::SparseRows::InnerIterator e(E(), i); e; ++e) diagonal = diagonal && e.col() == i;
    if (diagonal) return;
    std::int32_t first = 0;
    for (const std::int32_t rows : groups_) {
        Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity() / penalty_;
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < rows; ++j)
                inverse(i, j) += scale_[first + i] * E().coeff(first + i, first + j) * scale_[first + j];
        blocks_V_.emplace_back(inverse.inverse());
        first += rows;
    }
}

void ScaledPartSystem::apply_V(sdk::Vector& v) const {
    if (blocks_V_.empty()) {
        v.array() *= diagonal_V_.array();
        return;
    }
    std::int32_t first = 0;
    for (std::size_t g = 0; g < groups_.size(); first += groups_[g++])
        v.segment(first, groups_[g]) =
            (blocks_V_[g].topLeftCorner(groups_[g], groups_[g]) * v.segment(first, groups_[g])).eval();
}

void ScaledPartSystem::set_penalty(double penalty) {
    if (penalty == penalty_) return;
    const auto span = processes().meter()->span(DELASSUS_PHASE_LINEAR_SYSTEMS);
    penalty_ = penalty;
    find_V();
    ++factorizations_;
    if (problem_->raw->n_all == 0) return;
    if (!matrix_.get()) {
        make_matrix(*problem_, groups_, matrix_);
        ++analyses_;
    }
    check(MatZeroEntries(matrix_.get()));
    fill_H(*problem_, matrix_.get());
    std::vector<std::int32_t> local;
    Eigen::MatrixXd values, block;
    std::int32_t first = 0;
    for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
        const int rows = groups_[g];
        dense_rows(first, rows, local, values);
        if (local.empty()) continue;
        for (int i = 0; i < rows; ++i) values.row(i) *= scale_[first + i];
        if (blocks_V_.empty()) {
            block.noalias() = values.transpose() * diagonal_V_.segment(first, rows).asDiagonal() * values;
        } else {
            block.noalias() = values.transpose() * blocks_V_[g].topLeftCorner(rows, rows) * values;
        }
        add(local, block, matrix_.get());
    }
    assemble(matrix_.get());
    if (!krylov_.get()) make_linear_solver(processes(), matrix_.get(), LinearSolver::Mumps, krylov_);
    if (!set_up(krylov_.get())) {
        penalty_ = 0.0;
        throw sdk::NumericalFailure(
            "the Cholesky factorisation of H + ρDᵀD failed: H is singular, or the values span too many decades");
    }
}

void ScaledPartSystem::resolve(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u) {
    mu = w / penalty_ - b_;
    sdk::Vector work = mu;
    apply_V(work);
    x_ = problem_->a + apply_transpose(scale_.cwiseProduct(work));
    if (krylov_.get()) solve(krylov_.get(), x_);
    mu -= scale_.cwiseProduct(apply_D(x_));
    apply_V(mu);
    u = (w - mu) / penalty_;
}

}  // namespace delassus::petsc
