/* SPDX-License-Identifier: BSD-3-Clause
 *
 * The border between Delassus and a solver plugin. Plain C, self-contained.
 *
 * A plugin is a shared library that exports one function, delassus_plugin(), which returns a static descriptor.
 * Nothing but what is declared here crosses: no C++ object, no exception, no ownership of memory. A plugin may
 * therefore be built by another compiler, with other vector instructions, or in another language. C++ authors
 * derive from delassus::sdk::Solver (delassus/sdk/solver.hpp) and never see this file.
 *
 * The problem (docs/problem.md; x are velocities, λ reaction impulses in SI scenes, but no unit is assumed):
 *
 *     H x − Dᵀ λ   = a          n rows
 *     D x + E λ + b = u         m rows
 *     λ ∈ Υ  ⊥  u ∈ Υ*          Υ = Υ₁ × Υ₂ × …, one cone for each block of rows
 *
 * Life of a solver: create → (analyze → (factorize → solve*)*)* → destroy. The host calls
 *   analyze    when the pattern changed: n, m, the sparsity of H, D or E, the kinds and sizes of the cones;
 *   factorize  when values of H, D or E changed (always after analyze);
 *   solve      for every right-hand side. a, b, cones' parameters and bounds, and the law may differ at each call.
 * Each call is given the whole problem; its pointers are valid during that call only.
 * A solver is used by one thread at a time; two solvers of one plugin may be used by two threads.
 */
#ifndef DELASSUS_PLUGIN_H
#define DELASSUS_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DELASSUS_PLUGIN_MAGIC 0x53414c44u /* "DLAS" in memory order on a little-endian machine */
/* A minor version adds fields at the end of structs, and bits and numbers; it changes nothing that is there. Either
 * side may be the older one: a field marked "since 2.k" is read only if the struct_size that comes with it covers it.
 * Of a descriptor the host checks that itself: it takes any that has all fields of 2.0.
 * Major version 1 was never released; its cones had no stride. */
#define DELASSUS_ABI_MAJOR 2 /* must be equal on both sides */
#define DELASSUS_ABI_MINOR 6

#if defined(_WIN32)
#define DELASSUS_PLUGIN_EXPORT __declspec(dllexport)
#else
#define DELASSUS_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif

/* ---- The problem --------------------------------------------------------------------------------------------- */

/* A sparse matrix by compressed rows. Columns ascend within a row and do not repeat; all values are finite.
 * An absent matrix has entries = 0 and a row_start of zeros. */
typedef struct delassus_matrix {
    int32_t rows, columns;
    int32_t entries;          /* = row_start[rows] */
    const int32_t* row_start; /* rows + 1 */
    const int32_t* column;    /* entries */
    const double* value;      /* entries */
} delassus_matrix;

typedef enum delassus_cone_kind {
    DELASSUS_CONE_FREE = 0,        /* Υ = Rᵏ, Υ* = {0}: bilateral constraints */
    DELASSUS_CONE_NONNEGATIVE = 1, /* λ ≥ 0, u ≥ 0: frictionless contact, stops */
    DELASSUS_CONE_BOX = 2,         /* lo ≤ λ ≤ hi and the variational inequality of the box */
    DELASSUS_CONE_FRICTION = 3     /* ‖λ_t‖ ≤ μ λ_n, normal first; 3 rows, or 2 in the plane */
} delassus_cone_kind;

/* Cones stand cone_stride bytes apart, so that a minor version can add fields here: see delassus_cone_at(). It can also
 * append parameters to those of a kind. Where such a field or parameter matters, the problem needs a DELASSUS_CAN_* bit
 * of its own: a plugin that does not know it is not called. */
typedef struct delassus_cone {
    int32_t kind;      /* delassus_cone_kind */
    int32_t first_row; /* blocks follow one another and cover all m rows */
    int32_t rows;      /* ≥ 1 */
    int32_t parameter_count;
    const double* parameters; /* parameter_count; friction: [0] is μ ≥ 0. NULL where there are none */
    const double* lo;         /* rows values, −INFINITY allowed; NULL unless a box */
    const double* hi;         /* rows values, +INFINITY allowed; NULL unless a box */
} delassus_cone;

typedef enum delassus_law {
    DELASSUS_LAW_ASSOCIATED = 0, /* the convex cone complementarity problem (seed, eq. 121) */
    DELASSUS_LAW_COULOMB = 1     /* exact Coulomb: u is replaced by u + (μ‖u_t‖, 0, 0) (seed, eq. 72) */
} delassus_law;

