// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus for the boxed linear complementarity problem that engines pose (DART, Bullet, ODE):
//
//     A x = b + w,   lo ≤ x ≤ hi,   w_i ≥ 0 where x_i = lo_i,   w_i ≤ 0 where x_i = hi_i,   else w_i = 0
//
// A row of friction names the row of its normal force. The engine's own solvers bound each such row by itself,
// |x_i| ≤ μ_i x_n, which makes a pyramid. Here a normal row and the rows that name it are one cone of friction.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

/// In the terms of docs/problem.md the problem is reduced: n = 0, E = S A S, b = −S b, u = S w, exact Coulomb law. S is
/// the identity but for contacts whose two coefficients differ: with S_i = μ_i/μ, μ the greater one, the ellipse
/// √((x_1/μ_1)² + (x_2/μ_2)²) ≤ x_n is the cone ‖λ_t‖ ≤ μ λ_n of λ = S⁻¹ x.
class BoxedLcp {
public:
    /// solver: as --solver has it, "pgs" or "ssn(…)". tolerance: the natural error that is asked for; an answer within
    /// `loosest` is used too. Throws delassus::InputError.
    explicit BoxedLcp(const std::string& solver = "auto", double tolerance = 1e-10, double loosest = 1e-6)
        : solver_(make_solver(registry_, delassus::parse_solver(solver))) {
        settings_.tolerance = tolerance;
        settings_.loosest = std::max(tolerance, loosest);
        settings_.max_iterations = 10000;
        settings_.warm_start = true;
    }

    /// The problem of n rows with cones. A(i, j); normal_of[i]: the row of the normal force of a row of friction, which
    /// then has hi[i] = −lo[i] = μ; negative or i in other rows. Throws delassus::InputError where no cone says it.
    template <class Matrix, class Vector, class Index>
    const delassus::PreparedProblem& pose(int n, const Matrix& A, const Vector& b, const Vector& lo, const Vector& hi,
                                          const Index& normal_of) {
        delassus::Problem problem;
        problem.law = delassus::Law::Coulomb;
        rows_.clear();
        scale_.clear();
        const std::vector<std::array<int, 2>> tangents = tangents_of(n, lo, hi, normal_of);
        for (int i = 0; i < n; ++i) {
            if (is_friction(i, hi, normal_of)) continue;  // its normal row has it
            rows_.push_back(i);
            scale_.push_back(1.0);
            const auto [first, second] = tangents[static_cast<std::size_t>(i)];
            const double mu = std::max<double>(first < 0 ? 0.0 : hi[first], second < 0 ? 0.0 : hi[second]);
            for (const int row : {first, second}) {
                if (row < 0) continue;
                rows_.push_back(row);
                scale_.push_back(hi[row] / mu);
            }
            problem.cones.push_back(first < 0 ? box(lo[i], hi[i]) : delassus::Cone::friction(mu, second < 0 ? 2 : 3));
        }
        delassus::SparseMatrix& E = problem.E = delassus::SparseMatrix::zero(n, n);
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            for (std::size_t l = 0; l < rows_.size(); ++l) {  // A is symmetric up to rounding
                const double sum = A(rows_[k], rows_[l]) + A(rows_[l], rows_[k]);
                if (sum == 0.0) continue;
                E.column.push_back(static_cast<std::int32_t>(l));
                E.value.push_back(0.5 * sum * scale_[k] * scale_[l]);
            }
            E.row_start[k + 1] = E.entries();
            problem.b.push_back(-scale_[k] * b[rows_[k]]);
        }
        return problem_.emplace(std::move(problem));
    }

    /// Poses and solves, from the engine's x. False if the answer is not as exact as needed, or with the sentence in
    /// refusal() if no cones say the problem: x is as it was, and the engine can take its own solver, with pyramids.
    template <class Matrix, class Vector, class X, class Index>
    bool solve(int n, const Matrix& A, const Vector& b, X& x, const Vector& lo, const Vector& hi,
               const Index& normal_of) try {
        refusal_.clear();
        pose(n, A, b, lo, hi, normal_of);
        delassus::Solution solution{{}, lambda_of(x)};
        report_ = solver_.solve(*problem_, solution, settings_);
        if (!(report_.error.natural <= settings_.loosest)) return false;
        for (std::size_t k = 0; k < rows_.size(); ++k) x[rows_[k]] = scale_[k] * solution.lambda[k];
        return true;
    } catch (const std::exception& error) {
        refusal_ = error.what();
        return false;
    }

    /// λ = S⁻¹ x in the order of the problem's rows.
    template <class X>
    [[nodiscard]] std::vector<double> lambda_of(const X& x) const {
        std::vector<double> lambda;
        for (std::size_t k = 0; k < rows_.size(); ++k) lambda.push_back(x[rows_[k]] / scale_[k]);
        return lambda;
    }

    /// Of the latest solve: status, time, errors as Delassus measures them.
    [[nodiscard]] const delassus::SolveReport& report() const { return report_; }
    [[nodiscard]] const std::string& refusal() const { return refusal_; }

private:
    /// Engines write infinity as a large number.
    static bool infinite(double bound) { return bound >= 1e9; }
    static delassus::Cone box(double lo, double hi) {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        if (infinite(-lo) && infinite(hi)) return delassus::Cone::free(1);
        return delassus::Cone::box({infinite(-lo) ? -infinity : lo}, {infinite(hi) ? infinity : hi});
    }
    /// With μ = 0 it is a row that gives no force.
    template <class Vector, class Index>
    static bool is_friction(int i, const Vector& hi, const Index& normal_of) {
        return normal_of[i] >= 0 && normal_of[i] != i && hi[i] != 0;
    }
    /// For each row the rows of friction that name it; −1: none.
    template <class Vector, class Index>
    static std::vector<std::array<int, 2>> tangents_of(int n, const Vector& lo, const Vector& hi,
                                                       const Index& normal_of) {
        std::vector<std::array<int, 2>> tangents(static_cast<std::size_t>(n), {-1, -1});
        const auto require = [](bool fine, int row, const char* problem) {
            if (!fine) throw delassus::InputError("Row " + std::to_string(row) + " of the engine's problem " + problem);
        };
        for (int i = 0; i < n; ++i) {
            if (!is_friction(i, hi, normal_of)) continue;
            const int normal = normal_of[i];
            require(normal < n && !is_friction(normal, hi, normal_of), i, "names a normal force that is none.");
            require(lo[normal] == 0 && infinite(hi[normal]), normal,
                    "is a normal force with other bounds than 0 and ∞.");
            require(hi[i] > 0 && hi[i] == -lo[i] && !infinite(hi[i]), i,
                    "is friction with other bounds than −μ and μ.");
            auto& [first, second] = tangents[static_cast<std::size_t>(normal)];
            require(second < 0, i, "is the third direction of friction of a contact; a cone has two.");
            (first < 0 ? first : second) = i;
        }
        return tangents;
    }

    delassus::Registry registry_;
    delassus::Solver solver_;
    delassus::SolveSettings settings_;
    std::optional<delassus::PreparedProblem> problem_;
    std::vector<int> rows_;      ///< the engine's row of each row of the problem
    std::vector<double> scale_;  ///< S
    delassus::SolveReport report_;
    std::string refusal_;
};
