// SPDX-License-Identifier: BSD-3-Clause
// The part of summary.md on processes.
#include <fmt/format.h>

#include <cmath>

#include "bench/bench_writers.hpp"
#include "bench/json_text.hpp"
#include "bench/markdown_table.hpp"

namespace delassus::bench {

namespace {

std::string number_text(const Json& value, const char* form) {
    const double number = number_of(value);
    return std::isnan(number) ? "—" : fmt::format(fmt::runtime(form), number);
}

std::string integer_text(const Json& value) {
    return value.is_null() ? "—" : fmt::format("{}", value.get<std::int64_t>());
}

/// The columns that strong and weak scaling share.
std::vector<std::string> cells_of(const Json& point) {
    return {std::to_string(point.at("processes").get<int>()),
            seconds_text(number_of(point.at("seconds"))),
            number_text(point.at("efficiency"), "{:.2f}"),
            integer_text(point.at("iterations")),
            number_text(point.at("efficiency_of_an_iteration"), "{:.2f}"),
            number_text(point.at("bytes_an_iteration"), "{:.4g}"),
            fmt::format("{:.1f}", point.at("peak_memory").get<double>() / 1048576.0),
            integer_text(point.at("ghosts")),
            number_text(point.at("imbalance"), "{:.3f}")};
}

const std::vector<std::string> shared_head = {"processes",       "time", "efficiency", "iterations", "of an iteration",
                                              "bytes/iteration", "MiB",  "ghosts",     "imbalance"};

std::string table_of(const Json& list, const char* title, const char* what, const char* subject) {
    if (list.empty()) return {};
    std::vector<std::string> head = {subject, "contacts or rows", "law", "solver", "tolerance"};
    head.insert(head.end(), shared_head.begin(), shared_head.end());
    MarkdownTable table(head);
    for (const Json& one : list)
        for (const Json& point : one.at("points")) {
            std::vector<std::string> row = {one.at(subject), fmt::format("{:.0f}", point.at("size").get<double>()),
                                            one.at("law"), one.at("solver"),
                                            fmt::format("{:g}", one.at("tolerance").get<double>())};
            for (auto& cell : cells_of(point)) row.push_back(std::move(cell));
            table.add(std::move(row));
        }
    return fmt::format("### {}\n\n{}\n\n{}\n", title, what, table.text());
}

std::string traffic_text(const Json& list) {
    MarkdownTable table(
        {"family", "law", "solver", "tolerance", "processes", "bytes/iteration grow as size^", "sizes"});
    int count = 0;
    for (const Json& one : list) {
        if (one.at("fit").is_null()) continue;
        ++count;
        table.add({one.at("family"), one.at("law"), one.at("solver"),
                   fmt::format("{:g}", one.at("tolerance").get<double>()), integer_text(one.at("processes")),
                   fmt::format("{:.2f} ± {:.2f}", number_of(one.at("fit").at("exponent")),
                               number_of(one.at("fit").at("standard_error"))),
                   std::to_string(one.at("points").size())});
    }
    return count == 0 ? "" : "### Growth of what is sent\n\n" + table.text() + "\n";
}

std::string split_text(const Json& list) {
    MarkdownTable table({"problem", "solver", "tolerance", "processes", "setup", "products", "projections",
                         "linear systems", "exchange", "reductions", "waiting", "other"});
    int count = 0;
    for (const Json& one : list)
        for (const Json& point : one.at("points")) {
            const Json& phases = point.at("phases");
            if (phases.is_null()) continue;
            ++count;
            std::vector<std::string> row = {one.at("problem"), one.at("solver"),
                                            fmt::format("{:g}", one.at("tolerance").get<double>()),
                                            integer_text(point.at("processes"))};
            double all = 0.0;
            for (const auto& [phase, seconds] : phases.items()) all += number_of(seconds);
            for (const char* phase :
                 {"setup", "products", "projections", "linear_systems", "exchange", "reductions", "waiting", "other"})
                row.push_back(phases.contains(phase) && all > 0.0
                                  ? fmt::format("{:.1f}", 100.0 * number_of(phases.at(phase)) / all)
                                  : "—");
            table.add(std::move(row));
        }
    return count == 0 ? "" : "### What the time goes to (per cent, mean of the processes)\n\n" + table.text() + "\n";
}

}  // namespace

std::string processes_markdown(const ResultSet& results, const Json& analysis) {
    const Json& processes = analysis.at("processes");
    std::string text = table_of(processes.at("strong"), "Strong scaling: the same problem on more processes",
                                "Efficiency: T₁ / (P · T) of setup and solve, and of the solve of an iteration; T₁ "
                                "is the run on the fewest processes, P how many times as many there are. MiB: of "
                                "the largest process. Bytes: of all processes together.",
                                "problem") +
                       table_of(processes.at("weak"), "Weak scaling: as many contacts on each process",
                                "Efficiency: T₁ / T of setup and solve, and of the solve of an iteration.", "family") +
                       traffic_text(processes.at("traffic")) + split_text(processes.at("strong"));
    if (!processes.at("beyond_cores").is_null())
        text += fmt::format(
            "Up to {} processes shared the {} cores of this machine: times beyond as many processes as cores say "
            "nothing about scaling.\n\n",
            processes.at("beyond_cores").get<int>(), results.session.at("machine").at("cores").get<int>());
    return text;
}

}  // namespace delassus::bench
