// SPDX-License-Identifier: BSD-3-Clause
// The linear system of a solution's derivative (delassus/_derivative.py has the equations): blocks of the projection's
// derivative, and the factor of the rows that are active.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/needs.hpp"
#include "delassus/problem.hpp"

namespace delassus::python {

/// Rows of λ that the derivative of the projection couples: a block of friction, or one row of another kind.
struct ActiveUnit {
    using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;
    using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
    std::int32_t first = 0;  ///< row
    std::int32_t cone = 0;
    Matrix J;      ///< derivative of the projection
    Matrix moved;  ///< ρ J C
    Vector by_mu;  ///< ∂Π/∂μ − ρ J ∂û/∂μ
    [[nodiscard]] std::int32_t rows() const { return static_cast<std::int32_t>(J.rows()); }
};

/// The derivative of a solution's equations. It reads H, D, E and the cones of the problem, which never change and must
/// outlive it.
class Linearization {
public:
    using Vector = Eigen::VectorXd;

    /// lambda, u: m. tolerance: how near to an edge of the projection a block counts as degenerate, relative.
    Linearization(const PreparedProblem& problem, const std::vector<double>& lambda, const std::vector<double>& u,
                  bool coulomb, double tolerance);
    ~Linearization();
    Linearization(const Linearization&) = delete;
    Linearization& operator=(const Linearization&) = delete;

    [[nodiscard]] const std::vector<std::int32_t>& degenerate() const { return degenerate_; }
    [[nodiscard]] const std::vector<double>& local() const { return local_; }
    /// Whether factorize() can: H is reduced, diagonal, or definite of blocks whose inverses are small.
    [[nodiscard]] bool has_small_blocks() const;

    /// Factors the system with more compliance on its diagonal; false where it is singular to working precision.
    bool factorize(double compliance);

    /// (dx, dλ) with H dx − Dᵀ dλ = first and ρ J C D dx + (I − J + ρ J C E) dλ = second.
    [[nodiscard]] std::pair<Vector, Vector> solve(const Vector& first, const Vector& second) const;
    /// (p, q) with the transposed matrix; q of rows that are not active is left 0, since nothing asks for it.
    [[nodiscard]] std::pair<Vector, Vector> solve_transposed(const Vector& to_x, const Vector& to_lambda) const;
    /// ρ J C v; m.
    [[nodiscard]] Vector moved(const Vector& v) const;
    /// (ρ J C)ᵀ v; m.
    [[nodiscard]] Vector moved_back(const Vector& v) const;
    [[nodiscard]] const std::vector<ActiveUnit>& units() const { return units_; }
    [[nodiscard]] std::int32_t n() const { return n_; }
    [[nodiscard]] std::int32_t m() const { return m_; }
    [[nodiscard]] const Problem& problem() const { return problem_->problem(); }

    /// D v; m. v: n.
    [[nodiscard]] Vector rows_times(const Vector& v) const;
    /// Dᵀ v; n. v: m.
    [[nodiscard]] Vector columns_times(const Vector& v) const;
    /// E v; m. E is symmetric up to rounding; transposed: Eᵀ v.
    [[nodiscard]] Vector compliance_times(const Vector& v, bool transposed) const;

private:
    [[nodiscard]] Eigen::Index active() const { return static_cast<Eigen::Index>(row_of_.size()); }

    /// The diagonal of D diag(H)⁻¹ Dᵀ + E.
    void find_local_mobilities();

    /// Adds the units of a block of rows that are active; whether the solution is not differentiable there.
    bool add(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda, const double* u,
             bool coulomb, double tolerance);

    bool add_friction(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda, const double* u,
                      bool coulomb, double rho, double near);

    void invert_blocks();

    void number_active_rows();

    /// H⁻¹ v; n.
    [[nodiscard]] Vector of_H(const Vector& v) const;

    /// I − J + ρ J C (D H⁻¹ Dᵀ + E + compliance I) of the active rows.
    [[nodiscard]] Eigen::SparseMatrix<double> reduced(double compliance) const;

    [[nodiscard]] Vector gather(const Vector& v) const;
    [[nodiscard]] Vector scatter(const Vector& v) const;
    [[nodiscard]] Vector backsubstitute(const Vector& v) const;
    [[nodiscard]] Vector backsubstitute_transposed(const Vector& v) const;

    struct Place {
        std::int32_t block, row;
    };
    const PreparedProblem* problem_;
    std::int32_t n_, m_;
    std::vector<double> local_;
    std::vector<std::int32_t> degenerate_;
    std::vector<ActiveUnit> units_;
    std::vector<Eigen::MatrixXd> inverse_;  // of each block of H
    std::vector<Place> place_;              // of each velocity in the blocks of H
    std::vector<std::int32_t> number_of_;   // of each row among the active ones; −1: not active
    std::vector<std::int32_t> row_of_;      // its inverse
    Vector size_;                           // of each row of the reduced system
    struct Factor;
    std::unique_ptr<Factor> factor_;  // of the reduced system; null if no row is active
};

}  // namespace delassus::python
