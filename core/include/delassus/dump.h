/* SPDX-License-Identifier: BSD-3-Clause
 *
 * Writes a problem of any engine as a problem folder of Delassus (docs/files.md), which its commands read:
 *
 *     delassus inspect step_17
 *     delassus compare step_17 step_18
 *
 * One file of C99, no library: copy it to where it is needed. docs/engine-adapters.md has an example. The problem is
 *
 *     H x − Dᵀ λ   = a          n rows: momentum balance
 *     D x + E λ + b = u         m rows: constraint velocities
 *     λ ∈ Υ  ⊥  u ∈ Υ*          one cone for each block of rows
 *
 * or with n = 0 only E, the Delassus operator D H⁻¹ Dᵀ, and b. Units are the engine's.
 */
#ifndef DELASSUS_DUMP_H
#define DELASSUS_DUMP_H

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sys/stat.h>
#if defined(_WIN32)
#include <direct.h>
#endif

/* ---- What is written ----------------------------------------------------------------------------------------- */

/* A matrix in one of three forms; the arrays stay the caller's. All zero: the matrix is zero. Indices count from 0.
 * Made by delassus_dump_dense(), delassus_dump_csr() or delassus_dump_triplets(). */
typedef struct delassus_dump_matrix {
    const double* value;
    const int* row_start; /* by compressed rows: one more than rows */
    const int* row;       /* triplets */
    const int* column;    /* by compressed rows, in any order within a row, and triplets */
    size_t entries;       /* triplets; those that share a place are added up in their order */
    size_t stride;        /* dense: from one row to the next */
} delassus_dump_matrix;

typedef enum delassus_dump_cone_kind {
    DELASSUS_DUMP_FREE = 0,        /* any λ, u = 0: bilateral constraints */
    DELASSUS_DUMP_NONNEGATIVE = 1, /* λ ≥ 0, u ≥ 0, λu = 0: contact without friction, stops */
    DELASSUS_DUMP_BOX = 2,         /* lo ≤ λ ≤ hi: motors with limits */
    DELASSUS_DUMP_FRICTION = 3     /* normal first: ‖λ_t‖ ≤ μ λ_n; 3 rows, or 2 in the plane */
} delassus_dump_cone_kind;

typedef struct delassus_dump_cone {
    int kind; /* a delassus_dump_cone_kind */
    int rows;
    double mu;        /* friction */
    const double* lo; /* box: `rows` bounds, −INFINITY allowed */
    const double* hi; /* box: `rows` bounds, INFINITY allowed */
} delassus_dump_cone;

typedef struct delassus_dump_problem {
    int n, m;
    int coulomb; /* friction: 1 exact Coulomb law, 0 associated (convex; u_n = μ‖u_t‖ where contacts slide) */
    delassus_dump_matrix H;          /* n × n, both triangles */
    delassus_dump_matrix D;          /* m × n */
    delassus_dump_matrix E;          /* m × m, both triangles, symmetric positive semidefinite */
    const double* a;                 /* n; NULL: zero */
    const double* b;                 /* m; NULL: zero */
    const delassus_dump_cone* cones; /* in the order of the rows; together m rows */
    size_t cone_count;
    const char* source; /* where it came from, ASCII; may be NULL */
    const char* notes;  /* anything odd, ASCII; may be NULL */
} delassus_dump_problem;

/* value: rows × columns, row by row. stride ≥ columns. */
static inline delassus_dump_matrix delassus_dump_dense(const double* value, size_t stride) {
    delassus_dump_matrix matrix;
    memset(&matrix, 0, sizeof matrix);
    matrix.value = value;
    matrix.stride = stride;
    return matrix;
}

static inline delassus_dump_matrix delassus_dump_csr(const int* row_start, const int* column, const double* value) {
    delassus_dump_matrix matrix;
    memset(&matrix, 0, sizeof matrix);
    matrix.value = value;
    matrix.row_start = row_start;
    matrix.column = column;
    return matrix;
}

static inline delassus_dump_matrix delassus_dump_triplets(size_t entries, const int* row, const int* column,
                                                          const double* value) {
    delassus_dump_matrix matrix;
    memset(&matrix, 0, sizeof matrix);
    matrix.value = value;
    matrix.row = row;
    matrix.column = column;
    matrix.entries = entries;
    return matrix;
}

