// SPDX-License-Identifier: BSD-3-Clause
#include "solver/auto_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/solver_config.hpp"
#include "delassus/version.hpp"
#include "problem/need_of.hpp"
#include "solver/acceptance.hpp"
#include "solver/finished_solver.hpp"
#include "solver/ranking.hpp"
#include "solver/rounds.hpp"
#include "solver/solver_implementation.hpp"
#include "solver/stages.hpp"

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

Ranking ranking_of(const Registry& registry, const OptionTexts& options) {
    const auto values = resolve_options(auto_name, auto_info(registry).options, options);
    return Ranking(values[0].text.empty() ? ranking_file(registry) : fs::path(values[0].text));
}

/// The needs of a problem with these under the other law, if there is one.
std::uint64_t needs_under(std::optional<Law> law, std::uint64_t needs) {
    if (!law || (needs & sdk::cones_with_law) == 0) return needs;
    return (needs & ~(need_of(Law::Associated) | need_of(Law::Coulomb))) | need_of(*law);
}

/// Whether this plugin is installed and has all these capabilities.
bool can(const Registry& registry, const std::string& name, std::uint64_t needs) {
    const auto& plugins = registry.plugins();
    return std::any_of(plugins.begin(), plugins.end(),
                       [&](const PluginInfo& plugin) { return plugin.name == name && plugin.missing(needs) == 0; });
}

/// The plugins, by ascending name, that can take problems with these needs and work without being named by the user.
std::vector<std::string> unnamed(const Registry& registry, std::uint64_t needs) {
    std::vector<std::string> names = registry.capable(needs);
    std::erase_if(names, [&](const std::string& name) {
        return std::any_of(registry.plugins().begin(), registry.plugins().end(), [&](const PluginInfo& plugin) {
            return plugin.name == name && (plugin.flags & DELASSUS_FLAG_PEER) != 0;
        });
    });
    return names;
}

/// Only free rows, in a step: what a factorisation leaves there is rounding, often of rows that repeat each other,
/// which no other solver removes. So the first that can is the only one.
bool is_linear_step(const Order& order) {
    return order.linear.value_or(false) && order.step.value_or(false);
}

/// The solvers of the order that can take problems with these needs, then all others that can but for peers.
std::vector<RankedSolver> members_of(const Registry& registry, const Order& order, std::uint64_t needs) {
    constexpr double of_a_stranger = 100.0;  // iterations of a solver of which nothing is known
    std::vector<RankedSolver> members;
    for (const auto& ranked : order.solvers)
        if (can(registry, ranked.solver, needs_under(ranked.law, needs))) members.push_back(ranked);
    if (!members.empty() && is_linear_step(order)) return {members.front()};
    for (const auto& name : unnamed(registry, needs))
        if (std::ranges::none_of(members, [&](const RankedSolver& member) { return member.solver == name; }))
            members.push_back({name, {}, of_a_stranger});
    return members;
}

/// What the rounds need of these.
std::vector<Member> traits_of(const Registry& registry, const std::vector<RankedSolver>& ranked) {
    std::vector<Member> members;
    for (const auto& one : ranked) {
        const PluginInfo& info = registry.find(one.solver);
        members.push_back({one.iterations, (info.capabilities & DELASSUS_CAN_WARM_START) != 0,
                           (info.flags & DELASSUS_FLAG_LOCAL) != 0});
    }
    return members;
}

class AutoSolver : public Solver::Implementation {
public:
    AutoSolver(const Registry& registry, OptionTexts options)
        : registry_(registry),
          info_(auto_info(registry)),
          options_(std::move(options)),
          ranking_(ranking_of(registry, options_)) {}

    [[nodiscard]] const PluginInfo& info() const override { return info_; }
    [[nodiscard]] const OptionTexts& options() const override { return options_; }

    [[nodiscard]] std::string refusal(const Prepared& problem, const SolveSettings& settings) override {
        const std::uint64_t needs = needs_of(problem, {});
        if (!unnamed(registry_, needs).empty()) return {};
        for (const auto& ranked : order_of(problem, settings.origin).solvers)
            if (can(registry_, ranked.solver, needs)) return {};
        return fmt::format("auto cannot solve {}: no installed solver can take {}.", quoted_name(problem),
                           problem.describe(needs));
    }

