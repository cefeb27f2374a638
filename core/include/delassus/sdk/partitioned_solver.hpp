// SPDX-License-Identifier: BSD-3-Clause
// The base class of solvers that take a problem in parts, of which each process of an MPI run holds its own. It needs
// no MPI itself; a solver's library turns the communicator's handle into its own (MPI_Comm_f2c).
#pragma once

#include <numeric>
#include <span>
#include <vector>

#include "delassus/sdk/solver.hpp"

namespace delassus::sdk {

/// Own rows of a matrix; columns are numbered through all processes. See delassus_local_matrix.
struct LocalMatrixView {
    explicit LocalMatrixView(const delassus_local_matrix& matrix)
        : rows(matrix.rows),
          columns(matrix.columns),
          row_start(matrix.row_start, static_cast<std::size_t>(matrix.rows) + 1),
          column(matrix.column, static_cast<std::size_t>(matrix.entries)),
          value(matrix.value, static_cast<std::size_t>(matrix.entries)) {}

    std::int64_t rows, columns;
    std::span<const std::int64_t> row_start, column;
    std::span<const double> value;
};

/// The own part of H x − Dᵀλ = a, D x + E λ + b = u, λ ∈ Υ ⊥ u ∈ Υ*: see delassus_local_problem for every field.
/// Nothing is copied; a view is valid during one call.
struct LocalProblemView {
    explicit LocalProblemView(const delassus_local_problem& problem)
        : n(problem.n),
          m(problem.m),
          H(problem.H),
          D(problem.D),
          E(problem.E),
          a(problem.a, problem.n),
          b(problem.b, problem.m),
          column_start(problem.column_start, static_cast<std::size_t>(problem.processes) + 1),
          row_start(problem.row_start, static_cast<std::size_t>(problem.processes) + 1),
          cones(problem),
          h_block_start(problem.h_block_start, blocks(problem)),
          h_block_index(problem.h_block_index, problem.h_block_count > 0 ? static_cast<std::size_t>(problem.n) : 0),
          coulomb(problem.law == DELASSUS_LAW_COULOMB),
          needs(problem.needs),
          raw(&problem) {}

    [[nodiscard]] bool needs_any(std::uint64_t bits) const { return (needs & bits) != 0; }
    /// The number of the first own entry of x, and of λ, among those of all processes.
    [[nodiscard]] std::int64_t first_column() const { return column_start[static_cast<std::size_t>(raw->process)]; }
    [[nodiscard]] std::int64_t first_row() const { return row_start[static_cast<std::size_t>(raw->process)]; }
    /// Own cone k; its first_row counts within this process.
    [[nodiscard]] const delassus_cone& cone(std::int64_t k) const { return cones[static_cast<std::size_t>(k)]; }

    Eigen::Index n, m;                                           ///< own
    LocalMatrixView H;                                           ///< n × n_all, both triangles
    LocalMatrixView D;                                           ///< m × n_all
    LocalMatrixView E;                                           ///< m × m_all, both triangles; no entries if absent
    VectorView a;                                                ///< n
    VectorView b;                                                ///< m
    std::span<const std::int64_t> column_start, row_start;       ///< processes + 1
    ConeRange cones;                                             ///< own
    std::span<const std::int64_t> h_block_start, h_block_index;  ///< empty unless H is DIAGONAL or BLOCKS
    bool coulomb;                                                ///< exact Coulomb law; otherwise associated
    std::uint64_t needs;                                         ///< DELASSUS_CAN_* bits
    const delassus_local_problem* raw;

private:
    static std::size_t blocks(const delassus_local_problem& problem) {
        return problem.h_block_count > 0 ? static_cast<std::size_t>(problem.h_block_count) + 1 : 0;
    }
};

/// A whole problem as the part of the only process. Its index arrays are copies with 64-bit numbers; values, cones and
/// right-hand sides are the whole problem's own.
class WholeAsPart {
public:
    explicit WholeAsPart(const delassus_problem& whole) : column_start_{0, whole.n}, row_start_{0, whole.m} {
        local_.struct_size = sizeof local_;
        local_.law = whole.law;
        local_.processes = 1;
        local_.cone_stride = whole.cone_stride;
        local_.n = local_.n_all = whole.n;
        local_.m = local_.m_all = whole.m;
        local_.column_start = column_start_.data();
        local_.row_start = row_start_.data();
        local_.H = widen(whole.H, H_);
        local_.D = widen(whole.D, D_);
        local_.E = widen(whole.E, E_);
        local_.a = whole.a;
        local_.b = whole.b;
        local_.cone_count = whole.cone_count;
        local_.cones = whole.cones;
        if ((whole.needs & (DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS)) != 0) {
            block_start_.assign(whole.h_block_start, whole.h_block_start + whole.h_block_count + 1);
            block_index_.assign(whole.h_block_index, whole.h_block_index + whole.n);
            local_.h_block_count = whole.h_block_count;
            local_.h_block_start = block_start_.data();
            local_.h_block_index = block_index_.data();
        }
        local_.needs = whole.needs | DELASSUS_CAN_PARTITIONED;
        local_.pattern_id = whole.pattern_id;
        local_.values_id = whole.values_id;
    }
    WholeAsPart(const WholeAsPart&) = delete;
    WholeAsPart& operator=(const WholeAsPart&) = delete;

    [[nodiscard]] const delassus_local_problem& local() const { return local_; }

private:
    struct Wide {
        std::vector<std::int64_t> row_start, column;
    };
    static delassus_local_matrix widen(const delassus_matrix& matrix, Wide& wide) {
        wide.row_start.assign(matrix.row_start, matrix.row_start + matrix.rows + 1);
        wide.column.assign(matrix.column, matrix.column + matrix.entries);
        return {matrix.rows, matrix.columns, matrix.entries, wide.row_start.data(), wide.column.data(), matrix.value};
    }

    std::vector<std::int64_t> column_start_, row_start_, block_start_, block_index_;
    Wide H_, D_, E_;
    delassus_local_problem local_{};
};

/// A solver of partitioned problems. Every operation is called on all processes at once; what one process finds out
/// (a failure, the end of the time) it has to agree on with the others before it acts. A whole problem is the case of
/// one process.
class PartitionedSolver : public Solver {
public:
    using LocalView = LocalProblemView;
    using LocalBase = PartitionedSolver;

    virtual void analyze(const LocalProblemView& problem) = 0;
    virtual void factorize(const LocalProblemView& problem) = 0;
    /// x: n, lambda: m, own parts; on entry the start if request.warm_start(), on return the best iterate.
    virtual Outcome solve(const LocalProblemView& problem, const Request& request, MutableVectorView x,
                          MutableVectorView lambda) = 0;

    void analyze(const ProblemView& problem) final { analyze(LocalProblemView(WholeAsPart(*problem.raw).local())); }
    void factorize(const ProblemView& problem) final { factorize(LocalProblemView(WholeAsPart(*problem.raw).local())); }
    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) final {
        const WholeAsPart whole(*problem.raw);
        return solve(LocalProblemView(whole.local()), request, x, lambda);
    }
};

}  // namespace delassus::sdk