/* Writes the problem to a new folder, with 17 digits, so that reading gives the same bits. Returns 0; or −1, with one
 * sentence in message (size characters with the final zero; NULL: none), and no folder. It fails if the folder exists.
 */
static inline int delassus_dump(const char* folder, const delassus_dump_problem* problem, char* message, size_t size);

/* ---- How ----------------------------------------------------------------------------------------------------- */

typedef struct delassus_dump_entry {
    int row, column;
    size_t order;
    double value;
} delassus_dump_entry;

typedef struct delassus_dump_state {
    const char* folder;
    char* path; /* of the temporary folder, with room for a file's name */
    size_t length;
    char* message;
    size_t size;
} delassus_dump_state;

static inline int delassus_dump_refuse(const delassus_dump_state* state, const char* what, const char* which,
                                       long place, const char* wrong) {
    if (state->message == NULL || state->size == 0) return -1;
    if (place < 0)
        snprintf(state->message, state->size, "%s cannot be written: %s%s %s.", state->folder, what, which, wrong);
    else
        snprintf(state->message, state->size, "%s cannot be written: %s%s, at place %ld, %s.", state->folder, what,
                 which, place, wrong);
    return -1;
}

static inline int delassus_dump_refuse_by_system(const delassus_dump_state* state, const char* what) {
    if (state->message != NULL && state->size > 0)
        snprintf(state->message, state->size, "%s cannot be written: %s: %s.", state->folder, what, strerror(errno));
    return -1;
}

static inline int delassus_dump_by_place(const void* left, const void* right) {
    const delassus_dump_entry* a = (const delassus_dump_entry*)left;
    const delassus_dump_entry* b = (const delassus_dump_entry*)right;
    if (a->row != b->row) return a->row < b->row ? -1 : 1;
    if (a->column != b->column) return a->column < b->column ? -1 : 1;
    return a->order < b->order ? -1 : a->order > b->order;
}

/* 17 digits, with a point whatever the program's locale has. */
static inline void delassus_dump_number(FILE* file, double value) {
    char text[64];
    const char* point = localeconv()->decimal_point;
    const size_t length = strlen(point);
    char* found;
    snprintf(text, sizeof text, "%.17g", value);
    found = length > 0 ? strstr(text, point) : NULL;
    if (found != NULL) {
        *found = '.';
        memmove(found + 1, found + length, strlen(found + length) + 1);
    }
    fputs(text, file);
}

static inline FILE* delassus_dump_open(const delassus_dump_state* state, const char* name) {
    FILE* file;
    strcpy(state->path + state->length, name);
    file = fopen(state->path, "wb");
    if (file == NULL) delassus_dump_refuse_by_system(state, name + 1);
    return file;
}

static inline int delassus_dump_close(const delassus_dump_state* state, FILE* file, const char* name) {
    const int failed = ferror(file);
    if (fclose(file) == 0 && !failed) return 0;
    return delassus_dump_refuse(state, name, "", -1, "could not be written to its end (is the disk full?)");
}

