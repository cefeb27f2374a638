// SPDX-License-Identifier: BSD-3-Clause
// The conformance suite: one set of checks that every plugin must pass, ours included (docs/conformance.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace delassus::check {

/// One check of the suite.
struct CheckResult {
    enum class Verdict { Passed, Failed, Skipped, Warning };  ///< a warning is no failure
    std::string name;                                         ///< e.g. "known/friction_sliding"
    Verdict verdict = Verdict::Failed;
    std::string detail;  ///< why it failed, was skipped or warns; figures where there are any
};

struct ConformanceReport {
    std::filesystem::path library;
    std::string plugin;  ///< its name; empty if the handshake failed
    std::vector<CheckResult> results;

    /// No check failed, and there were some.
    [[nodiscard]] bool passed() const;
    [[nodiscard]] std::size_t count(CheckResult::Verdict verdict) const;
};

/// Runs the suite over the shared library at an absolute path. Each check runs in a process of its own with a time
/// limit in seconds, so that a crash or a hang is a failed check and not the end. The library is never loaded into
/// this process. After three checks that did not return, the others are skipped.
[[nodiscard]] ConformanceReport run_conformance(const std::filesystem::path& library, double seconds_per_check = 20.0);

[[nodiscard]] std::string to_json(const ConformanceReport& report);

/// A line a check on standard output, and a summary.
void print(const ConformanceReport& report);

}  // namespace delassus::check
