// SPDX-License-Identifier: BSD-3-Clause
#include "scaled_part.hpp"

#include <algorithm>

namespace delassus::petsc {

namespace {

std::size_t at(std::int64_t i) {
    return static_cast<std::size_t>(i);
}

/// The rows of each group get all columns that any of them has, so that they share them.
void share_columns(std::span<const sdk::RowGroup> groups, sdk::CompressedRows& W) {
    const auto same = [&W](const sdk::RowGroup& group) {
        const auto begin = W.start[at(group.first)], length = W.start[at(group.first) + 1] - begin;
        for (std::int32_t i = 1; i < group.rows; ++i) {
            const auto other = W.start[at(group.first + i)];
            if (W.start[at(group.first + i) + 1] - other != length ||
                !std::equal(W.column.begin() + begin, W.column.begin() + begin + length, W.column.begin() + other))
                return false;
        }
        return true;
    };
    if (std::all_of(groups.begin(), groups.end(), same)) return;
    sdk::CompressedRows shared;
    shared.clear();
    shared.column.reserve(W.column.size());
    shared.value.reserve(W.value.size());
    std::vector<std::int32_t> all;
    for (const sdk::RowGroup& group : groups) {
        all.assign(W.column.begin() + W.start[at(group.first)],
                   W.column.begin() + W.start[at(group.first + group.rows)]);
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        for (std::int32_t i = group.first; i < group.first + group.rows; ++i) {
            auto e = at(W.start[at(i)]);
            for (const auto j : all) {
                const bool has = e < at(W.start[at(i) + 1]) && W.column[e] == j;
                shared.put(j, has ? W.value[e] : 0.0);
                if (has) ++e;
            }
            shared.end_row();
        }
    }
    W = std::move(shared);
}

}  // namespace

void ScaledPart::analyze(const Processes& processes, const sdk::LocalProblemView& problem) {
    bodies_.analyze(processes, problem);
    has_compliance_ = processes.any(!problem.E.value.empty());
    rows_ = Exchange(processes, problem.row_start,
                     foreign_columns(problem.E, problem.first_row(), problem.first_row() + problem.m));
    cut_slices(problem);
}

void ScaledPart::cut_slices(const sdk::LocalProblemView& problem) {
    const auto most = std::max<std::int64_t>(least_slice, problem.m / 16);
    slices_.clear();
    first_cone_.assign(1, 0);
    Slice slice;
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        slice.rows += problem.cones[c].rows;
        if (slice.rows < most && c + 1 < problem.cones.size()) continue;
        slice.groups = sdk::row_groups(problem.cones.part(first_cone_.back(), c + 1));
        slice.groups.shrink_to_fit();
        for (sdk::RowGroup& group : slice.groups) group.first -= slice.first;
        const std::int32_t next = slice.first + slice.rows;
        slices_.push_back(std::move(slice));
        first_cone_.push_back(c + 1);
        slice = {};
        slice.first = next;
    }
}

void ScaledPart::factorize(const sdk::LocalProblemView& problem) {
    bodies_.factorize(problem);
    p_.setOnes(problem.m);
    ratio_.setOnes(problem.m);
    work_.setZero(bodies_.columns().size() + sdk::chunk_padding);
    sdk::Vector diagonal = sdk::Vector::Zero(problem.m);
    processes().together([&] {
        for (std::size_t s = 0; s < slices_.size(); ++s) whiten(problem, s, diagonal);
    });
    fill_immobile(processes(), problem.cones, diagonal);
    scale(problem.cones, diagonal);
    if (has_compliance_) fill_compliance(problem);
}

// The rows' diagonal of N, P, and Ŵ. A row whose diagonal is zero has no entry in Ŵ; its p follows from other cones,
// and is not final here.
void ScaledPart::whiten(const sdk::LocalProblemView& problem, std::size_t number, sdk::Vector& diagonal) {
    Slice& slice = slices_[number];
    LocalRows local;
    sdk::CompressedRows W;
    const std::int32_t end = slice.first + slice.rows;
    if (bodies_.columns().size() > 0) {
        bodies_.inverse().half_solve_rows(local.view(problem.D, bodies_.columns(), slice.first, end), W);
    } else {
        W.start.assign(at(slice.rows) + 1, 0);
    }
    for (std::int32_t i = 0; i < slice.rows; ++i) {
        const auto row = at(slice.first + i);
        for (auto e = at(W.start[at(i)]); e < at(W.start[at(i) + 1]); ++e)
            diagonal[slice.first + i] += W.value[e] * W.value[e];
        for (auto e = at(problem.E.row_start[row]); e < at(problem.E.row_start[row + 1]); ++e)
            if (problem.E.column[e] == problem.first_row() + slice.first + i)
                diagonal[slice.first + i] += problem.E.value[e];
    }
    scale(problem.cones.part(first_cone_[number], first_cone_[number + 1]), diagonal);
    if (bodies_.columns().size() == 0) return;
    share_columns(slice.groups, W);
    slice.inertia = sdk::BlockRows(W.view(bodies_.columns().size()), slice.groups, p_.data() + slice.first, nullptr);
}

