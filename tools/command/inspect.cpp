// SPDX-License-Identifier: BSD-3-Clause
// delassus inspect: what a problem is, what it needs, and who could solve it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "command.hpp"
#include "delassus/distributed.hpp"
#include "delassus/needs.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/qualification.hpp"
#include "delassus/rank.hpp"
#include "on_all_processes.hpp"
#include "partition_report.hpp"
#include "support/json.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

struct InspectArguments {
    std::filesystem::path problem;
    std::string law;
    std::vector<std::filesystem::path> plugin_path;
    bool qualification = false, whole = false, json = false;
};

struct ConeCount {
    std::int64_t blocks = 0, rows = 0;
};

Json json_of(Answer answer) {
    return answer == Answer::Undecided ? Json(nullptr) : Json(answer == Answer::Yes);
}

/// The blocks of the problem that take part in reactions that cancel, with their largest component.
std::vector<std::pair<std::size_t, double>> cancelling_blocks(const Problem& problem,
                                                              const std::vector<double>& reactions) {
    constexpr double noticeable = 1e-4;  // of the sum of the normal reactions
    std::vector<std::pair<std::size_t, double>> blocks;
    std::size_t row = 0;
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        double largest = 0.0;
        for (std::int32_t i = 0; i < problem.cones[c].rows; ++i)
            largest = std::max(largest, std::abs(reactions[row++]));
        if (largest > noticeable) blocks.emplace_back(c, largest);
    }
    return blocks;
}

Json json_of(const Problem& problem, const Qualification& found) {
    Json json = {{"licq", json_of(found.independent)},
                 {"rank", found.rank ? Json(*found.rank) : Json(nullptr)},
                 {"free_rows", found.free_rows},
                 {"free_rank", found.free_rank ? Json(*found.free_rank) : Json(nullptr)},
                 {"pointed", json_of(found.pointed)},
                 {"pointedness", std::isfinite(found.pointedness) ? Json(found.pointedness) : Json(nullptr)},
                 {"cancelling_blocks", Json::array()}};
    if (!found.cancelling.empty())
        for (const auto& [block, size] : cancelling_blocks(problem, found.cancelling))
            json["cancelling_blocks"].push_back({{"block", block}, {"reaction", size}});
    return json;
}

void print(const Problem& problem, const Qualification& found) {
    fmt::print("  qualification\n");
    if (found.independent == Answer::Undecided) {
        fmt::print("    LICQ undecided: the rank was not found\n");
    } else if (found.independent == Answer::Yes) {
        fmt::print("    LICQ holds: all {} rows are independent; the reactions are unique\n", found.rows);
    } else {
        fmt::print("    LICQ fails: rank {} of {} rows; the reactions need not be unique, the velocities are\n",
                   *found.rank, found.rows);
    }
    if (found.free_rank && *found.free_rank < found.free_rows)
        fmt::print("    free rows: rank {} of {}: their reactions have no bound\n", *found.free_rank, found.free_rows);
    if (found.pointed == Answer::Undecided) {
        fmt::print("    pointed friction cone undecided: no solver came close enough\n");
    } else if (found.pointed == Answer::Yes && std::isinf(found.pointedness)) {
        fmt::print("    pointed friction cone holds: there are free rows only, and they are independent\n");
    } else if (found.pointed == Answer::Yes) {
        fmt::print(
            "    pointed friction cone holds: reactions are bounded (net effect at least {:.2g} of the normals)\n",
            found.pointedness);
    } else if (found.cancelling.empty()) {
        fmt::print("    pointed friction cone fails because of the free rows alone\n");
    } else {
        constexpr std::size_t most = 8;
        const auto blocks = cancelling_blocks(problem, found.cancelling);
        fmt::print(
            "    pointed friction cone fails: reactions of {} blocks can cancel out, so they have no bound:\n     ",
            blocks.size());
        for (std::size_t k = 0; k < std::min(most, blocks.size()); ++k) fmt::print(" {}", blocks[k].first);
        fmt::print("{}\n", blocks.size() > most ? " …" : "");
    }
}

