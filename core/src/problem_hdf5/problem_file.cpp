// SPDX-License-Identifier: BSD-3-Clause
#include "problem_hdf5/problem_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "delassus/error.hpp"
#include "partitioned/even_shares.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/structure.hpp"
#include "support/call_in_child.hpp"
#include "support/text_file.hpp"

namespace delassus::problem_hdf5 {

using hdf5::Array;
using hdf5::Group;
using hdf5::Handle;
using hdf5::last_complaint;

OpenFile::OpenFile(const std::filesystem::path& path, const char* format) {
    const std::string name = path.string();
    require_regular_file(path);
    std::error_code error;
    bytes_ = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
    if (H5Fis_hdf5(name.c_str()) <= 0) throw InputError(name + " is not an HDF5 file.");
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
    file_ = Handle(H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.get()));
    if (!file_.valid()) throw InputError(fmt::format("{} cannot be opened ({}).", name, last_complaint()));
    root_.emplace(Handle(H5Gopen2(file_.get(), "/", H5P_DEFAULT)), name, "", static_cast<std::uint64_t>(bytes_));
    if (const auto found = root_->attribute_text("format"); found != format)
        root_->refuse(fmt::format("the attribute format must be \"{}\", but {}", format,
                                  found.empty() ? "is missing" : fmt::format("is \"{}\"", found)));
    if (const auto version = root_->attribute_integer("version", 0); version != format_version)
        root_->refuse(fmt::format("the attribute version must be the integer {}, but is {}", format_version,
                                  version == 0 ? "missing" : std::to_string(version)));
}

void check_in_child(const std::filesystem::path& path, const char* format) {
    constexpr unsigned seconds = 20;
    call_in_child(path, "HDF5", seconds, [&] {
        hdf5::require_memory();
        const hdf5::Silence silence;
        if (format == problem_format) {
            ProblemFile(path).touch();
        } else {
            const OpenFile file(path, format);
        }
        return std::string();
    });
}

ProblemFile::ProblemFile(const std::filesystem::path& path) : file_(path, problem_format) {
    const Group& root = file_.root();
    root.require_only({"H", "D", "E", "a", "b", "cones", "body_start"});
    a_ = root.number_array("a");
    b_ = root.number_array("b");
    n_ = a_.count();
    m_ = b_.count();
    H_ = open_matrix("H", n_);
    D_ = open_matrix("D", m_);
    E_ = open_matrix("E", m_);
    const Group cones = root.group("cones");
    std::vector<std::string_view> names = {"row_start", "kind", "lo", "hi"};
    for (const auto& kind : sdk::cone_table)
        for (const auto& parameter : kind.named_parameters())
            if (std::find(names.begin(), names.end(), parameter.key) == names.end()) names.push_back(parameter.key);
    cones.require_only(names);
    cone_row_ = cones.integer_array("row_start");
    cone_kind_ = cones.integer_array("kind");
    if (cone_row_.count() != cone_kind_.count() + 1)
        refuse(fmt::format("/cones/row_start has {} elements, but /cones/kind of {} cones asks for {}",
                           cone_row_.count(), cone_kind_.count(), cone_kind_.count() + 1));
    for (const auto& kind : sdk::cone_table) {
        for (const auto& parameter : kind.named_parameters()) {
            const std::string name(parameter.key);
            const bool known = std::any_of(parameters_.begin(), parameters_.end(),
                                           [&](const auto& other) { return other.first == name; });
            if (known || !cones.has(name.c_str())) continue;
            parameters_.emplace_back(name, cones.number_array(name.c_str()));
            if (parameters_.back().second.count() != cone_count())
                refuse(fmt::format("/cones/{} has {} elements for {} cones", name, parameters_.back().second.count(),
                                   cone_count()));
        }
    }
    for (const auto& [name, bound] : {std::pair("lo", &lo_), std::pair("hi", &hi_)}) {
        if (!cones.has(name)) continue;
        *bound = cones.number_array(name);
        if ((*bound)->count() != m_)
            refuse(fmt::format("/cones/{} has {} elements for {} rows", name, (*bound)->count(), m_));
    }
    if (root.has("body_start")) {
        body_start_ = root.integer_array("body_start");
        if (body_start_->count() < 1 || at(*body_start_, 0) != 0 || at(*body_start_, body_start_->count() - 1) != n_)
            refuse(fmt::format("/body_start must ascend from 0 to n = {}", n_));
    }
    if (at(cone_row_, 0) != 0 || at(cone_row_, cone_count()) != m_)
        refuse(fmt::format("/cones/row_start must ascend from 0 to m = {}", m_));
}

