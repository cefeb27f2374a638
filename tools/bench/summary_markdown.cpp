// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/analysis.hpp"
#include "bench/bench_writers.hpp"
#include "bench/markdown_table.hpp"

namespace delassus::bench {

namespace {

std::string error_text(const Json& value) {
    return value.is_number() ? fmt::format("{:.1e}", value.get<double>()) : "—";
}

std::string name_of_hash(const std::vector<Json>& rows, const char* key, const Json& hash) {
    for (const Json& row : rows)
        if (row.at(key) == hash) return row.at("name");
    return hash;
}

const std::map<std::string, std::string>& class_titles() {
    static const std::map<std::string, std::string> titles = {
        {"linear", "Linear problems (free rows only)"},     {"unsymmetric", "Linear problems, H unsymmetric"},
        {"indefinite", "Linear problems, H indefinite"},    {"associated", "Contact problems, associated law"},
        {"coulomb", "Contact problems, exact Coulomb law"}, {"all", "All problems"}};
    return titles;
}

/// Solved, and mean time, for each solver at each tolerance.
std::string class_text(const Json& one) {
    const Json& tolerances = one.at("tolerances");
    std::vector<std::string> head = {"solver"};
    std::map<std::string, std::vector<std::string>> rows;
    std::map<std::string, double> means;
    std::vector<std::string> order;
    for (const Json& at : tolerances) {
        const auto tolerance = at.at("tolerance").get<double>();
        head.push_back(fmt::format("solved {:g}", tolerance));
        head.push_back("mean");
        for (const Json& solver : at.at("solvers")) {
            const std::string label = solver.at("solver");
            if (!rows.contains(label)) order.push_back(label);
            rows[label].push_back(solver.at("supported") == 0 ? "—"
                                                              : fmt::format("{} of {}", solver.at("solved").get<int>(),
                                                                            solver.at("supported").get<int>()));
            rows[label].push_back(solver.at("supported") == 0 ? "—" : seconds_text(number_of(solver.at("mean"))));
            means[label] += solver.at("supported") == 0 ? 1e9 : number_of(solver.at("mean"));
        }
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](const auto& a, const auto& b) { return means.at(a) < means.at(b); });
    MarkdownTable table(head);
    std::string refused;
    for (const auto& label : order) {
        if (means.at(label) >= 1e9) {
            refused += (refused.empty() ? "" : ", ") + label;
            continue;
        }
        std::vector<std::string> row = {label};
        row.insert(row.end(), rows.at(label).begin(), rows.at(label).end());
        row.resize(head.size(), "—");
        table.add(row);
    }
    const int problems = one.at("problems");
    return fmt::format(
        "### {}: {}\n\n{}{}\n",
        class_titles().count(one.at("name")) ? class_titles().at(one.at("name")) : one.at("name").get<std::string>(),
        problems, table.text(),
        refused.empty() ? "" : fmt::format("\nSolvers that take none of these problems: {}.\n", refused));
}

/// Solved, and mean time, for each decade of sizes and solver at each tolerance.
std::string sizes_text(const Json& one) {
    if (one.at("sizes").empty()) return {};
    std::vector<std::string> head = {"contacts or rows", "solver"};
    for (const Json& at : one.at("tolerances")) {
        head.push_back(fmt::format("solved {:g}", at.at("tolerance").get<double>()));
        head.push_back("mean");
    }
    MarkdownTable table(head);
    for (const Json& size : one.at("sizes")) {
        const auto from = size.at("from").get<double>();
        std::map<std::string, std::vector<std::string>> rows;
        std::vector<std::string> order;
        std::size_t columns = 2;
        for (const Json& at : size.at("tolerances")) {
            for (const Json& solver : at.at("solvers")) {
                const std::string label = solver.at("solver");
                if (solver.at("supported") == 0) continue;
                if (!rows.contains(label)) order.push_back(label);
                auto& row = rows[label];
                row.resize(columns, "—");
                row[0] = fmt::format("{:.0f} to {:.0f}", from, 10.0 * from - 1.0);
                row[1] = label;
                row.push_back(fmt::format("{} of {}", solver.at("solved").get<int>(), size.at("problems").get<int>()));
                row.push_back(seconds_text(number_of(solver.at("mean"))));
            }
            columns += 2;
        }
        for (const auto& label : order) {
            rows.at(label).resize(head.size(), "—");
            table.add(rows.at(label));
        }
    }
    return fmt::format("#### By size\n\n{}\n", table.text());
}

/// The fastest solver of each problem at the tightest tolerance.
std::string fastest_text(const ResultSet& results) {
    double tightest = 1.0;
    for (const auto& tolerance : results.session.at("settings").at("tolerances"))
        tightest = std::min(tightest, tolerance.get<double>());
    MarkdownTable table({"problem", "rows", "law", "fastest", "time", "natural", "velocity", "iterations"});
    std::map<std::string, const Json*> best;
    std::vector<std::pair<std::string, const Json*>> asked;
    for (const Json& row : results.solves) {
        if (row.at("tolerance") != tightest) continue;
        const std::string key = row.at("problem").get<std::string>() + row.at("law").get<std::string>();
        if (asked.empty() || asked.back().first != key) asked.emplace_back(key, &row);
        if (row.at("cause") != "") continue;
        auto& held = best[key];
        if (!held || total_seconds(row) < total_seconds(*held)) held = &row;
    }
    for (const auto& [key, any] : asked) {
        std::string rows = "—";
        for (const Json& problem : results.problems)
            if (problem.at("problem") == any->at("problem")) rows = std::to_string(problem.at("m").get<std::int64_t>());
        const std::string name = name_of_hash(results.problems, "problem", any->at("problem"));
        const Json* row = best.contains(key) ? best.at(key) : nullptr;
        if (!row) {
            table.add({name, rows, any->at("law"), "none solved it", "—", "—", "—", "—"});
        } else {
            table.add({name, rows, row->at("law"), row->at("label"), seconds_text(total_seconds(*row)),
                       error_text(row->at("error").at("natural")), error_text(row->at("error").at("velocity")),
                       std::to_string(row->at("iterations").get<std::int64_t>())});
        }
    }
    return asked.empty() ? "" : fmt::format("### The fastest at {:g}\n\n{}\n", tightest, table.text());
}

std::string failures_text(const Json& analysis) {
    std::map<std::string, std::string> causes;
    for (const Json& failure : analysis.at("failures")) {
        if (failure.at("cause") == "unsupported") continue;
        auto& text = causes[failure.at("cause")];
        const int skipped = failure.at("skipped");
        text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", failure.at("solver").get<std::string>(),
                            failure.at("count").get<int>(),
                            skipped > 0 ? fmt::format(", {} of them not run", skipped) : "");
    }
    if (causes.empty()) return {};
    std::string text = "### Failures (runs)\n\n";
    if (const auto lies = causes.find("false_claim"); lies != causes.end()) {
        text += fmt::format("- **FALSE CLAIM**: {}\n", lies->second);
        causes.erase(lies);
    }
    for (auto& [cause, who] : causes) {
        std::string spoken = cause;
        std::replace(spoken.begin(), spoken.end(), '_', ' ');
        text += fmt::format("- {}: {}\n", spoken, who);
    }
    return text + "\n";
}

