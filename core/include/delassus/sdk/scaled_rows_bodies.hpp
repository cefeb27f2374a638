// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/scaled_rows.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/scaled_rows.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void ScaledRows::scale(const ConeRange& cones, const Vector& diagonal) {
    const std::vector<double> block = block_scaling(cones, diagonal);
    for (std::size_t c = 0; c < cones.size(); ++c) {
        const bool whole = !is_separable(cones[c]);
        for (std::int32_t i = cones[c].first_row; i < cones[c].first_row + cones[c].rows; ++i) {
            p_[i] = whole || !(diagonal[i] > 0.0) ? block[c] : 1.0 / std::sqrt(diagonal[i]);
            ratio_[i] = block[c] / p_[i];
        }
    }
}

DELASSUS_SDK_FUNCTION void ScaledRows::load(const ConeRange& cones, bool coulomb, double reference, Keep keep) {
    coulomb_ = coulomb;
    reference_ = reference;
    blocks_.clear();
    contacts_.clear();
    intervals_.clear();
    parts_.clear();
    std::size_t separable = 0, others = 0;
    for (const delassus_cone& cone : cones) {
        if (is_separable(cone)) {
            ++separable;
        } else if (cone.kind != DELASSUS_CONE_FRICTION) {
            ++others;
        }
    }
    contacts_.reserve(cones.size() - separable);
    const bool all_blocks = keep == Keep::AllBlocks || others > 0;
    lower_.setZero(separable > 0 ? p_.size() : 0);
    upper_.setZero(lower_.size());
    for (const delassus_cone& cone : cones) {
        const ConeOperations& kind = operations_of(cone);
        if (!kind.is_separable()) {
            const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
            if (all_blocks)
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
}

DELASSUS_SDK_FUNCTION void ScaledRows::append_parts(std::size_t slice, std::span<const RowGroup> groups,
                                                    std::int32_t rows) {
    Part part = parts_.empty() ? Part{} : parts_.back();
    part.slice = slice;
    part.first += part.rows;
    const std::int32_t first = part.first, last = first + rows;
    part.first_group = part.groups = 0;
    while (part.first < last) {
        part.first_block += part.blocks;
        part.first_interval += part.intervals;
        part.first_group += part.groups;
        part.blocks = part.intervals = part.groups = 0;
        std::int32_t end = part.first;
        while (end < last && end - part.first < part_rows) {
            const std::size_t block = part.first_block + part.blocks;
            if (block < contacts_.size() && contacts_[block].first == end) {
                end += rows_of(block);
                ++part.blocks;
            } else {
                end += intervals_[part.first_interval + part.intervals].rows;
                ++part.intervals;
            }
        }
        while (part.first_group + part.groups < groups.size() &&
               first + groups[part.first_group + part.groups].first < end)
            ++part.groups;
        part.rows = end - part.first;
        parts_.push_back(part);
        part.first = end;
    }
}

DELASSUS_SDK_FUNCTION void ScaledRows::project_block(std::size_t number, double* lambda) const {
    const Contact& contact = contacts_[number];
    if (contact.rows > 0) return FrictionCone::project_with_slope(contact.mu, contact.rows, lambda);
    const Block& block = blocks_[number];
    for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] *= block.unit;
    sdk::project(block.cone, lambda);
    for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] /= block.unit;
}

DELASSUS_SDK_FUNCTION void ScaledRows::project(const Part& part, Vector& lambda) const {
    for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
        double* v = lambda.data() + contacts_[k].first;
        if (contacts_[k].rows == 3) {
            FrictionCone::project_with_slope(contacts_[k].mu, 3, v);
        } else {
            project_block(k, v);
        }
    }
    for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k)
        for (std::int32_t i = intervals_[k].first; i < intervals_[k].first + intervals_[k].rows; ++i)
            lambda[i] = std::min(upper_[i], std::max(lower_[i], lambda[i]));
}

DELASSUS_SDK_FUNCTION double ScaledRows::natural_square(const Part& part, const Vector& lambda,
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
        const std::int32_t rows = rows_of(k);
        double* tried = trial.data();
        for (std::int32_t i = 0; i < rows; ++i) tried[i] = l[i] - u[i];
        if (coulomb_)
            tried[0] -=
                contact.rows > 0 ? contact.mu * FrictionCone::tangent_norm(rows, u) : de_saxce(blocks_[k].cone, u);
        project_block(k, tried);
        for (std::int32_t i = 0; i < rows; ++i) sum += (l[i] - tried[i]) * (l[i] - tried[i]);
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

}  // namespace delassus::sdk