std::optional<MatrixArrays> ProblemFile::open_matrix(const char* name, std::int64_t rows) const {
    if (!file_.root().has(name)) return std::nullopt;
    const Group group = file_.root().group(name);
    group.require_only({"row_start", "column", "value"});
    MatrixArrays arrays{group.integer_array("row_start"), group.integer_array("column"), group.number_array("value")};
    if (arrays.row_start.count() != rows + 1)
        refuse(fmt::format("/{}/row_start has {} elements for {} rows", name, arrays.row_start.count(), rows));
    if (arrays.column.count() != arrays.value.count())
        refuse(fmt::format("/{0}/column has {1} elements and /{0}/value {2}", name, arrays.column.count(),
                           arrays.value.count()));
    if (at(arrays.row_start, 0) != 0 || at(arrays.row_start, rows) != arrays.value.count())
        refuse(
            fmt::format("/{}/row_start must ascend from 0 to the number of entries, {}", name, arrays.value.count()));
    return arrays;
}

const std::optional<MatrixArrays>& ProblemFile::matrix(const char* name) const {
    return *name == 'H' ? H_ : *name == 'D' ? D_ : E_;
}

std::int64_t ProblemFile::entries(const char* name) const {
    return matrix(name) ? matrix(name)->value.count() : 0;
}

Law ProblemFile::law() const {
    const std::string name = text("law");
    for (const Law law : {Law::Associated, Law::Coulomb})
        if (name == name_of(law)) return law;
    refuse(fmt::format("the attribute law must be \"{}\" or \"{}\"", name_of(Law::Associated), name_of(Law::Coulomb)));
}

std::vector<std::int64_t> ProblemFile::integers(const Array& array, std::int64_t first, std::int64_t last) const {
    std::vector<std::int64_t> values(static_cast<std::size_t>(last - first));
    array.read(first, values);
    bytes_read_ += (last - first) * array.element_bytes();
    return values;
}

std::vector<double> ProblemFile::numbers(const Array& array, std::int64_t first, std::int64_t last) const {
    std::vector<double> values(static_cast<std::size_t>(last - first));
    array.read(first, values);
    bytes_read_ += (last - first) * array.element_bytes();
    return values;
}

void ProblemFile::touch() const {
    const auto ends_of = [&](const Array& array, auto read) {
        if (array.count() == 0) return;
        (this->*read)(array, 0, 1);
        (this->*read)(array, array.count() - 1, array.count());
    };
    const auto ends_of_matrix = [&](const std::optional<MatrixArrays>& matrix) {
        if (!matrix) return;
        ends_of(matrix->row_start, &ProblemFile::integers);
        ends_of(matrix->column, &ProblemFile::integers);
        ends_of(matrix->value, &ProblemFile::numbers);
    };
    for (const auto* matrix : {&H_, &D_, &E_}) ends_of_matrix(*matrix);
    for (const auto* array : {&a_, &b_}) ends_of(*array, &ProblemFile::numbers);
    for (const auto* array : {&cone_row_, &cone_kind_}) ends_of(*array, &ProblemFile::integers);
    for (const auto* bound : {&lo_, &hi_})
        if (*bound) ends_of(**bound, &ProblemFile::numbers);
    for (const auto& [name, array] : parameters_) ends_of(array, &ProblemFile::numbers);
    if (body_start_) ends_of(*body_start_, &ProblemFile::integers);
    static_cast<void>(law());
}

