// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/anderson.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>

#include "delassus/sdk/anderson.hpp"
#include "delassus/sdk/compiled_once.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void Anderson::reset(Eigen::Index size, int memory) {
    memory_ = memory;
    df_.resize(size, memory);
    dF_.resize(size, memory);
    gram_.resize(memory, memory);
    f_.resize(size);
    F_.resize(size);
    clear();
}

DELASSUS_SDK_FUNCTION void Anderson::push(const Vector& f, const Vector& F) {
    if (has_point_) {
        const double length = (f - f_).norm();
        if (length > 0.0) {
            df_.col(position_) = (f - f_) / length;
            dF_.col(position_) = (F - F_) / length;
            count_ = std::min(count_ + 1, memory_);
            gram_.row(position_).head(count_) = df_.col(position_).transpose() * df_.leftCols(count_);
            gram_.col(position_).head(count_) = gram_.row(position_).head(count_).transpose();
            position_ = (position_ + 1) % memory_;
        }
    }
    f_ = f;
    F_ = F;
    has_point_ = true;
}

DELASSUS_SDK_FUNCTION bool Anderson::extrapolate(Vector& next) {
    // Added to the diagonal of the normalised normal equations: directions below its root are rounding.
    constexpr double regularization = 1e-10;
    if (count_ == 0) return false;
    matrix_ = gram_.topLeftCorner(count_, count_);
    matrix_.diagonal().array() += regularization;
    factor_.compute(matrix_);
    gamma_.noalias() = df_.leftCols(count_).transpose() * f_;
    factor_.solveInPlace(gamma_);
    if (!gamma_.allFinite()) return false;
    next = F_;
    next.noalias() -= dF_.leftCols(count_) * gamma_;
    return true;
}

}  // namespace delassus::sdk
