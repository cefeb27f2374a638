/* SPDX-License-Identifier: BSD-3-Clause */
/* A solver that allocates nothing: projected Gauss-Seidel on a dense N in static arrays, for tiny problems with free,
   nonnegative, box and friction rows, any definite H, and E. */
#include <math.h>
#include <stddef.h>

#include "delassus/plugin.h"

enum { LARGEST = 96 };
static double H[LARGEST][LARGEST], Z[LARGEST][LARGEST], N[LARGEST][LARGEST], r[LARGEST], x0[LARGEST];
static int only_solver;

static int32_t create(const delassus_option_value* values, int32_t count, void** solver) {
    (void)values;
    (void)count;
    *solver = &only_solver;
    return DELASSUS_SOLVED;
}
static void destroy(void* solver) {
    (void)solver;
}
static int32_t nothing(void* solver, const delassus_problem* problem) {
    (void)solver;
    return problem->n <= LARGEST && problem->m <= LARGEST ? DELASSUS_SOLVED : DELASSUS_ERROR;
}

/* H = L Lᵀ in place, lower triangle. */
static void factorize(const delassus_problem* p) {
    for (int32_t i = 0; i < p->n; ++i) {
        for (int32_t j = 0; j < p->n; ++j) H[i][j] = 0.0;
        for (int32_t k = p->H.row_start[i]; k < p->H.row_start[i + 1]; ++k) H[i][p->H.column[k]] = p->H.value[k];
    }
    for (int32_t j = 0; j < p->n; ++j)
        for (int32_t i = j; i < p->n; ++i) {
            double sum = H[i][j];
            for (int32_t k = 0; k < j; ++k) sum -= H[i][k] * H[j][k];
            H[i][j] = i == j ? sqrt(sum) : sum / H[j][j];
        }
}
static void apply_inverse(int32_t n, double* v) {
    for (int32_t i = 0; i < n; ++i) {
        for (int32_t k = 0; k < i; ++k) v[i] -= H[i][k] * v[k];
        v[i] /= H[i][i];
    }
    for (int32_t i = n - 1; i >= 0; --i) {
        for (int32_t k = i + 1; k < n; ++k) v[i] -= H[k][i] * v[k];
        v[i] /= H[i][i];
    }
}
static double row_times(const delassus_matrix* D, int32_t row, const double* v) {
    double sum = 0.0;
    for (int32_t k = D->row_start[row]; k < D->row_start[row + 1]; ++k) sum += D->value[k] * v[D->column[k]];
    return sum;
}
static void project(const delassus_cone* cone, double* l) {
    if (cone->kind == DELASSUS_CONE_NONNEGATIVE)
        for (int32_t i = 0; i < cone->rows; ++i) l[i] = fmax(l[i], 0.0);
    if (cone->kind == DELASSUS_CONE_BOX)
        for (int32_t i = 0; i < cone->rows; ++i) l[i] = fmin(fmax(l[i], cone->lo[i]), cone->hi[i]);
    if (cone->kind != DELASSUS_CONE_FRICTION) return;
    const double mu = cone->parameters[0];
    double norm = 0.0;
    for (int32_t i = 1; i < cone->rows; ++i) norm = hypot(norm, l[i]);
    if (norm <= mu * l[0]) return;
    if (mu * norm <= -l[0]) {
        for (int32_t i = 0; i < cone->rows; ++i) l[i] = 0.0;
        return;
    }
    const double normal = (l[0] + mu * norm) / (1.0 + mu * mu);
    for (int32_t i = 1; i < cone->rows; ++i) l[i] *= mu * normal / norm;
    l[0] = normal;
}

static int32_t solve(void* solver, const delassus_problem* p, const delassus_request* request, double* x,
                     double* lambda, delassus_outcome* outcome) {
    (void)solver;
    (void)request;
    factorize(p);
    for (int32_t i = 0; i < p->n; ++i) x0[i] = p->a[i];
    apply_inverse(p->n, x0);
    for (int32_t i = 0; i < p->m; ++i) {
        r[i] = p->b[i] + row_times(&p->D, i, x0);
        for (int32_t k = 0; k < p->n; ++k) Z[i][k] = 0.0;
        for (int32_t k = p->D.row_start[i]; k < p->D.row_start[i + 1]; ++k) Z[i][p->D.column[k]] = p->D.value[k];
        apply_inverse(p->n, Z[i]);
    }
    for (int32_t i = 0; i < p->m; ++i)
        for (int32_t j = 0; j < p->m; ++j) N[i][j] = row_times(&p->D, i, Z[j]);
    for (int32_t i = 0; i < p->m; ++i)
        for (int32_t k = p->E.row_start[i]; k < p->E.row_start[i + 1]; ++k) N[i][p->E.column[k]] += p->E.value[k];
    double change = 1.0;
    int64_t sweep = 0;
    for (; sweep < 100000 && change > 1e-30; ++sweep) {
        change = 0.0;
        for (int32_t c = 0; c < p->cone_count; ++c) {
            const delassus_cone* cone = delassus_cone_at(p, c);
            double trace = 0.0, before[8], u[8];
            for (int32_t i = 0; i < cone->rows; ++i) {
                const int32_t row = cone->first_row + i;
                trace += N[row][row];
                before[i] = lambda[row];
                if (cone->kind == DELASSUS_CONE_FREE) { /* row by row */
                    double v = r[row];
                    for (int32_t j = 0; j < p->m; ++j) v += N[row][j] * lambda[j];
                    lambda[row] -= v / N[row][row];
                }
            }
            if (cone->kind != DELASSUS_CONE_FREE) {
                for (int32_t i = 0; i < cone->rows; ++i) {
                    u[i] = r[cone->first_row + i];
                    for (int32_t j = 0; j < p->m; ++j) u[i] += N[cone->first_row + i][j] * lambda[j];
                }
                for (int32_t i = 0; i < cone->rows; ++i) lambda[cone->first_row + i] -= u[i] / trace;
                project(cone, lambda + cone->first_row);
            }
            for (int32_t i = 0; i < cone->rows; ++i) {
                const double d = lambda[cone->first_row + i] - before[i];
                change += d * d * trace;
            }
        }
    }
    for (int32_t i = 0; i < p->n; ++i) {
        x[i] = x0[i];
        for (int32_t j = 0; j < p->m; ++j) x[i] += Z[j][i] * lambda[j];
    }
    outcome->iterations = sweep;
    outcome->analyses = 0;
    outcome->factorizations = 0;
    outcome->residual = NAN;
    outcome->message = NULL;
    outcome->status = DELASSUS_SOLVED;
    return DELASSUS_SOLVED;
}
static const char* last_error(void* solver) {
    (void)solver;
    return "the problem is too large for this solver";
}

const delassus_plugin_descriptor* delassus_plugin(void) {
    static const delassus_plugin_descriptor descriptor = {
        .magic = DELASSUS_PLUGIN_MAGIC,
        .abi_major = DELASSUS_ABI_MAJOR,
        .abi_minor = DELASSUS_ABI_MINOR,
        .struct_size = sizeof(delassus_plugin_descriptor),
        .name = "quiet",
        .version = "1.0",
        .description = "allocates nothing",
        .licence = "BSD-3-Clause",
        .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                        DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                        DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                        DELASSUS_CAN_WARM_START,
        .create = create,
        .destroy = destroy,
        .analyze = nothing,
        .factorize = nothing,
        .solve = solve,
        .last_error = last_error,
    };
    return &descriptor;
}
