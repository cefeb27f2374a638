// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <span>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/symmetry.hpp"
#include "problem/validate.hpp"
#include "support/finite.hpp"

namespace delassus {
namespace {

/// Refuses with one sentence that begins with the problem's name.
class Checker {
public:
    Checker(const Problem& problem, const Known& known) : problem_(problem), known_(known) {}

    void run() const {
        vector(problem_.a, "a");
        if (!known_.rows) vector(problem_.b, "b");
        const std::int32_t n = problem_.n();
        const std::int32_t m = problem_.m();
        if (!known_.places) places(problem_.H, "H", n, n, "n × n");
        if (!known_.H) values(problem_.H, "H");
        if (n > 0 && problem_.H.rows == 0) {
            refuse("H is absent, but a has {} entries; give an {} × {} matrix, or an empty a for a reduced problem.", n,
                   n, n);
        }
        if (!known_.places) places(problem_.D, "D", m, n, "m × n");
        if (!known_.rows) values(problem_.D, "D");
        if (!known_.places) places(problem_.E, "E", m, m, "m × m");
        values(problem_.E, "E");
        cones();
        compliance();
        if (!known_.H || !known_.places) symmetry_of_H();
        if (problem_.law != Law::Associated && problem_.law != Law::Coulomb) {
            refuse("its friction law has the number {}; 0 (associated) and 1 (coulomb) exist.",
                   static_cast<int>(problem_.law));
        }
    }

private:
    template <class Exception = InputError, class... Arguments>
    [[noreturn]] void refuse(fmt::format_string<Arguments...> text, Arguments&&... arguments) const {
        const std::string sentence = fmt::format(text, std::forward<Arguments>(arguments)...);
        if (problem_.name.empty()) throw Exception("The problem is not valid: " + sentence);
        throw Exception(fmt::format("The problem \"{}\" is not valid: {}", problem_.name, sentence));
    }

    void vector(std::span<const double> v, const char* name) const {
        if (v.size() >= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
            refuse("{} has {} entries; at most 2147483646 are possible.", name, v.size());
        }
        if (all_finite(v)) return;
        for (std::size_t k = 0; k < v.size(); ++k) {
            if (!std::isfinite(v[k])) refuse<NotFinite>("{}[{}] is {}; every entry must be finite.", name, k, v[k]);
        }
    }

    void places(const SparseMatrix& A, const char* name, std::int32_t rows, std::int32_t columns,
                const char* shape) const {
        const bool absent = A.rows == 0 && A.columns == 0;
        if (!absent && (A.rows != rows || A.columns != columns)) {
            refuse("{} is {} × {}; it must be {} = {} × {}, since a has {} and b has {} entries.", name, A.rows,
                   A.columns, shape, rows, columns, problem_.n(), problem_.m());
        }
        if (A.row_start.size() != static_cast<std::size_t>(A.rows) + 1) {
            refuse("{}.row_start has {} positions; {} rows need {}.", name, A.row_start.size(), A.rows,
                   static_cast<std::int64_t>(A.rows) + 1);
        }
        if (A.column.size() != A.value.size()) {
            refuse("{} has {} columns and {} values; each entry needs one of each.", name, A.column.size(),
                   A.value.size());
        }
        if (A.row_start[0] != 0 || A.row_start.back() < 0 ||
            static_cast<std::size_t>(A.row_start.back()) != A.value.size()) {
            refuse("{}.row_start goes from {} to {}; it must go from 0 to the number of entries, {}.", name,
                   A.row_start[0], A.row_start.back(), A.value.size());
        }
        // All positions first: only then is it safe to look at the entries of a row.
        for (std::int32_t row = 0; row < A.rows; ++row) {
            if (A.row_start[row + 1] < A.row_start[row]) {
                refuse("{}.row_start descends at row {}; positions must not descend.", name, row);
            }
        }
        for (std::int32_t row = 0; row < A.rows; ++row) {
            if (columns_ascend(A, row)) continue;
            for (std::int32_t k = A.row_start[row]; k < A.row_start[row + 1]; ++k) {
                if (A.column[k] < 0 || A.column[k] >= A.columns) {
                    refuse("row {} of {} has an entry in column {}; columns go from 0 to {}.", row, name, A.column[k],
                           A.columns - 1);
                }
                if (k > A.row_start[row] && A.column[k] <= A.column[k - 1]) {
                    refuse("row {} of {} has column {} after column {}; columns must ascend and not repeat.", row, name,
                           A.column[k], A.column[k - 1]);
                }
            }
        }
    }

    /// From 0 to the number of columns − 1. Without a branch an entry.
    static bool columns_ascend(const SparseMatrix& A, std::int32_t row) {
        const std::int32_t *first = A.column.data() + A.row_start[row], *last = A.column.data() + A.row_start[row + 1];
        if (first == last) return true;
        bool ascends = *first >= 0 && last[-1] < A.columns;
        for (; first + 1 < last; ++first) ascends &= first[0] < first[1];
        return ascends;
    }

