// SPDX-License-Identifier: BSD-3-Clause
#include "split_part.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace delassus::petsc {

namespace {

std::size_t at(std::int64_t i) {
    return static_cast<std::size_t>(i);
}

}  // namespace

void SplitPart::analyze(const Processes& processes, const sdk::LocalProblemView& problem) {
    bodies_.analyze(processes, problem);
    processes.together([&] {
        check_compliance(problem);
        const sdk::SparseRowsView D = rows_.view(problem.D, columns(), 0, problem.m);
        D_start_ = {D.outerIndexPtr(), at(problem.m) + 1};
        D_column_ = {D.innerIndexPtr(), at(D.nonZeros())};
        E_start_.assign(1, 0);
        E_column_.clear();
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(problem.m); ++i) {
            for (auto e = at(problem.E.row_start[at(i)]); e < at(problem.E.row_start[at(i) + 1]); ++e)
                if (problem.E.column[e] == problem.first_row() + i) E_column_.push_back(i);
            E_start_.push_back(static_cast<std::int32_t>(E_column_.size()));
        }
        block_start_ = bodies_.block_start();
        block_index_ = bodies_.block_index();
        if (columns().size() > 0) return;
        block_start_ = {0, 1};  // an own velocity that nothing touches: no part has none
        block_index_ = {0};
    });
    find_shares();
    H_.start.assign(block_index_.size() + 1, 0);
    H_.column.clear();
    H_.value.clear();
    E_value_.assign(E_column_.size(), 0.0);
    a_.setZero(share_.size());
    make_view(problem);
}

void SplitPart::check_compliance(const sdk::LocalProblemView& problem) const {
    if (problem.m >= std::numeric_limits<std::int32_t>::max())
        throw std::runtime_error("one process has too many rows for 32-bit numbers: use more processes");
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (auto e = at(problem.E.row_start[at(i)]); e < at(problem.E.row_start[at(i) + 1]); ++e) {
            if (problem.E.value[e] == 0.0) continue;
            if (problem.E.column[e] != problem.first_row() + i)
                throw std::runtime_error("E couples rows, which pgs_petsc cannot take: E must be zero or diagonal");
            if (problem.E.value[e] < 0.0) throw std::runtime_error("E has a negative entry on its diagonal");
        }
}

// A block of H is touched as a whole. Foreign ones are there because own rows touch them.
void SplitPart::find_shares() {
    const Eigen::Index size = columns().size();
    share_.setOnes(std::max<Eigen::Index>(size, 1));
    shared_.clear();
    elsewhere_.clear();
    shared_rows_.clear();
    if (!exist()) return;
    std::vector<std::int32_t> block_of(at(size));
    for (std::size_t k = 0; k + 1 < block_start_.size() && size > 0; ++k)
        for (auto i = block_start_[k]; i < block_start_[k + 1]; ++i)
            block_of[at(block_index_[at(i)])] = static_cast<std::int32_t>(k);
    std::vector<char> touched(block_start_.size(), 0), is_shared(at(size), 0);
    for (const std::int32_t column : D_column_) touched[at(block_of[at(column)])] = 1;
    sdk::Vector count(size);
    for (Eigen::Index j = 0; j < size; ++j) count[j] = touched[at(block_of[at(j)])] != 0 ? 1.0 : 0.0;
    columns().collect(count.data());
    columns().bring(count.data());
    for (Eigen::Index j = 0; j < size; ++j) {
        const bool here = touched[at(block_of[at(j)])] != 0;
        if (count[j] > 1.0) share_[j] = 1.0 / count[j];
        if (here && count[j] > 1.0) {
            shared_.push_back({static_cast<std::int32_t>(j), share_[j]});
            is_shared[at(j)] = 1;
        }
        if (!here && count[j] > 0.0) elsewhere_.push_back(static_cast<std::int32_t>(j));
    }
    scratch_.setZero(size);
    if (shared_.empty()) return;
    for (std::size_t i = 0; i + 1 < D_start_.size(); ++i)
        for (auto e = at(D_start_[i]); e < at(D_start_[i + 1]); ++e)
            if (is_shared[at(D_column_[e])] != 0) {
                shared_rows_.push_back(static_cast<std::int32_t>(i));
                break;
            }
}