std::string scaling_text(const Json& analysis) {
    MarkdownTable table({"family", "law", "solver", "tolerance", "cost grows as size^", "sizes"});
    int count = 0;
    for (const Json& one : analysis.at("scaling")) {
        if (one.at("fit").is_null()) continue;
        ++count;
        table.add({one.at("family"), one.at("law"), one.at("solver"),
                   fmt::format("{:g}", one.at("tolerance").get<double>()),
                   fmt::format("{:.2f} ± {:.2f}", one.at("fit").at("exponent").get<double>(),
                               one.at("fit").at("standard_error").get<double>()),
                   std::to_string(one.at("points").size())});
    }
    return count == 0 ? "" : "### Growth of cost with size\n\n" + table.text() + "\n";
}

std::string stepping_text(const ResultSet& results, const Json& analysis) {
    if (results.simulations.empty()) return {};
    MarkdownTable table({"scene", "timestepper", "step s", "error", "time", "steps", "order", "ended"});
    for (const Json& row : results.simulations) {
        std::string order = "—";
        for (const Json& one : analysis.at("orders"))
            if (one.at("scene") == row.at("scene") && one.at("timestepper") == row.at("timestepper") &&
                one.at("solver") == row.at("solver") && !one.at("fit").is_null())
                order = fmt::format("{:.2f}", one.at("fit").at("exponent").get<double>());
        const Json& totals = row.at("totals");
        table.add({name_of_hash(results.scenes, "scene", row.at("scene")), row.at("timestepper"),
                   fmt::format("{:g}", row.at("step").get<double>()), error_text(row.at("error").at("position")),
                   seconds_text(number_of(row.at("seconds").at("stepping"))),
                   totals.contains("steps") ? std::to_string(totals.at("steps").get<std::int64_t>()) : "—", order,
                   row.at("status")});
    }
    return "### Timesteppers: error of the trajectory's end\n\n" + table.text() + "\n";
}

