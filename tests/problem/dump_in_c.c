/* SPDX-License-Identifier: BSD-3-Clause
 * delassus/dump.h as a program in C has it. */
#include "delassus/dump.h"

int dump_in_c(const char* folder, const delassus_dump_problem* problem, char* message, size_t size);

int dump_in_c(const char* folder, const delassus_dump_problem* problem, char* message, size_t size) {
    return delassus_dump(folder, problem, message, size);
}
