// SPDX-License-Identifier: BSD-3-Clause
// The sweeps of projected Gauss–Seidel and Jacobi: each visits the blocks and replaces λ_c by the answer of a local
// problem with the other reactions held fixed. And a look, which visits the blocks, changes nothing and measures how
// far off λ is. No memory is allocated in either.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "contact_problem.hpp"
#include "delassus/sdk/block_rows.hpp"
#include "delassus/sdk/cones.hpp"
#include "sweep_order.hpp"

namespace delassus::pgs {

enum class Local {
    Diagonal,  ///< friction: λ_c ← P(λ_c − ω ρ_c u_c) with one scalar ρ_c = 1/λ_max(M_c)
    Exact      ///< friction: λ_c solves its one-contact problem, the others being fixed
};
enum class Direction { Forward, Backward };

/// What the local problem of a block needs besides its rows. M_c is the diagonal block of N, or the larger block of
/// the Jacobi variant.
struct LocalBlock {
    enum class Kind : std::int32_t {
        Interval,  ///< one row with lo ≤ λ ≤ hi: free, nonnegative, box
        Free,      ///< two to six free rows, solved together
        Friction   ///< normal and one or two tangents
    };
    Kind kind = Kind::Interval;
    std::int32_t matrix = 0;  ///< index of the ContactMatrix, or offset of the inverse of M_c
    double step = 0.0;        ///< ρ_c; for an interval 1/M_cc
    double mu = 0.0;
    double lo = -std::numeric_limits<double>::infinity(), hi = std::numeric_limits<double>::infinity();
};

/// The local problems of all blocks.
struct LocalProblems {
    std::vector<LocalBlock> block;
    std::vector<ContactMatrix> contact;  ///< one a friction block
    std::vector<double> inverse;         ///< pseudo-inverses of the M_c of free blocks, row-major
    mutable std::vector<double> kappa;   ///< sliding multipliers of the last visit, guesses for the next; one a contact
};

/// The settings of a sweep.
struct SweepRule {
    Local local = Local::Exact;
    Direction direction = Direction::Forward;
    bool coulomb = false;
    double omega = 1.0;
};

/// λ_c ← P(λ_c − ω ρ u), with the De Saxcé term in u_n under the Coulomb law.
template <int Rows>
inline void diagonal_contact_step(const LocalBlock& local, const SweepRule& rule, const double* u, double* lambda) {
    const double step = rule.omega * local.step;
    const double tangent = Rows == 3 ? std::sqrt(u[1] * u[1] + u[2] * u[2]) : std::abs(u[1]);
    lambda[0] -= step * (u[0] + (rule.coulomb ? local.mu * tangent : 0.0));
    for (int i = 1; i < Rows; ++i) lambda[i] -= step * u[i];
    sdk::FrictionCone::project_with_slope(local.mu, Rows, lambda);
}

/// λ_c ← P(λ_c + ω (λ_c* − λ_c)), where λ_c* solves M_c λ* + q = u, q = u_c − M_c λ_c, in its cone.
template <int Rows>
[[gnu::noinline]] void exact_contact_step(const LocalProblems& problems, const LocalBlock& local, const SweepRule& rule,
                                          const double* u, double* lambda) {
    const ContactMatrix& M = problems.contact[static_cast<std::size_t>(local.matrix)];
    double q[3] = {}, solution[3] = {lambda[0], 0.0, 0.0};
    if constexpr (Rows == 3) {
        q[0] = u[0] - M.nn * lambda[0] - M.nt[0] * lambda[1] - M.nt[1] * lambda[2];
        q[1] = u[1] - M.nt[0] * lambda[0] - M.tt[0] * lambda[1] - M.tt[1] * lambda[2];
        q[2] = u[2] - M.nt[1] * lambda[0] - M.tt[1] * lambda[1] - M.tt[2] * lambda[2];
    } else {
        q[0] = u[0] - M.nn * lambda[0] - M.nt[0] * lambda[1];
        q[1] = u[1] - M.nt[0] * lambda[0] - M.tt[0] * lambda[1];
    }
    double& kappa = problems.kappa[static_cast<std::size_t>(local.matrix)];
    if (rule.coulomb) {
        solve_coulomb(M, local.mu, q, kappa, solution);
    } else {
        solve_associated(M, local.mu, q, kappa, solution);
    }
    for (int i = 0; i < Rows; ++i) lambda[i] += rule.omega * (solution[i] - lambda[i]);
    if (rule.omega != 1.0) sdk::FrictionCone::project_with_slope(local.mu, Rows, lambda);
}

/// The new λ of a block from its velocities u.
template <int Rows>
inline void local_step(const LocalProblems& problems, const LocalBlock& local, const SweepRule& rule, const double* u,
                       double* lambda) {
    if constexpr (Rows == 2 || Rows == 3) {
        if (local.kind == LocalBlock::Kind::Friction) {
            if (rule.local == Local::Diagonal) {
                diagonal_contact_step<Rows>(local, rule, u, lambda);
            } else {
                exact_contact_step<Rows>(problems, local, rule, u, lambda);
            }
            return;
        }
    }
    if constexpr (Rows == 1) {
        if (local.step > 0.0) {
            lambda[0] = std::min(local.hi, std::max(local.lo, lambda[0] - rule.omega * local.step * u[0]));
        } else if (u[0] > 0.0 ? std::isfinite(local.lo) : std::isfinite(local.hi) && u[0] < 0.0) {
            lambda[0] = u[0] > 0.0 ? local.lo : local.hi;  // no reaction moves this row
        }
    } else {
        const double* inverse = problems.inverse.data() + local.matrix;
        for (int i = 0; i < Rows; ++i) {
            double change = 0.0;
            for (int j = 0; j < Rows; ++j) change += inverse[i * Rows + j] * u[j];
            lambda[i] -= rule.omega * change;
        }
    }
}

/// One block's ‖s⁻¹(λ_c − P(λ_c − s²u_c))‖², as sdk::NaturalResidual has it; square: s². sliding: De Saxcé's term, or
/// 0.
template <int Rows>
inline double squared_residual(const LocalBlock& local, double square, double sliding, const double* u,
                               const double* lambda) {
    double sum = 0.0;
    const bool bounded = std::isfinite(local.lo) || std::isfinite(local.hi);
    if (local.kind == LocalBlock::Kind::Free || (local.kind == LocalBlock::Kind::Interval && !bounded)) {
        for (int i = 0; i < Rows; ++i) sum += u[i] * u[i];
        return square * sum;
    }
    double trial[Rows];
    for (int i = 0; i < Rows; ++i) trial[i] = lambda[i] - square * u[i];
    trial[0] -= square * sliding;
    if constexpr (Rows == 3) {
        sdk::FrictionCone::project_spatial(local.mu, trial);
    } else if constexpr (Rows == 2) {
        sdk::FrictionCone::project_with_slope(local.mu, Rows, trial);
    } else {
        trial[0] = std::min(local.hi, std::max(local.lo, trial[0]));
    }
    for (int i = 0; i < Rows; ++i) sum += (lambda[i] - trial[i]) * (lambda[i] - trial[i]);
    return sum / square;
}

/// Adds a block's squared_residual, from its velocities u before λ_c moves, to what a sweep or a look finds.
struct Record {
    const double* squares;  ///< s² by blocks
    double* sliding;        ///< by blocks: De Saxcé's terms, under the Coulomb law
    double sum = 0.0;

