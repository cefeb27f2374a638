// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/partitioned.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/cone_bytes.hpp"
#include "problem/structure.hpp"

namespace delassus {

namespace {

/// Places between columns, 0 … n, at which a process may begin: none lies within a small block of H, nor between two
/// columns that only occur together in cones, as those of a body do.
std::vector<char> places_to_cut(const Problem& problem) {
    const auto n = static_cast<std::size_t>(problem.n());
    std::vector<char> may(n + 1, 1);
    const BlockPartition blocks = connected_components(problem.H);
    for (std::size_t k = 0; k + 1 < blocks.start.size(); ++k) {
        const auto first = blocks.index.begin() + blocks.start[k], last = blocks.index.begin() + blocks.start[k + 1];
        if (last - first > largest_inertia_block) continue;
        const auto [low, high] = std::minmax_element(first, last);
        for (auto place = *low + 1; place <= *high; ++place) may[static_cast<std::size_t>(place)] = 0;
    }
    const SparseMatrix& D = problem.D;
    std::vector<std::int32_t> cones(n, 0), with_the_one_before(n, 0), columns;
    std::int32_t row = 0;
    for (const Cone& cone : problem.cones) {
        columns.assign(D.column.begin() + D.row_start[static_cast<std::size_t>(row)],
                       D.column.begin() + D.row_start[static_cast<std::size_t>(row + cone.rows)]);
        row += cone.rows;
        std::sort(columns.begin(), columns.end());
        columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
        for (std::size_t k = 0; k < columns.size(); ++k) {
            ++cones[static_cast<std::size_t>(columns[k])];
            if (k > 0 && columns[k - 1] == columns[k] - 1) ++with_the_one_before[static_cast<std::size_t>(columns[k])];
        }
    }
    for (std::size_t j = 1; j < n; ++j)
        if (cones[j] > 0 && cones[j] == cones[j - 1] && cones[j] == with_the_one_before[j]) may[j] = 0;
    return may;
}

/// Processes + 1 starts: process p begins at the first possible place after p/P of all.
std::vector<std::int64_t> even_starts(std::int64_t count, int processes, const std::vector<char>& may_cut) {
    std::vector<std::int64_t> start = {0};
    for (int p = 1; p < processes; ++p) {
        std::int64_t place = std::max(start.back(), count * p / processes);
        while (place < count && !may_cut[static_cast<std::size_t>(place)]) ++place;
        start.push_back(place);
    }
    start.push_back(count);
    return start;
}

LocalMatrix rows_of(const SparseMatrix& matrix, std::int64_t columns, std::int64_t first, std::int64_t last) {
    LocalMatrix local;
    if (matrix.rows == 0 && matrix.columns == 0) {
        local.rows = last - first;
        local.columns = columns;
        local.row_start.assign(static_cast<std::size_t>(last - first) + 1, 0);
        return local;
    }
    local.rows = last - first;
    local.columns = columns;
    const auto begin = matrix.row_start.begin() + first;
    const std::int64_t offset = *begin;
    local.row_start.clear();
    for (auto at = begin; at <= matrix.row_start.begin() + last; ++at) local.row_start.push_back(*at - offset);
    const auto end = offset + local.row_start.back();
    local.column.assign(matrix.column.begin() + offset, matrix.column.begin() + end);
    local.value.assign(matrix.value.begin() + offset, matrix.value.begin() + end);
    return local;
}

}  // namespace

PartitionedProblem part_of(const Communicator& communicator, Problem problem) {
    PartitionedProblem part;
    together(communicator, [&] {
        if (problem.H.rows == 0) problem.H = SparseMatrix::zero(problem.n(), problem.n());
        if (problem.D.rows == 0) problem.D = SparseMatrix::zero(problem.m(), problem.n());
        validate(problem);
        const int processes = communicator.size();
        const std::int64_t n = problem.n(), m = problem.m();
        part.name = problem.name;
        part.law = problem.law;
        part.source = problem.source;
        part.notes = problem.notes;
        const std::vector<char> may_begin = places_to_cut(problem);
        part.column_start = even_starts(n, processes, may_begin);
        std::vector<char> may(static_cast<std::size_t>(m) + 1, 0);
        std::vector<std::int64_t> first_row = {0};
        for (const Cone& cone : problem.cones) {
            may[static_cast<std::size_t>(first_row.back())] = 1;
            first_row.push_back(first_row.back() + cone.rows);
        }
        part.row_start = even_starts(m, processes, may);
        part.cone_start.clear();
        for (const auto row : part.row_start)
            part.cone_start.push_back(std::lower_bound(first_row.begin(), first_row.end(), row) - first_row.begin());

        const auto own = static_cast<std::size_t>(communicator.rank());
        const auto column = part.column_start[own], column_end = part.column_start[own + 1];
        const auto row = part.row_start[own], row_end = part.row_start[own + 1];
        for (auto place = column; place < column_end; ++place)
            if (may_begin[static_cast<std::size_t>(place)]) part.body_start.push_back(place);
        part.H = rows_of(problem.H, n, column, column_end);
        part.D = rows_of(problem.D, n, row, row_end);
        if (problem.E.entries() > 0) part.E = rows_of(problem.E, m, row, row_end);
        part.a.assign(problem.a.begin() + column, problem.a.begin() + column_end);
        part.b.assign(problem.b.begin() + row, problem.b.begin() + row_end);
        part.cones.assign(problem.cones.begin() + part.cone_start[own],
                          problem.cones.begin() + part.cone_start[own + 1]);
    });
    return part;
}

namespace {

void put_matrix(Bytes& bytes, const LocalMatrix& matrix) {
    put(bytes, matrix.row_start);
    put(bytes, matrix.column);
    put(bytes, matrix.value);
}

void append_rows(ByteReader& reader, SparseMatrix& matrix) {
    const auto start = reader.next<std::int64_t>();
    for (std::size_t k = 1; k < start.size(); ++k)
        matrix.row_start.push_back(static_cast<std::int32_t>(matrix.column.size()) +
                                   static_cast<std::int32_t>(start[k]));
    for (const auto column : reader.next<std::int64_t>()) matrix.column.push_back(static_cast<std::int32_t>(column));
    reader.append(matrix.value);
    matrix.rows += static_cast<std::int32_t>(start.size()) - 1;
}

}  // namespace

Problem gathered(const Communicator& communicator, const PartitionedProblem& part) {
    Bytes own;
    together(communicator, [&] {
        put_matrix(own, part.H);
        put_matrix(own, part.D);
        put_matrix(own, part.E);
        put(own, part.a);
        put(own, part.b);
        std::vector<std::size_t> all(part.cones.size());
        std::iota(all.begin(), all.end(), std::size_t{0});
        put_cones(own, part.cones, all);
    });
    const auto parts = communicator.exchange(std::vector<Bytes>(static_cast<std::size_t>(communicator.size()), own));
    Problem whole;
    together(communicator, [&] {
        whole.name = part.name;
        whole.law = part.law;
        whole.source = part.source;
        whole.notes = part.notes;
        for (const Bytes& bytes : parts) {
            ByteReader reader(bytes);
            for (SparseMatrix* matrix : {&whole.H, &whole.D, &whole.E}) append_rows(reader, *matrix);
            reader.append(whole.a);
            reader.append(whole.b);
            append_cones(reader, whole.cones);
        }
        const auto n = static_cast<std::int32_t>(part.n_all()), m = static_cast<std::int32_t>(part.m_all());
        whole.H.columns = whole.D.columns = n;
        whole.E.columns = whole.E.rows > 0 ? m : 0;
    });
    return whole;
}

void validate(const Communicator& communicator, const PartitionedProblem& problem) {
    together(communicator, [&] {
        const auto own = static_cast<std::size_t>(communicator.rank());
        const auto refuse = [&](const std::string& what) {
            throw InputError(fmt::format("process {} of {}: {}", own, communicator.size(), what));
        };
        const auto starts = static_cast<std::size_t>(communicator.size()) + 1;
        for (const auto* start : {&problem.column_start, &problem.row_start, &problem.cone_start})
            if (start->size() != starts || start->front() != 0 || !std::is_sorted(start->begin(), start->end()))
                refuse("the starts of its ranges must ascend from 0, one for each process and the end");
        const auto length = [&](const std::vector<std::int64_t>& start) { return start[own + 1] - start[own]; };
        if (problem.n() != length(problem.column_start) || problem.m() != length(problem.row_start) ||
            static_cast<std::int64_t>(problem.cones.size()) != length(problem.cone_start))
            refuse(fmt::format("it has {} columns, {} rows and {} cones, where its ranges have {}, {} and {}",
                               problem.n(), problem.m(), problem.cones.size(), length(problem.column_start),
                               length(problem.row_start), length(problem.cone_start)));
        const auto check = [&](const char* name, const LocalMatrix& matrix, std::int64_t rows, std::int64_t columns,
                               bool may_be_absent) {
            if (may_be_absent && matrix.rows == 0 && matrix.columns == 0) return;
            if (matrix.rows != rows || matrix.columns != columns ||
                matrix.row_start.size() != static_cast<std::size_t>(rows) + 1 || matrix.row_start.front() != 0 ||
                matrix.row_start.back() != matrix.entries() || matrix.column.size() != matrix.value.size())
                refuse(fmt::format("{} is not {} x {} by compressed rows", name, rows, columns));
            for (std::int64_t row = 0; row < rows; ++row) {
                std::int64_t last = -1;
                if (matrix.row_start[static_cast<std::size_t>(row)] >
                    matrix.row_start[static_cast<std::size_t>(row) + 1])
                    refuse(fmt::format("row {} of its {} has a negative number of entries", row, name));
                for (auto k = matrix.row_start[static_cast<std::size_t>(row)];
                     k < matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k) {
                    const auto column = matrix.column[static_cast<std::size_t>(k)];
                    if (column <= last || column >= columns)
                        refuse(fmt::format("row {} of its {} has the column {} where {} to {} may follow", row, name,
                                           column, last + 1, columns - 1));
                    if (!std::isfinite(matrix.value[static_cast<std::size_t>(k)]))
                        refuse(fmt::format("row {} of its {} holds a value that is not finite", row, name));
                    last = column;
                }
            }
        };
        check("H", problem.H, problem.n(), problem.n_all(), false);
        check("D", problem.D, problem.m(), problem.n_all(), false);
        check("E", problem.E, problem.m(), problem.m_all(), true);
        for (std::size_t k = 0; k < problem.body_start.size(); ++k)
            if (problem.body_start[k] < problem.column_start[own] ||
                problem.body_start[k] >= problem.column_start[own + 1] ||
                problem.body_start[k] <= (k == 0 ? problem.column_start[own] - 1 : problem.body_start[k - 1]))
                refuse(fmt::format("its body {} begins at the column {}, out of its range or of order", k,
                                   problem.body_start[k]));
        if (!problem.body_start.empty() && problem.body_start[0] != problem.column_start[own])
            refuse("its first body does not begin where its columns do");
        for (const auto& [origin, size] :
             {std::pair(&problem.column_origin, problem.n()), std::pair(&problem.row_origin, problem.m())})
            if (!origin->empty() && static_cast<std::int64_t>(origin->size()) != size)
                refuse(fmt::format("it knows the origin of {} of {} entries", origin->size(), size));
        const auto finite = [](const std::vector<double>& values) {
            return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
        };
        if (!finite(problem.a)) refuse("its a holds a value that is not finite");
        if (!finite(problem.b)) refuse("its b holds a value that is not finite");
        std::int64_t rows = 0;
        for (std::size_t k = 0; k < problem.cones.size(); ++k) {
            const Cone& cone = problem.cones[k];
            rows += cone.rows;
            if (k > 0 && cone.kind == problem.cones[k - 1].kind && cone.rows == problem.cones[k - 1].rows &&
                cone.parameters == problem.cones[k - 1].parameters && cone.lo.empty() && cone.hi.empty() &&
                problem.cones[k - 1].lo.empty() && problem.cones[k - 1].hi.empty())
                continue;  // as good as the one before
            // The checks of one cone are those of a small problem of its own.
            Problem alone;
            alone.H = SparseMatrix::from_triplets(1, 1, {{0, 0, 1.0}});
            alone.a = {0.0};
            alone.D = SparseMatrix::zero(std::max(cone.rows, 0), 1);
            alone.b.assign(static_cast<std::size_t>(std::max(cone.rows, 0)), 0.0);
            alone.cones = {cone};
            try {
                validate(alone);
            } catch (const InputError& error) {
                refuse(fmt::format("its cone {}: {}", k, error.what()));
            }
        }
        if (rows != problem.m()) refuse(fmt::format("its cones have {} rows and its b {}", rows, problem.m()));
    });
    std::vector<std::int64_t> largest, smallest;
    for (const auto* start : {&problem.column_start, &problem.row_start, &problem.cone_start})
        for (const auto value : *start) {
            largest.push_back(value);
            smallest.push_back(-value);
        }
    communicator.max(largest);
    communicator.max(smallest);
    for (std::size_t k = 0; k < largest.size(); ++k)
        if (largest[k] != -smallest[k]) throw InputError("the processes do not agree on who owns which numbers");
}

}  // namespace delassus