void ScaledPart::fill_compliance(const sdk::LocalProblemView& problem) {
    padded_.setZero(rows_.size() + sdk::chunk_padding);
    sdk::Vector right = sdk::Vector::Zero(rows_.size());
    right.segment(rows_.first_own(), rows_.own()) = p_;
    rows_.bring(right.data());
    processes().together([&] {
        LocalRows local;
        for (Slice& slice : slices_)
            slice.compliance = sdk::BlockRows(local.view(problem.E, rows_, slice.first, slice.first + slice.rows),
                                              slice.groups, p_.data() + slice.first, right.data());
    });
}

void ScaledPart::load(const sdk::LocalProblemView& problem) {
    r_ = problem.b;
    bodies_.multiply_add(problem, local_velocity(problem, sdk::Vector::Zero(problem.m)), r_);
    r_.array() *= p_.array();
    const double square = processes().sum(ratio_.cwiseProduct(r_).squaredNorm());
    ScaledRows::load(problem.cones, problem.coulomb, sdk::reference_of(square), Keep::BlocksOfOtherKinds);
    for (std::size_t s = 0; s < slices_.size(); ++s) append_parts(s, slices_[s].groups, slices_[s].rows);
}

void ScaledPart::begin_product(const sdk::Vector& lambda) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    work_.setZero();
    for (const Slice& slice : slices_)
        if (slice.inertia.entries() > 0)
            slice.inertia.transpose_multiply_add(lambda.data() + slice.first, work_.data());
    bodies_.columns().collect(work_.data());
    bodies_.columns().bring(work_.data());
    if (!has_compliance_) return;
    padded_.segment(rows_.first_own(), rows_.own()) = lambda;
    rows_.bring(padded_.data());
}

void ScaledPart::finish_product(const Part& part, sdk::Vector& result) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    part.of(result).setZero();
    const Slice& slice = slices_[part.slice];
    double* rows = result.data() + slice.first;
    const std::size_t last = part.first_group + part.groups;
    if (slice.inertia.entries() > 0) slice.inertia.multiply(work_.data(), rows, rows, part.first_group, last);
    if (slice.compliance.entries() > 0) slice.compliance.multiply(padded_.data(), rows, rows, part.first_group, last);
}

void ScaledPart::gradient(const sdk::Vector& lambda, sdk::Vector& result) const {
    result.resize(lambda.size());
    begin_product(lambda);
    for (const Part& part : parts()) {
        finish_product(part, result);
        part.of(result) += part.of(r_);
    }
}

double ScaledPart::natural(const sdk::Vector& lambda, const sdk::Vector& velocity) const {
    const auto projecting = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    return natural_from(processes().sum(natural_square(lambda, velocity)));
}

// H⁻¹(a + Dᵀλ) at all local columns.
sdk::Vector ScaledPart::local_velocity(const sdk::LocalProblemView& problem,
                                       const Eigen::Ref<const sdk::Vector>& lambda) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    const Exchange& columns = bodies_.columns();
    sdk::Vector v = sdk::Vector::Zero(columns.size());
    bodies_.transpose_multiply_add(problem, lambda, v);
    columns.collect(v.data());
    v.segment(columns.first_own(), columns.own()) += problem.a;
    columns.bring(v.data());
    bodies_.inverse().apply(v);
    return v;
}

double ScaledPart::measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                            sdk::Vector& velocity) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    sdk::Vector u = problem.b;
    velocity = local_velocity(problem, lambda);
    bodies_.multiply_add(problem, velocity, u);
    if (has_compliance_) {
        sdk::Vector all = sdk::Vector::Zero(rows_.size());
        all.segment(rows_.first_own(), rows_.own()) = lambda;
        rows_.bring(all.data());
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (auto e = at(problem.E.row_start[at(i)]); e < at(problem.E.row_start[at(i) + 1]); ++e)
                u[i] += problem.E.value[e] * all[rows_.local(problem.E.column[e])];
    }
    u.array() *= p_.array();
    return natural(lambda.cwiseQuotient(p_), u);
}

sdk::Vector ScaledPart::velocity(const sdk::LocalProblemView& problem,
                                 const Eigen::Ref<const sdk::Vector>& lambda) const {
    const Exchange& columns = bodies_.columns();
    return local_velocity(problem, lambda).segment(columns.first_own(), columns.own());
}

}  // namespace delassus::petsc
