// SPDX-License-Identifier: BSD-3-Clause
#include "contact_problem.hpp"

#include <new>

#include <CSparseMatrix.h>
#include <NumericsMatrix.h>
#include <SparseBlockMatrix.h>

#include "delassus/sdk/block_rows.hpp"

namespace delassus::siconos {

using namespace delassus::sdk;

void ContactProblem::Free::operator()(NumericsMatrix* matrix) const {
    NM_free(matrix);
}

void ContactProblem::factorize(const ProblemView& problem) {
    operator_.factorize(problem);
    const std::vector<double> scaling = block_scaling(problem.cones, operator_.diagonal());
    p_.setOnes(problem.m);
    if (scaled_)
        for (std::size_t c = 0; c < problem.cones.size(); ++c)
            p_.segment(problem.cones[c].first_row, problem.cones[c].rows).setConstant(scaling[c]);

    const std::vector<RowGroup> groups = row_groups(problem.cones);
    place_.resize(static_cast<std::size_t>(problem.m));
    std::int32_t embedded_rows = 0;
    for (const RowGroup& group : groups) {
        for (std::int32_t i = 0; i < group.rows; ++i)
            place_[static_cast<std::size_t>(group.first + i)] = embedded_rows + i;
        embedded_rows += 3;
    }

    const SparseRows N = operator_.formed(problem);
    std::unique_ptr<NumericsMatrix, Free> sparse(NM_create(NM_SPARSE, embedded_rows, embedded_rows));
    if (!sparse) throw std::bad_alloc();
    NM_triplet_alloc(sparse.get(), N.nonZeros() + embedded_rows - problem.m);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        for (SparseRows::InnerIterator entry(N, i); entry; ++entry)
            NM_entry(sparse.get(), place_[static_cast<std::size_t>(i)], place_[static_cast<std::size_t>(entry.col())],
                     p_[i] * entry.value() * p_[entry.col()]);
    }
    std::int32_t contact = 0;
    for (const RowGroup& group : groups) {
        for (std::int32_t i = group.rows; i < 3; ++i) NM_entry(sparse.get(), contact + i, contact + i, 1.0);
        contact += 3;
    }
    if (blocks_ && embedded_rows > 0) {
        SparseBlockStructuredMatrix* blocks = SBM_new();
        if (!blocks) throw std::bad_alloc();
        matrix_.reset(NM_new_SBM(embedded_rows, embedded_rows, blocks));
        if (!matrix_) throw std::bad_alloc();
        if (SBM_from_csparse(3, NM_csc(sparse.get()), blocks) != 0)
            throw NumericalFailure("Siconos could not make its block matrix of N");
    } else {
        NM_csc(sparse.get());
        matrix_ = std::move(sparse);
    }
}

void ContactProblem::load(const ProblemView& problem) {
    const Vector r = operator_.free_velocity(problem);
    residual_ = NaturalResidual(problem, operator_.diagonal(), r);
    const std::vector<RowGroup> groups = row_groups(problem.cones);
    q_.assign(3 * groups.size(), 0.0);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        const auto row = static_cast<std::size_t>(i);
        q_[static_cast<std::size_t>(place_[row])] = p_[i] * r[i];
    }
    mu_.assign(groups.size(), 0.0);
    for (const delassus_cone& cone : problem.cones)
        if (cone.kind == DELASSUS_CONE_FRICTION)
            mu_[static_cast<std::size_t>(place_[static_cast<std::size_t>(cone.first_row)] / 3)] =
                friction_coefficient(cone);
    raw_ = {3, static_cast<int>(groups.size()), matrix_.get(), q_.data(), mu_.data()};
}

Vector ContactProblem::embedded(const Vector& lambda) const {
    Vector reaction = Vector::Zero(static_cast<Eigen::Index>(q_.size()));
    for (Eigen::Index i = 0; i < lambda.size(); ++i) reaction[place_[static_cast<std::size_t>(i)]] = lambda[i] / p_[i];
    return reaction;
}

Vector ContactProblem::restricted(const Vector& reaction) const {
    Vector lambda(p_.size());
    for (Eigen::Index i = 0; i < lambda.size(); ++i) lambda[i] = p_[i] * reaction[place_[static_cast<std::size_t>(i)]];
    return lambda;
}

double ContactProblem::natural(const ProblemView& problem, const Vector& lambda, Vector& velocity) const {
    operator_.velocity(problem, lambda, velocity);
    Vector u = problem.b;
    if (problem.n > 0) u.noalias() += problem.D * velocity;
    if (problem.E.nonZeros() > 0) u.noalias() += problem.E * lambda;
    return residual_.natural(lambda, u);
}

}  // namespace delassus::siconos