    [[nodiscard]] SetUpCounts counts() const override {
        SetUpCounts sum;
        for (const auto& [key, solver] : solvers_) sum += counts_of(solver);
        return sum;
    }

    std::optional<Errors> run(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                              SolveReport& report) override {
        StageRunner runner(problem, solution, settings, report);
        const bool step = settings.origin == Origin::Step;
        // Asked before solved_at_start() gives the velocities that go with the reactions.
        const bool begins_at_rest = std::ranges::all_of(solution.x, [](double speed) { return speed == 0.0; });
        const bool at_start = step && runner.solved_at_start();
        if (at_start && settings.stands_still && settings.stands_still(solution.x, runner.error()->natural))
            return runner.error();
        const Order& order = order_of(problem, settings.origin);
        const Team& team = team_of(problem, order);
        if (at_start) {
            sharpen(problem, team, settings, begins_at_rest, runner, report);
            return runner.error();
        }
        const std::vector<RankedSolver>& ranked = team.ranked;
        const std::vector<Member>& members = team.members;
        Solution start = solution;
        bool has_start = settings.warm_start;
        std::vector<Solution> left(members.size());
        std::map<const Solver*, std::size_t> users;  // the member that used it last
        bool hopes = false;                          // of the last turn
        const RoundsEnd end = run_rounds(members, [&](const Turn& turn) -> TurnResult {
            const RankedSolver& own = ranked[turn.member];
            if (turn.work > 0.0 && !hopes && runner.worst() <= acceptable_error(settings, turn.work)) {
                report.near_goal = !(runner.worst() <= settings.tolerance);
                return {TurnEnd::Done, runner.worst()};
            }
            const Prepared* solvable = runner.problem_of(own.law);
            Solver* solver = solvable ? usable(own, *solvable) : nullptr;
            if (!solver) return {TurnEnd::Retired, std::numeric_limits<double>::infinity()};
            Stage stage{.reason = fmt::format("round {}", turn.round + 1),
                        .iterations = turn.iterations,
                        .may_pass = turn.may_pass && !members[turn.member].local,
                        .law = own.law,
                        .resume = turn.start == turn.member && users.contains(solver) && users[solver] == turn.member};
            users[solver] = turn.member;
            // What Newton's method gains with its last iteration costs nothing.
            if (step && members[turn.member].local) stage.tighter = sharper;
            Solution& iterate = left[turn.member];
            iterate = turn.start ? left[*turn.start] : start;
            TurnResult result = runner.run(*solver, stage, iterate, turn.start || has_start);
            hopes = result.hopes;
            if (own.law && result.end != TurnEnd::Done) {
                start = iterate;
                has_start = true;
                result.end = TurnEnd::Retired;
            }
            return result;
        });
        if (end == RoundsEnd::Stale && report.status != Status::Solved) report.status = Status::Stalled;
        report.message = fmt::format("{}: {}{}", order.name, runner.sentence(),
                                     end == RoundsEnd::Stale ? "; no solver got nearer in three rounds" : "");
        return runner.error();
    }

private:
    [[nodiscard]] const Order& order_of(const Prepared& problem, Origin origin) const {
        const auto m = static_cast<double>(problem.all_rows());
        const auto n = static_cast<double>(problem.whole() ? problem.whole()->n : problem.part()->n_all);
        return ranking_.order({needs_of(problem, {}), origin == Origin::Step}, {m, n > 0.0 ? m / n : 0.0});
    }

    struct Team {
        std::vector<RankedSolver> ranked;
        std::vector<Member> members;  // the same as the rounds see them
    };

    /// Newton's method leaves this share of a tolerance that it meets, for an iteration or two.
    static constexpr double sharper = 1e-3;

