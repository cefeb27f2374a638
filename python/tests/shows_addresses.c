/* SPDX-License-Identifier: BSD-3-Clause */
/* A plugin that solves nothing: its message is the addresses of the arrays of the problem that it was given. */
#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>

#include "delassus/plugin.h"

static char message[600];

static int32_t create(const delassus_option_value* values, int32_t count, void** solver) {
    (void)values;
    (void)count;
    *solver = message;
    return DELASSUS_SOLVED;
}
static void destroy(void* solver) {
    (void)solver;
}
static int32_t nothing(void* solver, const delassus_problem* problem) {
    (void)solver;
    (void)problem;
    return DELASSUS_SOLVED;
}
static int write_matrix(char* text, size_t size, const char* name, const delassus_matrix* matrix) {
    return snprintf(text, size, "%s.indptr %" PRIuPTR " %s.indices %" PRIuPTR " %s.data %" PRIuPTR " ", name,
                    (uintptr_t)matrix->row_start, name, (uintptr_t)matrix->column, name, (uintptr_t)matrix->value);
}
static int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                     double* lambda, delassus_outcome* outcome) {
    (void)solver;
    (void)request;
    (void)x;
    (void)lambda;
    int length = 0;
    length += write_matrix(message + length, sizeof message - (size_t)length, "H", &problem->H);
    length += write_matrix(message + length, sizeof message - (size_t)length, "D", &problem->D);
    length += write_matrix(message + length, sizeof message - (size_t)length, "E", &problem->E);
    snprintf(message + length, sizeof message - (size_t)length, "a %" PRIuPTR " b %" PRIuPTR, (uintptr_t)problem->a,
             (uintptr_t)problem->b);
    outcome->iterations = 0;
    outcome->analyses = 0;
    outcome->factorizations = 0;
    outcome->residual = NAN;
    outcome->message = message;
    outcome->status = DELASSUS_STALLED;
    return DELASSUS_STALLED;
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
        .name = "shows_addresses",
        .version = "1",
        .description = "says where the arrays of the problem are",
        .licence = "BSD-3-Clause",
        .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_FRICTION | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL |
                        DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE,
        .create = create,
        .destroy = destroy,
        .analyze = nothing,
        .factorize = nothing,
        .solve = solve,
        .last_error = last_error,
    };
    return &descriptor;
}
