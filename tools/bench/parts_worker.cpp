// SPDX-License-Identifier: BSD-3-Clause
#include "bench/parts_worker.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <iterator>

#include "bench/key.hpp"
#include "bench/worker.hpp"
#include "bench/worker_requests.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/repartition.hpp"
#include "delassus/solver_config.hpp"
#include "problem/errors_json.hpp"
#include "problem/structure.hpp"
#include "process/child_process.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "process/watched_process.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace {

/// "pile:contacts=…" for a generated problem that is made in parts; empty for all others.
std::string pile_text(const Json& source) {
    if (source.is_string() || source.at("generate") != "pile") return {};
    std::string text = "pile";
    for (const auto& [key, value] : source.at("parameters").items())
        text += fmt::format("{}{}={}", text == "pile" ? ":" : ",", key, value.get<double>());
    return text;
}

PartitionedProblem read_part(const Communicator& run, const Json& request) {
    const Json& source = request.at("problem");
    const std::string pile = pile_text(source);
    PartitionedProblem part = [&]() -> PartitionedProblem {
        if (!pile.empty()) return generate_partitioned(run, pile_parameters(pile));
        bool file = false;
        together(run, [&] { file = source.is_string() && is_partitioned_file(source.get<std::string>()); });
        if (file) return read_partitioned(run, source.get<std::string>());
        Problem whole;
        together(run, [&] { whole = read_source(source); });
        return part_of(run, std::move(whole));
    }();
    part = repartition(run, std::move(part));
    if (const auto law = request.value("law", std::string()); !law.empty()) part.law = law_of(law);
    return part;
}

Json figures_json(const std::vector<ProcessReport>& processes) {
    Json list = Json::array();
    for (const ProcessReport& one : processes) {
        Json phases = {{"setup", json_number(one.cost.setup)}, {"solve", json_number(one.cost.solve)}};
        for (int k = 0; k < DELASSUS_PHASE_COUNT; ++k)
            phases[std::string(name_of(static_cast<delassus_phase>(k)))] =
                json_number(one.cost.phases[static_cast<std::size_t>(k)]);
        list.push_back({{"n", one.n},
                        {"m", one.m},
                        {"ghosts", one.ghosts},
                        {"peak_memory", one.peak_memory},
                        {"bytes_sent", one.cost.bytes_sent < 0 ? Json(nullptr) : Json(one.cost.bytes_sent)},
                        {"seconds", phases}});
    }
    return list;
}

/// FNV-1a of the bytes, read in pieces.
std::string hash_of_file(const std::string& path) {
    require_regular_file(path);
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw InputError(path + " cannot be read");
    std::vector<char> piece(std::size_t{1} << 22);
    Hash hash;
    while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())) || stream.gcount() > 0)
        hash.add(piece.data(), static_cast<std::size_t>(stream.gcount()));
    return fmt::format("{:016x}", hash.value());
}

/// From now on this process runs on a core of its own if each of the run's can have one.
void take_core() {
    const auto cores = allowed_cores();
    if (static_cast<int>(cores.size()) < process_count()) return;
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(cores[cores.size() - 1 - static_cast<std::size_t>(process_rank())]), &set);
    sched_setaffinity(0, sizeof set, &set);
}

}  // namespace

void measure_in_parts(const Channel& channel, const Json& request, const std::shared_ptr<const Communicator>& run) {
    const PreparedPart problem(run, read_part(*run, request));
    const Registry registry(plugin_path_of(request));
    SolveSettings settings = settings_of(request);
    Solution own;
    SolveCost cost;
    const auto solve = [&] {
        channel.send("begin");
        Solver solver = make_solver(registry, solver_of(request), *run);
        SolveReport report = solver.solve(problem, own, settings);
        cost = report.cost;
        return report;
    };
    const auto send_figures = [&] {
        channel.send("processes", {{"processes", figures_json(process_reports(problem, cost))}});
    };

    settings.record_curve = true;
    bool past_limit = false;
    if (run->rank() == 0)
        settings.on_sample = [&](const CurveSample& sample) {
            if (past_limit) return;  // a solver that does not stop when told falls silent here, and counts as hung
            past_limit = sample.seconds >= settings.time_limit;
            channel.send("sample", sample_json(sample));
        };
    SolveReport report;
    try {
        report = solve();
    } catch (const Unsupported& refusal) {
        channel.send("refused", {{"message", refusal.what()}});
        return;
    }
    double speed = 0.0;
    for (const double entry : own.x) speed = std::isnan(entry) ? entry : std::max(speed, std::abs(entry));
    run->max(std::span(&speed, 1));
    channel.send("recorded", recorded_json(report, NAN, speed));
    send_figures();

    settings.record_curve = false;
    settings.on_sample = {};
    const int repeats = repeats_of(request, report);
    for (int k = 0; k < repeats; ++k) {
        const SolveReport again = solve();
        if (again.status == Status::Cancelled) break;
        channel.send("repeat", repeat_json(again));
        send_figures();
    }
}

void describe_in_parts(const Channel& channel, const Json& request, const std::shared_ptr<const Communicator>& run) {
    const Json& source = request.at("problem");
    const std::string pile = pile_text(source);
    if (pile.empty()) {
        const auto path = source.get<std::string>();
        const PartitionedFileSummary summary = inspect_partitioned(*run, path);
        std::string hash;
        together(*run, [&] {
            if (run->rank() == 0) hash = hash_of_file(path);
        });
        std::map<std::string, std::int64_t> blocks;
        for (const auto& [kind, cones] : summary.cones) blocks[kind] = cones.blocks;
        channel.send("problem", {{"name", summary.name},
                                 {"law", name_of(summary.law)},
                                 {"structure", name_of(summary.structure)},
                                 {"n", summary.n},
                                 {"m", summary.m},
                                 {"cones", blocks},
                                 {"hash", hash},
                                 {"source", summary.source}});
        return;
    }
    const PileParameters parameters = pile_parameters(pile);
    const PartitionedProblem part = generate_partitioned(*run, parameters);
    // The parameters say all: a generated problem is the same, bit for bit, for any number of processes.
    channel.send("problem", {{"name", part.name},
                             {"law", name_of(part.law)},
                             {"structure", name_of(Structure::Blocks)},
                             {"n", part.column_start.back()},
                             {"m", part.row_start.back()},
                             {"cones", {{name_of(ConeKind::Friction), part.cone_start.back()}}},
                             {"hash", key_of({"pile", to_text(parameters)})},
                             {"source", part.source}});
}

int run_worker_together(int descriptor) {
    // Whoever kills the launcher means this process too.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == 1) return 3;
    take_core();
    continue_in_watched_child(fmt::format("process {} of {}", process_rank(), process_count()), 3);
    const auto run = communicator_of_run(), last_words = communicator_of_run();
    std::string request;
    if (run->rank() == 0) request.assign(std::istreambuf_iterator<char>(std::cin), {});
    request = run->broadcast(request);
    const Channel channel(run->rank() == 0 ? descriptor : Channel::silent);
    return answer(request, channel, run, [&](const std::string& sentence) { meet_in_failure(*last_words, sentence); });
}

}  // namespace delassus::bench
