// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/anderson.hpp (sdk/compiled_once.hpp).
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "delassus/sdk/anderson.hpp"
#include "delassus/sdk/compiled_once.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void Anderson::reset(Eigen::Index size, int memory) {
    memory_ = memory;
    df_.resize(size, memory);
    dF_.resize(size, memory);
    gram_.resize(memory, memory);
    slope_.resize(memory);
    f_.resize(size);
    F_.resize(size);
    sums_.resize(2 * memory, Team::parts_of(size));
    totals_.resize(2 * memory);
    clear();
}

// One pass over the memory. Differences are not scaled: their lengths stand on the diagonal of the Gram matrix.
DELASSUS_SDK_FUNCTION void Anderson::push(const Vector& f, const Vector& F, const Team& team, const Sum& sum) {
    const bool differs = has_point_;
    const int kept = differs ? std::min(count_ + 1, memory_) : 0, place = position_;
    team.for_parts(f.size(), [&](Eigen::Index part, Eigen::Index first, Eigen::Index size) {
        auto f_part = f_.segment(first, size), F_part = F_.segment(first, size);
        const auto new_f = f.segment(first, size);
        if (differs) {
            auto difference = df_.col(place).segment(first, size);
            difference = new_f - f_part;
            dF_.col(place).segment(first, size) = F.segment(first, size) - F_part;
            for (int k = 0; k < kept; ++k) {
                const auto other = df_.col(k).segment(first, size);
                sums_(k, part) = other.dot(difference);
                sums_(memory_ + k, part) = other.dot(new_f);
            }
        }
        f_part = new_f;
        F_part = F.segment(first, size);
    });
    has_point_ = true;
    if (!differs) return;
    auto totals = totals_.head(2 * kept);
    totals.setZero();
    for (int k = 0; k < kept; ++k)
        for (Eigen::Index part = 0; part < sums_.cols(); ++part) {
            totals[k] += sums_(k, part);
            totals[kept + k] += sums_(memory_ + k, part);
        }
    if (sum) sum({totals.data(), static_cast<std::size_t>(totals.size())});
    for (int k = 0; k < kept; ++k) {
        gram_(place, k) = gram_(k, place) = totals[k];
        slope_[k] = totals[kept + k];
    }
    if (!(gram_(place, place) > 0.0)) {  // the same point again
        gram_.row(place).head(kept).setZero();
        gram_.col(place).head(kept).setZero();
    }
    count_ = kept;
    position_ = (place + 1) % memory_;
}

DELASSUS_SDK_FUNCTION bool Anderson::extrapolate(Vector& next, const Team& team) {
    // Added to the diagonal of the normalised normal equations: directions below its root are rounding.
    constexpr double regularization = 1e-10;
    if (count_ == 0) return false;
    const Vector scale = gram_.diagonal().head(count_).unaryExpr(
        [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
    // Local: an Eigen object that is resized where memory has ended frees its memory twice (3.4.0).
    Eigen::MatrixXd matrix = scale.asDiagonal() * gram_.topLeftCorner(count_, count_) * scale.asDiagonal();
    matrix.diagonal().array() += regularization;
    Vector gamma = scale.cwiseProduct(slope_.head(count_));
    matrix.ldlt().solveInPlace(gamma);
    if (!gamma.allFinite()) return false;
    gamma.array() *= scale.array();
    next.resize(F_.size());
    team.for_parts(F_.size(), [&](Eigen::Index, Eigen::Index first, Eigen::Index size) {
        next.segment(first, size) = F_.segment(first, size);
        next.segment(first, size).noalias() -= dF_.middleRows(first, size).leftCols(count_) * gamma;
    });
    return true;
}

}  // namespace delassus::sdk
