/* SPDX-License-Identifier: BSD-3-Clause */
/* Plain C, and nothing but the border: it takes problems without rows and with a diagonal H, x_i = a_i / H_ii. */
#include <math.h>
#include <stddef.h>

#include "delassus/plugin.h"

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
static int32_t accept_none_with_rows(void* solver, const delassus_problem* problem, char* reason, int32_t capacity) {
    (void)solver;
    if (problem->m == 0) return 1;
    const char* text = "it has rows";
    int32_t i = 0;
    for (; text[i] && i + 1 < capacity; ++i) reason[i] = text[i];
    reason[i] = '\0';
    return 0;
}
static int32_t nothing(void* solver, const delassus_problem* problem) {
    (void)solver;
    (void)problem;
    return DELASSUS_SOLVED;
}
static int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                     double* lambda, delassus_outcome* outcome) {
    (void)solver;
    (void)request;
    (void)lambda;
    for (int32_t i = 0; i < problem->n; ++i) x[i] = problem->a[i] / problem->H.value[i];
    outcome->iterations = 0;
    outcome->analyses = 0;
    outcome->factorizations = 0;
    outcome->residual = NAN;
    outcome->message = NULL;
    outcome->status = DELASSUS_SOLVED;
    return DELASSUS_SOLVED;
}
static const char* last_error(void* solver) {
    (void)solver;
    return "";
}

const delassus_plugin_descriptor* delassus_plugin(void) {
    static const delassus_plugin_descriptor descriptor = {
        .magic = DELASSUS_PLUGIN_MAGIC,
        .abi_major = DELASSUS_ABI_MAJOR,
        .abi_minor = DELASSUS_ABI_MINOR,
        .struct_size = sizeof(delassus_plugin_descriptor),
        .name = "minimal",
        .version = "0.9",
        .description = "divides by a diagonal",
        .licence = "BSD-3-Clause",
        .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL,
        .create = create,
        .destroy = destroy,
        .accepts = accept_none_with_rows,
        .analyze = nothing,
        .factorize = nothing,
        .solve = solve,
        .last_error = last_error,
    };
    return &descriptor;
}
