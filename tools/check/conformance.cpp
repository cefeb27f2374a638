// SPDX-License-Identifier: BSD-3-Clause
#include "check/conformance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "check/checks.hpp"

namespace delassus::check {

namespace {

using Verdict = CheckResult::Verdict;

/// After this many checks that did not return, the others are skipped.
constexpr int patience = 3;

std::vector<Check> all_checks() {
    std::vector<Check> checks;
    for (auto group : {identity_checks(), option_checks(), capability_checks(), reuse_checks(), instance_checks(),
                       progress_checks(), failure_checks()})
        std::move(group.begin(), group.end(), std::back_inserter(checks));
    return checks;
}

/// Runs the checks one by one and keeps what concerns all of them.
class Run {
public:
    Run(ConformanceReport& report, double seconds) : report_(report), seconds_(seconds) {}

    /// Loads the library in a child and reads its name; false if that fails.
    bool handshake() {
        // The name, and whether the plugin wants MPI, come back as the check's detail.
        auto outcome = isolated("handshake", Leave::AtOnce, [](const Subject& subject) {
            const bool mpi = (subject.info().flags & DELASSUS_FLAG_MPI) != 0;
            return subject.info().name + (mpi ? "+" : "");
        });
        if (outcome.verdict == Verdict::Passed) {
            if (outcome.detail.ends_with('+')) {
                leave_ = Leave::ByExit;
                outcome.detail.pop_back();
            }
            report_.plugin = outcome.detail;
        }
        add("handshake", outcome);
        return outcome.verdict == Verdict::Passed;
    }

    void check(const Check& check) { check_and_leave(check, leave_); }

    void check_and_leave(const Check& check, Leave leave) {
        if (hangs_ >= patience) {
            report_.results.push_back(
                {check.name, Verdict::Skipped, fmt::format("not run: {} checks before it did not return", patience)});
            return;
        }
        add(check.name, isolated(check.name, leave, check.run));
    }

    /// What all checks together printed.
    void judge_output() {
        const bool quiet = printing_.empty();
        report_.results.push_back(
            {"output/quiet", quiet ? Verdict::Passed : Verdict::Failed,
             quiet ? "" : fmt::format("it wrote {} bytes to standard output, first in {}", bytes_printed_, printing_)});
    }

private:
    IsolatedOutcome isolated(const std::string& name, Leave leave,
                             const std::function<std::string(const Subject&)>& run) {
        auto outcome = run_isolated(seconds_, leave, [&] { return run(Subject(report_.library)); });
        if (!outcome.returned) ++hangs_;
        if (outcome.bytes_printed > 0 && printing_.empty()) printing_ = name;
        bytes_printed_ += outcome.bytes_printed;
        return outcome;
    }

    void add(const std::string& name, const IsolatedOutcome& outcome) {
        report_.results.push_back({name, outcome.verdict, outcome.detail});
    }

    ConformanceReport& report_;
    double seconds_;
    Leave leave_ = Leave::AtOnce;
    int hangs_ = 0;
    std::string printing_;
    std::size_t bytes_printed_ = 0;
};

std::string end_the_process(const Subject& subject) {
    Solver solver = subject.solver();
    solve_known(solver, subject.problems().front());
    return {};
}

}  // namespace

std::size_t ConformanceReport::count(CheckResult::Verdict verdict) const {
    return static_cast<std::size_t>(
        std::count_if(results.begin(), results.end(), [&](const auto& result) { return result.verdict == verdict; }));
}

bool ConformanceReport::passed() const {
    return !results.empty() && count(Verdict::Failed) == 0;
}

ConformanceReport run_conformance(const std::filesystem::path& library, double seconds_per_check) {
    ConformanceReport report;
    report.library = library;
    Run run(report, seconds_per_check);
    if (run.handshake()) {
        for (const auto& check : all_checks()) run.check(check);
        run.check_and_leave({"instances/end_of_process", end_the_process}, Leave::ByExit);
    }
    run.judge_output();
    return report;
}

}  // namespace delassus::check