ProblemFile::Cut ProblemFile::end() const {
    return {n_, cone_count(), m_, body_count()};
}

std::int64_t ProblemFile::smallest_column(std::int64_t cone) const {
    const std::int64_t row = at(cone_row_, cone);
    if (row < 0 || row >= m_) refuse("/cones/row_start does not ascend");
    const auto entry = integers(D_->row_start, row, row + 2);
    return entry[0] == entry[1] ? -1 : at(D_->column, entry[0]);
}

namespace {

/// The first number of first … last that fulfils the predicate, which holds for all later ones.
template <class Predicate>
std::int64_t first_that(std::int64_t first, std::int64_t last, Predicate&& holds) {
    while (first < last) {
        const std::int64_t middle = first + (last - first) / 2;
        if (holds(middle)) {
            last = middle;
        } else {
            first = middle + 1;
        }
    }
    return first;
}

}  // namespace

std::int64_t ProblemFile::first_cone_from(std::int64_t column) const {
    return first_that(0, cone_count(), [&](std::int64_t cone) { return smallest_column(cone) >= column; });
}

std::int64_t ProblemFile::after_block(std::int64_t column) const {
    if (!H_ || column <= 0 || column >= n_) return column;
    const std::int64_t first = std::max<std::int64_t>(0, column - largest_inertia_block),
                       last = std::min(n_, column + largest_inertia_block);
    const LocalMatrix rows = rows_of("H", first, last);
    for (std::int64_t place = column; place < last; ++place) {
        bool within = false;
        for (std::int64_t row = first; row < place; ++row)
            for (auto k = rows.row_start[static_cast<std::size_t>(row - first)];
                 k < rows.row_start[static_cast<std::size_t>(row - first) + 1]; ++k)
                within = within || (rows.column[static_cast<std::size_t>(k)] >= place &&
                                    rows.column[static_cast<std::size_t>(k)] < row + largest_inertia_block);
        if (!within) return place;
    }
    return column;
}

ProblemFile::Cut ProblemFile::cut_by_bodies(int process, int processes) const {
    if (process == 0) return {};
    if (process == processes) return end();
    const std::int64_t target = EvenShares{n_ + m_, processes}.start(process);
    const auto row_from = [&](std::int64_t column) { return at(cone_row_, first_cone_from(column)); };
    Cut cut;
    cut.body = first_that(0, places(), [&](std::int64_t body) {
        const std::int64_t column = column_of(body);
        return column + row_from(column) >= target;
    });
    cut.column = column_of(cut.body);
    if (!body_start_) cut.column = after_block(cut.column);
    cut.cone = first_cone_from(cut.column);
    cut.row = at(cone_row_, cut.cone);
    return cut;
}

ProblemFile::Cut ProblemFile::cut_evenly(int process, int processes) const {
    if (process == 0) return {};
    if (process == processes) return end();
    const std::int64_t column = EvenShares{n_, processes}.start(process),
                       row = EvenShares{m_, processes}.start(process);
    Cut cut;
    cut.body = first_that(0, places(), [&](std::int64_t body) { return column_of(body) >= column; });
    cut.column = column_of(cut.body);
    if (!body_start_) cut.column = after_block(cut.column);
    cut.cone = first_that(0, cone_count(), [&](std::int64_t cone) { return at(cone_row_, cone) >= row; });
    cut.row = at(cone_row_, cut.cone);
    return cut;
}

LocalMatrix ProblemFile::rows_of(const char* name, std::int64_t first, std::int64_t last) const {
    LocalMatrix local;
    local.rows = last - first;
    local.columns = *name == 'E' ? m_ : n_;
    const auto& arrays = matrix(name);
    if (!arrays) {
        local.row_start.assign(static_cast<std::size_t>(local.rows) + 1, 0);
        return local;
    }
    local.row_start = integers(arrays->row_start, first, last + 1);
    const std::int64_t begin = local.row_start.front(), end = local.row_start.back();
    if (begin < 0 || end > arrays->value.count() || !std::is_sorted(local.row_start.begin(), local.row_start.end()))
        refuse(fmt::format("/{}/row_start does not ascend between the rows {} and {}", name, first, last));
    for (auto& start : local.row_start) start -= begin;
    local.column = integers(arrays->column, begin, end);
    local.value = numbers(arrays->value, begin, end);
    return local;
}