void SplitPart::factorize(const sdk::LocalProblemView& problem) {
    H_ = bodies_.fetched(problem);
    for (Eigen::Index j = 0; j < columns().size(); ++j)
        for (auto e = at(H_.start[at(j)]); e < at(H_.start[at(j) + 1]); ++e) H_.value[e] *= share_[j];
    if (columns().size() == 0) {
        H_.put(0, 1.0);
        H_.end_row();
    }
    std::size_t k = 0;
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (auto e = at(problem.E.row_start[at(i)]); e < at(problem.E.row_start[at(i) + 1]); ++e)
            if (problem.E.column[e] == problem.first_row() + i) E_value_[k++] = problem.E.value[e];
    make_view(problem);
}

void SplitPart::load(const sdk::LocalProblemView& problem) {
    a_.setZero();
    a_.segment(columns().first_own(), columns().own()) = problem.a;
    columns().bring(a_.data());
    a_.array() *= share_.array();
    make_view(problem);
}

void SplitPart::make_view(const sdk::LocalProblemView& problem) {
    const auto n = static_cast<std::int32_t>(share_.size()), m = static_cast<std::int32_t>(problem.m);
    raw_ = {};
    raw_.struct_size = sizeof raw_;
    raw_.law = problem.raw->law;
    raw_.n = n;
    raw_.m = m;
    raw_.H = {n, n, static_cast<std::int32_t>(H_.value.size()), H_.start.data(), H_.column.data(), H_.value.data()};
    raw_.D = {m, n, D_start_.back(), D_start_.data(), D_column_.data(), problem.D.value.data()};
    raw_.E = {m, m, E_start_.back(), E_start_.data(), E_column_.data(), E_value_.data()};
    raw_.a = a_.data();
    raw_.b = problem.raw->b;
    raw_.cone_count = static_cast<std::int32_t>(problem.raw->cone_count);
    raw_.cone_stride = problem.raw->cone_stride;
    raw_.cones = problem.raw->cones;
    raw_.h_block_count = static_cast<std::int32_t>(block_start_.size()) - 1;
    raw_.h_block_start = block_start_.data();
    raw_.h_block_index = block_index_.data();
    raw_.needs = problem.needs;
    view_ = std::make_unique<sdk::ProblemView>(raw_);
}

sdk::Vector SplitPart::diagonal(const sdk::DelassusOperator& split) const {
    sdk::Vector result = split.diagonal();
    const sdk::CompressedRows& W = split.whitened();
    for (const std::int32_t i : shared_rows_) {
        result[i] = 0.0;
        for (auto e = at(E_start_[at(i)]); e < at(E_start_[at(i) + 1]); ++e) result[i] += E_value_[e];
        for (auto e = at(W.start[at(i)]); e < at(W.start[at(i) + 1]); ++e)
            result[i] += share_[W.column[e]] * W.value[e] * W.value[e];
    }
    return result;
}

// a is a share, and so is the sum of all Dᵀλ: by (H/k)⁻¹ they give the body's velocity, in each copy.
sdk::Vector SplitPart::velocity(const sdk::DelassusOperator& split, const sdk::Vector& lambda) const {
    sdk::Vector x = sdk::Vector::Zero(share_.size());
    if (problem().m > 0) x.noalias() += problem().D.transpose() * lambda;
    columns().collect(x.data());
    columns().bring(x.data());
    x.array() *= share_.array();
    x += a_;
    split.inverse().apply(x);
    return x;
}

void SplitPart::find_places(const pgs::Model& model) {
    place_.clear();
    for (const Shared& one : shared_) place_.push_back(model.place_of_column(at(one.column)));
}

void SplitPart::reconcile(std::span<double> state) const {
    for (const std::int32_t j : elsewhere_) scratch_[j] = 0.0;
    for (std::size_t k = 0; k < shared_.size(); ++k) scratch_[shared_[k].column] = state[place_[k]];
    columns().collect(scratch_.data());
    for (const std::int32_t j : elsewhere_) scratch_[j] *= share_[j];
    for (const Shared& one : shared_) scratch_[one.column] *= one.share;
    columns().bring(scratch_.data());
    for (std::size_t k = 0; k < shared_.size(); ++k) state[place_[k]] = scratch_[shared_[k].column];
}

}  // namespace delassus::petsc
