// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>

#include "delassus/error.hpp"
#include "fclib/fclib.hpp"
#include "hdf5/hdf5.hpp"
#include "problem/symmetry.hpp"

namespace delassus::fclib {
namespace {

using hdf5::Group;
using hdf5::Handle;
using hdf5::last_complaint;
using hdf5::Silence;

constexpr std::int32_t largest = std::numeric_limits<std::int32_t>::max() - 1;

/// What `nz` says about the storage: a number from 0 on counts triplets, −1 means compressed columns, and
constexpr std::int32_t compressed_rows = -2;

/// The entries of a matrix of csparse's form. Its size must be rows × columns, which the vectors have shown to be
/// honest. The same place may occur more than once: csparse adds such entries up.
std::vector<Triplet> read_matrix(const Group& parent, const char* name, std::int32_t rows, std::int32_t columns) {
    const Group matrix = parent.group(name);
    const std::int32_t m = matrix.integer("m", 0, largest);
    const std::int32_t n = matrix.integer("n", 0, largest);
    if (m != rows || n != columns) {
        matrix.refuse(fmt::format(" is {} × {}, but must be {} × {} to fit the vectors", m, n, rows, columns));
    }
    const std::int32_t nz = matrix.integer("nz", compressed_rows, largest);
    std::vector<Triplet> triplets;
    const auto add = [&](std::int64_t row, std::int64_t column, double value) {
        if (row < 0 || row >= rows || column < 0 || column >= columns) {
            matrix.refuse(fmt::format(" has an entry at row {}, column {} (counted from 0), outside its {} × {}", row,
                                      column, rows, columns));
        }
        triplets.push_back({static_cast<std::int32_t>(row), static_cast<std::int32_t>(column), value});
    };
    if (nz >= 0) {
        // fclib.h says that p holds the rows, but fclib hands its matrices to csparse, for which p holds the columns,
        // and so do the files that Siconos wrote. So csparse's way is taken wherever the indices allow it.
        const auto p = matrix.integers("p", nz);
        const auto i = matrix.integers("i", nz);
        const auto x = matrix.first_numbers("x", nz);
        const auto fits = [](const std::vector<std::int64_t>& indices, std::int32_t size) {
            return std::all_of(indices.begin(), indices.end(), [&](std::int64_t k) { return k >= 0 && k < size; });
        };
        const bool rows_in_p = !(fits(i, rows) && fits(p, columns)) && fits(p, rows) && fits(i, columns);
        triplets.reserve(x.size());
        for (std::size_t k = 0; k < x.size(); ++k) {
            rows_in_p ? add(p[k], i[k], x[k]) : add(i[k], p[k], x[k]);
        }
        return triplets;
    }
    const bool by_rows = nz == compressed_rows;
    const std::int32_t lines = by_rows ? rows : columns;
    const auto p = matrix.integers("p", std::int64_t{lines} + 1);
    if (p[0] != 0 || !std::is_sorted(p.begin(), p.end())) {
        matrix.refuse("/p must begin with 0 and not descend");
    }
    if (p.back() > largest) matrix.refuse(fmt::format("/p announces {} entries, more than can be held", p.back()));
    const auto i = matrix.integers("i", p.back());
    const auto x = matrix.first_numbers("x", p.back());
    triplets.reserve(x.size());
    for (std::int32_t line = 0; line < lines; ++line) {
        for (std::int64_t k = p[line]; k < p[line + 1]; ++k) {
            by_rows ? add(line, i[k], x[k]) : add(i[k], line, x[k]);
        }
    }
    return triplets;
}

/// Adds the entries of a part, perhaps transposed, at an offset.
void place(const std::vector<Triplet>& part, std::int32_t row, std::int32_t column, bool transposed,
           std::vector<Triplet>& whole) {
    for (const Triplet& t : part) {
        whole.push_back({row + (transposed ? t.column : t.row), column + (transposed ? t.row : t.column), t.value});
    }
}

std::int32_t size_of(const Group& vectors, const char* name) {
    const std::int64_t count = vectors.count(name);
    if (count > largest) vectors.refuse(fmt::format("/{} has {} elements, more than can be held", name, count));
    return static_cast<std::int32_t>(count);
}

/// b = {first; second}, and the cones: friction for the first part, then one block of free rows for the second.
void read_rows(const Group& problem_group, const Group& vectors, const char* first, std::int32_t contact_rows,
               const char* second, std::int32_t free_rows, Problem& problem) {
    const std::int32_t dimension = problem_group.integer("spacedim", 2, 3);
    if (contact_rows % dimension != 0) {
        vectors.refuse(
            fmt::format("/{} has {} elements, but must have {} for each contact", first, contact_rows, dimension));
    }
    if (contact_rows > largest - free_rows) vectors.refuse(fmt::format("/{} is too long", second));
    problem.b = vectors.numbers(first, contact_rows);
    for (const double mu : vectors.numbers("mu", contact_rows / dimension)) {
        problem.cones.push_back(Cone::friction(mu, dimension));
    }
    if (free_rows > 0) {
        const auto bilateral = vectors.numbers(second, free_rows);
        problem.b.insert(problem.b.end(), bilateral.begin(), bilateral.end());
        problem.cones.push_back(Cone::free(free_rows));
    }
}

void note(Problem& problem, const std::string& text) {
    if (!problem.notes.empty()) problem.notes += "; ";
    problem.notes += text;
}

/// Asymmetry from rounding is averaged out silently, so that a matrix written as symmetric is symmetric bit by bit.
void symmetrise(SparseMatrix& matrix, const char* name, Problem& problem) {
    for (const double value : matrix.value) {
        if (!std::isfinite(value)) return;  // validate() will say so
    }
    const Asymmetry asymmetry = asymmetry_of(matrix);
    if (asymmetry.row < 0) return;
    matrix = symmetric_part(matrix);
    if (asymmetry.relative > symmetry_tolerance) {
        note(problem,
             fmt::format("{} was asymmetric by {:.1e} (relative) and is symmetrised", name, asymmetry.relative));
    }
}

void read_local(const Group& local, Problem& problem) {
    const Group vectors = local.group("vectors");
    const std::int32_t contact_rows = size_of(vectors, "q");
    const bool bilateral = local.has("V") || local.has("R");
    const std::int32_t free_rows = bilateral ? size_of(vectors, "s") : 0;
    read_rows(local, vectors, "q", contact_rows, "s", free_rows, problem);
    std::vector<Triplet> E = read_matrix(local, "W", contact_rows, contact_rows);
    if (bilateral) {
        const auto V = read_matrix(local, "V", contact_rows, free_rows);
        place(V, 0, contact_rows, false, E);
        place(V, contact_rows, 0, true, E);
        place(read_matrix(local, "R", free_rows, free_rows), contact_rows, contact_rows, false, E);
    }
    problem.E = SparseMatrix::from_triplets(problem.m(), problem.m(), std::move(E));
    symmetrise(problem.E, "E", problem);
}

void read_global(const Group& global, Problem& problem) {
    const Group vectors = global.group("vectors");
    const std::int32_t n = size_of(vectors, "f");
    const std::int32_t contact_rows = size_of(vectors, "w");
    const bool bilateral = global.has("G");
    const std::int32_t free_rows = bilateral ? size_of(vectors, "b") : 0;
    if (n == 0) vectors.refuse("/f is empty; a problem without velocities is a local one");
    problem.a = vectors.numbers("f", n);
    read_rows(global, vectors, "w", contact_rows, "b", free_rows, problem);
    problem.H = SparseMatrix::from_triplets(n, n, read_matrix(global, "M", n, n));
    if (contact_rows > 0) symmetrise(problem.H, "H", problem);
    std::vector<Triplet> D;
    place(read_matrix(global, "H", n, contact_rows), 0, 0, true, D);
    if (bilateral) place(read_matrix(global, "G", n, free_rows), contact_rows, 0, true, D);
    problem.D = SparseMatrix::from_triplets(problem.m(), n, std::move(D));
}

}  // namespace

Problem read_file(const std::filesystem::path& file) {
    const Silence silence;
    const std::string name = file.string();
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) throw InputError(name + " is not a regular file.");
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (H5Fis_hdf5(name.c_str()) <= 0) {
        throw InputError(name + " is not an HDF5 file, though its name says so; FCLib files are.");
    }
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
    Handle opened(H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.get()));
    if (!opened.valid()) throw InputError(fmt::format("{} cannot be opened ({}).", name, last_complaint()));
    const Handle file_handle = std::move(opened);
    const Group root(Handle(H5Gopen2(file_handle.get(), "/", H5P_DEFAULT)), name, "", bytes);
    const bool global = root.has("fclib_global");
    if (!global && !root.has("fclib_local")) {
        root.refuse("neither /fclib_local nor /fclib_global is there, so it is not an FCLib problem");
    }
    const Group group = root.group(global ? "fclib_global" : "fclib_local");
    Problem problem;
    problem.name = file.stem().string();
    problem.law = Law::Coulomb;
    if (group.has("info")) {
        const Group info = group.group("info");
        problem.source = info.text("description");
        if (problem.source.empty()) problem.source = info.text("title");
        problem.notes = info.text("math_info");
    }
    if (global && root.has("fclib_local")) note(problem, "the file holds a local problem too, which is not read");
    global ? read_global(group, problem) : read_local(group, problem);
    try {
        validate(problem);
    } catch (const InputError& refusal) {
        throw InputError(fmt::format("{}: {}", name, refusal.what()));
    }
    return problem;
}

}  // namespace delassus::fclib
