// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/face_step.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/face_step.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void FaceStep::reset(const ScaledProblem& scaled) {
    const Eigen::Index m = scaled.r().size();
    for (Vector* v : {&F_, &delta_, &residual_, &direction_, &product_, &trial_}) v->setZero(m);
    free_row_.assign(static_cast<std::size_t>(m), 0);
    surfaces_.clear();
    surfaces_.reserve(scaled.blocks().size());
    pieces_.assign(scaled.blocks().size(), Piece::Apex);
    radius_ = std::numeric_limits<double>::infinity();
}

DELASSUS_SDK_FUNCTION FaceStep::Result FaceStep::step(const ScaledProblem& scaled, Vector& lambda, Vector& velocity,
                                                      std::int64_t products, double relative, const Count& count) {
    identify(scaled, lambda, velocity);
    residual_ = -F_;
    tangent(scaled, residual_, trial_);
    delta_ = residual_ - trial_;  // δ_⊥
    residual_ = trial_;
    add_curvature(trial_, residual_);
    if (delta_.squaredNorm() > 0.0) {
        scaled.multiply(delta_, product_);
        if (count()) return Result::Stopped;
        tangent(scaled, product_, trial_);
        residual_ -= trial_;
    }
    if (!solve(scaled, products, relative, count)) return Result::Stopped;

    const double size = delta_.norm();
    if (!(size > 0.0)) return Result::Failed;
    trial_ = lambda + delta_;
    scaled.project(trial_);
    trial_ -= lambda;
    const double slope = velocity.dot(trial_);
    if (!(slope < 0.0)) {
        radius_ = 0.25 * size;
        return Result::Failed;
    }
    scaled.multiply(trial_, product_);
    const double curvature = trial_.dot(product_);
    const double length = curvature > 0.0 ? std::min(1.0, -slope / curvature) : 1.0;
    lambda += length * trial_;
    velocity += length * product_;
    if (length > 0.999) {
        radius_ *= 2.0;
    } else if (length < 0.5) {
        radius_ = 0.25 * size;
    }
    return Result::Improved;
}

DELASSUS_SDK_FUNCTION void FaceStep::identify(const ScaledProblem& scaled, const Vector& lambda,
                                              const Vector& velocity) {
    surfaces_.clear();
    for (std::size_t k = 0; k < scaled.blocks().size(); ++k)
        pieces_[k] = identify_block(scaled.blocks()[k], lambda, velocity);
    for (const ScaledProblem::Interval& run : scaled.intervals()) {
        for (std::int32_t i = run.first; i < run.first + run.rows; ++i) {
            const double z = lambda[i] - velocity[i];
            const double p = std::min(scaled.upper()[i], std::max(scaled.lower()[i], z));
            F_[i] = lambda[i] - p;
            free_row_[static_cast<std::size_t>(i)] = z == p;
        }
    }
}

DELASSUS_SDK_FUNCTION void FaceStep::tangent(const ScaledProblem& scaled, const Vector& v, Vector& result) const {
    auto surface = surfaces_.begin();
    for (std::size_t k = 0; k < scaled.blocks().size(); ++k) {
        const ScaledProblem::Block& block = scaled.blocks()[k];
        const double* in = v.data() + block.first;
        double* out = result.data() + block.first;
        if (pieces_[k] == Piece::Inside) {
            std::copy_n(in, block.rows, out);
        } else if (pieces_[k] == Piece::Apex) {
            std::fill_n(out, block.rows, 0.0);
        } else {
            const double *ray = surface->ray.data(), *round = surface->round.data();
            double along = 0.0, around = 0.0;
            for (std::int32_t i = 0; i < block.rows; ++i) {
                along += ray[i] * in[i];
                around += round[i] * in[i];
            }
            for (std::int32_t i = 0; i < block.rows; ++i) out[i] = along * ray[i] + around * round[i];
            ++surface;
        }
    }
    for (const ScaledProblem::Interval& run : scaled.intervals())
        for (std::int32_t i = run.first; i < run.first + run.rows; ++i)
            result[i] = free_row_[static_cast<std::size_t>(i)] ? v[i] : 0.0;
}

// The piece of a friction block; also its rows of F, and its entry in surfaces_ if it has one.
DELASSUS_SDK_FUNCTION FaceStep::Piece FaceStep::identify_block(const ScaledProblem::Block& block, const Vector& lambda,
                                                               const Vector& velocity) {
    const double* l = lambda.data() + block.first;
    const double* u = velocity.data() + block.first;
    const auto rows = static_cast<std::size_t>(block.rows);
    std::array<double, 3> z{};
    for (std::size_t i = 0; i < rows; ++i) z[i] = l[i] - u[i];
    std::array<double, 3> p = z;
    sdk::project(block.cone, p.data());
    for (std::size_t i = 0; i < rows; ++i) F_[block.first + static_cast<Eigen::Index>(i)] = l[i] - p[i];
    if (p == z) return Piece::Inside;
    if (!(p[0] > 0.0)) return Piece::Apex;
    Surface surface{block.first, block.rows, p, {}, 0.0};
    const double norm = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (double& v : surface.ray) v /= norm;
    const double radius = std::sqrt(p[1] * p[1] + p[2] * p[2]);
    if (rows == 3 && radius > 1e-12 * norm) {
        surface.round = {0.0, -p[2] / radius, p[1] / radius};
        surface.curvature = std::sqrt(z[1] * z[1] + z[2] * z[2]) / radius - 1.0;
    }
    surfaces_.push_back(surface);
    return Piece::Surface;
}

// result += K v
DELASSUS_SDK_FUNCTION void FaceStep::add_curvature(const Vector& v, Vector& result) const {
    for (const Surface& surface : surfaces_) {
        const double* round = surface.round.data();
        double around = 0.0;
        for (std::int32_t i = 0; i < surface.rows; ++i) around += round[i] * v[surface.first + i];
        around *= surface.curvature;
        for (std::int32_t i = 0; i < surface.rows; ++i) result[surface.first + i] += around * round[i];
    }
}

// Conjugate gradients on (T N T + K) δ_T = residual_, added to delta_. False: stopped.
DELASSUS_SDK_FUNCTION bool FaceStep::solve(const ScaledProblem& scaled, std::int64_t products, double relative,
                                           const Count& count) {
    double square = residual_.squaredNorm();
    const double goal = relative * relative * square;
    direction_ = residual_;
    for (std::int64_t k = 0; k < products && square > goal; ++k) {
        scaled.multiply(direction_, trial_);
        if (count()) return false;
        tangent(scaled, trial_, product_);
        add_curvature(direction_, product_);
        const double curvature = direction_.dot(product_);
        if (!(curvature > 1e-14 * direction_.squaredNorm())) break;  // a direction that N does not see
        const double length = square / curvature;
        delta_ += length * direction_;
        if (const double size = delta_.norm(); size > radius_) {
            delta_ *= radius_ / size;
            break;
        }
        residual_ -= length * product_;
        const double next = residual_.squaredNorm();
        direction_ = residual_ + (next / square) * direction_;
        square = next;
    }
    return true;
}

}  // namespace delassus::sdk
