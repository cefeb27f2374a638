// SPDX-License-Identifier: BSD-3-Clause
// Iterative refinement of the linear system of an interior point step, with the residual of the system as it stands.
#pragma once

#include "complementarity.hpp"

namespace delassus::ipm {

/// System: a KktSystem, or what has its operations for the rows of one process.
template <class System>
class Refinement {
public:
    /// Where a solve starts from: zero, or the δx and δz that are there.
    enum class Start { Zero, Given };

    /// From f (n) and g (m) δx and δz (rows of g and δz in the bases of cones), to a relative residual of `enough` if
    /// it can be had.
    void solve(System& system, const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough,
               Start start, sdk::Vector& dx, sdk::Vector& dz) {
        const double size = system.weighted_norm(f, g);
        if (start == Start::Zero || !(size > 0.0)) {
            dx.setZero(f.size());
            dz.setZero(g.size());
        }
        if (!(size > 0.0)) return;
        f_rest_ = f;
        g_rest_ = g;
        double rest = size;
        if (start == Start::Given) {
            system.find_rest(cones, f, g, dx, dz, f_rest_, g_rest_);
            rest = system.weighted_norm(f_rest_, g_rest_);
            if (rest <= enough * size) return;
            if (!(rest < size)) return solve(system, cones, f, g, enough, Start::Zero, dx, dz);
        }
        for (int refinement = 0;; ++refinement) {
            system.solve_once(cones, f_rest_, g_rest_, 0.3 * enough * size, correction_x_, correction_z_);
            dx += correction_x_;
            dz += correction_z_;
            system.find_rest(cones, f, g, dx, dz, f_rest_, g_rest_);
            const double next = system.weighted_norm(f_rest_, g_rest_);
            if (!(next < rest)) {
                if (refinement == 0 && start == Start::Zero) return;
                dx -= correction_x_;
                dz -= correction_z_;
                return;
            }
            const bool slow = next > 0.5 * rest;
            rest = next;
            if (rest <= enough * size || slow || refinement >= system.refinements()) return;
        }
    }

private:
    sdk::Vector f_rest_, g_rest_, correction_x_, correction_z_;
};

}  // namespace delassus::ipm
