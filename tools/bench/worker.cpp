// SPDX-License-Identifier: BSD-3-Clause
#include "bench/worker.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>

#include "bench/channel.hpp"
#include "bench/json_text.hpp"
#include "bench/parts_worker.hpp"
#include "bench/scene_worker.hpp"
#include "bench/worker_requests.hpp"
#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver_config.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/errors_json.hpp"
#include "problem/structure.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "support/sentence.hpp"

namespace delassus::bench {

namespace {

namespace fs = std::filesystem;

PreparedProblem read(const Json& request) {
    Problem problem = read_source(request.at("problem"));
    if (const auto law = request.value("law", std::string()); !law.empty()) problem.law = law_of(law);
    return PreparedProblem(std::move(problem));
}

/// A hash, 16 hexadecimal digits, of everything that a solver sees except names and the friction law.
std::string content_hash(const PreparedProblem& prepared) {
    const Problem& problem = prepared.problem();
    Hash hash;
    hash.add_size(prepared.raw().values_id);
    hash.add(problem.a);
    hash.add(problem.b);
    for (const Cone& cone : problem.cones) {
        hash.add(cone.parameters.data(), parameter_bytes(cone));
        hash.add(cone.lo);
        hash.add(cone.hi);
    }
    return fmt::format("{:016x}", hash.value());
}

void send_facts(const Channel& channel, const PreparedProblem& prepared) {
    const Problem& problem = prepared.problem();
    std::map<std::string, std::int64_t> blocks;
    for (const Cone& cone : problem.cones) ++blocks[std::string(name_of(cone.kind))];
    channel.send("problem", {{"name", problem.name},
                             {"law", name_of(problem.law)},
                             {"structure", name_of(prepared.structure())},
                             {"n", problem.n()},
                             {"m", problem.m()},
                             {"cones", blocks},
                             {"hash", content_hash(prepared)},
                             {"source", problem.source}});
}

void measure(const Channel& channel, const Json& request) {
    const PreparedProblem problem = read(request);
    send_facts(channel, problem);
    const Registry registry(plugin_path_of(request));
    const SolverConfig config = solver_of(request);
    SolveSettings settings = settings_of(request);

    const auto run = [&](Solution& solution) {
        channel.send("begin");
        Solver solver = make_solver(registry, config);
        return solver.solve(problem, solution, settings);
    };

    // The recorded run comes first: it has the curve if the solver crashes or hangs, and it warms the caches up.
    settings.record_curve = true;
    bool past_limit = false;
    settings.on_sample = [&](const CurveSample& sample) {
        // A solver that does not stop when told falls silent here, and counts as hung.
        if (past_limit) return;
        past_limit = sample.seconds >= settings.time_limit;
        channel.send("sample", sample_json(sample));
    };
    Solution solution;
    SolveReport report;
    try {
        report = run(solution);
    } catch (const Unsupported& refusal) {
        channel.send("refused", {{"message", refusal.what()}});
        return;
    }
    if (const auto folder = request.at("solution").get<std::string>(); !folder.empty())
        write_solution(solution, {}, folder);
    double velocity = std::numeric_limits<double>::quiet_NaN();
    if (const auto folder = request.at("reference").get<std::string>(); !folder.empty())
        velocity =
            problem.meter().velocity(solution.x, read_solution(folder, problem.problem().n(), problem.problem().m()).x);
    double speed = 0.0;  // NaN wherever an entry is
    for (const double entry : solution.x) speed = std::isnan(entry) ? entry : std::max(speed, std::abs(entry));
    channel.send("recorded", recorded_json(report, velocity, speed));

    settings.record_curve = false;
    settings.on_sample = {};
    const int repeats = repeats_of(request, report);
    for (int k = 0; k < repeats && !interrupted(); ++k) {
        const SolveReport again = run(solution);
        if (again.status == Status::Cancelled) break;
        channel.send("repeat", repeat_json(again));
    }
}

void compare_velocities(const Channel& channel, const Json& request) {
    const PreparedProblem problem = read(request);
    const ErrorMeter meter(problem);
    const auto n = problem.problem().n(), m = problem.problem().m();
    const Solution reference = read_solution(request.at("reference").get<std::string>(), n, m);
    Json errors = Json::array();
    for (const auto& folder : request.at("solutions")) {
        try {
            const Solution solution = read_solution(folder.get<std::string>(), n, m);
            errors.push_back(json_number(meter.velocity(solution.x, reference.x)));
        } catch (const InputError&) {
            errors.push_back(nullptr);  // that run left no solution
        }
    }
    channel.send("velocity", {{"errors", errors}});
}

/// The file names of the shared libraries in this process, links resolved, so that versions stand in them.
std::set<std::string> mapped_libraries() {
    std::set<std::string> names;
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);)
        if (const auto slash = line.rfind('/');
            slash != std::string::npos && line.find(".so", slash) != std::string::npos)
            names.insert(line.substr(slash + 1));
    return names;
}

}  // namespace

int answer(const std::string& request_text, const Channel& channel, const std::shared_ptr<const Communicator>& run,
           const std::function<void(const std::string& sentence)>& failed) {
    install_interrupt_handler();
    StdoutGuard guard;
    const auto fail = [&](const char* kind, const std::string& message) {
        failed(message);
        channel.send("failed", {{"kind", kind}, {"message", message}});
        failed(message);
        return 2;
    };
    try {
        const Json request = parse_ordered_json(request_text);
        const std::string task = request.at("do");
        const bool parts = request.value("parts", false);
        if (task == "measure" && parts) {
            measure_in_parts(channel, request, run);
        } else if (task == "describe" && parts) {
            describe_in_parts(channel, request, run);
        } else if (task == "ping") {
            static_cast<void>(run->all(run->rank()));
        } else if (run->size() > 1) {
            throw InputError("several workers cannot do \"" + task + "\"");
        } else if (task == "describe") {
            send_facts(channel, read(request));
        } else if (task == "measure") {
            measure(channel, request);
        } else if (task == "velocity") {
            compare_velocities(channel, request);
        } else if (task == "plan") {
            send_plan(channel, request);
        } else if (task == "simulate") {
            simulate(channel, request);
        } else {
            throw InputError("a worker cannot do \"" + task + "\"");
        }
        std::array<std::int64_t, 1> printed = {static_cast<std::int64_t>(guard.release())};
        run->sum(printed);
        channel.send(
            "done",
            {{"printed", printed[0]}, {"libraries", mapped_libraries()}, {"unoptimized", unoptimized_plugins()}});
        return 0;
    } catch (const InputError& error) {
        return fail("input", error.what());
    } catch (const std::bad_alloc&) {
        failed("out of memory");
        channel.send_out_of_memory();
        failed("out of memory");
        return 2;
    } catch (const std::exception& error) {
        return fail("error", sentence_of(error));
    }
}

int run_worker(const std::string& request, int descriptor) {
    return answer(request, Channel(descriptor), single_process(), [](const std::string&) {});
}

}  // namespace delassus::bench
