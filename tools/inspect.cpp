// SPDX-License-Identifier: BSD-3-Clause
// delassus inspect: what a problem is, what it needs, and who could solve it.
#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "command.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/rank.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

struct InspectArguments {
    std::filesystem::path problem;
    std::string law;
    std::vector<std::filesystem::path> plugin_path;
    bool json = false;
};

struct ConeCount {
    std::int64_t blocks = 0, rows = 0;
};

int inspect(const InspectArguments& arguments) {
    Problem data = read_problem(arguments.problem);
    if (!arguments.law.empty()) data.law = law_of(arguments.law);
    const PreparedProblem prepared(std::move(data));
    const Problem& problem = prepared.problem();
    const Registry registry(absolute(arguments.plugin_path));
    const auto capable = registry.capable(prepared.needs());
    const auto rank = estimate_rank(problem);

    std::map<std::string, ConeCount> cones;
    for (const Cone& cone : problem.cones) {
        auto& count = cones[std::string(name_of(cone.kind))];
        ++count.blocks;
        count.rows += cone.rows;
    }

    if (arguments.json) {
        Json json = {{"problem", problem.name},
                     {"n", problem.n()},
                     {"m", problem.m()},
                     {"law", name_of(problem.law)},
                     {"structure", name_of(prepared.structure())},
                     {"h_blocks", prepared.raw().h_block_count},
                     {"entries", {{"H", problem.H.entries()}, {"D", problem.D.entries()}, {"E", problem.E.entries()}}},
                     {"cones", Json::object()},
                     {"rank", rank ? Json(*rank) : Json(nullptr)},
                     {"needs", capability_names(prepared.needs())},
                     {"capable", capable},
                     {"source", problem.source},
                     {"notes", problem.notes}};
        for (const auto& [kind, count] : cones) json["cones"][kind] = {{"blocks", count.blocks}, {"rows", count.rows}};
        fmt::print("{}\n", json.dump(2));
        return exit_solved;
    }
    fmt::print("{}\n", problem.name);
    fmt::print("  n = {} velocities, m = {} constraint rows, law {}\n", problem.n(), problem.m(), name_of(problem.law));
    fmt::print("  H is {}", name_of(prepared.structure()));
    if (problem.n() > 0) fmt::print(", {} blocks, {} entries", prepared.raw().h_block_count, problem.H.entries());
    fmt::print("\n  D has {} entries, E {}\n", problem.D.entries(), problem.E.entries());
    for (const auto& [kind, count] : cones) fmt::print("  {} {} blocks, {} rows\n", count.blocks, kind, count.rows);
    if (rank) {
        fmt::print("  rank of N about {} of {}{}\n", *rank, problem.m(),
                   *rank < problem.m() ? ": reactions are not unique, velocities are" : "");
    } else {
        fmt::print("  rank of N not estimated at this size\n");
    }
    fmt::print("  needs   {}\n", fmt::join(capability_names(prepared.needs()), " "));
    fmt::print("  solvers {}\n", capable.empty() ? "none installed" : fmt::format("{}", fmt::join(capable, " ")));
    if (!problem.source.empty()) fmt::print("  source  {}\n", problem.source);
    if (!problem.notes.empty()) fmt::print("  notes   {}\n", problem.notes);
    return exit_solved;
}

}  // namespace

void add_inspect(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<InspectArguments>();
    auto* command = program.add_subcommand(
        "inspect", "Show a problem's sizes, structure, cones, rank, needs, and who could solve it");
    command->add_option("problem", arguments->problem, "Problem folder, or FCLib file (.hdf5)")
        ->required()
        ->type_name("PROBLEM");
    command->add_option("--law", arguments->law, "Friction law in place of the problem's own: associated | coulomb")
        ->type_name("LAW");
    add_plugin_path(*command, arguments->plugin_path);
    command->add_flag("--json", arguments->json, "Print JSON");
    command->callback([arguments, &action] { action.run = [arguments] { return inspect(*arguments); }; });
}

}  // namespace delassus::command
