// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "delassus/error.hpp"
#include "fclib/fclib.hpp"
#include "hdf5/hdf5.hpp"
#include "support/output_folder.hpp"

namespace delassus::fclib {
namespace {

using hdf5::Handle;
using hdf5::last_complaint;
using hdf5::Silence;

/// The rows as FCLib orders them: those of friction cones, then the free ones.
struct Rows {
    std::int32_t dimension = 3;
    std::vector<double> mu;
    std::int32_t contact_rows = 0;
    std::vector<std::int32_t> place;  ///< of each row of the problem, in FCLib's order
};

Rows order_rows(const Problem& problem, const std::string& name) {
    const auto refuse = [&](const std::string& reason) {
        throw InputError(fmt::format("{} cannot be written: {}; write a problem folder instead.", name, reason));
    };
    Rows rows;
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const Cone& cone = problem.cones[c];
        if (cone.kind == ConeKind::Free) continue;
        if (cone.kind != ConeKind::Friction) {
            refuse(
                fmt::format("FCLib files hold friction cones and free rows, but cone {} is {}", c, name_of(cone.kind)));
        }
        if (!rows.mu.empty() && cone.rows != rows.dimension) {
            refuse(
                fmt::format("FCLib files hold friction cones of one dimension, but cone {} has {} rows after ones "
                            "of {}",
                            c, cone.rows, rows.dimension));
        }
        rows.dimension = cone.rows;
        rows.mu.push_back(cone.parameters[0]);
        rows.contact_rows += cone.rows;
    }
    if (!rows.mu.empty() && problem.law != Law::Coulomb) {
        refuse(
            fmt::format("FCLib files use the law coulomb, but the law of the problem is {}; `--law coulomb` changes it",
                        name_of(problem.law)));
    }
    if (problem.n() > 0) {
        const auto nonzero =
            std::find_if(problem.E.value.begin(), problem.E.value.end(), [](double v) { return v != 0; });
        if (nonzero != problem.E.value.end()) refuse("a global FCLib problem has no compliance, but E is not zero");
    }
    std::int32_t contact = 0;
    std::int32_t free = rows.contact_rows;
    for (const Cone& cone : problem.cones) {
        std::int32_t& next = cone.kind == ConeKind::Friction ? contact : free;
        for (std::int32_t k = 0; k < cone.rows; ++k) rows.place.push_back(next++);
    }
    return rows;
}

class Writer {
public:
    Writer(hid_t parent, const char* group, const std::string& name)
        : name_(name), group_(H5Gcreate2(parent, group, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)) {
        check(group_.valid());
    }

    [[nodiscard]] hid_t id() const { return group_.get(); }

    void integer(const char* dataset, std::int32_t value) const { integers(dataset, {&value, 1}); }

    void integers(const char* dataset, std::span<const std::int32_t> values) const {
        write(dataset, H5T_NATIVE_INT32, values.size(), values.data());
    }

    void numbers(const char* dataset, std::span<const double> values) const {
        write(dataset, H5T_NATIVE_DOUBLE, values.size(), values.data());
    }

    void text(const char* dataset, const std::string& value) const {
        // fclib reads a text with its final zero.
        const Handle type(H5Tcopy(H5T_C_S1));
        check(H5Tset_size(type.get(), value.size() + 1) >= 0);
        const Handle space(H5Screate(H5S_SCALAR));
        put(dataset, type.get(), space.get(), value.c_str());
    }

    /// The matrix as csparse's compressed columns, which are the compressed rows of its transpose.
    void matrix(const char* group, const SparseMatrix& transposed) const {
        const Writer writer(group_.get(), group, name_);
        writer.integer("nzmax", transposed.entries());
        writer.integer("m", transposed.columns);
        writer.integer("n", transposed.rows);
        writer.integer("nz", -1);
        writer.integers("p", transposed.row_start);
        writer.integers("i", transposed.column);
        writer.numbers("x", transposed.value);
    }

private:
    void check(bool good) const {
        if (!good) throw InputError(fmt::format("{} cannot be written ({}).", name_, last_complaint()));
    }

    void write(const char* dataset, hid_t type, std::size_t count, const void* data) const {
        const hsize_t size = count;
        const Handle space(H5Screate_simple(1, &size, nullptr));
        put(dataset, type, space.get(), data);
    }