/// A problem in one file: what it holds without what takes the whole of it (rank, needs, solvers). Under mpirun also
/// how it would be shared.
int inspect_file(const InspectArguments& arguments) {
    return on_all_processes([&](const std::shared_ptr<const Communicator>& run) {
        PartitionedFileSummary found = inspect_partitioned(*run, arguments.problem);
        if (!arguments.law.empty()) found.law = law_of(arguments.law);
        std::optional<PartitionQuality> quality;
        if (run->size() > 1) quality = measure_partition(*run, read_partitioned(*run, arguments.problem));
        if (run->rank() != 0) return static_cast<int>(exit_solved);
        const bool blocks = found.structure == Structure::Diagonal || found.structure == Structure::Blocks;
        const std::string structure = found.structure == Structure::Definite
                                          ? "sparse, symmetric, with a positive diagonal"
                                          : std::string(name_of(found.structure));
        if (arguments.json) {
            Json json = {{"problem", found.name},
                         {"n", found.n},
                         {"m", found.m},
                         {"law", name_of(found.law)},
                         {"structure", structure},
                         {"h_largest_block", blocks ? Json(found.largest_block) : Json(nullptr)},
                         {"bodies", found.body_count > 0 ? Json(found.body_count) : Json(nullptr)},
                         {"entries", {{"H", found.H_entries}, {"D", found.D_entries}, {"E", found.E_entries}}},
                         {"cones", Json::object()},
                         {"bytes", found.file_bytes},
                         {"source", found.source},
                         {"notes", found.notes}};
            for (const auto& [kind, count] : found.cones)
                json["cones"][kind] = {{"blocks", count.blocks}, {"rows", count.rows}};
            if (quality)
                json["partition"] = {{"processes", run->size()},
                                     {"cut_cones", quality->cut_cones},
                                     {"ghosts", quality->ghosts},
                                     {"most_ghosts", quality->most_ghosts},
                                     {"imbalance", quality->imbalance}};
            fmt::print("{}\n", json_text(json, 2));
            return static_cast<int>(exit_solved);
        }
        fmt::print("{}\n  n = {} velocities, m = {} constraint rows, law {}\n", found.name, found.n, found.m,
                   name_of(found.law));
        fmt::print("  H is {}, {} entries", structure, found.H_entries);
        if (blocks) fmt::print(", blocks of at most {}", found.largest_block);
        fmt::print("\n  D has {} entries, E {}\n", found.D_entries, found.E_entries);
        if (found.body_count > 0) fmt::print("  {} bodies\n", found.body_count);
        for (const auto& [kind, count] : found.cones)
            fmt::print("  {} {} blocks, {} rows\n", count.blocks, kind, count.rows);
        if (quality) print_quality(*quality, run->size());
        if (!found.source.empty()) fmt::print("  source  {}\n", found.source);
        if (!found.notes.empty()) fmt::print("  notes   {}\n", found.notes);
        fmt::print("  rank, needs and solvers take the whole problem: --whole, or a problem folder\n");
        return static_cast<int>(exit_solved);
    });
}

int inspect(const InspectArguments& arguments) {
    const bool parts = process_count() > 1 && arguments.problem.extension() == ".h5";
    if (!arguments.whole && !arguments.qualification && (parts || is_partitioned_file(arguments.problem)))
        return inspect_file(arguments);
    Problem data = read_problem(arguments.problem);
    if (!arguments.law.empty()) data.law = law_of(arguments.law);
    const PreparedProblem prepared(std::move(data));
    const Problem& problem = prepared.problem();
    const Registry registry(absolute(arguments.plugin_path));
    const auto capable = registry.capable(prepared.needs());

    std::optional<Qualification> qualification;
    if (arguments.qualification) qualification = qualify(problem, registry);
    const auto rank = qualification ? qualification->rank : estimate_rank(problem);

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
        if (qualification) json["qualification"] = json_of(problem, *qualification);
        fmt::print("{}\n", json_text(json, 2));
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
        fmt::print("  rank of N not found: the factorisation failed\n");
    }
    if (qualification) print(problem, *qualification);
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
        "inspect", "Show a problem's sizes, structure, cones, rank, needs, and which solvers can take it");
    command->add_option("problem", arguments->problem, "Problem folder, or HDF5 file (.h5, .hdf5)")
        ->required()
        ->type_name("PROBLEM");
    add_law(*command, arguments->law, "Friction law in place of the problem's own");
    add_plugin_path(*command, arguments->plugin_path);
    command->add_flag("--qualification", arguments->qualification,
                      "Check LICQ and the pointed friction cone: are reactions unique, are they bounded?");
    command->add_flag("--whole", arguments->whole,
                      "Read all of a problem in one file (.h5), for its rank, its needs and the solvers");
    command->add_flag("--json", arguments->json, "Print JSON");
    command->callback([arguments, &action] { action.run = [arguments] { return inspect(*arguments); }; });
}

}  // namespace delassus::command
