// SPDX-License-Identifier: BSD-3-Clause
// sdk::Anderson for vectors of which each process has its own rows: one reduction a point.
#pragma once

#include "petsc/processes.hpp"

namespace delassus::petsc {

class AndersonPart {
public:
    /// size: own rows. memory ≥ 1 differences are kept.
    void reset(const Processes& processes, Eigen::Index size, int memory);
    /// Forgets all differences; the next point pushed starts anew.
    void clear() { count_ = 0, position_ = 0, has_point_ = false; }
    /// Takes a point's f = F(y) − y and F. Collective.
    void push(const sdk::Vector& f, const sdk::Vector& F);
    /// next ← F − ΔF γ with the γ that minimises ‖f − Δf γ‖; false if there is no difference yet, or none that helps.
    [[nodiscard]] bool extrapolate(sdk::Vector& next) const;

private:
    Processes processes_;
    int memory_ = 0, count_ = 0, position_ = 0;
    bool has_point_ = false;
    Eigen::MatrixXd df_, dF_;  // own rows × memory, a ring
    Eigen::MatrixXd gram_;     // memory × memory: df_ᵀ df_
    sdk::Vector f_, F_;        // of the latest point
    sdk::Vector slope_;        // df_ᵀ f_
};

}  // namespace delassus::petsc
