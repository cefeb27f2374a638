// SPDX-License-Identifier: BSD-3-Clause
#include "scaled_part.hpp"

#include <limits>
#include <stdexcept>

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
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const delassus_cone& cone = problem.cone(c);
        const std::int32_t rows = sdk::is_separable(cone) ? 1 : cone.rows;
        for (std::int32_t i = 0; i < cone.rows; i += rows)
            slice.groups.push_back({cone.first_row + i - slice.first, rows});
        slice.rows += cone.rows;
        if (slice.rows < most && c + 1 < problem.raw->cone_count) continue;
        const std::int32_t next = slice.first + slice.rows;
        slice.groups.shrink_to_fit();
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
    trace_.assign(at(problem.raw->cone_count), 0.0);
    work_.setZero(bodies_.columns().size() + sdk::chunk_padding);
    processes().together([&] {
        for (std::size_t s = 0; s < slices_.size(); ++s)
            whiten(problem, slices_[s], first_cone_[s], first_cone_[s + 1]);
    });
    scale_rest();
    for (std::size_t s = 0; s < slices_.size(); ++s)
        for (std::int64_t c = first_cone_[s]; c < first_cone_[s + 1]; ++c) {
            const delassus_cone& cone = problem.cone(c);
            const double block = 1.0 / std::sqrt(trace_[at(c)]);
            for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i) {
                if (std::isnan(p_[i])) p_[i] = block;
                ratio_[i] = block / p_[i];
            }
        }
    trace_ = {};
    if (has_compliance_) fill_compliance(problem);
}

// The rows' diagonal of N, P, and Ŵ. A row whose diagonal is zero has no entry in Ŵ; its p (NaN until scale_rest)
// follows from other blocks.
void ScaledPart::whiten(const sdk::LocalProblemView& problem, Slice& slice, std::int64_t first_cone,
                        std::int64_t last_cone) {
    LocalRows local;
    sdk::CompressedRows W;
    const std::int32_t end = slice.first + slice.rows;
    if (bodies_.columns().size() > 0) {
        bodies_.inverse().half_solve_rows(local.view(problem.D, bodies_.columns(), slice.first, end), W);
    } else {
        W.start.assign(at(slice.rows) + 1, 0);
    }
    sdk::Vector diagonal = sdk::Vector::Zero(slice.rows), left = sdk::Vector::Ones(slice.rows);
    for (std::int32_t i = 0; i < slice.rows; ++i) {
        for (auto e = at(W.start[at(i)]); e < at(W.start[at(i) + 1]); ++e) diagonal[i] += W.value[e] * W.value[e];
        const auto row = at(slice.first + i);
        for (auto e = at(problem.E.row_start[row]); e < at(problem.E.row_start[row + 1]); ++e)
            if (problem.E.column[e] == problem.first_row() + slice.first + i) diagonal[i] += problem.E.value[e];
    }
    for (std::int64_t c = first_cone; c < last_cone; ++c) {
        const delassus_cone& cone = problem.cone(c);
        const std::int32_t first = cone.first_row - slice.first;
        const double trace = diagonal.segment(first, cone.rows).sum() / cone.rows;
        trace_[at(c)] = trace;
        const double block = trace > 0.0 ? 1.0 / std::sqrt(trace) : std::numeric_limits<double>::quiet_NaN();
        for (std::int32_t i = first; i < first + cone.rows; ++i) {
            const bool whole = !sdk::is_separable(cone);
            const double p = whole || !(diagonal[i] > 0.0) ? block : 1.0 / std::sqrt(diagonal[i]);
            p_[slice.first + i] = p;
            left[i] = std::isnan(p) ? 1.0 : p;
        }
    }
    if (bodies_.columns().size() == 0) return;
    share_columns(slice.groups, W);
    slice.inertia = sdk::BlockRows(W.view(bodies_.columns().size()), slice.groups, left.data(), nullptr);
}

// Blocks without mobility take the mean of the others, as sdk::block_scaling does.
void ScaledPart::scale_rest() {
    std::array<double, 2> sums = {};
    for (const double trace : trace_)
        if (trace > 0.0) {
            sums[0] += trace;
            sums[1] += 1.0;
        }
    processes().sum(sums);
    const double mean = sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
    for (double& trace : trace_)
        if (!(trace > 0.0)) trace = mean;
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
    sdk::Vector r = problem.b;
    bodies_.multiply_add(problem, local_velocity(problem, nullptr), r);
    contacts_.clear();
    rest_.clear();
    intervals_.clear();
    std::int64_t separable = 0, others = 0;
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        separable += sdk::is_separable(problem.cone(c)) ? 1 : 0;
        others += !sdk::is_separable(problem.cone(c)) && problem.cone(c).kind != DELASSUS_CONE_FRICTION ? 1 : 0;
    }
    contacts_.reserve(at(problem.raw->cone_count - separable));
    const Eigen::Index bounded = separable > 0 ? problem.m : 0;
    lower_.setZero(bounded);
    upper_.setZero(bounded);
    double square = 0.0;
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const delassus_cone& cone = problem.cone(c);
        const sdk::ConeOperations& kind = sdk::operations_of(cone);
        const double s = ratio_[cone.first_row] * p_[cone.first_row];
        square += s * s * r.segment(cone.first_row, cone.rows).squaredNorm();
        if (!kind.is_separable()) {
            const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
            contacts_.push_back(
                {friction ? sdk::friction_coefficient(cone) : 0.0, cone.first_row, friction ? cone.rows : 0});
            if (others > 0) rest_.push_back({cone, kind.is_cone ? 1.0 : p_[cone.first_row]});
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
    square = processes().sum(square);
    reference_ = square > 0.0 ? std::sqrt(square) : 1.0;
    r_ = p_.cwiseProduct(r);
    divide();
}

