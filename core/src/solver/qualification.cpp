// SPDX-License-Identifier: BSD-3-Clause
// The pointed friction cone by one convex problem. Let e have a 1 on each normal (and nonnegative) row and 0 elsewhere;
// e lies inside Υ*, and eᵀλ > 0 for every λ ∈ Υ but 0 if there are no free rows. Consider
//
//     minimise  ½ ‖Dᵀλ‖² + ½ (eᵀλ − 1)²   over λ ∈ Υ.
//
// It is the problem with the velocities (x, s), H = 1, D' = [D e], a' = (0, −1), b' = 0: x = Dᵀλ, s = eᵀλ − 1,
// u = D x + e s. It always has a solution, with ⟨λ, u⟩ = ‖x‖² + (eᵀλ) s = 0. Either
//   s < 0: D x = u + |s| e lies inside Υ* on all cones and is 0 on free rows. A λ ∈ Υ with Dᵀλ = 0 would have
//          0 = ⟨λ, D x⟩ > 0 unless its cone part vanished. So the cone is pointed, up to dependence among the free
//          rows. The smallest ‖Dᵀλ‖ with eᵀλ = 1 is d = ‖x‖/eᵀλ by homogeneity.
//   s = 0: Dᵀλ = 0 with eᵀλ = 1: λ itself shows that the cone is not pointed.
// A reduced problem has E in the place of D Dᵀ: one velocity s, D' = e.
#include "delassus/qualification.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "delassus/errors.hpp"
#include "delassus/rank.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus {

namespace {

constexpr double tolerance = 1e-11;
constexpr double accepted = 1e-8;   // natural error of an answer that is believed
constexpr double vanishing = 1e-6;  // d below it cannot be told from 0: λᵀNλ is known to about 1e-14

/// visit(row, column, value) for each entry.
template <class Visit>
void for_each_entry(const SparseMatrix& matrix, Visit&& visit) {
    for (std::int32_t row = 0; row < matrix.rows; ++row)
        for (auto k = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row)]);
             k < static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row) + 1]); ++k)
            visit(row, matrix.column[k], matrix.value[k]);
}

/// What the rows of N are made of.
const SparseMatrix& geometry(const Problem& problem) {
    return problem.n() > 0 ? problem.D : problem.E;
}

/// A row that takes part: in the problem, and its factor there.
struct Row {
    std::int32_t index = 0;
    double factor = 1.0;
    bool normal = false;
};

/// The cones of the directions in which λ may grow without bound.
struct Recession {
    std::vector<Row> rows;
    std::vector<Cone> cones;
    std::vector<std::int32_t> free;  // indices of free rows

    void add(Row row, Cone cone) {
        rows.push_back(row);
        cones.push_back(std::move(cone));
    }
};

Recession recession_of(const Problem& problem) {
    Recession recession;
    std::int32_t first = 0;
    for (const Cone& cone : problem.cones) {
        const sdk::ConeOperations& kind = operations_of(cone);
        const delassus_cone raw = raw_cone(cone);
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const std::int32_t index = first + i;
            if (!kind.is_separable()) {
                if (kind.is_cone) recession.rows.push_back({index, 1.0, i == 0});
                continue;
            }
            const auto [lo, hi] = kind.interval(raw, i);
            if (std::isinf(lo) && std::isinf(hi)) {
                recession.add({index, 1.0, false}, Cone::free(1));
                recession.free.push_back(index);
            } else if (std::isinf(hi)) {
                recession.add({index, 1.0, true}, Cone::nonnegative(1));
            } else if (std::isinf(lo)) {
                recession.add({index, -1.0, true}, Cone::nonnegative(1));
            }
        }
        if (!kind.is_separable() && kind.is_cone) recession.cones.push_back(cone);
        first += cone.rows;
    }
    return recession;
}

/// The squared length of each of the problem's rows: of D, or the diagonal of E.
std::vector<double> squared_rows(const Problem& problem) {
    std::vector<double> square(static_cast<std::size_t>(problem.m()), 0.0);
    for_each_entry(geometry(problem), [&](std::int32_t row, std::int32_t column, double value) {
        if (problem.n() > 0) square[static_cast<std::size_t>(row)] += value * value;
        if (problem.n() == 0 && column == row) square[static_cast<std::size_t>(row)] += value;
    });
    return square;
}

/// Scales each block by one factor, so that its rows have length 1 in the mean. A block without entries is left alone.
void scale(Recession& recession, const std::vector<double>& square) {
    std::size_t row = 0;
    for (const Cone& cone : recession.cones) {
        double sum = 0.0;
        for (std::int32_t i = 0; i < cone.rows; ++i)
            sum += square[static_cast<std::size_t>(recession.rows[row + static_cast<std::size_t>(i)].index)];
        const double factor = sum > 0.0 ? std::sqrt(cone.rows / sum) : 1.0;
        for (std::int32_t i = 0; i < cone.rows; ++i) recession.rows[row++].factor *= factor;
    }
}

