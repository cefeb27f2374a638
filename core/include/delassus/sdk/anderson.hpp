// SPDX-License-Identifier: BSD-3-Clause
// Anderson acceleration of a fixed-point iteration y ← F(y).
#pragma once

#include <functional>
#include <span>

#include "delassus/sdk/problem_view.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// With f(y) = F(y) − y, the next point is F(y) − ΔF γ, where γ minimises ‖f − Δf γ‖ over the latest `memory`
/// differences of f and F: for a linear F this is GMRES in another guise (Anderson 1965; Walker and Ni 2011, "type II";
/// Fang and Saad 2009). The bits do not depend on the team.
class Anderson {
public:
    /// memory ≥ 1 differences of vectors of the given size are kept.
    void reset(Eigen::Index size, int memory);

    /// Forgets all differences; the next point pushed starts anew.
    void clear() { count_ = 0, position_ = 0, has_point_ = false; }

    /// values ← their sums over all processes that hold entries of the same vectors.
    using Sum = std::function<void(std::span<double> values)>;

    /// Takes a point's f and F (y itself is F − f). sum: absent, or called once where the point is not the first one;
    /// all processes then do the same.
    void push(const Vector& f, const Vector& F, const Team& team = {}, const Sum& sum = {});

    /// next ← the accelerated point from the latest push; false if there is no difference yet, or none that helps.
    [[nodiscard]] bool extrapolate(Vector& next, const Team& team = {});

private:
    int memory_ = 0, count_ = 0, position_ = 0;
    bool has_point_ = false;
    Eigen::MatrixXd df_, dF_;  // size × memory, a ring
    Eigen::MatrixXd gram_;     // memory × memory: df_ᵀ df_
    Vector f_, F_;             // of the latest point
    Vector slope_;             // df_ᵀ f_
    Eigen::MatrixXd sums_;     // by parts of the rows: df_ᵀ times the latest difference and f_
    Vector totals_;            // of the columns of sums_
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/anderson_bodies.hpp"
#endif
