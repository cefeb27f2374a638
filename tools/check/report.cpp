// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "check/conformance.hpp"
#include "support/json.hpp"

namespace delassus::check {

namespace {

using Verdict = CheckResult::Verdict;

struct Word {
    const char* shown;
    const char* in_json;
};

Word word_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::Passed:
            return {"passed", "passed"};
        case Verdict::Skipped:
            return {"skipped", "skipped"};
        case Verdict::Warning:
            return {"WARNING", "warning"};
        case Verdict::Failed:
            break;
    }
    return {"FAILED", "failed"};
}

}  // namespace

std::string to_json(const ConformanceReport& report) {
    nlohmann::ordered_json json = {{"library", report.library.string()},
                                   {"plugin", report.plugin},
                                   {"passed", report.passed()},
                                   {"checks", nlohmann::ordered_json::array()}};
    for (const auto& result : report.results)
        json["checks"].push_back(
            {{"name", result.name}, {"verdict", word_of(result.verdict).in_json}, {"detail", result.detail}});
    // What a plugin says may not be UTF-8.
    return json_text(json, 2) + "\n";
}

void print(const ConformanceReport& report) {
    for (const auto& result : report.results)
        fmt::print("{:<8} {:<36} {}\n", word_of(result.verdict).shown, result.name, result.detail);
    const std::size_t warnings = report.count(Verdict::Warning);
    fmt::print("\n{} {}: {} passed, {} failed, {} skipped{}\n",
               report.plugin.empty() ? report.library.string() : report.plugin,
               report.passed() ? "conforms" : "does not conform", report.count(Verdict::Passed),
               report.count(Verdict::Failed), report.count(Verdict::Skipped),
               warnings > 0 ? fmt::format(", {} warning{}", warnings, warnings > 1 ? "s" : "") : "");
}

}  // namespace delassus::check
