// SPDX-License-Identifier: BSD-3-Clause
// MuJoCo's constraints as rows of a problem with cones: what a row is, and how forces go back.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "delassus/problem.hpp"

/// One constraint, or one part of a contact, with a cone of its own. A contact of condim 4 and 6 has two or three:
///
///     Contact   f_n, f_1, f_2     √(f_1² + (f_2/s)²) ≤ μ f_n,  s = μ_2/μ_1    3 rows of cone `friction`
///     Spin      τ                 |τ| ≤ μ_τ f_n                               1 row of cone `box`
///     Roll      ·, τ_1, τ_2       √(τ_1² + (τ_2/s)²) ≤ μ_r f_n                3 rows of cone `friction`
///
/// The bounds of the last two hold f_n of the solve before. The first row of Roll is no constraint: it holds that
/// bound, as E λ_0 + b_0 = 0 with exact Coulomb's u_0 = 0, so that rolling friction is as round as sliding friction.
struct ConstraintBlock {
    enum Kind { Equality, Loss, Limit, Frictionless, Contact, Spin, Roll };
    Kind kind = Equality;
    int row = 0;  ///< first of the problem
    int rows = 1;
    int efc = 0;       ///< first of MuJoCo's constraint
    int contact = -1;  ///< index in data->contact
    int normal = -1;   ///< Spin and Roll: row of the normal force
    double mu = 0.0;
    double stretch = 1.0;  ///< s
};

/// The rows as velocities and forces have them in MuJoCo's frame of a contact: normal, two tangents, spin, two of
/// rolling; whatever cone the model has.
///
/// Pyramidal rows are the edges J_n ± μ_i J_i, all with the same R. So J_n is the mean of two edges and J_i their
/// difference over 2 μ_i; the same for the reference acceleration. What rounding leaves in J_i grows with 1/μ_i, but
/// the forces that it is multiplied with shrink with μ_i. mj_jac would not do for the flexes of MuJoCo 3.
class ContactRows {
public:
    std::array<double, 6> reference{}, compliance{};  ///< a_ref, R
    std::array<std::vector<double>, 6> jacobian;      ///< nv each

    template <class RowOf>
    void read(const mjModel* m, const mjData* d, int efc, const mjContact& contact, const RowOf& row_of) {
        const auto nv = static_cast<std::size_t>(m->nv);
        if (d->efc_type[efc] != mjCNSTR_CONTACT_PYRAMIDAL) {
            for (int j = 0; j < contact.dim; ++j) {
                const auto at = static_cast<std::size_t>(j);
                row_of(efc + j, jacobian[at]);
                reference[at] = d->efc_aref[efc + j];
                compliance[at] = d->efc_R[efc + j];
            }
            return;
        }
        // R of an edge is 2 (mu of the regularised cone)² R_n; R_1 = R_n / impratio; R_j μ_j² = R_1 μ_1².
        compliance[0] = d->efc_R[efc] / (2.0 * contact.mu * contact.mu);
        for (int i = 0; i < contact.dim - 1; ++i) {
            const int up = efc + 2 * i, down = up + 1;
            const double mu = contact.friction[i];
            const auto at = static_cast<std::size_t>(i + 1);
            row_of(up, upper_);
            row_of(down, lower_);
            jacobian[at].resize(nv);
            for (std::size_t k = 0; k < nv; ++k) jacobian[at][k] = (upper_[k] - lower_[k]) / (2.0 * mu);
            reference[at] = (d->efc_aref[up] - d->efc_aref[down]) / (2.0 * mu);
            compliance[at] = compliance[0] * (contact.mu * contact.mu) / (mu * mu);
            if (i > 0) continue;
            jacobian[0].resize(nv);
            for (std::size_t k = 0; k < nv; ++k) jacobian[0][k] = 0.5 * (upper_[k] + lower_[k]);
            reference[0] = 0.5 * (d->efc_aref[up] + d->efc_aref[down]);
        }
    }

private:
    std::vector<double> upper_, lower_;
};

/// Writes a contact's force into efc_force: as it is, or as forces of a pyramid's edges,
///
///     f_n = Σ_i (e_i⁺ + e_i⁻),   f_i = μ_i (e_i⁺ − e_i⁻),
///
/// where each direction takes a share of f_n in proportion to |f_i|/μ_i, or an even one where nothing is tangential. A
/// force of a round cone may be outside the pyramid: an edge is then negative, and the sums still hold.
/// mju_encodePyramid would clip such a force.
inline void write_contact_force(const mjData* d, int efc, const mjContact& contact,
                                const std::array<double, 6>& force) {
    double* out = d->efc_force + efc;
    if (d->efc_type[efc] != mjCNSTR_CONTACT_PYRAMIDAL) {
        std::copy_n(force.begin(), contact.dim, out);
        return;
    }
    const int directions = contact.dim - 1;
    std::array<double, 5> along{};
    double sum = 0.0;
    for (int i = 0; i < directions; ++i) {
        along[static_cast<std::size_t>(i)] = force[static_cast<std::size_t>(i) + 1] / contact.friction[i];
        sum += std::abs(along[static_cast<std::size_t>(i)]);
    }
    for (int i = 0; i < directions; ++i) {
        const double difference = along[static_cast<std::size_t>(i)];
        const double share = sum > 0.0 ? force[0] * std::abs(difference) / sum : force[0] / directions;
        out[2 * i] = 0.5 * (share + difference);
        out[2 * i + 1] = 0.5 * (share - difference);
    }
}
