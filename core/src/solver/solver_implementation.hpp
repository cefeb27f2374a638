// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "delassus/solver.hpp"

namespace delassus {

/// By the plugin's own count, since the solver was made.
struct SetUpCounts {
    std::int64_t analyses = 0, factorizations = 0;

    SetUpCounts& operator+=(const SetUpCounts& other) {
        analyses += other.analyses;
        factorizations += other.factorizations;
        return *this;
    }
};

/// The inside of a Solver: one plugin, or several in stages. run() is called after the settings have been checked and
/// the starting point is in place; its result is judged afterwards.
class Solver::Implementation {
public:
    Implementation() = default;
    virtual ~Implementation() = default;
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    [[nodiscard]] virtual const PluginInfo& info() const = 0;
    /// The options that were chosen.
    [[nodiscard]] virtual const OptionTexts& options() const = 0;
    /// See Solver::refusal.
    [[nodiscard]] virtual std::string refusal(const Prepared& problem, const SolveSettings& settings) = 0;
    /// Of all solves so far. Solver::solve writes it into the report.
    [[nodiscard]] virtual SetUpCounts counts() const = 0;
    /// Solves; fills the report's status, message, iterations, times, curve and stages. Returns the errors of the
    /// result if they have been measured; the result is then finite.
    virtual std::optional<Errors> run(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                                      SolveReport& report) = 0;

protected:
    /// Those of a solver that this one is made of.
    [[nodiscard]] static SetUpCounts counts_of(const Solver& solver) { return solver.implementation_->counts(); }
};

/// "\"pile\"", or "the problem" if it has no name.
[[nodiscard]] std::string quoted_name(const Prepared& problem);

/// What a solver must be able to do for this problem and these settings: DELASSUS_CAN_* bits.
[[nodiscard]] std::uint64_t needs_of(const Prepared& problem, const SolveSettings& settings);

/// ". Can: a, b" or ". No installed solver can", for the end of a refusal.
[[nodiscard]] std::string who_can(const Registry& registry, std::uint64_t needs);

}  // namespace delassus
