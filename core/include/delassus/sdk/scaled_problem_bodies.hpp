// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/scaled_problem.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void ScaledProblem::factorize(const ProblemView& problem, const Team& given) {
    const Team team = useful(given, problem);
    operator_.factorize(problem, cheapest_form(problem) == Form::Formed, team);
    scale_rows(problem);
    build_operator(problem, team);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::load(const ProblemView& problem) {
    r_ = operator_.free_velocity(problem);
    residual_ = NaturalResidual(problem, operator_.diagonal(), r_);
    coulomb_ = problem.coulomb;
    r_.array() *= p_.array();
    blocks_.clear();
    contacts_.clear();
    intervals_.clear();
    lower_.setZero(problem.m);
    upper_.setZero(problem.m);
    for (const delassus_cone& cone : problem.cones) {
        const ConeOperations& kind = operations_of(cone);
        if (!kind.is_separable()) {
            const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
            blocks_.push_back({cone, cone.first_row, cone.rows, kind.is_cone ? 1.0 : p_[cone.first_row]});
            contacts_.push_back(
                {friction ? friction_coefficient(cone) : 0.0, cone.first_row, friction ? cone.rows : 0});
            continue;
        }
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const auto [lo, hi] = kind.interval(cone, i);
            lower_[cone.first_row + i] = lo / p_[cone.first_row + i];
            upper_[cone.first_row + i] = hi / p_[cone.first_row + i];
        }
        for (std::int32_t i = 0; i < cone.rows; i += longest_interval)
            intervals_.push_back({cone.first_row + i, std::min(longest_interval, cone.rows - i)});
    }
    divide();
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

DELASSUS_SDK_FUNCTION void ScaledProblem::project(Vector& lambda) const {
    for (const Part& part : parts_) project(part, lambda);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::project(const Part& part, Vector& lambda) const {
    for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
        const Contact& contact = contacts_[k];
        if (contact.rows == 3) {
            FrictionCone::project_with_slope(contact.mu, 3, lambda.data() + contact.first);
        } else {
            project_block(blocks_[k], lambda.data() + blocks_[k].first);
        }
    }
    for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k)
        for (std::int32_t i = intervals_[k].first; i < intervals_[k].first + intervals_[k].rows; ++i)
            lambda[i] = std::min(upper_[i], std::max(lower_[i], lambda[i]));
}

DELASSUS_SDK_FUNCTION double ScaledProblem::natural(const Vector& lambda, const Vector& velocity) const {
    double sum = 0.0;
    for (const Part& part : parts_) sum += natural_square(part, lambda, velocity);
    return natural_from(sum);
}

DELASSUS_SDK_FUNCTION double ScaledProblem::natural_square(const Part& part, const Vector& lambda,
                                                           const Vector& velocity) const {
    double sum = 0.0, sums[3] = {};  // of three rows apart: their additions do not wait for one another
    std::array<double, largest_block_rows> trial;
    for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
        const Contact& contact = contacts_[k];
        const double* l = lambda.data() + contact.first;
        const double* u = velocity.data() + contact.first;
        if (contact.rows == 3 && !coulomb_) {
            for (std::size_t i = 0; i < 3; ++i) trial[i] = l[i] - u[i];
            FrictionCone::project_with_slope(contact.mu, 3, trial.data());
            for (std::size_t i = 0; i < 3; ++i) sums[i] += (l[i] - trial[i]) * (l[i] - trial[i]);
            continue;
        }
        const Block& block = blocks_[k];
        double* tried = trial.data();
        for (std::int32_t i = 0; i < block.rows; ++i) tried[i] = l[i] - u[i];
        if (coulomb_) tried[0] -= de_saxce(block.cone, u);
        project_block(block, tried);
        for (std::int32_t i = 0; i < block.rows; ++i) sum += (l[i] - tried[i]) * (l[i] - tried[i]);
    }
    for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k) {
        const Interval& run = intervals_[k];
        for (std::int32_t i = run.first; i < run.first + run.rows; ++i) {
            const double w = ratio_[i];
            const double change = std::min(lambda[i] - lower_[i], std::max(lambda[i] - upper_[i], w * w * velocity[i]));
            sum += change * change / (w * w);
        }
    }
    return sum + sums[0] + sums[1] + sums[2];
}

DELASSUS_SDK_FUNCTION double ScaledProblem::measured(const ProblemView& problem, const Vector& lambda,
                                                     Vector& velocity) const {
    velocity = operator_.velocity(problem, lambda);
    Vector u = problem.b;
    if (problem.n > 0) u.noalias() += problem.D * velocity;
    if (problem.E.nonZeros() > 0) u.noalias() += problem.E * lambda;
    return residual_.natural(lambda, u);
}

DELASSUS_SDK_FUNCTION void ScaledProblem::project_block(const Block& block, double* lambda) {
    if (block.unit == 1.0) return sdk::project(block.cone, lambda);
    for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] *= block.unit;
    sdk::project(block.cone, lambda);
    for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] /= block.unit;
}

DELASSUS_SDK_FUNCTION void ScaledProblem::scale_rows(const ProblemView& problem) {
    const Vector& diagonal = operator_.diagonal();
    const std::vector<double> block = block_scaling(problem.cones, diagonal);
    p_.resize(problem.m);
    ratio_.resize(problem.m);
    groups_.clear();
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const delassus_cone& cone = problem.cones[c];
        const bool whole = !is_separable(cone);
        if (whole) groups_.push_back({cone.first_row, cone.rows});
        for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i) {
            p_[i] = whole || !(diagonal[i] > 0.0) ? block[c] : 1.0 / std::sqrt(diagonal[i]);
            ratio_[i] = block[c] / p_[i];
            if (!whole) groups_.push_back({i, 1});
        }
    }
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

// Cuts the rows into parts of at least part_rows, where no block, interval or group is cut. All three stand in the
// order of their rows.
DELASSUS_SDK_FUNCTION void ScaledProblem::divide() {
    parts_.clear();
    Part part;
    const auto rows = static_cast<std::int32_t>(p_.size());
    while (part.first < rows) {
        part.first_block += part.blocks;
        part.first_interval += part.intervals;
        part.first_group += part.groups;
        part.blocks = part.intervals = part.groups = 0;
        std::int32_t end = part.first;
        while (end < rows && end - part.first < part_rows) {
            const std::size_t block = part.first_block + part.blocks;
            if (block < blocks_.size() && blocks_[block].first == end) {
                end += blocks_[block].rows;
                ++part.blocks;
            } else {
                end += intervals_[part.first_interval + part.intervals].rows;
                ++part.intervals;
            }
        }
        while (part.first_group + part.groups < groups_.size() && groups_[part.first_group + part.groups].first < end)
            ++part.groups;
        part.rows = end - part.first;
        parts_.push_back(part);
        part.first = end;
    }
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