/* The entries by rows and columns, with no place twice; *result is the caller's to free. */
static inline int delassus_dump_gather(const delassus_dump_state* state, const char* name, int rows, int columns,
                                       const delassus_dump_matrix* matrix, delassus_dump_entry** result,
                                       size_t* count) {
    const int by_rows = matrix->row_start != NULL, dense = !by_rows && matrix->stride > 0;
    size_t room = matrix->entries, used = 0, k;
    delassus_dump_entry* entries;
    int i, j;
    *result = NULL;
    *count = 0;
    if (by_rows) {
        if (matrix->row_start[0] != 0) return delassus_dump_refuse(state, name, ".row_start", 0, "is not 0");
        for (i = 0; i < rows; ++i)
            if (matrix->row_start[i + 1] < matrix->row_start[i])
                return delassus_dump_refuse(state, name, ".row_start", i + 1L, "descends");
        room = (size_t)matrix->row_start[rows];
    } else if (dense) {
        if (matrix->stride < (size_t)columns)
            return delassus_dump_refuse(state, name, "", -1, "has a stride below its number of columns");
        room = (size_t)rows * (size_t)columns;
    }
    if (room == 0) return 0;
    if (matrix->value == NULL || (!dense && matrix->column == NULL) || (!dense && !by_rows && matrix->row == NULL))
        return delassus_dump_refuse(state, name, "", -1, "has entries, but lacks an array of them");
    entries = (delassus_dump_entry*)malloc(room * sizeof *entries);
    if (entries == NULL) return delassus_dump_refuse(state, name, "", -1, "is too large for the memory");
    *result = entries;
    if (!dense) {
        for (i = 0, k = 0; k < room; ++k) {
            if (by_rows)
                while ((size_t)matrix->row_start[i + 1] <= k) ++i;
            entries[k].row = by_rows ? i : matrix->row[k];
            entries[k].column = matrix->column[k];
            entries[k].value = matrix->value[k];
            entries[k].order = k;
        }
        used = room;
    } else {
        for (i = 0; i < rows; ++i)
            for (j = 0; j < columns; ++j) {
                const double value = matrix->value[(size_t)i * matrix->stride + (size_t)j];
                if (value == 0.0) continue;
                entries[used].row = i;
                entries[used].column = j;
                entries[used].value = value;
                entries[used].order = used;
                ++used;
            }
    }
    for (k = 0; k < used; ++k) {
        if (entries[k].row < 0 || entries[k].row >= rows || entries[k].column < 0 || entries[k].column >= columns)
            return delassus_dump_refuse(state, name, "", (long)entries[k].order, "has a row or a column out of range");
        if (!isfinite(entries[k].value))
            return delassus_dump_refuse(state, name, "", (long)entries[k].order, "has a value that is not finite");
    }
    qsort(entries, used, sizeof *entries, delassus_dump_by_place);
    for (k = 0; k < used; ++k) {
        delassus_dump_entry* last = *count > 0 ? entries + *count - 1 : NULL;
        if (last != NULL && last->row == entries[k].row && last->column == entries[k].column)
            last->value += entries[k].value;
        else
            entries[(*count)++] = entries[k];
    }
    for (k = 0; k < *count; ++k)
        if (!isfinite(entries[k].value))
            return delassus_dump_refuse(state, name, "", (long)entries[k].order, "has a sum that is not finite");
    return 0;
}

/* E as the reader wants it: symmetric to 1e-10 of its largest entry, no negative entry on the diagonal. */
static inline int delassus_dump_check_compliance(const delassus_dump_state* state, const delassus_dump_entry* entries,
                                                 size_t count) {
    double largest = 0.0;
    size_t k;
    for (k = 0; k < count; ++k)
        if (fabs(entries[k].value) > largest) largest = fabs(entries[k].value);
    for (k = 0; k < count; ++k) {
        delassus_dump_entry mirrored = entries[k];
        const delassus_dump_entry* found = NULL;
        size_t low = 0, high = count;
        mirrored.row = entries[k].column;
        mirrored.column = entries[k].row;
        while (low < high) {
            const size_t middle = low + (high - low) / 2;
            const delassus_dump_entry* entry = entries + middle;
            if (entry->row < mirrored.row || (entry->row == mirrored.row && entry->column < mirrored.column))
                low = middle + 1;
            else
                high = middle;
        }
        if (low < count && entries[low].row == mirrored.row && entries[low].column == mirrored.column)
            found = entries + low;
        if (fabs(entries[k].value / largest - (found != NULL ? found->value / largest : 0.0)) > 1e-10)
            return delassus_dump_refuse(state, "E", "", (long)entries[k].order,
                                        "is not symmetric; give both triangles");
        if (entries[k].row == entries[k].column && entries[k].value < 0.0)
            return delassus_dump_refuse(state, "E", "", (long)entries[k].order, "is negative on the diagonal");
    }
    return 0;
}

static inline int delassus_dump_write_matrix(const delassus_dump_state* state, const char* name, int rows, int columns,
                                             const delassus_dump_matrix* matrix) {
    delassus_dump_entry* entries;
    size_t count, k;
    int failed = delassus_dump_gather(state, name, rows, columns, matrix, &entries, &count);
    if (!failed && name[0] == 'E') failed = delassus_dump_check_compliance(state, entries, count);
    if (!failed && count > 0) {
        const char file_name[] = {'/', name[0], '.', 'm', 't', 'x', 0};
        FILE* file = delassus_dump_open(state, file_name);
        failed = file == NULL ? -1 : 0;
        if (file != NULL) {
            fprintf(file, "%%%%MatrixMarket matrix coordinate real general\n%d %d %lu\n", rows, columns,
                    (unsigned long)count);
            for (k = 0; k < count; ++k) {
                fprintf(file, "%d %d ", entries[k].row + 1, entries[k].column + 1);
                delassus_dump_number(file, entries[k].value);
                fputc('\n', file);
            }
            failed = delassus_dump_close(state, file, file_name + 1);
        }
    }
    free(entries);
    return failed;
}

