// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "check/checks.hpp"
#include "check/raw_solver.hpp"
#include "delassus/error.hpp"

namespace delassus::check {

namespace {

std::string solve_one(const Subject& subject, const KnownProblem& known) {
    const PreparedProblem problem(known.problem);
    if (const auto missing = subject.info().missing(problem.needs()))
        throw Skip(fmt::format("it does not declare {}", fmt::join(capability_names(missing), ", ")));
    Solver solver = subject.solver();
    if (const auto reason = solver.refusal(problem, settings_of(fine_tolerance)); !reason.empty()) throw Skip(reason);
    const auto report = solve_known(solver, known);
    return fmt::format("{} iterations, natural error {:.1e}, balance error {:.1e}", report.iterations,
                       report.error.natural, report.error.balance);
}

/// A plugin that refuses problems by its own predicate must still take at least one that needs each thing it declares.
std::string check_shown(const Subject& subject) {
    std::uint64_t shown =
        DELASSUS_CAN_WARM_START | DELASSUS_CAN_DISTRIBUTED | DELASSUS_CAN_PARTITIONED;  // checks of their own
    const auto problems = subject.problems();
    for (const auto& known : problems) shown |= PreparedProblem(known.problem).needs();
    const auto hidden = subject.info().capabilities & ~shown;
    expect(hidden == 0, fmt::format("it declares {}, and takes none of the known problems that need it",
                                    fmt::join(capability_names(hidden), ", ")));
    return fmt::format("{} of {} known problems taken", problems.size(), known_problems().size());
}

/// Hosts of later minor versions have longer cones, and so a longer way from one to the next.
std::string check_cone_stride(const Subject& subject) {
    struct LongerCone {
        delassus_cone cone;
        double later[3];
    };
    int solves = 0;
    for (const auto& known : subject.problems()) {
        const PreparedProblem problem(known.problem);
        if (problem.raw().cone_count < 2) continue;
        std::vector<LongerCone> cones;
        for (std::int32_t c = 0; c < problem.raw().cone_count; ++c)
            cones.push_back({*delassus_cone_at(&problem.raw(), c), {-1.0, -1.0, -1.0}});
        delassus_problem longer = problem.raw();
        longer.cones = &cones.front().cone;
        longer.cone_stride = sizeof(LongerCone);
        RawSolver here(subject), there(subject);
        expect(here.set_up(problem.raw()) == DELASSUS_SOLVED && there.set_up(longer) == DELASSUS_SOLVED,
               fmt::format("\"{}\" cannot be set up", known.problem.name));
        const auto expected = here.solve(problem.raw(), settings_of(fine_tolerance), nullptr);
        const auto found = there.solve(longer, settings_of(fine_tolerance), nullptr);
        expect(found.status == expected.status && found.solution.lambda == expected.solution.lambda &&
                   found.solution.x == expected.solution.x,
               fmt::format("\"{}\" has another answer where cones are {} bytes apart", known.problem.name,
                           sizeof(LongerCone)));
        ++solves;
    }
    if (solves == 0) throw Skip("it takes no known problem of two cones");
    return fmt::format("{} problems with cones {} bytes apart", solves, sizeof(LongerCone));
}

std::string check_refusal(const Subject& subject) {
    Solver solver = subject.solver();
    int refused = 0;
    for (const auto& known : known_problems()) {
        const PreparedProblem problem(known.problem);
        const auto missing = subject.info().missing(problem.needs());
        if (missing == 0) continue;
        Solution solution;
        std::string sentence;
        try {
            static_cast<void>(solver.solve(problem, solution, settings_of(fine_tolerance)));
        } catch (const Unsupported& refusal) {
            sentence = refusal.what();
        }
        expect(sentence.find(problem.describe(missing)) != std::string::npos,
               fmt::format("\"{}\" needs {} and was not refused by that name: {}", known.problem.name,
                           problem.describe(missing), sentence.empty() ? "it was called" : sentence));
        ++refused;
    }
    return fmt::format("{} problems refused before the call", refused);
}

std::string check_tolerances(const Subject& subject) {
    int solves = 0;
    for (const auto& known : subject.problems()) {
        const PreparedProblem problem(known.problem);
        Solver solver = subject.solver();
        for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
            Solution solution;
            const auto report = solver.solve(problem, solution, settings_of(tolerance));
            expect(report.status == Status::Solved,
                   fmt::format("\"{}\" at tolerance {:.0e} ended with {}; {}", known.problem.name, tolerance,
                               name_of(report.status), report.message));
            ++solves;
        }
    }
    return fmt::format("{} solves, each claim true", solves);
}

/// A tolerance below rounding cannot be reached, and a solver that misses it must say so. Solver and host round
/// differently, so a claim is false here only if the error exceeds rounding.
constexpr double rounding = 1e-12;

std::string check_impossible_tolerance(const Subject& subject) {
    int claimed = 0, solves = 0;
    for (const auto& known : subject.problems()) {
        Solver solver = subject.solver();
        auto settings = settings_of(1e-17);
        settings.max_iterations = 2000;
        settings.time_limit = 1.0;
        Solution solution;
        const auto report = solver.solve(PreparedProblem(known.problem), solution, settings);
        const bool is_false_claim =
            report.status == Status::FalseClaim && std::max(report.error.natural, report.error.balance) > rounding;
        expect(!is_false_claim && report.status != Status::Error,
               fmt::format("\"{}\" at tolerance 1e-17 ended with {}: {}", known.problem.name, name_of(report.status),
                           report.message));
        claimed += report.status == Status::Solved || report.status == Status::FalseClaim;
        ++solves;
    }
    return fmt::format("{} solves at 1e-17, {} claims, none wrong by more than rounding", solves, claimed);
}

}  // namespace

std::vector<Check> capability_checks() {
    std::vector<Check> checks;
    for (const auto& known : known_problems())
        checks.push_back(
            {"known/" + known.problem.name, [known](const Subject& subject) { return solve_one(subject, known); }});
    checks.push_back({"capabilities/shown", check_shown});
    checks.push_back({"capabilities/cone_stride", check_cone_stride});
    checks.push_back({"capabilities/refusal", check_refusal});
    checks.push_back({"claims/tolerances", check_tolerances});
    checks.push_back({"claims/impossible_tolerance", check_impossible_tolerance});
    return checks;
}

}  // namespace delassus::check
