// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/measures.hpp"
#include "bench/writers.hpp"

namespace delassus::bench {

namespace {

std::string plain_error(double value) {
    return std::isfinite(value) ? fmt::format("{:.1e}", value) : "—";
}

std::string plain_seconds(double value) {
    if (!std::isfinite(value)) return "—";
    if (value < 1e-4) return fmt::format("{:.1e}", value);
    return fmt::format("{:.{}f}", value, value < 0.01 ? 5 : value < 1.0 ? 4 : value < 100.0 ? 2 : 0);
}

std::string heading(const ProblemFacts& facts) {
    std::string text = fmt::format("{}: n = {}, m = {}", facts.name, facts.n, facts.m);
    for (const auto& [kind, count] : facts.cones)
        text += fmt::format("{}{} {}", kind == facts.cones.front().first ? "; cones: " : ", ", count, kind);
    return text + fmt::format("; law {}, H {}\n", facts.law, facts.structure);
}

}  // namespace

std::string table_text(const ProblemResults& problem) {
    std::size_t width = 6;
    for (const auto& row : problem.results) width = std::max(width, row.label.size());
    std::string text = heading(problem.facts);
    text += fmt::format("  {:<{}}  {:<17} {:>10} {:>9} {:>9}", "solver", width, "status", "iterations", "setup s",
                        "solve s");
    for (const AnswerMeasure& measure : answer_measures())
        if (measure.brief) text += fmt::format(" {:>8}", measure.name);
    text += fmt::format(" {:>8}\n", "MiB");
    for (const auto& row : problem.results) {
        text += fmt::format("  {:<{}}  {:<17} {:>10} {:>9} {:>9}", row.label, width, row.status,
                            row.iterations ? std::to_string(*row.iterations) : "—", plain_seconds(row.setup),
                            plain_seconds(row.solve));
        for (const AnswerMeasure& measure : answer_measures())
            if (measure.brief) text += fmt::format(" {:>8}", plain_error(value_of(row, measure)));
        text += fmt::format(" {:>8.1f}\n", static_cast<double>(row.peak_memory) / (1024.0 * 1024.0));
    }
    for (const auto& row : problem.results)
        if (!row.message.empty())
            text += row.status == "unsupported" ? fmt::format("  {}\n", row.message)
                                                : fmt::format("  {}: {}\n", row.label, row.message);
    return text;
}

}  // namespace delassus::bench
