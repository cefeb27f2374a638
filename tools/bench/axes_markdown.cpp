// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bench/bench_writers.hpp"
#include "bench/markdown_table.hpp"
#include "bench/outcome.hpp"

namespace delassus::bench {

namespace {

std::string number_text(double value) {
    return fmt::format("{:g}", value);
}

/// The text without what would break a row of a table, and shortened.
std::string cell_text(std::string text) {
    std::replace(text.begin(), text.end(), '|', '/');
    std::replace(text.begin(), text.end(), '\n', ' ');
    constexpr std::size_t longest = 160;
    if (text.size() <= longest) return text;
    std::size_t end = longest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;  // not within a character
    return text.substr(0, end) + "…";
}

}  // namespace

std::string axes_markdown(const ResultSet& results) {
    if (results.cells.empty()) return {};
    std::map<std::string, int> counts;
    for (const Json& cell : results.cells) ++counts[cell.at("outcome")];
    std::string text = "### Where methods break\n\n";
    for (const char* outcome : {"correct", "inaccurate", "refused", "failed", "wrong", "crashed", "hung"})
        text += fmt::format("{}{} {}", outcome == std::string("correct") ? "" : ", ", counts[outcome], outcome);
    text += fmt::format(", of {} runs.\n\n", results.cells.size());
    const auto all = breakdowns(results.cells);
    for (const Json& axis : results.axes) {
        const std::string name = axis.at("axis"), unit = axis.at("unit");
        text += fmt::format("#### {} ({}{}{})\n\n", axis.at("title").get<std::string>(), name, unit.empty() ? "" : ", ",
                            unit);
        MarkdownTable table({"method", "correct up to", "breaks at", "as", "what it says"});
        std::string refused;
        for (const auto& one : all) {
            if (one.axis != name) continue;
            if (one.outcome == "refused" && !one.last_correct && one.correct_again.empty()) {
                refused += (refused.empty() ? "" : ", ") + one.method;
                continue;
            }
            std::string again;
            for (const double value : one.correct_again) again += (again.empty() ? "" : ", ") + number_text(value);
            table.add({one.method, one.last_correct ? number_text(*one.last_correct) : "none",
                       one.first_not ? number_text(*one.first_not) : "does not", one.outcome.empty() ? "" : one.outcome,
                       cell_text(one.sentence + (again.empty() ? "" : " (correct again at " + again + ")"))});
        }
        text += table.text();
        if (!refused.empty()) text += fmt::format("\nRefused from the start by: {}.\n", refused);
        text += '\n';
    }
    return text;
}

}  // namespace delassus::bench