/* What a problem can need and a solver can offer. A problem sets exactly one DELASSUS_CAN_H_* or DELASSUS_CAN_REDUCED.
 * The bits 0 to 15 are those of the kinds of cones, by number. */
#define DELASSUS_CAN_CONE(kind) (UINT64_C(1) << (kind))
#define DELASSUS_CAN_FREE DELASSUS_CAN_CONE(0)
#define DELASSUS_CAN_NONNEGATIVE DELASSUS_CAN_CONE(1)
#define DELASSUS_CAN_BOX DELASSUS_CAN_CONE(2)
#define DELASSUS_CAN_FRICTION DELASSUS_CAN_CONE(3)
#define DELASSUS_CAN_ASSOCIATED (UINT64_C(1) << 16)     /* needed only where there are friction cones */
#define DELASSUS_CAN_COULOMB (UINT64_C(1) << 17)        /* likewise */
#define DELASSUS_CAN_H_DIAGONAL (UINT64_C(1) << 24)     /* positive diagonal */
#define DELASSUS_CAN_H_BLOCKS (UINT64_C(1) << 25)       /* small definite blocks: see h_block_start */
#define DELASSUS_CAN_H_DEFINITE (UINT64_C(1) << 26)     /* sparse, symmetric positive definite */
#define DELASSUS_CAN_H_SEMIDEFINITE (UINT64_C(1) << 27) /* symmetric, singular or nearly so, no negative curvature */
#define DELASSUS_CAN_H_INDEFINITE (UINT64_C(1) << 28)   /* symmetric with negative curvature */
#define DELASSUS_CAN_H_UNSYMMETRIC (UINT64_C(1) << 29)
#define DELASSUS_CAN_REDUCED (UINT64_C(1) << 30)     /* n = 0: E λ + b = u */
#define DELASSUS_CAN_COMPLIANCE (UINT64_C(1) << 32)  /* E present while n > 0 */
#define DELASSUS_CAN_REDUNDANT (UINT64_C(1) << 33)   /* rows of D known to depend on one another, where E is zero */
#define DELASSUS_CAN_WARM_START (UINT64_C(1) << 34)  /* x and λ on entry of solve are used */
#define DELASSUS_CAN_DISTRIBUTED (UINT64_C(1) << 35) /* works on all processes of an MPI run together */
#define DELASSUS_CAN_PARTITIONED (UINT64_C(1) << 36) /* takes a problem that no process holds as a whole; since 2.3 */

typedef struct delassus_problem {
    uint32_t struct_size; /* sizeof(delassus_problem) on the host's side */
    int32_t law;          /* delassus_law */
    int32_t n, m;
    delassus_matrix H; /* n × n, both triangles stored */
    delassus_matrix D; /* m × n */
    delassus_matrix E; /* m × m, both triangles stored */
    const double* a;   /* n */
    const double* b;   /* m */
    int32_t cone_count;
    int32_t cone_stride;        /* bytes from one cone to the next, ≥ sizeof(delassus_cone) of version 2.0 */
    const delassus_cone* cones; /* cone_count; delassus_cone_at(problem, k) is the k-th */
    int32_t h_block_count;      /* diagonal blocks of H (connected components of its pattern) */
    int32_t reserved;
    const int32_t* h_block_start; /* h_block_count + 1 positions in h_block_index */
    const int32_t* h_block_index; /* n: the rows of block k are h_block_index[h_block_start[k] … h_block_start[k+1]) */
    uint64_t needs;               /* DELASSUS_CAN_* bits that a solver must have */
    uint64_t pattern_id;          /* equal ids: equal patterns (what analyze may keep) */
    uint64_t values_id;           /* equal ids: equal values of H, D and E (what factorize may keep) */
} delassus_problem;

/* Cone k of a problem, 0 ≤ k < cone_count. */
static inline const delassus_cone* delassus_cone_at(const delassus_problem* problem, int32_t k) {
    return (const delassus_cone*)((const char*)problem->cones + (size_t)k * (size_t)problem->cone_stride);
}