    template <int Rows>
    void add(std::size_t k, const LocalBlock& local, bool coulomb, const double* u, const double* lambda) {
        if (coulomb && local.kind == LocalBlock::Kind::Friction) {
            double tangent = 0.0;
            for (int i = 1; i < Rows; ++i) tangent += u[i] * u[i];
            sliding[k] = local.mu * std::sqrt(tangent);
        }
        sum += squared_residual<Rows>(local, squares[k], sliding[k], u, lambda);
    }
};

/// Visits the blocks first … last − 1. lambda and offset: by the rows of `rows`. record: null, or what it finds.
///   OnVelocities: z and next have the entries of v̂; Gauss–Seidel passes one array for both, Jacobi reads z and adds to
///   next (a copy of z on entry). Otherwise z is λ itself and next where new values go; lambda is not used.
template <bool OnVelocities, bool Records, int Width>
void visit_blocks(const sdk::BlockRows& rows, std::size_t first, std::size_t last, const LocalProblems& problems,
                  const SweepRule& rule, const double* offset, const double* z, double* next, double* lambda,
                  Record* record) {
    constexpr std::size_t ahead = 256, line = 8;  // doubles: coefficients are fetched this far ahead
    const bool forward = rule.direction == Direction::Forward;
    for (std::size_t k = first; k < last; ++k) {
        const std::size_t index = forward ? k : last - 1 - (k - first);
        const auto& block = rows.groups()[index];
        const LocalBlock& local = problems.block[index];
        const double* value = rows.values(block);
        const std::int32_t* start = rows.starts(block);
        sdk::with_rows(block.rows, [&]<int Rows>() {
            for (std::size_t i = 0; i < 2 * Rows * Width; i += line)
                __builtin_prefetch(forward ? value + ahead + i : value - ahead + i);
            double u[Rows], fresh[Rows], delta[Rows];
            sdk::multiply_group<Rows, Width>(value, start, block.chunks, z, offset + block.first, u);
            const double* old = (OnVelocities ? lambda : z) + block.first;
            for (int i = 0; i < Rows; ++i) fresh[i] = old[i];
            if constexpr (Records) record->add<Rows>(index, local, rule.coulomb, u, old);
            local_step<Rows>(problems, local, rule, u, fresh);
            if constexpr (OnVelocities) {
                for (int i = 0; i < Rows; ++i) {
                    delta[i] = fresh[i] - lambda[block.first + i];
                    lambda[block.first + i] = fresh[i];
                }
                sdk::transpose_multiply_group<Rows, Width>(value, start, block.chunks, delta, next);
            } else {
                for (int i = 0; i < Rows; ++i) next[block.first + i] = fresh[i];
            }
        });
    }
}

/// visit_blocks with the width chosen at run time.
template <bool OnVelocities>
void visit(const sdk::BlockRows& rows, std::size_t first, std::size_t last, const LocalProblems& problems,
           const SweepRule& rule, const double* offset, const double* z, double* next, double* lambda, Record* record) {
    sdk::with_width(rows.width(), [&]<int Width>() {
        if (record)
            visit_blocks<OnVelocities, true, Width>(rows, first, last, problems, rule, offset, z, next, lambda, record);
        else
            visit_blocks<OnVelocities, false, Width>(rows, first, last, problems, rule, offset, z, next, lambda,
                                                     record);
    });
}

/// Records the blocks first … last − 1 and changes nothing. lambda: in the order of the sweep.
inline void look_at(const sdk::BlockRows& rows, std::size_t first, std::size_t last, const LocalProblems& problems,
                    bool coulomb, const double* offset, const double* z, const double* lambda, Record& record) {
    sdk::with_width(rows.width(), [&]<int Width>() {
        for (std::size_t k = first; k < last; ++k) {
            const auto& block = rows.groups()[k];
            sdk::with_rows(block.rows, [&]<int Rows>() {
                double u[Rows];
                sdk::multiply_group<Rows, Width>(rows.values(block), rows.starts(block), block.chunks, z,
                                                 offset + block.first, u);
                record.add<Rows>(k, problems.block[k], coulomb, u, lambda + block.first);
            });
        }
    });
}

}  // namespace delassus::pgs