static inline int delassus_dump_write_vector(const delassus_dump_state* state, const char* name, int rows,
                                             const double* vector) {
    const char file_name[] = {'/', name[0], '.', 'm', 't', 'x', 0};
    FILE* file;
    int i;
    if (rows == 0) return 0;
    for (i = 0; i < rows && vector != NULL; ++i)
        if (!isfinite(vector[i])) return delassus_dump_refuse(state, name, "", i, "is not finite");
    file = delassus_dump_open(state, file_name);
    if (file == NULL) return -1;
    fprintf(file, "%%%%MatrixMarket matrix array real general\n%d 1\n", rows);
    for (i = 0; i < rows; ++i) {
        delassus_dump_number(file, vector == NULL ? 0.0 : vector[i]);
        fputc('\n', file);
    }
    return delassus_dump_close(state, file, file_name + 1);
}

static inline void delassus_dump_text(FILE* file, const char* key, const char* text) {
    if (text == NULL || text[0] == 0) return;
    fprintf(file, ",\n \"%s\": \"", key);
    for (; *text != 0; ++text) {
        const unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\')
            fprintf(file, "\\%c", c);
        else if (c < 0x20)
            fprintf(file, "\\u%04x", (unsigned)c);
        else
            fputc(c < 0x7f ? c : '?', file);
    }
    fputc('"', file);
}

static inline void delassus_dump_bounds(FILE* file, const char* key, int rows, const double* bounds) {
    int i;
    fprintf(file, ", \"%s\": [", key);
    for (i = 0; i < rows; ++i) {
        if (i > 0) fputs(", ", file);
        if (isinf(bounds[i]))
            fputs("null", file);
        else
            delassus_dump_number(file, bounds[i]);
    }
    fputc(']', file);
}

static inline int delassus_dump_check_cones(const delassus_dump_state* state, const delassus_dump_problem* problem) {
    size_t k;
    long rows = 0;
    int i;
    if (problem->cone_count > 0 && problem->cones == NULL)
        return delassus_dump_refuse(state, "cones", "", -1, "are missing");
    for (k = 0; k < problem->cone_count; ++k) {
        const delassus_dump_cone* cone = problem->cones + k;
        const int friction = cone->kind == DELASSUS_DUMP_FRICTION;
        if (cone->kind < 0 || cone->kind > 3)
            return delassus_dump_refuse(state, "cones", "", (long)k, "is of no kind that there is");
        if (cone->rows < 1 || (friction && cone->rows != 2 && cone->rows != 3))
            return delassus_dump_refuse(state, "cones", "", (long)k,
                                        "has a wrong number of rows (at least 1; friction: 3, or 2 in the plane)");
        if (friction && !(cone->mu >= 0.0 && isfinite(cone->mu)))
            return delassus_dump_refuse(state, "cones", "", (long)k, "has a mu that is negative or not finite");
        if (cone->kind == DELASSUS_DUMP_BOX) {
            if (cone->lo == NULL || cone->hi == NULL)
                return delassus_dump_refuse(state, "cones", "", (long)k, "is a box without bounds");
            for (i = 0; i < cone->rows; ++i)
                if (!(cone->lo[i] <= cone->hi[i]) || (isinf(cone->lo[i]) && cone->lo[i] > 0.0) ||
                    (isinf(cone->hi[i]) && cone->hi[i] < 0.0))
                    return delassus_dump_refuse(state, "cones", "", (long)k, "is a box without lo <= hi");
        }
        rows += cone->rows;
    }
    if (rows != problem->m) return delassus_dump_refuse(state, "cones", "", -1, "do not have m rows together");
    return 0;
}

