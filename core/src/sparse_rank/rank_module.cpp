// SPDX-License-Identifier: BSD-3-Clause
#include "problem/rank_module.hpp"

#include <SuiteSparseQR_C.h>
#include <cholmod.h>

#include <algorithm>
#include <memory>

#include "delassus/export.hpp"

namespace {

/// CHOLMOD's state, and the matrices that are freed with it.
class Session {
public:
    Session() {
        cholmod_l_start(&common);
        common.print = 0;
        common.error_handler = nullptr;
    }
    ~Session() {
        cholmod_l_free_sparse(&A, &common);
        cholmod_l_free(static_cast<std::size_t>(columns), sizeof(SuiteSparse_long), permutation, &common);
        cholmod_l_finish(&common);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    cholmod_common common{};
    cholmod_sparse* A = nullptr;
    SuiteSparse_long* permutation = nullptr;
    std::int64_t columns = 0;
};

}  // namespace

extern "C" DELASSUS_API std::int64_t delassus_sparse_rank(std::int64_t rows, std::int64_t columns,
                                                          const std::int32_t* column_start, const std::int32_t* row,
                                                          const double* value, double tolerance) {
    Session session;
    session.columns = columns;
    const auto entries = static_cast<std::size_t>(column_start[columns]);
    session.A = cholmod_l_allocate_sparse(static_cast<std::size_t>(rows), static_cast<std::size_t>(columns), entries, 1,
                                          1, 0, CHOLMOD_REAL, &session.common);
    if (!session.A) return -1;
    std::copy_n(column_start, columns + 1, static_cast<SuiteSparse_long*>(session.A->p));
    std::copy_n(row, entries, static_cast<SuiteSparse_long*>(session.A->i));
    std::copy_n(value, entries, static_cast<double*>(session.A->x));
    return SuiteSparseQR_C_QR(SPQR_ORDERING_DEFAULT, tolerance, 0, session.A, nullptr, nullptr, &session.permutation,
                              &session.common);
}