    /// A start that meets the tolerance, with bodies that move, as a light one that rolls slowly on a heavy one: an
    /// error of the one is small beside the reactions of the other. Newton's method, where its iterations are not dear,
    /// makes the motion exact. Where all stand still, the start is the answer. Whether what stood begins to move is
    /// looked at as closely as can be: the error of an arch that sways as a whole is small beside its speed.
    void sharpen(const Prepared& problem, const Team& team, const SolveSettings& settings, bool begins_at_rest,
                 StageRunner& runner, SolveReport& report) {
        constexpr double least = 1e-6, rounding = 1e-5;
        constexpr double enough = 10.0;
        const auto newton = std::ranges::find_if(
            team.members, [](const Member& member) { return member.local && member.iterations >= enough; });
        if (settings.tolerance > least || newton == team.members.end()) return;
        double moves = begins_at_rest ? 0.0 : 1.0;  // on any process
        problem.communicator().max(std::span(&moves, 1));
        const double share = runner.worst() / settings.tolerance;
        if (share <= (moves > 0.0 ? sharper : rounding)) return;
        Solver* solver = usable(team.ranked[static_cast<std::size_t>(newton - team.members.begin())], problem);
        if (!solver) return;
        runner.run(*solver, {.reason = "sharper",
                             .tighter = sharper * (moves > 0.0 ? 1.0 : share),
                             .iterations = static_cast<std::int64_t>(newton->iterations)});
        report.status = Status::Solved;
    }

    /// Who takes turns, found once for problems alike.
    const Team& team_of(const Prepared& problem, const Order& order) {
        const std::uint64_t needs = needs_of(problem, {});
        const auto [place, fresh] = teams_.try_emplace({&order, needs, registry_.plugins().size()});
        if (fresh) {
            place->second.ranked = members_of(registry_, order, needs);
            place->second.members = traits_of(registry_, place->second.ranked);
        }
        return place->second;
    }

    /// The solver of a member, kept from problem to problem; null if it cannot take the problem.
    Solver* usable(const RankedSolver& ranked, const Prepared& problem) {
        const auto key = std::make_pair(ranked.solver, ranked.options);
        auto place = solvers_.find(key);
        if (place == solvers_.end()) {
            const auto make = [&] {
                place = solvers_.emplace(key, Solver(registry_.load(ranked.solver), ranked.options, &registry_)).first;
            };
            together(problem.communicator(), make);
        }
        return place->second.refusal(problem, {}).empty() ? &place->second : nullptr;
    }

    const Registry& registry_;
    PluginInfo info_;
    OptionTexts options_;
    Ranking ranking_;
    std::map<std::pair<std::string, OptionTexts>, Solver> solvers_;
    // By the order, the needs, and how many plugins there were, since more may come.
    std::map<std::tuple<const Order*, std::uint64_t, std::size_t>, Team> teams_;
};

}  // namespace

PluginInfo auto_info(const Registry& registry) {
    PluginInfo info;
    info.name = auto_name;
    info.version = DELASSUS_VERSION;
    info.description = "All solvers that can, in turns, with twice the work in each round";
    info.licence = "BSD-3-Clause";
    info.options = {{"ranking",
                     DELASSUS_OPTION_TEXT,
                     "",
                     0.0,
                     0.0,
                     {},
                     "",
                     "File of the orders of solvers; empty: ranking.json of the plugin folders"}};
    for (const auto& plugin : registry.plugins()) info.capabilities |= plugin.capabilities;
    return info;
}

Solver make_auto(const Registry& registry, OptionTexts options) {
    return Solver(std::make_unique<AutoSolver>(registry, std::move(options)));
}

AutoChoice auto_choice(const Registry& registry, OptionTexts options, std::uint64_t needs, Origin origin) {
    static_cast<void>(take_finish(options));
    AutoChoice choice;
    const auto add = [&](std::vector<std::string>& names, const std::string& name) {
        for (const auto* list : {&choice.first, &choice.later})
            if (std::find(list->begin(), list->end(), name) != list->end()) return;
        names.push_back(name);
    };
    const Ranking ranking = ranking_of(registry, options);
    const auto orders = ranking.orders({needs, origin == Origin::Step});
    const auto able = [&](const RankedSolver& ranked) {
        return can(registry, ranked.solver, needs_under(ranked.law, needs));
    };
    for (const auto* order : orders)
        if (const auto first = std::ranges::find_if(order->solvers, able); first != order->solvers.end())
            add(choice.first, first->solver);
    for (const auto* order : orders)
        for (const auto& ranked : members_of(registry, *order, needs))
            add(choice.first.empty() ? choice.first : choice.later, ranked.solver);
    return choice;
}

}  // namespace delassus
