// SPDX-License-Identifier: BSD-3-Clause
// A Newton step on the face that a projected gradient method has identified, by conjugate gradients.
//
// A solution is a zero of F(λ) = λ − Π(z), z = λ − û(λ) (all in scaled variables, hats left out). Where z lies inside
// one piece of the projection, Π is smooth with a symmetric Jacobian J, and Newton's equation (I − J + J N) δ = −F
// splits, with an orthonormal basis of the range of J (the tangent space T of the face at Π(z)) in which J = diag(j):
//     normal to T:   δ_⊥ = −F_⊥
//     in T:          (T N T + K) δ_T = −(I + K) F_T − T N δ_⊥,       K = diag(1/j − 1) ≥ 0.
// The pieces:
//     interval row   between its bounds: T = R, K = 0; at a bound: T = {0}
//     friction       z inside: T = all, K = 0;   z in the polar cone: T = {0};
//                    else the cone's surface: T is spanned by the ray e through Π(z), K = 0, and by the circumferential
//                    direction c, K = ‖z_t‖/‖Π(z)_t‖ − 1: how far z lies outside, over the radius of curvature.
// The matrix is symmetric positive semidefinite and the system is solved by conjugate gradients, truncated where the
// residual is small or δ leaves a trust region: N is singular as a rule (redundant contacts), far along its null space
// other pieces apply. The step goes to Π(λ + δ), and along the segment to there to the minimum of f, so f never grows:
// a feasible, monotone acceleration (Moré and Toraldo 1991 for boxes; Dostál and Kučera 2010 for balls).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::sdk {

/// A Newton step on the face of an iterate.
class FaceStep {
public:
    enum class Result {
        Improved,  ///< λ̂ and û moved
        Failed,    ///< nothing changed
        Stopped    ///< count() asked to stop; nothing changed
    };

    /// Sizes the work space and forgets the trust region.
    void reset(const ScaledProblem& scaled) {
        const Eigen::Index m = scaled.r().size();
        for (Vector* v : {&F_, &delta_, &residual_, &direction_, &product_, &trial_}) v->setZero(m);
        free_row_.assign(static_cast<std::size_t>(m), 0);
        surfaces_.clear();
        surfaces_.reserve(scaled.blocks().size());
        pieces_.assign(scaled.blocks().size(), Piece::Apex);
        radius_ = std::numeric_limits<double>::infinity();
    }

    /// One step from λ̂ with its û (both m), which are moved on success. Takes at most `products` + 2 products with N̂;
    /// each but the last calls count(), which returns true to stop. relative: the residual of the linear system, over
    /// that at the start, at which it counts as solved.
    template <class Count>
    Result step(const ScaledProblem& scaled, Vector& lambda, Vector& velocity, std::int64_t products, double relative,
                Count&& count) {
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

    /// Finds the face at λ̂ − û; both m. Needed before tangent().
    void identify(const ScaledProblem& scaled, const Vector& lambda, const Vector& velocity) {
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

    /// result ← the orthogonal projection of v onto T; both m, different vectors.
    void tangent(const ScaledProblem& scaled, const Vector& v, Vector& result) const {
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
                double along = 0.0, around = 0.0;
                for (std::int32_t i = 0; i < block.rows; ++i) {
                    along += surface->ray[i] * in[i];
                    around += surface->round[i] * in[i];
                }
                for (std::int32_t i = 0; i < block.rows; ++i)
                    out[i] = along * surface->ray[i] + around * surface->round[i];
                ++surface;
            }
        }
        for (const ScaledProblem::Interval& run : scaled.intervals())
            for (std::int32_t i = run.first; i < run.first + run.rows; ++i)
                result[i] = free_row_[static_cast<std::size_t>(i)] ? v[i] : 0.0;
    }

private:
    enum class Piece : std::uint8_t { Inside, Apex, Surface };
    struct Surface {
        std::int32_t first, rows;
        std::array<double, 3> ray, round;  // orthonormal; round is zero in the plane and where the cone is a ray
        double curvature;
    };

    // The piece of a friction block; also its rows of F, and its entry in surfaces_ if it has one.
    Piece identify_block(const ScaledProblem::Block& block, const Vector& lambda, const Vector& velocity) {
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
    void add_curvature(const Vector& v, Vector& result) const {
        for (const Surface& surface : surfaces_) {
            double around = 0.0;
            for (std::int32_t i = 0; i < surface.rows; ++i) around += surface.round[i] * v[surface.first + i];
            around *= surface.curvature;
            for (std::int32_t i = 0; i < surface.rows; ++i) result[surface.first + i] += around * surface.round[i];
        }
    }

    // Conjugate gradients on (T N T + K) δ_T = residual_, added to delta_. False: stopped.
    template <class Count>
    bool solve(const ScaledProblem& scaled, std::int64_t products, double relative, Count&& count) {
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

    Vector F_, delta_, residual_, direction_, product_, trial_;
    std::vector<Piece> pieces_;
    std::vector<Surface> surfaces_;
    std::vector<std::uint8_t> free_row_;
    double radius_ = std::numeric_limits<double>::infinity();  // of the trust region
};

}  // namespace delassus::sdk
