// SPDX-License-Identifier: BSD-3-Clause
#include "solver/auto_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "delassus/config.hpp"
#include "delassus/error.hpp"
#include "delassus/version.hpp"
#include "solver/ranking.hpp"
#include "solver/solver_implementation.hpp"

namespace delassus {

namespace {

namespace fs = std::filesystem;

/// The first ranking.json of the plugin folders.
fs::path ranking_file(const Registry& registry) {
    for (const auto& folder : registry.folders())
        if (fs::exists(folder / ranking_file_name)) return folder / ranking_file_name;
    throw InputError(
        fmt::format("auto finds no ranking.json in the plugin folders, of which the last is {}; name a solver instead",
                    registry.folders().back().string()));
}

class AutoSolver : public Solver::Implementation {
public:
    AutoSolver(const Registry& registry, OptionTexts options)
        : registry_(registry), info_(auto_info(registry)), options_(std::move(options)), ranking_(file()) {}

    [[nodiscard]] const PluginInfo& info() const override { return info_; }
    [[nodiscard]] const OptionTexts& options() const override { return options_; }

    [[nodiscard]] std::string refusal(const PreparedProblem& problem, const SolveSettings&) override {
        if (!registry_.capable(needs_of(problem, {})).empty()) return {};
        return fmt::format("auto cannot solve {}: no installed solver can take {}.", quoted_name(problem),
                           problem.describe(needs_of(problem, {})));
    }

    void run(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings,
             SolveReport& report) override {
        const RankingRule& rule = ranking_.rule(problem, settings.tolerance);
        StageRunner runner(problem, solution, settings, report);
        bool done = false;
        for (const auto& ranked : rule.stages) {
            Solver* solver = usable(ranked, runner.problem_of(ranked.stage));
            if (solver) done = runner.run(*solver, ranked.stage);
            if (done) break;
        }
        // Nothing of the rule is installed, or none got there: everyone else who can, from the best so far.
        if (!done)
            for (const auto& name : registry_.capable(needs_of(problem, {}))) {
                const RankedStage ranked{name, {}, {.reason = "those before it did not get there", .watched = true}};
                const bool tried =
                    std::any_of(report.stages.begin(), report.stages.end(), [&](const StageReport& stage) {
                        return stage.solver == name && stage.law == problem.problem().law;
                    });
                Solver* solver = tried ? nullptr : usable(ranked, problem);
                if (solver && runner.run(*solver, ranked.stage)) break;
            }
        report.message = fmt::format("{}: {}", rule.name, runner.sentence());
    }

private:
    [[nodiscard]] fs::path file() const {
        const auto values = resolve_options(auto_name, info_.options, options_);
        return values[0].text.empty() ? ranking_file(registry_) : fs::path(values[0].text);
    }

    /// The solver of a stage, kept from problem to problem; null if it is not installed or cannot take the problem.
    Solver* usable(const RankedStage& ranked, const PreparedProblem& problem) {
        const std::uint64_t needs = needs_of(problem, {});
        const auto& plugins = registry_.plugins();
        if (std::none_of(plugins.begin(), plugins.end(), [&](const PluginInfo& plugin) {
                return plugin.name == ranked.solver && plugin.missing(needs) == 0;
            }))
            return nullptr;
        const auto key = std::make_pair(ranked.solver, ranked.options);
        auto place = solvers_.find(key);
        if (place == solvers_.end())
            place = solvers_.emplace(key, Solver(registry_.load(ranked.solver), ranked.options, &registry_)).first;
        return place->second.refusal(problem, {}).empty() ? &place->second : nullptr;
    }

    const Registry& registry_;
    PluginInfo info_;
    OptionTexts options_;
    Ranking ranking_;
    std::map<std::pair<std::string, OptionTexts>, Solver> solvers_;
};

}  // namespace

PluginInfo auto_info(const Registry& registry) {
    PluginInfo info;
    info.name = auto_name;
    info.version = DELASSUS_VERSION;
    info.description = "Stages of the other solvers, chosen by the problem and by measured decrease";
    info.licence = "BSD-3-Clause";
    info.options = {{"ranking",
                     DELASSUS_OPTION_TEXT,
                     "",
                     0.0,
                     0.0,
                     {},
                     "",
                     "File that says who solves what; empty: ranking.json of the plugin folders"}};
    for (const auto& plugin : registry.plugins()) info.capabilities |= plugin.capabilities;
    return info;
}

Solver make_auto(const Registry& registry, OptionTexts options) {
    return Solver(std::make_unique<AutoSolver>(registry, std::move(options)));
}

}  // namespace delassus
