// SPDX-License-Identifier: BSD-3-Clause
#include "bench/results_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/rows.hpp"
#include "delassus/error.hpp"
#include "support/atomic_file.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

constexpr const char* file_name = "results.jsonl";

struct StoredLines {
    std::vector<Json> rows;
    std::size_t complete = 0;  ///< bytes up to the end of the last line that is whole
};

StoredLines read_lines(const fs::path& file) {
    const std::string text = read_file(file);
    StoredLines lines;
    std::size_t begin = 0, number = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
        ++number;
        Json row = try_parse_ordered_json(std::string_view(text).substr(begin, end - begin));
        if (!row.is_object() || !row.contains("kind"))
            throw InputError(
                fmt::format("{}, line {}: this is not a row of a benchmark's results", file.string(), number));
        if (row["kind"] == "session" &&
            (row.value("format", "") != rows_format || row.value("version", 0) != rows_version))
            throw InputError(fmt::format("{}, line {}: the format is {} {}; this version reads {} {}", file.string(),
                                         number, row.value("format", "?"), row.value("version", 0), rows_format,
                                         rows_version));
        lines.rows.push_back(std::move(row));
        lines.complete = end + 1;
    }
    if (!lines.rows.empty() && lines.rows.front()["kind"] != "session")
        throw InputError(fmt::format("{}: the first line is not that of a session", file.string()));
    return lines;
}

/// Puts the row in the place of one with the same value of the field, or at the end.
void replace_or_add(std::vector<Json>& rows, const Json& row, std::initializer_list<const char*> fields) {
    for (auto& other : rows) {
        bool same = true;
        for (const char* field : fields) same = same && other.at(field) == row.at(field);
        if (same) {
            other = row;
            return;
        }
    }
    rows.push_back(row);
}

}  // namespace

ResultSet read_results(const fs::path& folder) {
    const fs::path file = folder / file_name;
    if (!fs::exists(file))
        throw InputError(fmt::format("{} holds no {}: it is not a folder that `delassus bench run` wrote",
                                     folder.string(), file_name));
    ResultSet set;
    std::map<std::string, Json> solves, simulations, leaving_out, cells;
    std::vector<Json> axes;
    for (const Json& row : read_lines(file).rows) {
        const std::string kind = row.at("kind");
        if (kind == "session") set.session = row;
        if (kind == "problem") replace_or_add(set.problems, row, {"problem"});
        if (kind == "reference") replace_or_add(set.references, row, {"of", "law"});
        if (kind == "libraries") replace_or_add(set.libraries, row, {"solver"});
        if (kind == "scene") replace_or_add(set.scenes, row, {"scene"});
        if (kind == "solve") solves[row.at("key")] = row;
        if (kind == "axis") replace_or_add(axes, row, {"axis"});
        if (kind == "cell") cells[row.at("key")] = row;
        if (kind == "simulation") simulations[row.at("key")] = row;
        if (kind == "leaving_out") leaving_out[row.at("key")] = row;
    }
    if (set.session.is_null()) throw InputError(fmt::format("{} is empty: nothing has been run yet", file.string()));
    for (const auto& key : set.session.at("keys")) {
        if (const auto solve = solves.find(key); solve != solves.end()) {
            set.solves.push_back(solve->second);
        } else if (const auto simulation = simulations.find(key); simulation != simulations.end()) {
            set.simulations.push_back(simulation->second);
        } else if (const auto scene = leaving_out.find(key); scene != leaving_out.end()) {
            set.leaving_out.push_back(scene->second);
        } else if (const auto cell = cells.find(key); cell != cells.end()) {
            set.cells.push_back(cell->second);
        } else {
            ++set.missing;
        }
    }
    for (const Json& axis : axes)
        if (std::any_of(set.cells.begin(), set.cells.end(),
                        [&](const Json& cell) { return cell.at("axis") == axis.at("axis"); }))
            set.axes.push_back(axis);
    return set;
}

OutputFolder open_results(const fs::path& folder) {
    std::vector<std::string> adopted;
    if (const fs::path file = folder / file_name; fs::exists(file) && !read_lines(file).rows.empty())
        adopted = {file_name,     "summary.md", "results.csv", "cells.csv", "simulations.csv",
                   "report.html", "suite.yaml", "given",       "problems",  "references"};
    return OutputFolder(folder, "bench", adopted);
}

ResultsFile::ResultsFile(OutputFolder& folder) : folder_(folder), file_(folder.add(file_name)) {
    if (!fs::exists(file_)) return;
    const StoredLines lines = read_lines(file_);
    for (const Json& row : lines.rows) note(row);
    std::error_code failure;
    fs::resize_file(file_, lines.complete, failure);
    if (failure) throw InputError(fmt::format("{} cannot be written: {}", file_.string(), failure.message()));
}

void ResultsFile::add(const Json& row) {
    append_to_file(file_, json_text(row) + '\n');
    folder_.keep();
    note(row);
}

void ResultsFile::note(const Json& row) {
    if (row.contains("key"))
        ends_[row.at("key")] = {row.value("status", ""), row.value("cause", ""), row.contains("skipped_after")};
}

}  // namespace delassus::bench
