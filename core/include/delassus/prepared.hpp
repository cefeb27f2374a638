// SPDX-License-Identifier: BSD-3-Clause
// A problem as solvers, the stages of the core and its judge see it, whether one process has it whole (PreparedProblem)
// or each of several has a part (PreparedPart).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/plugin.h"
#include "delassus/problem.hpp"

namespace delassus {

struct Errors;

/// The structure of H, detected from its values, never declared. A problem may at most count as a more general one.
enum class Structure {
    Reduced,       ///< n = 0
    Diagonal,      ///< positive diagonal
    Blocks,        ///< definite diagonal blocks of at most 16 rows (connected components of the pattern)
    Definite,      ///< sparse symmetric positive definite
    Semidefinite,  ///< symmetric, singular to working precision, no negative curvature
    Indefinite,    ///< symmetric with negative curvature
    Unsymmetric
};

/// What rounding alone may contribute to Errors::balance at this (x, λ): ε ‖|H||x| + |D|ᵀ|λ| + |a|‖ over the divisor of
/// the balance, with the unit roundoff ε. With a stiff H, ‖|H||x|‖ is far above ‖Hx‖, and x rounded to double cannot
/// balance better. `reactions` is the part of |D|ᵀ|λ|: what reactions that cancel one another leave.
struct RoundingOfBalance {
    double all = 0.0, reactions = 0.0;
};

/// Vectors are the entries that this process owns: all n and m of them where the problem is whole. Where it is in
/// parts, every member that measures or computes is collective, and its result is the same on all processes, but for
/// own entries of vectors.
class DELASSUS_API Prepared {
public:
    virtual ~Prepared();

    /// The processes that have the problem among them: one, where it is whole.
    [[nodiscard]] virtual const Communicator& communicator() const = 0;
    /// What crosses the border, valid as long as this object: one of the two, the other is null.
    [[nodiscard]] virtual const delassus_problem* whole() const = 0;
    [[nodiscard]] virtual const delassus_local_problem* part() const = 0;

    [[nodiscard]] virtual const std::string& name() const = 0;
    [[nodiscard]] virtual Law law() const = 0;
    [[nodiscard]] virtual std::span<const double> a() const = 0;  ///< n
    [[nodiscard]] virtual std::span<const double> b() const = 0;  ///< m
    [[nodiscard]] virtual std::span<const Cone> cones() const = 0;
    /// H_ii of an own column, numbered from 0.
    [[nodiscard]] virtual double diagonal(std::size_t i) const = 0;
    /// Rows of D, of all processes together.
    [[nodiscard]] virtual std::int64_t all_rows() const = 0;

    [[nodiscard]] virtual Structure structure() const = 0;
    /// DELASSUS_CAN_* bits that a solver must have for this problem, whatever the settings of the solve.
    [[nodiscard]] virtual std::uint64_t needs() const = 0;
    /// The missing needs as a person would say them, e.g. "1421 friction cones, the exact Coulomb law".
    [[nodiscard]] virtual std::string describe(std::uint64_t missing) const = 0;

    /// Every measure of docs/errors.md. x: n, lambda: m, finite. Throws InputError on wrong sizes.
    [[nodiscard]] virtual Errors measure(std::span<const double> x, std::span<const double> lambda) const = 0;
    /// The natural error alone. x may be null (on all processes): H⁻¹(a + Dᵀλ) is used then, and the answer is NaN
    /// where H has no inverse.
    [[nodiscard]] virtual double natural(const double* x, const double* lambda) const = 0;
    /// ‖S r‖, which errors are relative to; NaN where the numbers of the problem allow no measure.
    [[nodiscard]] virtual double reference() const = 0;
    /// ‖S D v‖ for velocities v (n).
    [[nodiscard]] virtual double norm_in_rows(std::span<const double> v) const = 0;
    /// x ← H⁻¹(a + Dᵀλ), n, and the same without reactions. Throw an Error where H is not definite.
    virtual void velocity_of(std::span<const double> lambda, std::vector<double>& x) const = 0;
    virtual void free_velocities(std::vector<double>& x) const = 0;
    /// Zero where there is no H, and where nothing moves.
    [[nodiscard]] virtual RoundingOfBalance rounding_of_balance(const Solution& solution) const = 0;
    /// A lower bound of the size of every solution that this answer proves (problem/infeasibility.hpp).
    [[nodiscard]] virtual double proven_size(const Solution& answer) const = 0;

    /// The same problem under another law; null where that would need a second copy of what processes share.
    [[nodiscard]] virtual std::unique_ptr<Prepared> under(Law law) const = 0;

    /// Whether H is positive definite, or there is none: then velocities follow from reactions.
    [[nodiscard]] bool is_definite() const;
};

}  // namespace delassus
