// SPDX-License-Identifier: BSD-3-Clause
// C K C spread over the processes: each owns a stretch of x and a stretch of λ, so that both fields are shared out.
#pragma once

#include <vector>

#include "delassus/sdk/problem_view.hpp"
#include "library.hpp"

namespace delassus::petsc {

/// Where the unknowns live. Process p owns x[X_p … X_{p+1}) and λ[Y_p … Y_{p+1}), in PETSc's numbering the rows from
/// X_p + Y_p on, first those of x: x_i has number Y_p + i, λ_k has number X_{p+1} + k.
class Layout {
public:
    Layout() = default;
    Layout(std::int64_t n, std::int64_t m, int rank, int size);

    [[nodiscard]] PetscInt of_x(std::int64_t i) const { return x_number_[static_cast<std::size_t>(i)]; }
    [[nodiscard]] PetscInt of_lambda(std::int64_t k) const { return lambda_number_[static_cast<std::size_t>(k)]; }
    /// Of row i of K in the order {x; λ}.
    [[nodiscard]] PetscInt of(std::int64_t i) const { return i < n_ ? of_x(i) : of_lambda(i - n_); }
    [[nodiscard]] bool owns(std::int64_t i) const { return of(i) >= first_ && of(i) < first_ + local_rows(); }
    [[nodiscard]] PetscInt local_x() const { return local_x_; }
    [[nodiscard]] PetscInt local_lambda() const { return local_lambda_; }
    [[nodiscard]] PetscInt local_rows() const { return local_x_ + local_lambda_; }
    [[nodiscard]] PetscInt first() const { return first_; }
    [[nodiscard]] std::int64_t first_lambda() const { return first_lambda_; }  ///< Y_p

private:
    std::int64_t n_ = 0, first_lambda_ = 0;
    PetscInt first_ = 0, local_x_ = 0, local_lambda_ = 0;
    std::vector<PetscInt> x_number_, lambda_number_;
};

/// A matrix whose pattern is given once and whose values may be set often (COO assembly): PETSc then knows that the
/// pattern stayed, and preconditioners keep their symbolic factorisation.
class System {
public:
    explicit System(const sdk::MpiCommunicator& communicator) : communicator_(communicator) {}

    void analyze(const sdk::ProblemView& problem, const sdk::Vector& C);
    void factorize(const sdk::ProblemView& problem, const sdk::Vector& C, double shift);

    [[nodiscard]] Mat exact() const { return exact_.get(); }      ///< C K C
    [[nodiscard]] Mat shifted() const { return shifted_.get(); }  ///< with ±shift on the diagonal
    [[nodiscard]] Vec right_hand_side() const { return right_hand_side_.get(); }
    [[nodiscard]] Vec solution() const { return solution_.get(); }
    [[nodiscard]] const Layout& layout() const { return layout_; }
    [[nodiscard]] IS x_rows() const { return x_rows_.get(); }
    [[nodiscard]] IS lambda_rows() const { return lambda_rows_.get(); }

    /// A vector that every process holds, in the order {x; λ}, to the processes' shares; and back. Collective.
    void scatter(const sdk::Vector& values, Vec distributed) const;
    void gather(Vec distributed, sdk::Vector& values) const;

private:
    const sdk::MpiCommunicator& communicator_;
    Layout layout_;
    MatrixHandle exact_, shifted_;
    VectorHandle right_hand_side_, solution_, everything_;
    ScatterHandle to_all_;
    IndexHandle x_rows_, lambda_rows_;
};

/// Makes matrix (local × local rows of the process, square) with entries at (row, column), repeated ones added up.
void make_matrix(const sdk::MpiCommunicator& communicator, PetscInt local, std::vector<PetscInt> rows,
                 std::vector<PetscInt> columns, MatrixHandle& matrix);

}  // namespace delassus::petsc