/* ---- A problem in parts (since 2.3) ------------------------------------------------------------------------------
 *
 * The problem of all processes of an MPI run together, of which each holds its own part: the rows of H, a and x of
 * whole bodies, and the rows of D, E, b and λ of whole cones. Process p owns the numbers column_start[p] to
 * column_start[p + 1] − 1 of x, and row_start[p] to row_start[p + 1] − 1 of λ. Columns are numbered through all
 * processes: those of D may be anybody's. A process may own nothing. */

/* Rows of one process, by compressed rows. Columns ascend within a row and do not repeat; all values are finite.
 * An absent matrix has entries = 0 and a row_start of zeros. */
typedef struct delassus_local_matrix {
    int64_t rows;             /* of this process */
    int64_t columns;          /* of all processes */
    int64_t entries;          /* = row_start[rows] */
    const int64_t* row_start; /* rows + 1 */
    const int64_t* column;    /* entries; numbers through all processes */
    const double* value;      /* entries */
} delassus_local_matrix;

typedef struct delassus_local_problem {
    uint32_t struct_size; /* sizeof(delassus_local_problem) on the host's side */
    int32_t law;          /* delassus_law */
    int32_t communicator; /* of these processes: MPI_Comm_f2c(communicator) where processes > 1, else nothing */
    int32_t processes, process;
    int32_t cone_stride; /* as in delassus_problem */
    int64_t n, m;        /* own: the sizes of a and b */
    int64_t n_all, m_all;
    const int64_t* column_start;  /* processes + 1, from 0 to n_all */
    const int64_t* row_start;     /* processes + 1, from 0 to m_all */
    delassus_local_matrix H;      /* n × n_all, both triangles stored */
    delassus_local_matrix D;      /* m × n_all */
    delassus_local_matrix E;      /* m × m_all, both triangles stored */
    const double* a;              /* n */
    const double* b;              /* m */
    int64_t cone_count;           /* own */
    const delassus_cone* cones;   /* own; first_row counts within this process */
    int64_t h_block_count;        /* own diagonal blocks of H where H is DIAGONAL or BLOCKS; else 0 */
    const int64_t* h_block_start; /* h_block_count + 1 positions in h_block_index; NULL where there are none */
    const int64_t* h_block_index; /* n: the own rows, from 0, of block k, as in delassus_problem */
    uint64_t needs;               /* DELASSUS_CAN_* bits that a solver must have, DELASSUS_CAN_PARTITIONED among them */
    uint64_t pattern_id, values_id; /* as in delassus_problem; equal on all processes */
} delassus_local_problem;

/* ---- Options ------------------------------------------------------------------------------------------------- */

typedef enum delassus_option_type {
    DELASSUS_OPTION_BOOLEAN = 0, /* integer 0 or 1 */
    DELASSUS_OPTION_INTEGER = 1,
    DELASSUS_OPTION_REAL = 2,
    DELASSUS_OPTION_CHOICE = 3, /* text, one of choices */
    DELASSUS_OPTION_TEXT = 4
} delassus_option_type;

typedef struct delassus_option {
    const char* key; /* lower_snake_case, unique in the table */
    int32_t type;    /* delassus_option_type */
    int32_t choice_count;
    const char* default_value;  /* as a user would write it; "true" or "false" for booleans */
    double minimum, maximum;    /* closed range of numbers; ±INFINITY where open */
    const char* const* choices; /* choice_count */
    const char* unit;           /* "" where there is none */
    const char* doc;            /* one line */
} delassus_option;

typedef struct delassus_option_value {
    const char* key;
    int32_t type;
    int32_t reserved;
    int64_t integer;  /* booleans and integers */
    double real;      /* reals */
    const char* text; /* choices and texts; NULL otherwise */
} delassus_option_value;

/* ---- A solve ------------------------------------------------------------------------------------------------- */

/* What every operation returns, and how a solve ended. Not converging is a status, not an error. */
typedef enum delassus_status {
    DELASSUS_SOLVED = 0, /* analyze and factorize return it for "done" */
    DELASSUS_ITERATION_LIMIT = 1,
    DELASSUS_TIME_LIMIT = 2,
    DELASSUS_STALLED = 3,
    DELASSUS_INFEASIBLE = 4,
    DELASSUS_NUMERICAL_FAILURE = 5,
    DELASSUS_CANCELLED = 6,
    DELASSUS_ERROR = 7 /* misuse or a fault of the plugin: last_error says which */
} delassus_status;

