// SPDX-License-Identifier: BSD-3-Clause
// The module delassus_petsc_inverse: factors of a matrix that no process has as a whole, by MUMPS through PETSc.
#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "delassus/error.hpp"
#include "library.hpp"
#include "partitioned/coupled_inverse.hpp"

namespace delassus {

namespace {

using petsc::check;

/// Pivots of a matrix with a unit diagonal below this are rounding, as for a whole problem.
constexpr double null_pivot = 1e-14;

class MumpsFactors : public CoupledInverse {
public:
    MumpsFactors(MPI_Comm communicator, const delassus_local_matrix& rows, std::int64_t first)
        : communicator_(communicator),
          n_(static_cast<PetscInt>(rows.rows)),
          n_all_(static_cast<PetscInt>(rows.columns)) {
        const petsc::Session session;
        std::vector<PetscInt> start, column;
        std::vector<PetscScalar> value;
        for (std::int64_t row = 0; row < rows.rows; ++row) {
            start.push_back(static_cast<PetscInt>(value.size()));
            bool diagonal = false;
            const auto put = [&](std::int64_t j, double entry) {
                column.push_back(static_cast<PetscInt>(j));
                value.push_back(entry);
            };
            for (auto k = rows.row_start[row]; k < rows.row_start[row + 1]; ++k) {
                const std::int64_t j = rows.column[k];
                if (j > first + row && !diagonal) put(first + row, 0.0);
                diagonal = diagonal || j >= first + row;
                put(j, rows.value[k]);
            }
            if (!diagonal) put(first + row, 0.0);
        }
        start.push_back(static_cast<PetscInt>(value.size()));
        petsc::MatrixHandle A;
        check(MatCreateMPIAIJWithArrays(communicator_, n_, n_, n_all_, n_all_, start.data(), column.data(),
                                        value.data(), A.make()));
        check(MatSetOption(A.get(), MAT_SYMMETRIC, PETSC_TRUE));
        check(MatGetFactor(A.get(), MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, factors_.make()));
        Mat F = factors_.get();
        check(MatMumpsSetIcntl(F, 8, 0));    // the diagonal is one already
        check(MatMumpsSetIcntl(F, 13, 1));   // the root on one process: else its pivots are not counted
        check(MatMumpsSetIcntl(F, 14, 60));  // per cent of room to spare
        check(MatMumpsSetIcntl(F, 24, 1));   // null pivots are found
        check(MatMumpsSetCntl(F, 1, 0.0));   // no pivoting: the signs are those of the inertia (Sylvester)
        check(MatMumpsSetCntl(F, 3, -null_pivot));
        MatFactorInfo info;
        check(MatFactorInfoInitialize(&info));
        check(MatCholeskyFactorSymbolic(F, A.get(), nullptr, &info));
        check(MatCholeskyFactorNumeric(F, A.get(), &info));
        MatFactorError failed = MAT_FACTOR_NOERROR;
        check(MatFactorGetError(F, &failed));
        PetscInt reason = 0, negative = 0, null = 0;
        check(MatMumpsGetInfog(F, 1, &reason));
        if (failed != MAT_FACTOR_NOERROR || reason < 0)
            throw InputError(fmt::format("the factorisation of H by MUMPS failed with its code {}{}", reason,
                                         reason == -9 || reason == -13 || reason == -19 ? " (out of memory)" : ""));
        check(MatMumpsGetInfog(F, 12, &negative));
        check(MatMumpsGetInfog(F, 28, &null));
        negative_ = negative;
        null_ = null;
    }

    [[nodiscard]] std::int64_t negative_pivots() const override { return negative_; }
    [[nodiscard]] std::int64_t null_pivots() const override { return null_; }

    void apply(double* columns, std::int32_t count) const override {
        const petsc::Session session;
        std::vector<PetscScalar> right(columns,
                                       columns + static_cast<std::size_t>(n_) * static_cast<std::size_t>(count));
        petsc::MatrixHandle B, X;
        check(MatCreateDense(communicator_, n_, PETSC_DECIDE, n_all_, count, right.data(), B.make()));
        check(MatCreateDense(communicator_, n_, PETSC_DECIDE, n_all_, count, columns, X.make()));
        for (Mat matrix : {B.get(), X.get()}) {
            check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
            check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
        }
        check(MatMatSolve(factors_.get(), B.get(), X.get()));
    }

private:
    MPI_Comm communicator_;
    PetscInt n_, n_all_;
    petsc::MatrixHandle factors_;
    std::int64_t negative_ = 0, null_ = 0;
};

}  // namespace
}  // namespace delassus

extern "C" DELASSUS_API void delassus_petsc_inverse_make(std::int32_t communicator, const delassus_local_matrix& rows,
                                                         std::int64_t first,
                                                         std::unique_ptr<delassus::CoupledInverse>& inverse) {
    using namespace delassus;
    if (rows.columns > std::numeric_limits<PetscInt>::max() ||
        rows.entries > std::numeric_limits<PetscInt>::max() - rows.rows)
        throw InputError("PETSc has 32-bit numbers here, too small for the rows or entries of H");
    petsc::ensure_petsc();
    try {
        inverse = std::make_unique<MumpsFactors>(MPI_Comm_f2c(communicator), rows, first);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw InputError(error.what());
    }
}
