// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>
#include <numeric>

#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "problem_hdf5/problem_hdf5.hpp"
#include "problem_hdf5/shared_file.hpp"

namespace delassus::problem_hdf5 {

namespace {

/// Of a count that every process has its own of: where the own ones begin, and how many there are on all.
struct Range {
    std::int64_t first = 0, total = 0;
};

Range range_of(const Communicator& communicator, std::int64_t own) {
    const auto counts = communicator.all(own);
    const auto begin = counts.begin(), at = begin + communicator.rank();
    return {std::accumulate(begin, at, std::int64_t{0}), std::accumulate(begin, counts.end(), std::int64_t{0})};
}

/// A parameter of cones that some process has.
struct Parameter {
    std::string dataset;
    std::string_view key;
};

/// Values of the own cones.
std::vector<double> values_of(const std::vector<Cone>& cones, std::string_view key) {
    std::vector<double> values;
    values.reserve(cones.size());
    for (const Cone& cone : cones) {
        double value = 0.0;
        std::size_t k = 0;
        for (const auto& parameter : operations_of(cone).named_parameters()) {
            if (parameter.key == key) value = cone.parameters[k];
            ++k;
        }
        values.push_back(value);
    }
    return values;
}

struct Layout {
    std::int64_t n, m, cones;
    Range H, D, E, bodies;
    bool has_E, has_bodies, has_bounds;
    std::vector<Parameter> parameters;
};

Layout layout_of(const Communicator& communicator, const PartitionedProblem& part) {
    Layout layout{};
    layout.n = part.n_all();
    layout.m = part.m_all();
    layout.cones = part.cone_start.back();
    layout.H = range_of(communicator, part.H.entries());
    layout.D = range_of(communicator, part.D.entries());
    layout.E = range_of(communicator, part.E.entries());
    layout.bodies = range_of(communicator, static_cast<std::int64_t>(part.body_start.size()));
    // For each kind whether there is one; then E, bounds, columns without bodies.
    std::vector<std::int64_t> found(sdk::cone_table.size() + 3, 0);
    for (const Cone& cone : part.cones) {
        found[static_cast<std::size_t>(cone.kind)] = 1;
        if (operations_of(cone).has_bounds) found[sdk::cone_table.size() + 1] = 1;
    }
    found[sdk::cone_table.size()] = part.E.columns > 0;
    found[sdk::cone_table.size() + 2] = part.n() > 0 && part.body_start.empty();
    communicator.max(found);
    layout.has_E = found[sdk::cone_table.size()] != 0;
    layout.has_bounds = found[sdk::cone_table.size() + 1] != 0;
    layout.has_bodies = found[sdk::cone_table.size() + 2] == 0 && layout.bodies.total > 0;
    for (std::size_t kind = 0; kind < sdk::cone_table.size(); ++kind) {
        if (found[kind] == 0) continue;
        for (const auto& parameter : sdk::cone_table[kind].named_parameters()) {
            const std::string dataset = "cones/" + std::string(parameter.key);
            if (std::none_of(layout.parameters.begin(), layout.parameters.end(),
                             [&](const Parameter& known) { return known.dataset == dataset; }))
                layout.parameters.push_back({dataset, parameter.key});
        }
    }
    return layout;
}

void lay_out(Writing& file, const Layout& layout, const PartitionedProblem& part) {
    file.text("format", problem_format);
    file.integer("version", format_version);
    file.text("law", std::string(name_of(part.law)));
    file.text("source", part.source);
    file.text("notes", part.notes);
    const auto matrix = [&](const std::string& name, std::int64_t rows, std::int64_t entries) {
        file.group(name.c_str());
        file.create((name + "/row_start").c_str(), H5T_STD_I64LE, rows + 1);
        file.create((name + "/column").c_str(), H5T_STD_I64LE, entries);
        file.create((name + "/value").c_str(), H5T_IEEE_F64LE, entries);
    };
    matrix("H", layout.n, layout.H.total);
    matrix("D", layout.m, layout.D.total);
    if (layout.has_E) matrix("E", layout.m, layout.E.total);
    file.create("a", H5T_IEEE_F64LE, layout.n);
    file.create("b", H5T_IEEE_F64LE, layout.m);
    file.group("cones");
    file.create("cones/row_start", H5T_STD_I64LE, layout.cones + 1);
    file.create("cones/kind", H5T_STD_I8LE, layout.cones);
    for (const auto& parameter : layout.parameters)
        file.create(parameter.dataset.c_str(), H5T_IEEE_F64LE, layout.cones);
    if (layout.has_bounds)
        for (const char* name : {"cones/lo", "cones/hi"}) file.create(name, H5T_IEEE_F64LE, layout.m);
    if (layout.has_bodies) file.create("body_start", H5T_STD_I64LE, layout.bodies.total + 1);
}

/// Starts that count in the file; the last process writes the end too.
std::vector<std::int64_t> starts_in_file(const std::vector<std::int64_t>& own, std::int64_t first, bool with_end) {
    std::vector<std::int64_t> starts(own.begin(), own.end() - (with_end ? 0 : 1));
    for (auto& start : starts) start += first;
    return starts;
}

}  // namespace

void write(const Communicator& communicator, const PartitionedProblem& part, const std::filesystem::path& path,
           FileTraffic& traffic) {
    const Layout layout = layout_of(communicator, part);
    const auto own = static_cast<std::size_t>(communicator.rank());
    const bool last = communicator.rank() + 1 == communicator.size();
    const std::int64_t column = part.column_start[own], row = part.row_start[own], cone = part.cone_start[own];
    const auto write_own = [&](Writing& file) {
        const auto matrix = [&](const std::string& name, const LocalMatrix& values, std::int64_t first_row,
                                std::int64_t first_entry) {
            file.put((name + "/row_start").c_str(), first_row, starts_in_file(values.row_start, first_entry, last));
            file.put((name + "/column").c_str(), first_entry, values.column);
            file.put((name + "/value").c_str(), first_entry, values.value);
        };
        matrix("H", part.H, column, layout.H.first);
        matrix("D", part.D, row, layout.D.first);
        if (layout.has_E) {
            // A process may know E as absent where another has entries.
            LocalMatrix none;
            none.row_start.assign(static_cast<std::size_t>(part.m()) + 1, 0);
            matrix("E", part.E.columns > 0 ? part.E : none, row, layout.E.first);
        }
        file.put("a", column, part.a);
        file.put("b", row, part.b);
        std::vector<std::int64_t> first_row = {0}, kinds;
        for (const Cone& block : part.cones) {
            first_row.push_back(first_row.back() + block.rows);
            kinds.push_back(static_cast<std::int64_t>(block.kind));
        }
        file.put("cones/row_start", cone, starts_in_file(first_row, row, last));
        file.put("cones/kind", cone, kinds);
        for (const auto& parameter : layout.parameters)
            file.put(parameter.dataset.c_str(), cone, values_of(part.cones, parameter.key));
        if (layout.has_bounds) {
            std::vector<double> lo, hi;
            for (const Cone& block : part.cones) {
                const auto rows = static_cast<std::size_t>(block.rows);
                if (operations_of(block).has_bounds) {
                    lo.insert(lo.end(), block.lo.begin(), block.lo.end());
                    hi.insert(hi.end(), block.hi.begin(), block.hi.end());
                } else {
                    lo.insert(lo.end(), rows, -std::numeric_limits<double>::infinity());
                    hi.insert(hi.end(), rows, std::numeric_limits<double>::infinity());
                }
            }
            file.put("cones/lo", row, lo);
            file.put("cones/hi", row, hi);
        }
        if (layout.has_bodies) {
            std::vector<std::int64_t> starts = part.body_start;
            if (last) starts.push_back(layout.n);
            file.put("body_start", layout.bodies.first, starts);
        }
    };
    write_in_turn(
        communicator, path, [&](Writing& file) { lay_out(file, layout, part); }, write_own, traffic);
}

}  // namespace delassus::problem_hdf5