ProblemFile::ConeShapes ProblemFile::cone_shapes(std::int64_t first, std::int64_t last) const {
    ConeShapes shapes{integers(cone_row_, first, last + 1), integers(cone_kind_, first, last)};
    for (std::size_t k = 0; k < shapes.kind.size(); ++k) {
        const std::int64_t kind = shapes.kind[k], rows = shapes.row_start[k + 1] - shapes.row_start[k];
        const auto cone = first + static_cast<std::int64_t>(k);
        if (kind < 0 || kind > std::numeric_limits<std::int32_t>::max() || !is_known(static_cast<ConeKind>(kind)))
            refuse(fmt::format("/cones/kind has {} for cone {}; kinds are 0 to {}", kind, cone,
                               sdk::cone_table.size() - 1));
        if (rows <= 0 || rows > std::numeric_limits<std::int32_t>::max())
            refuse(fmt::format("/cones/row_start gives cone {} {} rows", cone, rows));
    }
    return shapes;
}

void ProblemFile::read_slice(const Cut& first, const Cut& last, PartitionedProblem& part) const {
    part.H = rows_of("H", first.column, last.column);
    part.D = rows_of("D", first.row, last.row);
    if (E_) part.E = rows_of("E", first.row, last.row);
    part.a = numbers(a_, first.column, last.column);
    part.b = numbers(b_, first.row, last.row);
    if (body_start_) part.body_start = integers(*body_start_, first.body, last.body);
    const ConeShapes shapes = cone_shapes(first.cone, last.cone);
    if (shapes.row_start.front() != first.row || shapes.row_start.back() != last.row)
        refuse("/cones/row_start does not ascend");
    std::vector<double> lo, hi;
    const bool bounded = std::any_of(shapes.kind.begin(), shapes.kind.end(), [](std::int64_t kind) {
        return operations_of(static_cast<ConeKind>(kind)).has_bounds;
    });
    if (bounded) {
        if (!lo_ || !hi_) refuse("/cones/lo and /cones/hi are missing, which the bounds of boxes need");
        lo = numbers(*lo_, first.row, last.row);
        hi = numbers(*hi_, first.row, last.row);
    }
    std::vector<std::vector<double>> parameters;
    for (const auto& [name, array] : parameters_) parameters.push_back(numbers(array, first.cone, last.cone));
    part.cones.reserve(shapes.kind.size());
    for (std::size_t k = 0; k < shapes.kind.size(); ++k) {
        Cone cone;
        cone.kind = static_cast<ConeKind>(shapes.kind[k]);
        cone.rows = static_cast<std::int32_t>(shapes.row_start[k + 1] - shapes.row_start[k]);
        const auto& kind = operations_of(cone.kind);
        std::size_t next = 0;
        for (const auto& parameter : kind.named_parameters()) {
            const auto found = std::find_if(parameters_.begin(), parameters_.end(),
                                            [&](const auto& known) { return known.first == parameter.key; });
            if (found == parameters_.end())
                refuse(fmt::format("/cones/{} is missing, which cone {} needs: it is {}", parameter.key,
                                   first.cone + static_cast<std::int64_t>(k), kind.name));
            cone.parameters[next++] = parameters[static_cast<std::size_t>(found - parameters_.begin())][k];
        }
        if (kind.has_bounds) {
            const auto row = shapes.row_start[k] - first.row;
            cone.lo.assign(lo.begin() + row, lo.begin() + row + cone.rows);
            cone.hi.assign(hi.begin() + row, hi.begin() + row + cone.rows);
        }
        part.cones.push_back(std::move(cone));
    }
}

}  // namespace delassus::problem_hdf5