static inline int delassus_dump_write_json(const delassus_dump_state* state, const delassus_dump_problem* problem) {
    static const char* const names[] = {"free", "nonnegative", "box", "friction"};
    FILE* file = delassus_dump_open(state, "/problem.json");
    size_t k;
    if (file == NULL) return -1;
    fprintf(file,
            "{\n \"format\": \"delassus-problem\",\n \"version\": 1,\n \"n\": %d,\n \"m\": %d,\n \"law\": \"%s\",\n",
            problem->n, problem->m, problem->coulomb ? "coulomb" : "associated");
    fputs(" \"cones\": [", file);
    for (k = 0; k < problem->cone_count; ++k) {
        const delassus_dump_cone* cone = problem->cones + k;
        fprintf(file, "%s\n  {\"kind\": \"%s\"", k > 0 ? "," : "", names[cone->kind]);
        if (cone->kind == DELASSUS_DUMP_FRICTION) {
            fputs(", \"count\": 1, \"mu\": ", file);
            delassus_dump_number(file, cone->mu);
            fprintf(file, ", \"dimension\": %d}", cone->rows);
            continue;
        }
        fprintf(file, ", \"rows\": %d", cone->rows);
        if (cone->kind == DELASSUS_DUMP_BOX) {
            delassus_dump_bounds(file, "lo", cone->rows, cone->lo);
            delassus_dump_bounds(file, "hi", cone->rows, cone->hi);
        }
        fputc('}', file);
    }
    fputs("]", file);
    delassus_dump_text(file, "source", problem->source);
    delassus_dump_text(file, "notes", problem->notes);
    fputs("\n}\n", file);
    return delassus_dump_close(state, file, "problem.json");
}

/* The temporary folder with all that may be in it. */
static inline void delassus_dump_remove(const delassus_dump_state* state) {
    static const char* const names[] = {"/H.mtx", "/D.mtx", "/E.mtx", "/a.mtx", "/b.mtx", "/problem.json"};
    size_t k;
    for (k = 0; k < sizeof names / sizeof *names; ++k) {
        strcpy(state->path + state->length, names[k]);
        remove(state->path);
    }
    state->path[state->length] = 0;
#if defined(_WIN32)
    _rmdir(state->path);
#else
    remove(state->path);
#endif
}

static inline int delassus_dump(const char* folder, const delassus_dump_problem* problem, char* message, size_t size) {
    static const char suffix[] = ".partial";
    size_t length = strlen(folder);
    delassus_dump_state state;
    struct stat info;
    int failed;
    while (length > 1 && folder[length - 1] == '/') --length;
    state.folder = folder;
    state.message = message;
    state.size = size;
    if (size > 0 && message != NULL) message[0] = 0;
    if (problem->n < 0 || problem->m < 0) return delassus_dump_refuse(&state, "n or m", "", -1, "is negative");
    if (stat(folder, &info) == 0) return delassus_dump_refuse(&state, "something of that name", "", -1, "is there");
    if (delassus_dump_check_cones(&state, problem) != 0) return -1;
    state.path = (char*)malloc(2 * length + 64);
    if (state.path == NULL) return delassus_dump_refuse(&state, "its name", "", -1, "is too long for the memory");
    memcpy(state.path, folder, length);
    memcpy(state.path + length, suffix, sizeof suffix);
    state.length = length + sizeof suffix - 1;
    delassus_dump_remove(&state); /* of a dump that was interrupted */
#if defined(_WIN32)
    failed = _mkdir(state.path);
#else
    failed = mkdir(state.path, 0777);
#endif
    if (failed != 0) {
        delassus_dump_refuse_by_system(&state, state.path);
        free(state.path);
        return -1;
    }
    failed = delassus_dump_write_matrix(&state, "H", problem->n, problem->n, &problem->H) != 0 ||
             delassus_dump_write_matrix(&state, "D", problem->m, problem->n, &problem->D) != 0 ||
             delassus_dump_write_matrix(&state, "E", problem->m, problem->m, &problem->E) != 0 ||
             delassus_dump_write_vector(&state, "a", problem->n, problem->a) != 0 ||
             delassus_dump_write_vector(&state, "b", problem->m, problem->b) != 0 ||
             delassus_dump_write_json(&state, problem) != 0;
    if (!failed) {
        char* target = state.path + state.length + 1;
        memcpy(target, folder, length);
        target[length] = 0;
        state.path[state.length] = 0;
        failed = rename(state.path, target) != 0;
        if (failed) delassus_dump_refuse_by_system(&state, "the last step");
    }
    if (failed) delassus_dump_remove(&state);
    free(state.path);
    return failed ? -1 : 0;
}

#endif /* DELASSUS_DUMP_H */
