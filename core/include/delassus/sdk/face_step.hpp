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

#include <array>
#include <cstdint>
#include <functional>
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

    using Count = std::function<bool()>;

    /// Sizes the work space and forgets the trust region.
    void reset(const ScaledProblem& scaled);

    /// One step from λ̂ with its û (both m), which are moved on success. Takes at most `products` + 2 products with N̂;
    /// each but the last calls count(), which returns true to stop. relative: the residual of the linear system, over
    /// that at the start, at which it counts as solved.
    Result step(const ScaledProblem& scaled, Vector& lambda, Vector& velocity, std::int64_t products, double relative,
                const Count& count);

    /// Finds the face at λ̂ − û; both m. Needed before tangent().
    void identify(const ScaledProblem& scaled, const Vector& lambda, const Vector& velocity);

    /// result ← the orthogonal projection of v onto T; both m, different vectors.
    void tangent(const ScaledProblem& scaled, const Vector& v, Vector& result) const;

private:
    enum class Piece : std::uint8_t { Inside, Apex, Surface };
    struct Surface {
        std::int32_t first, rows;
        std::array<double, 3> ray, round;  // orthonormal; round is zero in the plane and where the cone is a ray
        double curvature;
    };

    Piece identify_block(const ScaledProblem::Block& block, const Vector& lambda, const Vector& velocity);

    void add_curvature(const Vector& v, Vector& result) const;

    bool solve(const ScaledProblem& scaled, std::int64_t products, double relative, const Count& count);

    Vector F_, delta_, residual_, direction_, product_, trial_;
    std::vector<Piece> pieces_;
    std::vector<Surface> surfaces_;
    std::vector<std::uint8_t> free_row_;
    double radius_ = std::numeric_limits<double>::infinity();  // of the trust region
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/face_step_bodies.hpp"
#endif