// Cuts the rows into parts of at least part_rows, where no block, interval or group is cut, and no part crosses a
// slice.
void ScaledPart::divide() {
    parts_.clear();
    Part part;
    for (std::size_t s = 0; s < slices_.size(); ++s) {
        const Slice& slice = slices_[s];
        part.slice = s;
        part.first_group = part.groups = 0;
        const std::int32_t end_of_slice = slice.first + slice.rows;
        while (part.first < end_of_slice) {
            part.first_block += part.blocks;
            part.first_interval += part.intervals;
            part.first_group += part.groups;
            part.blocks = part.intervals = part.groups = 0;
            std::int32_t end = part.first;
            while (end < end_of_slice && end - part.first < part_rows) {
                const std::size_t block = part.first_block + part.blocks;
                if (block < contacts_.size() && contacts_[block].first == end) {
                    const std::int32_t rows = contacts_[block].rows;
                    end += rows > 0 ? rows : rest_[block].cone.rows;
                    ++part.blocks;
                } else {
                    end += intervals_[part.first_interval + part.intervals].rows;
                    ++part.intervals;
                }
            }
            while (part.first_group + part.groups < slice.groups.size() &&
                   slice.first + slice.groups[part.first_group + part.groups].first < end)
                ++part.groups;
            part.rows = end - part.first;
            parts_.push_back(part);
            part.first = end;
        }
    }
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
    for (const Part& part : parts_) {
        finish_product(part, result);
        part.of(result) += part.of(r_);
    }
}

void ScaledPart::project_block(std::size_t block, double* lambda) const {
    const Contact& contact = contacts_[block];
    if (contact.rows > 0) return sdk::FrictionCone::project_with_slope(contact.mu, contact.rows, lambda);
    const auto& [cone, unit] = rest_[block];
    for (std::int32_t i = 0; i < cone.rows; ++i) lambda[i] *= unit;
    sdk::project(cone, lambda);
    for (std::int32_t i = 0; i < cone.rows; ++i) lambda[i] /= unit;
}

void ScaledPart::project(const Part& part, sdk::Vector& lambda) const {
    for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
        double* v = lambda.data() + contacts_[k].first;
        if (contacts_[k].rows == 3) {
            sdk::FrictionCone::project_with_slope(contacts_[k].mu, 3, v);
        } else {
            project_block(k, v);
        }
    }
    for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k)
        for (std::int32_t i = intervals_[k].first; i < intervals_[k].first + intervals_[k].rows; ++i)
            lambda[i] = std::min(upper_[i], std::max(lower_[i], lambda[i]));
}

double ScaledPart::natural_square(const Part& part, const sdk::Vector& lambda, const sdk::Vector& velocity) const {
    double sum = 0.0, sums[3] = {};  // of three rows apart: their additions do not wait for one another
    std::array<double, sdk::largest_block_rows> trial;
    for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
        const Contact& contact = contacts_[k];
        const double* l = lambda.data() + contact.first;
        const double* u = velocity.data() + contact.first;
        if (contact.rows == 3) {
            for (std::size_t i = 0; i < 3; ++i) trial[i] = l[i] - u[i];
            sdk::FrictionCone::project_with_slope(contact.mu, 3, trial.data());
            for (std::size_t i = 0; i < 3; ++i) sums[i] += (l[i] - trial[i]) * (l[i] - trial[i]);
            continue;
        }
        const std::int32_t rows = contact.rows > 0 ? contact.rows : rest_[k].cone.rows;
        for (std::int32_t i = 0; i < rows; ++i) trial[at(i)] = l[i] - u[i];
        project_block(k, trial.data());
        for (std::int32_t i = 0; i < rows; ++i) sum += (l[i] - trial[at(i)]) * (l[i] - trial[at(i)]);
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

double ScaledPart::natural(const sdk::Vector& lambda, const sdk::Vector& velocity) const {
    const auto projecting = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    double sum = 0.0;
    for (const Part& part : parts_) sum += natural_square(part, lambda, velocity);
    return natural_from(processes().sum(sum));
}

// H⁻¹(a + Dᵀλ), or H⁻¹ a without λ, at all local columns.
sdk::Vector ScaledPart::local_velocity(const sdk::LocalProblemView& problem, const sdk::Vector* lambda) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    const Exchange& columns = bodies_.columns();
    sdk::Vector v = sdk::Vector::Zero(columns.size());
    if (lambda) bodies_.transpose_multiply_add(problem, *lambda, v);
    columns.collect(v.data());
    v.segment(columns.first_own(), columns.own()) += problem.a;
    columns.bring(v.data());
    bodies_.inverse().apply(v);
    return v;
}

double ScaledPart::measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda) const {
    const auto multiplying = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    sdk::Vector u = problem.b;
    bodies_.multiply_add(problem, local_velocity(problem, &lambda), u);
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

void ScaledPart::velocity(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                          sdk::MutableVectorView x) const {
    const Exchange& columns = bodies_.columns();
    x = local_velocity(problem, &lambda).segment(columns.first_own(), columns.own());
}

}  // namespace delassus::petsc