std::string leaving_out_text(const ResultSet& results) {
    if (results.leaving_out.empty()) return {};
    MarkdownTable table({"scene", "time", "forced", "ratio", "rows", "forced", "MiB", "forced", "libraries", "forced",
                         "ends differ by"});
    for (const Json& row : results.leaving_out) {
        const Json &own = row.at("as_is"), &forced = row.at("forced");
        const auto failed = [](const Json& run) { return !run.at("cause").get<std::string>().empty(); };
        const auto time = [&](const Json& run) {
            const double seconds = number_of(run.at("seconds").at("stepping"));
            return failed(run) ? run.at("cause").get<std::string>() : seconds_text(seconds);
        };
        const auto rows = [](const Json& run) {
            return run.at("totals").contains("most_rows") ? json_text(run.at("totals").at("most_rows")) : "—";
        };
        const auto mebibytes = [](const Json& run) {
            return fmt::format("{:.1f}", run.at("peak_memory").get<double>() / 1048576.0);
        };
        const double ratio =
            number_of(forced.at("seconds").at("stepping")) / number_of(own.at("seconds").at("stepping"));
        table.add({row.at("name"), time(own), time(forced),
                   failed(own) || failed(forced) || std::isnan(ratio) ? "—" : fmt::format("{:.2f}", ratio), rows(own),
                   rows(forced), mebibytes(own), mebibytes(forced), std::to_string(own.at("libraries").size()),
                   std::to_string(forced.at("libraries").size()), error_text(forced.at("error").at("position"))});
    }
    return "### What leaving out saves\n\nEach scene as it is, and \"forced\": with nothing left out (`leave_out: "
           "false`). Time of stepping, most rows of a problem, peak memory and libraries of the process, and by how "
           "much "
           "the ends of the two runs differ.\n\n" +
           table.text() + "\n";
}

}  // namespace

std::string summary_markdown(const ResultSet& results, const Json& analysis) {
    const Json& session = results.session;
    const Json& machine = session.at("machine");
    std::string text = fmt::format("## {}\n\n", session.at("suite").at("title").get<std::string>());
    std::string what;
    const auto list = [&](std::size_t runs, const char* of, std::size_t things, const char* named) {
        if (runs > 0) what += fmt::format("{}{} runs {} {} {}", what.empty() ? "" : ", ", runs, of, things, named);
    };
    list(results.solves.size(), "of solvers on", results.problems.size(), "problems");
    list(results.simulations.size(), "of", results.scenes.size(), "scenes");
    list(2 * results.leaving_out.size(), "of", results.leaving_out.size(), "scenes with and without leaving out");
    list(results.cells.size(), "on", results.axes.size(), "axes");
    text += fmt::format("{}; delassus {}, {}, {}.\n", what.empty() ? "nothing has been run" : what,
                        session.at("delassus").get<std::string>(), session.at("created").get<std::string>(),
                        machine.at("processor").get<std::string>());
    if (results.missing > 0)
        text += fmt::format("**Not complete**: {} runs are missing. Run the same command again to go on.\n",
                            results.missing);
    if (number_of(machine.at("load")) > 0.5 * machine.at("cores").get<double>())
        text +=
            fmt::format("The machine was busy when this began (load {:.1f}): times are longer than on a quiet one.\n",
                        machine.at("load").get<double>());
    for (const Json& sentence : session.at("left_out"))
        text += fmt::format("Left out: {}.\n", sentence.get<std::string>());
    text += '\n';
    text += axes_markdown(results);
    for (const Json& one : analysis.at("classes"))
        if (one.at("name") != "all") text += class_text(one) + sizes_text(one);
    text += fastest_text(results) + failures_text(analysis) + scaling_text(analysis) +
            processes_markdown(results, analysis) + stepping_text(results, analysis) + leaving_out_text(results);
    if (!results.solves.empty())
        text += fmt::format(
            "Mean: shifted geometric mean of setup and solve (shift {:g} s) over the problems that any solver solved; "
            "one that "
            "it did not solve counts as the time limit, {:g} s.\n",
            mean_shift, session.at("settings").at("time_limit").get<double>());
    return text;
}

}  // namespace delassus::bench
