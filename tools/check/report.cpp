// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "check/conformance.hpp"
#include "support/json.hpp"

namespace delassus::check {

namespace {

using Verdict = CheckResult::Verdict;

const char* word_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::Passed:
            return "passed";
        case Verdict::Skipped:
            return "skipped";
        case Verdict::Failed:
            break;
    }
    return "FAILED";
}

}  // namespace

std::string to_json(const ConformanceReport& report) {
    nlohmann::ordered_json json = {{"library", report.library.string()},
                                   {"plugin", report.plugin},
                                   {"passed", report.passed()},
                                   {"checks", nlohmann::ordered_json::array()}};
    for (const auto& result : report.results)
        json["checks"].push_back({{"name", result.name},
                                  {"verdict", result.verdict == Verdict::Failed ? "failed" : word_of(result.verdict)},
                                  {"detail", result.detail}});
    // What a plugin says may not be UTF-8.
    return json_text(json, 2) + "\n";
}

void print(const ConformanceReport& report) {
    for (const auto& result : report.results)
        fmt::print("{:<8} {:<36} {}\n", word_of(result.verdict), result.name, result.detail);
    fmt::print("\n{} {}: {} passed, {} failed, {} skipped\n",
               report.plugin.empty() ? report.library.string() : report.plugin,
               report.passed() ? "conforms" : "does not conform", report.count(Verdict::Passed),
               report.count(Verdict::Failed), report.count(Verdict::Skipped));
}

}  // namespace delassus::check