typedef enum delassus_answer {
    DELASSUS_CONTINUE = 0,
    DELASSUS_STOP_TIME = 1,  /* end with DELASSUS_TIME_LIMIT */
    DELASSUS_STOP_CANCEL = 2 /* end with DELASSUS_CANCELLED */
} delassus_answer;

/* Called by solve about once an iteration, with the iterate in the problem's own units. x (n) may be NULL: the host
 * then computes H⁻¹(a + Dᵀλ). λ (m) may not. The host's clock stands still meanwhile. Returns a delassus_answer,
 * which solve obeys at once, leaving its best iterate in x and λ. */
typedef int32_t (*delassus_progress)(void* context, int64_t iteration, const double* x, const double* lambda);

typedef struct delassus_request {
    uint32_t struct_size;
    int32_t warm_start;         /* 0: ignore x and λ on entry */
    double tolerance;           /* the natural error to reach (docs/errors.md), > 0 */
    int64_t max_iterations;     /* ≥ 0; of the solver's own kind of iteration */
    double time_limit;          /* seconds, INFINITY for none; for planning only: progress enforces it */
    delassus_progress progress; /* NULL: nobody listens */
    void* progress_context;
    /* Since 2.6. 1: go on where the last call of this solver stopped, at max_iterations or as progress asked, after at
     * least one iteration: it solved the same problem, and x and λ are as it left them. The iterates are to be those of
     * a solve that was not stopped; they count anew. Only plugins with DELASSUS_FLAG_RESUMES are asked. */
    int32_t resume;
    int32_t reserved;
} delassus_request;

/* Since 2.4. What a solve spends its time on in one process. Every second belongs to one phase at most; what belongs to
 * none is the method's own work on vectors. */
typedef enum delassus_phase {
    DELASSUS_PHASE_PRODUCTS = 0,       /* products with the matrices of the problem, without the two below */
    DELASSUS_PHASE_PROJECTIONS = 1,    /* cone by cone: projections, scalings, steps to the boundary */
    DELASSUS_PHASE_LINEAR_SYSTEMS = 2, /* making, factoring and solving linear systems, with what they communicate */
    DELASSUS_PHASE_EXCHANGE = 3,       /* messages between neighbours, but for the waiting */
    DELASSUS_PHASE_REDUCTIONS = 4,     /* sums and the like over all processes, but for the waiting */
    DELASSUS_PHASE_WAITING = 5         /* for other processes, in exchanges and reductions (docs/partitioned.md) */
} delassus_phase;
#define DELASSUS_PHASE_COUNT 6

typedef struct delassus_outcome {
    uint32_t struct_size; /* set by the host; write only fields that lie within */
    int32_t status;       /* delassus_status */
    int64_t iterations;
    int64_t analyses;       /* symbolic analyses since create */
    int64_t factorizations; /* numerical factorisations since create */
    double residual; /* the solver's own idea of the natural error; NaN if it has none; never reported as the error */
    const char* message; /* what a person should know, or NULL; owned by the solver, valid until its next call */
    /* Since 2.4. What this call cost this process. A solver that does not measure a figure leaves it as it is. */
    double* phase_seconds; /* the host's, phase_count long, NaN on entry, by delassus_phase; NULL: nobody asks */
    int32_t phase_count;   /* a later minor version may have more phases than the other side knows */
    int32_t reserved;
    int64_t bytes_sent; /* to other processes; −1 on entry */
} delassus_outcome;

/* ---- Threads --------------------------------------------------------------------------------------------------- */

/* Since 2.2. Threads of the host that a solver may share its work among. They sleep while there is nothing to do. */
typedef struct delassus_team {
    uint32_t struct_size;
    int32_t size; /* members, the calling thread among them; ≥ 1 */
    void* context;
    /* task(data, member) by every member at once, member 0 by the caller; returns when all are done. A task calls
     * neither run nor progress, and ends without an exception. */
    void (*run)(void* context, void (*task)(void* data, int32_t member), void* data);
    /* Called by every member inside a task: no member goes on before all have come. */
    void (*barrier)(void* context);
} delassus_team;

