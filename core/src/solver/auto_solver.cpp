// SPDX-License-Identifier: BSD-3-Clause
#include "solver/auto_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/solver_config.hpp"
#include "delassus/version.hpp"
#include "problem/need_of.hpp"
#include "solver/finished_solver.hpp"
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

struct AutoOptions {
    Ranking ranking;
    bool simulation;
};

AutoOptions read_options(const Registry& registry, const OptionTexts& options) {
    const auto values = resolve_options(auto_name, auto_info(registry).options, options);
    return {Ranking(values[0].text.empty() ? ranking_file(registry) : fs::path(values[0].text)),
            values[1].integer != 0};
}

class AutoSolver : public Solver::Implementation {
public:
    AutoSolver(const Registry& registry, OptionTexts options)
        : registry_(registry),
          info_(auto_info(registry)),
          options_(std::move(options)),
          chosen_(read_options(registry, options_)) {}

    [[nodiscard]] const PluginInfo& info() const override { return info_; }
    [[nodiscard]] const OptionTexts& options() const override { return options_; }

    [[nodiscard]] std::string refusal(const PreparedProblem& problem, const SolveSettings& settings) override {
        const std::uint64_t needs = needs_of(problem, {});
        if (!unnamed(registry_, needs).empty()) return {};
        for (const auto& ranked : rule_of(problem, settings).stages)
            if (can(registry_, ranked.solver, needs)) return {};
        return fmt::format("auto cannot solve {}: no installed solver can take {}.", quoted_name(problem),
                           problem.describe(needs));
    }

    [[nodiscard]] SetUpCounts counts() const override {
        SetUpCounts sum;
        for (const auto& [key, solver] : solvers_) sum += counts_of(solver);
        return sum;
    }

    std::optional<Errors> run(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings,
                              SolveReport& report) override {
        const std::uint64_t needs = needs_of(problem, {});
        const RankingRule& rule = rule_of(problem, settings);
        StageRunner runner(problem, solution, settings, report);
        if (chosen_.simulation && runner.solved_at_start()) return runner.error();
        bool done = false;
        for (const auto& ranked : rule.stages) {
            if (!ranked.m.takes(problem.raw().m)) continue;
            Solver* solver = usable(ranked, runner.problem_of(ranked.stage));
            if (!solver) continue;
            done = runner.run(*solver, ranked.stage) || ranked.last;
            if (done) break;
        }
        // No solver of the rule is installed, or none reached the tolerance: try every other capable solver, each from
        // the best iterate so far.
        if (!done)
            for (const auto& name : unnamed(registry_, needs)) {
                const RankedStage ranked{
                    name, {}, {.reason = "the solvers before it did not reach the tolerance", .watched = true}};
                const bool tried =
                    std::any_of(report.stages.begin(), report.stages.end(), [&](const StageReport& stage) {
                        return stage.solver == name && stage.law == problem.problem().law;
                    });
                Solver* solver = tried ? nullptr : usable(ranked, problem);
                if (solver && runner.run(*solver, ranked.stage)) break;
            }
        report.message = fmt::format("{}: {}", rule.name, runner.sentence());
        return runner.error();
    }

private:
    [[nodiscard]] const RankingRule& rule_of(const PreparedProblem& problem, const SolveSettings& settings) const {
        return chosen_.ranking.rule({needs_of(problem, {}), settings.tolerance, chosen_.simulation}, problem.raw().m);
    }

    /// The solver of a stage, kept from problem to problem; null if it is not installed or cannot take the problem.
    Solver* usable(const RankedStage& ranked, const PreparedProblem& problem) {
        if (!can(registry_, ranked.solver, needs_of(problem, {}))) return nullptr;
        const auto key = std::make_pair(ranked.solver, ranked.options);
        auto place = solvers_.find(key);
        if (place == solvers_.end())
            place = solvers_.emplace(key, Solver(registry_.load(ranked.solver), ranked.options, &registry_)).first;
        return place->second.refusal(problem, {}).empty() ? &place->second : nullptr;
    }

    const Registry& registry_;
    PluginInfo info_;
    OptionTexts options_;
    AutoOptions chosen_;
    std::map<std::pair<std::string, OptionTexts>, Solver> solvers_;
};

}  // namespace

bool can(const Registry& registry, const std::string& name, std::uint64_t needs) {
    const auto& plugins = registry.plugins();
    return std::any_of(plugins.begin(), plugins.end(),
                       [&](const PluginInfo& plugin) { return plugin.name == name && plugin.missing(needs) == 0; });
}

std::vector<std::string> unnamed(const Registry& registry, std::uint64_t needs) {
    std::vector<std::string> names = registry.capable(needs);
    std::erase_if(names, [&](const std::string& name) {
        return std::any_of(registry.plugins().begin(), registry.plugins().end(), [&](const PluginInfo& plugin) {
            return plugin.name == name && (plugin.flags & DELASSUS_FLAG_PEER) != 0;
        });
    });
    return names;
}

bool by_rules_of_simulations(const Registry& registry, const OptionTexts& options) {
    return read_options(registry, options).simulation;
}

Ranking ranking_of(const Registry& registry, const OptionTexts& options) {
    return read_options(registry, options).ranking;
}

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
                     "File of the rules that pick solvers; empty: ranking.json of the plugin folders"},
                    {"simulation",
                     DELASSUS_OPTION_BOOLEAN,
                     "false",
                     0.0,
                     0.0,
                     {},
                     "",
                     "The problems are steps of a simulation, each close to the one before"}};
    for (const auto& plugin : registry.plugins()) info.capabilities |= plugin.capabilities;
    return info;
}

Solver make_auto(const Registry& registry, OptionTexts options) {
    return Solver(std::make_unique<AutoSolver>(registry, std::move(options)));
}

AutoChoice auto_choice(const Registry& registry, OptionTexts options, std::uint64_t needs, double tolerance) {
    static_cast<void>(take_finish(options));
    AutoChoice choice;
    const auto add = [&](std::vector<std::string>& names, const std::string& name) {
        for (const auto* list : {&choice.first, &choice.later})
            if (std::find(list->begin(), list->end(), name) != list->end()) return;
        names.push_back(name);
    };
    const AutoOptions chosen = read_options(registry, options);
    const auto rules = chosen.ranking.rules({needs, tolerance, chosen.simulation});
    const auto able = [&](const RankedStage& ranked) {
        std::uint64_t own = needs;
        if (const auto law = ranked.stage.law; law && (needs & sdk::cones_with_law))
            own = (needs & ~(need_of(Law::Associated) | need_of(Law::Coulomb))) | need_of(*law);
        return can(registry, ranked.solver, own);
    };
    for (const auto* rule : rules) {
        const auto start = std::find_if(rule->stages.begin(), rule->stages.end(), able);
        if (start != rule->stages.end()) add(choice.first, start->solver);
    }
    bool others = false;
    for (const auto* rule : rules) {
        bool ends = false;
        for (const auto& ranked : rule->stages) {
            if (ends || !able(ranked)) continue;
            add(choice.later, ranked.solver);
            ends = ranked.last;
        }
        others = others || !ends;
    }
    if (others)
        for (const auto& name : unnamed(registry, needs)) add(choice.first.empty() ? choice.first : choice.later, name);
    return choice;
}

}  // namespace delassus
