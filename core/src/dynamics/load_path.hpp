// SPDX-License-Identifier: BSD-3-Clause
// Points on a path of equilibria under growing and falling loads (internal): the equations and Newton's method.
#pragma once

#include <functional>
#include <memory>

#include "delassus/export.hpp"
#include "dynamics/linear_problem.hpp"

namespace delassus {

/// A point on a path, with the unit tangent of the path there.
struct LoadPathPoint {
    State state;                ///< v = 0
    Vector lambda;              ///< reactions, m
    double load = 0.0;          ///< the load factor μ
    Vector direction;           ///< dq/ds, n
    Vector lambda_rate;         ///< dλ/ds, m
    double load_rate = 0.0;     ///< dμ/ds
    double arc = 0.0;           ///< s from the start, by chords; kept by PathFollower
    double step = 0.0;          ///< the distance from the point before, straight
    double turn = 0.0;          ///< rad, between its tangent and that of the point before
    int newton_iterations = 0;  ///< that led to it
    double residual = 0.0;      ///< largest entry of f + C_qᵀ λ, N or Nm
    double reaction = 0.0;      ///< largest entry of C_qᵀ λ
    std::int32_t negative = 0;  ///< negative eigenvalues of the tangent, −1: not found
};

struct LoadPathSettings {
    double tolerance = 1e-10;  ///< of Newton's method, relative to the way of a step
    int most_iterations = 12;
};

/// The equilibria f(q; μ) + C_qᵀ λ = 0, C(q) = 0 of a system whose f is affine in a factor μ.
class DELASSUS_API LoadPath {
public:
    /// system and set_load, which sets μ, outlive it. t and v of all states are those of the start.
    LoadPath(DynamicalSystem& system, std::function<void(double)> set_load, LoadPathSettings settings);
    ~LoadPath();
    LoadPath(const LoadPath&) = delete;
    LoadPath& operator=(const LoadPath&) = delete;

    /// start: state, lambda and load of what is nearly an equilibrium are given, the rest is found; the tangent is that
    /// along which μ grows. The unit of length of the path is set here. False where the tangent is not determined: the
    /// loads move something that nothing holds there.
    bool begin(LoadPathPoint& start);

    /// The point on the plane normal to from's tangent that is `length` ≠ 0 away along it, and the distance in to.step.
    /// False if Newton's method does not lead there, or leads too far from the plane's foot; to is then anything.
    bool find(const LoadPathPoint& from, double length, LoadPathPoint& to);

    /// At the point that was found last: the motion (n) whose ω² is nearest to that at which LoadPathPoint::negative
    /// counts, and ω² = φᵀ K φ/φᵀ M φ of a motion.
    [[nodiscard]] Vector critical_motion() const;
    [[nodiscard]] double square_of(const Vector& motion) const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
