// SPDX-License-Identifier: BSD-3-Clause
#include "anderson_part.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace delassus::petsc {

void AndersonPart::reset(const Processes& processes, Eigen::Index size, int memory) {
    processes_ = processes;
    memory_ = memory;
    df_.resize(size, memory);
    dF_.resize(size, memory);
    gram_.resize(memory, memory);
    slope_.resize(memory);
    clear();
}

void AndersonPart::push(const sdk::Vector& f, const sdk::Vector& F) {
    const bool differs = has_point_;
    has_point_ = true;
    const int kept = std::min(count_ + 1, memory_), place = position_;
    if (differs) {
        df_.col(place) = f - f_;
        dF_.col(place) = F - F_;
    }
    f_ = f;
    F_ = F;
    if (!differs) return;
    sdk::Vector sums(2 * kept);
    sums.head(kept).noalias() = df_.leftCols(kept).transpose() * df_.col(place);
    sums.tail(kept).noalias() = df_.leftCols(kept).transpose() * f_;
    processes_.sum(std::span(sums.data(), static_cast<std::size_t>(2 * kept)));
    gram_.col(place).head(kept) = sums.head(kept);
    gram_.row(place).head(kept) = sums.head(kept).transpose();
    slope_.head(kept) = sums.tail(kept);
    if (!(gram_(place, place) > 0.0)) {  // the same point again
        gram_.row(place).head(kept).setZero();
        gram_.col(place).head(kept).setZero();
    }
    count_ = kept;
    position_ = (place + 1) % memory_;
}

bool AndersonPart::extrapolate(sdk::Vector& next) const {
    // Added to the diagonal of the normalised normal equations: directions below its root are rounding.
    constexpr double regularization = 1e-10;
    if (count_ == 0) return false;
    const sdk::Vector scale = gram_.diagonal().head(count_).unaryExpr(
        [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
    Eigen::MatrixXd matrix = scale.asDiagonal() * gram_.topLeftCorner(count_, count_) * scale.asDiagonal();
    matrix.diagonal().array() += regularization;
    sdk::Vector gamma = scale.cwiseProduct(slope_.head(count_));
    matrix.ldlt().solveInPlace(gamma);
    if (!gamma.allFinite()) return false;
    gamma.array() *= scale.array();
    next = F_;
    next.noalias() -= dF_.leftCols(count_) * gamma;
    return true;
}

}  // namespace delassus::petsc