/// The problem of the head of this file.
Problem feasibility_problem(const Problem& problem, const Recession& recession) {
    const auto n = problem.n();
    const auto m = static_cast<std::int32_t>(recession.rows.size());
    std::vector<std::int32_t> place(static_cast<std::size_t>(problem.m()), -1);
    for (std::int32_t i = 0; i < m; ++i)
        place[static_cast<std::size_t>(recession.rows[static_cast<std::size_t>(i)].index)] = i;
    const auto factor = [&](std::int32_t i) { return recession.rows[static_cast<std::size_t>(i)].factor; };

    std::vector<Triplet> D, E, H;
    for_each_entry(geometry(problem), [&](std::int32_t row, std::int32_t column, double value) {
        const std::int32_t i = place[static_cast<std::size_t>(row)];
        if (i < 0) return;
        if (n > 0) {
            D.push_back({i, column, factor(i) * value});
        } else if (const std::int32_t j = place[static_cast<std::size_t>(column)]; j >= 0) {
            E.push_back({i, j, factor(i) * value * factor(j)});
        }
    });
    for (std::int32_t i = 0; i < m; ++i)
        if (recession.rows[static_cast<std::size_t>(i)].normal) D.push_back({i, n, 1.0});
    for (std::int32_t j = 0; j <= n; ++j) H.push_back({j, j, 1.0});

    Problem result;
    result.name = problem.name + ", qualification";
    result.H = SparseMatrix::from_triplets(n + 1, n + 1, std::move(H));
    result.D = SparseMatrix::from_triplets(m, n + 1, std::move(D));
    if (n == 0) result.E = SparseMatrix::from_triplets(m, m, std::move(E));
    result.a.assign(static_cast<std::size_t>(n) + 1, 0.0);
    result.a.back() = -1.0;
    result.b.assign(static_cast<std::size_t>(m), 0.0);
    result.cones = recession.cones;
    return result;
}

/// The problem of some rows alone, for their rank.
Problem rows_of(const Problem& problem, const std::vector<std::int32_t>& rows) {
    std::vector<std::int32_t> place(static_cast<std::size_t>(problem.m()), -1);
    for (std::size_t i = 0; i < rows.size(); ++i)
        place[static_cast<std::size_t>(rows[i])] = static_cast<std::int32_t>(i);
    const SparseMatrix& source = geometry(problem);
    std::vector<Triplet> entries;
    for_each_entry(source, [&](std::int32_t row, std::int32_t column, double value) {
        if (const std::int32_t i = place[static_cast<std::size_t>(row)]; i >= 0) entries.push_back({i, column, value});
    });
    Problem result;
    result.D = SparseMatrix::from_triplets(static_cast<std::int32_t>(rows.size()), source.columns, std::move(entries));
    result.a.assign(static_cast<std::size_t>(source.columns), 0.0);
    result.b.assign(rows.size(), 0.0);
    return result;
}

void find_pointedness(const Problem& problem, const Recession& recession, const Registry& registry,
                      Qualification& answer) {
    const PreparedProblem prepared(feasibility_problem(problem, recession));
    Solver solver = make_solver(registry, parse_solver("auto"));
    Solution solution;
    SolveSettings settings;
    settings.tolerance = tolerance;
    const SolveReport report = solver.solve(prepared, solution, settings);
    if (!(report.error.natural <= accepted)) return;

    // Not computed from s, whose root would lose half of the digits.
    double square = 0.0, sum = 0.0;
    for (std::int32_t j = 0; j < problem.n(); ++j)
        square += solution.x[static_cast<std::size_t>(j)] * solution.x[static_cast<std::size_t>(j)];
    if (problem.n() == 0) {
        std::vector<double> image(solution.lambda.size(), 0.0);
        prepared.problem().E.multiply_add(1.0, solution.lambda.data(), image.data());
        for (std::size_t i = 0; i < image.size(); ++i) square += solution.lambda[i] * image[i];
    }
    for (std::size_t i = 0; i < recession.rows.size(); ++i)
        if (recession.rows[i].normal) sum += solution.lambda[i];
    answer.pointedness = std::sqrt(std::max(0.0, square)) / sum;
    const bool dependent = answer.free_rank && *answer.free_rank < answer.free_rows;
    if (answer.pointedness <= vanishing) {
        answer.pointed = Answer::No;
        answer.cancelling.assign(static_cast<std::size_t>(problem.m()), 0.0);
        double normals = 0.0;
        for (std::size_t i = 0; i < recession.rows.size(); ++i) {
            const Row& row = recession.rows[i];
            const double value = row.factor * solution.lambda[i];
            answer.cancelling[static_cast<std::size_t>(row.index)] = value;
            if (row.normal) normals += std::abs(value);
        }
        for (double& value : answer.cancelling) value /= normals;
    } else {
        answer.pointed = dependent ? Answer::No : Answer::Yes;
    }
}

}  // namespace

Qualification qualify(const Problem& problem, const Registry& registry) {
    validate(problem);
    Qualification answer;
    answer.rows = problem.m();
    answer.rank = estimate_rank(problem);
    if (answer.rank) answer.independent = *answer.rank == answer.rows ? Answer::Yes : Answer::No;

    Recession recession = recession_of(problem);
    answer.free_rows = static_cast<std::int32_t>(recession.free.size());
    answer.free_rank = recession.free.empty() ? 0 : estimate_rank(rows_of(problem, recession.free));
    if (recession.rows.size() == recession.free.size()) {  // no cone but free rows
        answer.pointedness = std::numeric_limits<double>::infinity();
        if (answer.free_rank) answer.pointed = *answer.free_rank == answer.free_rows ? Answer::Yes : Answer::No;
        return answer;
    }
    scale(recession, squared_rows(problem));
    find_pointedness(problem, recession, registry, answer);
    return answer;
}

}  // namespace delassus
