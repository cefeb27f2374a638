// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/scaled_problem.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void ScaledProblem::factorize(const ProblemView& problem, const Team& given) {
    const Team team = useful(given, problem);
    operator_.factorize(problem, cheapest_form(problem) == Form::Formed, team);
    p_.resize(problem.m);
    ratio_.resize(problem.m);
    scale(problem.cones, operator_.diagonal());
    groups_ = row_groups(problem.cones);
    build_operator(problem, team);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::load(const ProblemView& problem) {
    r_ = operator_.free_velocity(problem);
    residual_ = NaturalResidual(problem, operator_.diagonal(), r_);
    r_.array() *= p_.array();
    ScaledRows::load(problem.cones, problem.coulomb, residual_.reference(), Keep::AllBlocks);
    append_parts(0, groups_, static_cast<std::int32_t>(problem.m));
}

DELASSUS_SDK_FUNCTION void ScaledProblem::begin_product(const Team& team, const Vector& lambda) const {
    if (rows_.entries() > 0) {
        if (const int members = team.size(); members > 1) {
            if (shares_.members() != members) shares_ = ColumnShares(rows_, work_.size(), members);
            team.run([&](int member) { shares_.transpose_multiply(rows_, lambda.data(), work_.data(), member); });
        } else {
            work_.setZero();
            rows_.transpose_multiply_add(lambda.data(), work_.data());
        }
        if (!whitened_) {
            velocity_ = work_.head(velocity_.size());
            operator_.inverse().apply(velocity_);
            work_.head(velocity_.size()) = velocity_;
        }
    }
    if (square_.entries() > 0) padded_.head(lambda.size()) = lambda;
}

DELASSUS_SDK_FUNCTION void ScaledProblem::finish_product(const Part& part, Vector& result) const {
    part.of(result).setZero();
    const std::size_t last = part.first_group + part.groups;
    if (rows_.entries() > 0) rows_.multiply(work_.data(), result.data(), result.data(), part.first_group, last);
    if (square_.entries() > 0) square_.multiply(padded_.data(), result.data(), result.data(), part.first_group, last);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::multiply(const Vector& lambda, Vector& result) const {
    multiply(Team(), lambda, result);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::multiply(const Team& team, const Vector& lambda, Vector& result) const {
    result.resize(lambda.size());
    begin_product(team, lambda);
    for_parts(team, [&](const Part& part) { finish_product(part, result); });
}

DELASSUS_SDK_FUNCTION void ScaledProblem::gradient(const Vector& lambda, Vector& result) const {
    multiply(lambda, result);
    result += r_;
}

DELASSUS_SDK_FUNCTION double ScaledProblem::measured(const ProblemView& problem, const Vector& lambda,
                                                     Vector& velocity) const {
    velocity = operator_.velocity(problem, lambda);
    Vector u = problem.b;
    if (problem.n > 0) u.noalias() += problem.D * velocity;
    if (problem.E.nonZeros() > 0) u.noalias() += problem.E * lambda;
    return residual_.natural(lambda, u);
}

// With a diagonal or block-diagonal H, Ŵ has about as many entries as D. With a sparse H a row of Ŵ reaches up the
// elimination tree: then the alternatives are D̂ with two triangular solves a product, or for few rows N̂ itself.
// Costs are counted in multiplications.
DELASSUS_SDK_FUNCTION ScaledProblem::Form ScaledProblem::cheapest_form(const ProblemView& problem) const {
    const HInverse& inverse = operator_.inverse();
    if (inverse.kind() != HInverse::Kind::Sparse) return Form::Whitened;
    const double whitened = 2.0 * static_cast<double>(inverse.sparse().reach(problem.D).entries);
    const double solved = 2.0 * static_cast<double>(problem.D.nonZeros() + inverse.factor_entries());
    const double formed = static_cast<double>(problem.m) * static_cast<double>(problem.m);
    if (formed <= std::min(whitened, solved)) return Form::Formed;
    return whitened <= solved ? Form::Whitened : Form::Solved;
}

DELASSUS_SDK_FUNCTION void ScaledProblem::build_operator(const ProblemView& problem, const Team& team) {
    rows_ = {};
    square_ = {};
    shares_ = {};
    work_.setZero(problem.n + chunk_padding);
    velocity_.setZero(problem.n);
    padded_.setZero(problem.m + chunk_padding);
    const Form form = cheapest_form(problem);
    whitened_ = form != Form::Solved;
    const HInverse& inverse = operator_.inverse();
    if (form == Form::Formed) {
        square_ = BlockRows(operator_.formed(problem), groups_, p_.data(), p_.data());
        return;
    }
    if (problem.n > 0 && inverse.kind() != HInverse::Kind::Sparse) {
        rows_ = BlockRows(operator_.whitened().view(problem.n), groups_, p_.data(), nullptr, team);
    } else if (problem.n > 0 && whitened_) {
        const SparseColumns Z = inverse.half_solved(problem.D);
        const SparseRowsView W(Z.cols(), Z.rows(), Z.nonZeros(), Z.outerIndexPtr(), Z.innerIndexPtr(),
                               Z.valuePtr());  // the columns of Z are the rows of W = Zᵀ
        rows_ = BlockRows(W, groups_, p_.data(), nullptr);
    } else if (problem.n > 0) {
        rows_ = BlockRows(problem.D, groups_, p_.data(), nullptr);
    }
    if (problem.E.nonZeros() > 0) square_ = BlockRows(problem.E, groups_, p_.data(), p_.data());
}

}  // namespace delassus::sdk
