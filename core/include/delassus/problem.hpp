// SPDX-License-Identifier: BSD-3-Clause
// The problem that solvers solve, as plain data:
//
//     H x − Dᵀ λ   = a          n rows: momentum balance
//     D x + E λ + b = u         m rows: constraint velocities
//     λ ∈ Υ  ⊥  u ∈ Υ*          one cone for each block of rows
//
// No Eigen type appears here: a program may include this header whatever vector instructions it is compiled for.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/array.hpp"
#include "delassus/export.hpp"

namespace delassus {

/// An entry of a matrix under construction; row and column count from 0.
struct Triplet {
    std::int32_t row = 0;
    std::int32_t column = 0;
    double value = 0.0;
};

/// A sparse matrix by compressed rows; columns ascend within a row and do not repeat. A default-constructed
/// matrix is 0 × 0 and counts as absent.
struct SparseMatrix {
    std::int32_t rows = 0;
    std::int32_t columns = 0;
    Array<std::int32_t> row_start = {0};  ///< rows + 1 positions
    Array<std::int32_t> column;           ///< one for each entry
    Array<double> value;                  ///< one for each entry

    [[nodiscard]] std::int32_t entries() const { return static_cast<std::int32_t>(value.size()); }

    /// A matrix of rows × columns without entries.
    DELASSUS_API static SparseMatrix zero(std::int32_t rows, std::int32_t columns);

    /// Sorts the triplets by rows and adds up those that share a place. Throws InputError on an index out of range.
    DELASSUS_API static SparseMatrix from_triplets(std::int32_t rows, std::int32_t columns,
                                                   std::vector<Triplet> triplets);

    [[nodiscard]] DELASSUS_API SparseMatrix transposed() const;

    /// One entry of this · vector (columns).
    [[nodiscard]] double row_times(std::int32_t row, const double* vector) const {
        double sum = 0.0;
        for (auto k = static_cast<std::size_t>(row_start[static_cast<std::size_t>(row)]),
                  end = static_cast<std::size_t>(row_start[static_cast<std::size_t>(row) + 1]);
             k < end; ++k)
            sum += value[k] * vector[column[k]];
        return sum;
    }

    /// Adds factor · (this · vector) to result; sizes columns and rows.
    DELASSUS_API void multiply_add(double factor, const double* vector, double* result) const;

    /// Adds factor · (thisᵀ · vector) to result; sizes rows and columns.
    DELASSUS_API void transpose_multiply_add(double factor, const double* vector, double* result) const;
};

/// By number, as in delassus_cone_kind. What there is to know of a kind is in the table of cones
/// (delassus/sdk/cones.hpp); kinds that only the table has need no enumerator.
enum class ConeKind : std::int32_t { Free = 0, Nonnegative = 1, Box = 2, Friction = 3 };
enum class Law : std::int32_t { Associated = 0, Coulomb = 1 };

[[nodiscard]] DELASSUS_API std::string_view name_of(ConeKind kind);
[[nodiscard]] DELASSUS_API std::string_view name_of(Law law);
/// The law of that name; throws InputError naming the choices.
[[nodiscard]] DELASSUS_API Law law_of(std::string_view name);

/// A block of rows with its cone. It is also the unit of scaling of the error measures: one scalar a block.
struct Cone {
    ConeKind kind = ConeKind::Free;
    std::int32_t rows = 1;
    /// As many as the kind has, then zeros; friction: the coefficient μ ≥ 0.
    std::array<double, 4> parameters = {};
    std::vector<double> lo;  ///< `rows` lower bounds, −infinity allowed; kinds with bounds (box) only
    std::vector<double> hi;  ///< `rows` upper bounds, +infinity allowed; kinds with bounds (box) only

    [[nodiscard]] static Cone free(std::int32_t rows) { return {ConeKind::Free, rows, {}, {}, {}}; }
    [[nodiscard]] static Cone nonnegative(std::int32_t rows) { return {ConeKind::Nonnegative, rows, {}, {}, {}}; }
    [[nodiscard]] static Cone box(std::vector<double> lo, std::vector<double> hi) {
        const auto rows = static_cast<std::int32_t>(lo.size());
        return {ConeKind::Box, rows, {}, std::move(lo), std::move(hi)};
    }
    /// Normal first; rows = 3, or 2 in the plane.
    [[nodiscard]] static Cone friction(double mu, std::int32_t rows = 3) {
        return {ConeKind::Friction, rows, {mu}, {}, {}};
    }
};

/// A problem by value, though its arrays may borrow their memory (Array). PreparedProblem checks it and shows it to
/// solvers.
struct Problem {
    std::string name;         ///< for messages and tables; a reader sets it from the file's name
    SparseMatrix H;           ///< n × n, both triangles; 0 × 0 for a reduced problem
    SparseMatrix D;           ///< m × n
    SparseMatrix E;           ///< m × m, symmetric positive semidefinite, both triangles; 0 × 0 if absent
    Array<double> a;          ///< n
    Array<double> b;          ///< m
    std::vector<Cone> cones;  ///< in the order of the rows; together m rows
    Law law = Law::Associated;
    std::string source;  ///< where it came from
    std::string notes;   ///< anything odd

    [[nodiscard]] std::int32_t n() const { return static_cast<std::int32_t>(a.size()); }
    [[nodiscard]] std::int32_t m() const { return static_cast<std::int32_t>(b.size()); }
};

/// What a solver fills, and what it may start from. Both in the problem's own units.
struct Solution {
    std::vector<double> x;       ///< n
    std::vector<double> lambda;  ///< m
};

/// Checks shapes, indices, finiteness, symmetry of E, cone parameters. Throws InputError with one sentence.
DELASSUS_API void validate(const Problem& problem);

}  // namespace delassus
