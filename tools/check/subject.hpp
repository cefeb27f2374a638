// SPDX-License-Identifier: BSD-3-Clause
// The plugin under test and what all checks do with it.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "check/isolated.hpp"
#include "check/known_problems.hpp"
#include "delassus/solver.hpp"

namespace delassus::check {

/// The tolerance at which answers are compared with the known ones.
inline constexpr double fine_tolerance = 1e-8;

/// The plugin, loaded into the child process of one check.
class Subject {
public:
    /// Throws PluginError if the handshake fails.
    explicit Subject(const std::filesystem::path& library) : plugin_(Plugin::load(library)) {}

    [[nodiscard]] const PluginInfo& info() const { return plugin_->info(); }
    [[nodiscard]] const std::shared_ptr<const Plugin>& plugin() const { return plugin_; }
    [[nodiscard]] bool can(std::uint64_t capabilities) const { return info().missing(capabilities) == 0; }

    [[nodiscard]] Solver solver(OptionTexts options = {}) const { return Solver(plugin_, std::move(options)); }

    /// Those of the list that the plugin declares to take and does not refuse with its default options.
    [[nodiscard]] std::vector<KnownProblem> takeable(std::vector<KnownProblem> list) const;

    /// takeable(known_problems()), at least one; throws Failure if there is none.
    [[nodiscard]] std::vector<KnownProblem> problems() const;

    /// The first tower that the plugin takes; throws Skip if there is none.
    [[nodiscard]] KnownProblem tower() const;

private:
    std::shared_ptr<const Plugin> plugin_;
};

/// Throws Failure with the sentence unless the condition holds.
void expect(bool condition, const std::string& sentence);

/// Throws Failure unless the solver says that it solved the problem, the host agrees, and (x, λ) is the known
/// solution to about a hundred times the tolerance.
void expect_known_solution(const KnownProblem& known, const Solution& solution, const SolveReport& report);

/// Solves at the tolerance from nothing and judges by expect_known_solution.
SolveReport solve_known(Solver& solver, const KnownProblem& known, double tolerance = fine_tolerance);

/// Settings of the checks: the tolerance, and a time limit well below that of a check.
[[nodiscard]] SolveSettings settings_of(double tolerance);

}  // namespace delassus::check
