// SPDX-License-Identifier: BSD-3-Clause
#include "bench/worker.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>

#include "bench/channel.hpp"
#include "bench/json_text.hpp"
#include "bench/scene_worker.hpp"
#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver_config.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/errors_json.hpp"
#include "problem/structure.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"

namespace delassus::bench {

namespace {

namespace fs = std::filesystem;

/// Runs longer than this are repeated once only.
constexpr double long_run = 5.0;

PreparedProblem read(const Json& request) {
    const Json& source = request.at("problem");
    Problem problem = source.is_string() ? read_problem(source.get<std::string>())
                                         : generate(source.at("generate").get<std::string>(),
                                                    source.at("parameters").get<std::map<std::string, double>>());
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

SolverConfig solver_of(const Json& request) {
    SolverConfig config;
    config.name = request.at("solver");
    config.options = request.at("options").get<OptionTexts>();
    return config;
}

SolveSettings settings_of(const Json& request) {
    SolveSettings settings;
    settings.tolerance = request.at("tolerance");
    settings.max_iterations = request.at("max_iterations");
    settings.time_limit = request.at("time_limit");
    settings.cancelled = interrupted;
    return settings;
}

/// Whether running again would say more about the time.
bool worth_repeating(Status status) {
    switch (status) {
        case Status::Solved:
        case Status::IterationLimit:
        case Status::Stalled:
        case Status::Infeasible:
        case Status::FalseClaim:
            return true;
        default:
            return false;
    }
}

void measure(const Channel& channel, const Json& request) {
    const PreparedProblem problem = read(request);
    send_facts(channel, problem);
    std::vector<fs::path> folders;
    for (const auto& folder : request.at("plugin_path")) folders.emplace_back(folder.get<std::string>());
    const Registry registry(folders);
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
        channel.send("sample", {{"iteration", sample.iteration},
                                {"seconds", json_number(sample.seconds)},
                                {"natural", json_number(sample.natural)}});
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
    Json stages = Json::array();
    for (const StageReport& stage : report.stages) stages.push_back(stage.solver);
    const CurveSample last = report.curve.empty() ? CurveSample{} : report.curve.back();
    channel.send("recorded", {{"solver", report.solver},
                              {"version", report.version},
                              {"status", name_of(report.status)},
                              {"message", report.message},
                              {"iterations", report.iterations},
                              {"setup", report.seconds_setup},
                              {"solve", report.seconds_solve},
                              {"analyses", report.analyses},
                              {"factorizations", report.factorizations},
                              {"error", errors_json(report.error)},
                              {"velocity", json_number(velocity)},
                              {"speed", json_number(speed)},
                              {"stages", stages},
                              {"last", {last.iteration, json_number(last.seconds), json_number(last.natural)}}});

    settings.record_curve = false;
    settings.on_sample = {};
    int repeats = worth_repeating(report.status) ? request.at("repeats").get<int>() : 0;
    if (report.seconds_setup + report.seconds_solve > long_run) repeats = std::min(repeats, 1);
    for (int k = 0; k < repeats && !interrupted(); ++k) {
        const SolveReport again = run(solution);
        if (again.status == Status::Cancelled) break;
        channel.send(
            "repeat",
            {{"status", name_of(again.status)}, {"setup", again.seconds_setup}, {"solve", again.seconds_solve}});
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

int run_worker(const std::string& request_text, int descriptor) {
    const Channel channel(descriptor);
    install_interrupt_handler();
    StdoutGuard guard;
    const char* kind = "error";
    std::string message;
    try {
        const Json request = parse_ordered_json(request_text);
        const std::string task = request.at("do");
        if (task == "describe") {
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
        channel.send("done", {{"printed", guard.release()}, {"libraries", mapped_libraries()}});
        return 0;
    } catch (const InputError& error) {
        kind = "input";
        message = error.what();
    } catch (const std::bad_alloc&) {
        channel.send_out_of_memory();
        return 2;
    } catch (const std::exception& error) {
        message = error.what();
    }
    channel.send("failed", {{"kind", kind}, {"message", message}});
    return 2;
}

}  // namespace delassus::bench
