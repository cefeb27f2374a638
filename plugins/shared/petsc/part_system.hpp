// SPDX-License-Identifier: BSD-3-Clause
// What methods that factor a matrix over the bodies need of a problem in parts: H⁻¹ of any definite H, the natural
// error, D's own rows, and matrices of the form H + Dᵀ V D as MPIAIJ with a KSP.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bodies.hpp"
#include "delassus/sdk/cones.hpp"

namespace delassus::petsc {

/// Own rows of the problem, with E coupling rows of one contact only. All operations but the getters are collective.
class PartSystem {
public:
    /// Throws std::runtime_error, on all processes, where E couples others, or PETSc's numbers are too small.
    void analyze(const Processes& processes, const sdk::LocalProblemView& problem);
    /// Factors H and finds the diagonal of N. Throws sdk::NumericalFailure. Where H couples bodies the diagonal costs a
    /// solve with H for each row of D, sixteen at a time.
    void factorize(const sdk::LocalProblemView& problem);
    /// a, b, the cones' parameters and the law are new.
    void load(const sdk::LocalProblemView& problem);

    [[nodiscard]] const Processes& processes() const { return bodies_.processes(); }
    [[nodiscard]] const Exchange& columns() const { return bodies_.columns(); }
    [[nodiscard]] const sdk::Vector& diagonal() const { return diagonal_; }  ///< of N; blocks of zeros filled
    [[nodiscard]] const sdk::Vector& free_velocity() const { return r_; }    ///< r = D H⁻¹ a + b
    [[nodiscard]] const sdk::SparseRows& D() const { return D_; }            ///< m × local columns
    [[nodiscard]] const sdk::SparseRows& E() const { return E_; }            ///< m × m, own rows
    [[nodiscard]] double reference() const { return reference_; }            ///< ‖S r‖
    /// Own rows as a problem with n = 0: the cones and the law. Valid as long as the problem that was loaded.
    [[nodiscard]] const sdk::ProblemView& rows() const { return *rows_; }

    /// v ← H⁻¹ v; own columns.
    void apply_inverse(sdk::Vector& v) const;
    /// H v; own columns.
    [[nodiscard]] sdk::Vector apply_H(const sdk::Vector& v) const;
    /// D v of own rows from own columns of v, and Dᵀ λ of own columns.
    [[nodiscard]] sdk::Vector apply_D(const sdk::Vector& v) const;
    [[nodiscard]] sdk::Vector apply_transpose(const sdk::Vector& lambda) const;
    /// x = H⁻¹(a + Dᵀλ), own columns.
    [[nodiscard]] sdk::Vector velocity(const sdk::LocalProblemView& problem, const sdk::Vector& lambda) const;
    /// u = D x + E λ + b of own rows.
    [[nodiscard]] sdk::Vector velocities(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                                         const sdk::Vector& x) const;
    /// The natural error of λ with u (without De Saxcé term).
    [[nodiscard]] double natural(const sdk::Vector& lambda, const sdk::Vector& u) const;
    /// The natural error as the host measures it; leaves x.
    [[nodiscard]] double measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                                  sdk::Vector& x) const;

    [[nodiscard]] double dot(const sdk::Vector& a, const sdk::Vector& b) const { return processes().sum(a.dot(b)); }
    [[nodiscard]] double norm(const sdk::Vector& v) const { return std::sqrt(dot(v, v)); }
    [[nodiscard]] bool everywhere(bool holds) const { return !processes().any(!holds); }
    void next_iteration() const { processes().meter()->clock().next_iteration(); }
    void end_iterations() const { processes().meter()->clock().end_iterations(); }

    /// An empty n_all × n_all matrix with the pattern of H and of all products of columns in one group of own rows,
    /// which follow one another and cover them (group_rows: their numbers).
    void make_matrix(const sdk::LocalProblemView& problem, const std::vector<std::int32_t>& group_rows,
                     MatrixHandle& matrix) const;
    /// matrix += H; before assemble().
    static void fill_H(const sdk::LocalProblemView& problem, Mat matrix);
    /// The columns of rows first … first + rows − 1, ascending local numbers, and their coefficients, rows × columns.
    void dense_rows(std::int32_t first, std::int32_t rows, std::vector<std::int32_t>& local,
                    Eigen::MatrixXd& values) const;
    /// matrix(local, local) += values, both with as many columns; between fill_H and assemble().
    void add(const std::vector<std::int32_t>& local, const Eigen::MatrixXd& values, Mat matrix) const;
    static void assemble(Mat matrix);
    /// matrix ← diag(R) matrix diag(R); R over own columns.
    void scale(Mat matrix, const sdk::Vector& R) const;
    /// v ← what krylov finds for the right-hand side v; own columns.
    void solve(KSP krylov, sdk::Vector& v) const;

private:
    void factor_coupled(const sdk::LocalProblemView& problem);
    void find_coupled_diagonal();

    Bodies bodies_;
    bool coupled_ = false;
    sdk::SparseRows D_, E_;
    sdk::Vector diagonal_, r_;
    std::vector<double> cone_scaling_;
    double reference_ = 1.0;
    MatrixHandle H_;
    KrylovHandle inverse_;
    mutable VectorHandle right_, solution_;
    std::vector<PetscInt> number_;  // of local columns
    delassus_problem raw_rows_{};
    std::vector<std::int32_t> no_blocks_;
    std::unique_ptr<sdk::ProblemView> rows_;
    bool coulomb_ = false;
};

/// Why a whole problem's E cannot be taken; empty if it can.
[[nodiscard]] std::string refusal_of_compliance(const sdk::ProblemView& problem);
/// Numbers of own rows that belong together, in their order: a contact's, else single rows.
[[nodiscard]] std::vector<std::int32_t> coupled_rows(const sdk::LocalProblemView& problem);

/// How linear systems with an n_all × n_all definite matrix are solved.
enum class LinearSolver { Mumps, Hypre, BlockJacobi, Schwarz };

/// Additive Schwarz: each process splits its columns into domains of about `columns` (PT-Scotch), each grows by
/// `overlap` layers of the matrix's graph, beyond the process's own where it borders on them, and is factored.
struct Schwarz {
    std::int64_t columns = 3000;
    int overlap = 2;
};

/// Sets up krylov for matrix: a factorisation by MUMPS, or conjugate gradients with hypre's BoomerAMG, with incomplete
/// Cholesky on each process, or with Schwarz' method and CHOLMOD. Collective.
void make_linear_solver(const Processes& processes, Mat matrix, LinearSolver kind, KrylovHandle& krylov,
                        Schwarz schwarz = {});
/// Factors or sets up the preconditioner for the matrix's new values. False if the factorisation failed. Collective.
[[nodiscard]] bool set_up(KSP krylov);

}  // namespace delassus::petsc