    void put(const char* dataset, hid_t type, hid_t space, const void* data) const {
        const Handle id(H5Dcreate2(group_.get(), dataset, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
        check(id.valid());
        if (H5Sget_simple_extent_npoints(space) > 0) {
            check(H5Dwrite(id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
        }
    }

    const std::string& name_;
    Handle group_;
};

/// The rows first … first + count − 1 of FCLib's order, of a matrix whose rows are in the problem's.
SparseMatrix block(const SparseMatrix& matrix, const Rows& rows, bool permute_columns, std::int32_t first,
                   std::int32_t count, std::int32_t first_column, std::int32_t column_count) {
    std::vector<Triplet> triplets;
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        for (std::int32_t k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k) {
            const std::int32_t r = rows.place[row] - first;
            const std::int32_t c = (permute_columns ? rows.place[matrix.column[k]] : matrix.column[k]) - first_column;
            if (r >= 0 && r < count && c >= 0 && c < column_count) triplets.push_back({r, c, matrix.value[k]});
        }
    }
    return SparseMatrix::from_triplets(count, column_count, std::move(triplets));
}

void write_vectors(const Writer& parent, const Problem& problem, const Rows& rows, const char* first,
                   const char* second, const std::string& name) {
    std::vector<double> b(problem.b.size());
    for (std::size_t row = 0; row < b.size(); ++row) b[rows.place[row]] = problem.b[row];
    const auto split = b.begin() + rows.contact_rows;
    const Writer vectors(parent.id(), "vectors", name);
    if (problem.n() > 0) vectors.numbers("f", problem.a);
    vectors.numbers(first, {b.begin(), split});
    vectors.numbers("mu", rows.mu);
    if (split != b.end()) vectors.numbers(second, {split, b.end()});
}

/// Tells the file from those that other programs wrote.
void write_mark(hid_t file, const std::string& name) {
    const Handle type(H5Tcopy(H5T_C_S1)), space(H5Screate(H5S_SCALAR));
    H5Tset_size(type.get(), file_mark.size());
    const Handle attribute(H5Acreate2(file, "writer", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT));
    if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), file_mark.data()) < 0)
        throw InputError(fmt::format("{} cannot be written ({}).", name, last_complaint()));
}

void write_content(hid_t file, const Problem& problem, const Rows& rows, const std::string& name) {
    write_mark(file, name);
    const std::int32_t n = problem.n();
    const std::int32_t contact = rows.contact_rows;
    const std::int32_t free = problem.m() - contact;
    const Writer top(file, n > 0 ? "fclib_global" : "fclib_local", name);
    top.integer("spacedim", rows.dimension);
    if (n > 0) {
        top.matrix("M", problem.H.transposed());
        top.matrix("H", block(problem.D, rows, false, 0, contact, 0, n));
        if (free > 0) top.matrix("G", block(problem.D, rows, false, contact, free, 0, n));
        write_vectors(top, problem, rows, "w", "b", name);
    } else {
        const SparseMatrix E = problem.E.transposed();
        top.matrix("W", block(E, rows, true, 0, contact, 0, contact));
        if (free > 0) {
            top.matrix("V", block(E, rows, true, contact, free, 0, contact));
            top.matrix("R", block(E, rows, true, contact, free, contact, free));
        }
        write_vectors(top, problem, rows, "q", "s", name);
    }
    const Writer info(top.id(), "info", name);
    info.text("title", problem.name);
    info.text("description", problem.source);
    info.text("math_info", problem.notes);
}

}  // namespace

void write_file(const Problem& problem, const std::filesystem::path& file, const std::string& name) {
    const Silence silence;
    const Rows rows = order_rows(problem, name);
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
    const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, access.get());
    if (id < 0) throw InputError(fmt::format("{} cannot be created ({}).", name, last_complaint()));
    try {
        write_content(id, problem, rows, name);
    } catch (...) {
        H5Fclose(id);
        throw;
    }
    // Closing writes what is still in memory, so a full disk shows here at the latest.
    if (H5Fclose(id) < 0) throw InputError(fmt::format("{} cannot be written ({}).", name, last_complaint()));
}

}  // namespace delassus::fclib
