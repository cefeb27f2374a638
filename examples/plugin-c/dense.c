/* SPDX-License-Identifier: BSD-3-Clause
 *
 * A solver plugin in C99, by delassus/plugin.h alone: bilateral rows of a reduced problem, E λ = −b, by Gaussian
 * elimination with row pivoting. About the least that passes the conformance suite. Against an installed Delassus:
 *
 *     cc -std=c99 -O2 -fPIC -shared -fvisibility=hidden dense.c $(pkg-config --cflags delassus) -lm -o dense_c.so
 *     delassus plugins describe ./dense_c.so --sidecar
 *     delassus plugins check ./dense_c.so
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "delassus/plugin.h"

typedef struct dense_solver {
    double* factors; /* m × m by rows: L below the diagonal, U on it and above */
    int32_t* pivot;  /* m: the row that changed places with row k in step k */
    int64_t factorizations;
    const char* error;
} dense_solver;

static const char* out_of_memory = "out of memory";

static int32_t fail(dense_solver* self, int32_t status, const char* sentence) {
    self->error = sentence;
    return status;
}

static int32_t create(const delassus_option_value* values, int32_t count, void** solver) {
    (void)values, (void)count;
    dense_solver* self = calloc(1, sizeof *self);
    *solver = self;
    if (!self) return DELASSUS_ERROR;
    self->error = "";
    return DELASSUS_SOLVED;
}

static void destroy(void* solver) {
    dense_solver* self = solver;
    free(self->factors);
    free(self->pivot);
    free(self);
}

static int32_t analyze(void* solver, const delassus_problem* problem) {
    dense_solver* self = solver;
    const size_t m = (size_t)problem->m;
    free(self->factors);
    free(self->pivot);
    self->factors = malloc((m * m + 1) * sizeof *self->factors);
    self->pivot = malloc((m + 1) * sizeof *self->pivot);
    return self->factors && self->pivot ? DELASSUS_SOLVED : fail(self, DELASSUS_ERROR, out_of_memory);
}

static int32_t factorize(void* solver, const delassus_problem* problem) {
    dense_solver* self = solver;
    const delassus_matrix* E = &problem->E;
    const ptrdiff_t m = problem->m;
    double* A = self->factors;
    for (ptrdiff_t k = 0; k < m * m; ++k) A[k] = 0.0;
    for (ptrdiff_t i = 0; i < m; ++i)
        for (int32_t k = E->row_start[i]; k < E->row_start[i + 1]; ++k) A[i * m + E->column[k]] = E->value[k];
    for (ptrdiff_t k = 0; k < m; ++k) {
        ptrdiff_t largest = k;
        for (ptrdiff_t i = k + 1; i < m; ++i)
            if (fabs(A[i * m + k]) > fabs(A[largest * m + k])) largest = i;
        self->pivot[k] = (int32_t)largest;
        if (A[largest * m + k] == 0.0) return fail(self, DELASSUS_NUMERICAL_FAILURE, "E is singular");
        for (ptrdiff_t j = 0; j < m && largest != k; ++j) {
            const double other = A[k * m + j];
            A[k * m + j] = A[largest * m + j];
            A[largest * m + j] = other;
        }
        for (ptrdiff_t i = k + 1; i < m; ++i) {
            const double factor = A[i * m + k] /= A[k * m + k];
            for (ptrdiff_t j = k + 1; j < m; ++j) A[i * m + j] -= factor * A[k * m + j];
        }
    }
    ++self->factorizations;
    return DELASSUS_SOLVED;
}

static int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                     double* lambda, delassus_outcome* outcome) {
    (void)request, (void)x;
    const dense_solver* self = solver;
    const ptrdiff_t m = problem->m;
    const double* A = self->factors;
    for (ptrdiff_t i = 0; i < m; ++i) lambda[i] = -problem->b[i];
    for (ptrdiff_t k = 0; k < m; ++k) {
        const double chosen = lambda[self->pivot[k]];
        lambda[self->pivot[k]] = lambda[k];
        lambda[k] = chosen;
    }
    for (ptrdiff_t i = 0; i < m; ++i)
        for (ptrdiff_t j = 0; j < i; ++j) lambda[i] -= A[i * m + j] * lambda[j];
    for (ptrdiff_t i = m - 1; i >= 0; --i) {
        for (ptrdiff_t j = i + 1; j < m; ++j) lambda[i] -= A[i * m + j] * lambda[j];
        lambda[i] /= A[i * m + i];
    }
    outcome->iterations = 0;
    outcome->analyses = 0;
    outcome->factorizations = self->factorizations;
    outcome->residual = NAN;
    outcome->message = NULL;
    outcome->status = DELASSUS_SOLVED;
    return DELASSUS_SOLVED;
}

static const char* last_error(void* solver) {
    return solver ? ((const dense_solver*)solver)->error : out_of_memory;
}

static const delassus_plugin_descriptor descriptor = {
    .magic = DELASSUS_PLUGIN_MAGIC,
    .abi_major = DELASSUS_ABI_MAJOR,
    .abi_minor = DELASSUS_ABI_MINOR,
    .struct_size = sizeof(delassus_plugin_descriptor),
    .name = "dense_c",
    .version = "1.0.0",
    .description = "Gaussian elimination of a reduced problem: an example in C",
    .licence = "BSD-3-Clause",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_REDUCED,
    .create = create,
    .destroy = destroy,
    .analyze = analyze,
    .factorize = factorize,
    .solve = solve,
    .last_error = last_error,
    .build = DELASSUS_BUILD,
};

const delassus_plugin_descriptor* delassus_plugin(void) {
    return &descriptor;
}