    void values(const SparseMatrix& A, const char* name) const {
        if (all_finite(A.value)) return;
        for (std::int32_t row = 0; row < A.rows; ++row) {
            for (std::int32_t k = A.row_start[row]; k < A.row_start[row + 1]; ++k) {
                if (!std::isfinite(A.value[k])) {
                    refuse<NotFinite>("{}({}, {}) is {}; every entry must be finite.", name, row, A.column[k],
                                      A.value[k]);
                }
            }
        }
    }

    void cones() const {
        std::int64_t rows = 0;
        for (std::size_t c = 0; c < problem_.cones.size(); ++c) {
            const Cone& block = problem_.cones[c];
            if (!is_known(block.kind)) {
                refuse("cone {} has the kind number {}; 0 to {} exist.", c, static_cast<int>(block.kind),
                       sdk::cone_table.size() - 1);
            }
            const sdk::ConeOperations& kind = operations_of(block);
            if (block.rows < kind.least_rows || block.rows > kind.most_rows) {
                refuse("cone {} has {} rows; one of the kind {} has {}.", c, block.rows, kind.name, kind.allowed_rows);
            }
            parameters(block, kind, c);
            bounds(block, kind, c);
            rows += block.rows;
        }
        if (rows != problem_.m()) {
            refuse("its cones cover {} rows, but b has {} entries; each row belongs to one cone.", rows, problem_.m());
        }
    }

    void parameters(const Cone& block, const sdk::ConeOperations& kind, std::size_t c) const {
        const auto known = kind.named_parameters();
        for (std::size_t k = 0; k < known.size(); ++k) {
            if (!known[k].takes(block.parameters[k]))
                refuse("cone {} has the {} {}; it must be {}.", c, known[k].name, block.parameters[k],
                       domain_of(known[k]));
        }
        for (std::size_t k = known.size(); k < block.parameters.size(); ++k) {
            if (block.parameters[k] != 0) {
                refuse("cone {} has {} as parameter {}; one of the kind {} has {} of them.", c, block.parameters[k], k,
                       kind.name, known.size());
            }
        }
    }

    void bounds(const Cone& block, const sdk::ConeOperations& kind, std::size_t c) const {
        const std::size_t wanted = kind.has_bounds ? static_cast<std::size_t>(block.rows) : 0;
        if (block.lo.size() != wanted || block.hi.size() != wanted) {
            refuse("cone {} ({}, {} rows) has {} lower and {} upper bounds; it must have {} of each.", c, kind.name,
                   block.rows, block.lo.size(), block.hi.size(), wanted);
        }
        constexpr double infinity = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < wanted; ++k) {
            const double lo = block.lo[k];
            const double hi = block.hi[k];
            if (!(lo <= hi) || lo == infinity || hi == -infinity) {
                refuse("row {} of cone {} has the bounds lo = {} and hi = {}; they must be numbers with lo <= hi.", k,
                       c, lo, hi);
            }
        }
    }

    void compliance() const {
        const SparseMatrix& E = problem_.E;
        for (std::int32_t row = 0; row < E.rows; ++row) {
            for (std::int32_t k = E.row_start[row]; k < E.row_start[row + 1]; ++k) {
                if (E.column[k] == row && E.value[k] < 0) {
                    refuse("E({}, {}) is {}; E must be positive semidefinite, so its diagonal cannot be negative.", row,
                           row, E.value[k]);
                }
            }
        }
        const Asymmetry asymmetry = asymmetry_of(E);
        if (asymmetry.relative > symmetry_tolerance) {
            refuse(
                "E is not symmetric: E({}, {}) differs from E({}, {}) by {:.1e} of the largest entry; "
                "at most {:.0e} is taken for rounding.",
                asymmetry.row, asymmetry.column, asymmetry.column, asymmetry.row, asymmetry.relative,
                symmetry_tolerance);
        }
    }

    void symmetry_of_H() const {
        for (std::size_t c = 0; c < problem_.cones.size(); ++c) {
            if (operations_of(problem_.cones[c]).is_linear) continue;
            const Asymmetry asymmetry = asymmetry_of(problem_.H);
            if (asymmetry.relative > symmetry_tolerance) {
                refuse(
                    "H is not symmetric (H({}, {}) differs from H({}, {}) by {:.1e} of the largest entry), but cone {} "
                    "is {}; an unsymmetric H is for free rows only.",
                    asymmetry.row, asymmetry.column, asymmetry.column, asymmetry.row, asymmetry.relative, c,
                    name_of(problem_.cones[c].kind));
            }
            return;
        }
    }

    const Problem& problem_;
    const Known known_;
};

}  // namespace

void validate(const Problem& problem) {
    validate(problem, {});
}

void validate(const Problem& problem, const Known& known) {
    Checker(problem, known).run();
}

}  // namespace delassus