/* ---- The descriptor ------------------------------------------------------------------------------------------ */
#define DELASSUS_FLAG_GLOBAL_SYMBOLS 1u /* load with RTLD_GLOBAL (libraries that load parts of themselves) */
#define DELASSUS_FLAG_MPI 2u            /* starts MPI when first created */
#define DELASSUS_FLAG_PEER 4u           /* for comparisons: works only where it is named, never as a last resort */
/* Since 2.5. It converges fast near a solution and hardly elsewhere: `auto` starts it at the best iterate of all. */
#define DELASSUS_FLAG_LOCAL 8u
/* Since 2.6. It keeps its state after a solve that was stopped, and can go on from there (delassus_request.resume). */
#define DELASSUS_FLAG_RESUMES 16u

/* Since 2.5. Whether the compiler optimised the plugin. Its times say little if not, and the host says so wherever it
 * shows or compares them. DELASSUS_BUILD is the number of the compilation at hand. */
#define DELASSUS_BUILD_UNKNOWN 0u
#define DELASSUS_BUILD_OPTIMIZED 1u
#define DELASSUS_BUILD_UNOPTIMIZED 2u
#if defined(__OPTIMIZE__)
#define DELASSUS_BUILD DELASSUS_BUILD_OPTIMIZED
#elif defined(__GNUC__)
#define DELASSUS_BUILD DELASSUS_BUILD_UNOPTIMIZED
#else
#define DELASSUS_BUILD DELASSUS_BUILD_UNKNOWN
#endif

typedef struct delassus_plugin_descriptor {
    uint32_t magic;       /* DELASSUS_PLUGIN_MAGIC */
    uint16_t abi_major;   /* DELASSUS_ABI_MAJOR */
    uint16_t abi_minor;   /* DELASSUS_ABI_MINOR */
    uint32_t struct_size; /* sizeof(delassus_plugin_descriptor) on the plugin's side */
    uint32_t flags;       /* DELASSUS_FLAG_* */
    const char* name;     /* lower-case word, unique among plugins */
    const char* version;
    const char* description; /* one line */
    const char* licence;     /* SPDX expression of the plugin together with what it links */
    uint64_t capabilities;   /* DELASSUS_CAN_* */
    const delassus_option* options;
    int32_t option_count;
    int32_t reserved;

    /* Makes a solver. values holds every option of the table, in its order. On failure *solver stays NULL and
     * last_error(NULL) explains. */
    int32_t (*create)(const delassus_option_value* values, int32_t count, void** solver);
    void (*destroy)(void* solver);

    int32_t (*analyze)(void* solver, const delassus_problem* problem);
    int32_t (*factorize)(void* solver, const delassus_problem* problem);

    /* x: n, λ: m, both in and out. Writes *outcome. Returns outcome->status. */
    int32_t (*solve)(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                     double* lambda, delassus_outcome* outcome);

    /* One sentence on the last DELASSUS_ERROR or DELASSUS_NUMERICAL_FAILURE; never NULL. */
    const char* (*last_error)(void* solver);

    /* Since 2.1. Optional (may be NULL): a last look at a problem whose needs are all met. Returns 1 to take it, or 0
     * after writing a short NUL-terminated reason. Cheap: no factorisation. */
    int32_t (*accepts)(void* solver, const delassus_problem* problem, char* reason, int32_t capacity);

    /* Since 2.2. Optional (may be NULL): the threads that analyze, factorize and solve may use from now on, NULL for
     * the calling thread alone. *team stays as it is until the next call. Results must not depend on the size, to the
     * bit.
     */
    void (*use_team)(void* solver, const delassus_team* team);

    /* Since 2.3. What analyze, factorize and solve are for a whole problem; NULL without DELASSUS_CAN_PARTITIONED.
     * Collective: the host calls each on all processes at once, and all return the same status. x: n, λ: m, both in and
     * out, own parts. progress is collective too: it is called on all processes for the same iteration, with the own
     * parts of the iterate, and answers the same on all. */
    int32_t (*analyze_partitioned)(void* solver, const delassus_local_problem* problem);
    int32_t (*factorize_partitioned)(void* solver, const delassus_local_problem* problem);
    int32_t (*solve_partitioned)(void* solver, const delassus_local_problem* problem, const delassus_request* request,
                                 double* x, double* lambda, delassus_outcome* outcome);

    uint32_t build; /* since 2.5: DELASSUS_BUILD */
    uint32_t reserved_2;
} delassus_plugin_descriptor;

/* The one exported symbol. */
DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin(void);

#define DELASSUS_PLUGIN_SYMBOL "delassus_plugin"

#ifdef __cplusplus
}
#endif
#endif
