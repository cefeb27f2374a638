// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>

#include <bit>

#include "delassus/prepared_part.hpp"
#include "problem/errors_json.hpp"
#include "solver/report_json.hpp"

namespace delassus {

namespace {

/// A double from every process, to the bit.
std::vector<double> all_of(const Communicator& run, double value) {
    std::vector<double> values;
    for (const std::int64_t bits : run.all(std::bit_cast<std::int64_t>(value)))
        values.push_back(std::bit_cast<double>(bits));
    return values;
}

nlohmann::ordered_json seconds_json(const SolveCost& cost) {
    nlohmann::ordered_json json = {{"setup", json_number(cost.setup)}, {"solve", json_number(cost.solve)}};
    for (std::size_t k = 0; k < cost.phases.size(); ++k)
        json[std::string(name_of(static_cast<delassus_phase>(k)))] = json_number(cost.phases[k]);
    return json;
}

}  // namespace

std::vector<ProcessReport> process_reports(const PreparedPart& problem, const SolveCost& cost) {
    const Communicator& run = problem.communicator();
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto n = run.all(problem.raw().n), m = run.all(problem.raw().m), ghosts = run.all(problem.ghosts()),
               bytes = run.all(run.bytes_sent()), memory = run.all(static_cast<std::int64_t>(usage.ru_maxrss) * 1024),
               sent = run.all(cost.bytes_sent);
    const auto setup = all_of(run, cost.setup), solve = all_of(run, cost.solve);
    std::vector<ProcessReport> reports;
    for (std::size_t p = 0; p < n.size(); ++p) {
        reports.push_back({n[p], m[p], ghosts[p], bytes[p], memory[p]});
        reports.back().cost.setup = setup[p];
        reports.back().cost.solve = solve[p];
        reports.back().cost.bytes_sent = sent[p];
    }
    for (std::size_t k = 0; k < cost.phases.size(); ++k) {
        const auto seconds = all_of(run, cost.phases[k]);
        for (std::size_t p = 0; p < n.size(); ++p) reports[p].cost.phases[k] = seconds[p];
    }
    return reports;
}

std::string to_json(const SolveReport& report, const std::vector<ProcessReport>& processes) {
    using Json = nlohmann::ordered_json;
    auto json = report_json(report);
    auto list = Json::array();
    for (const auto& one : processes)
        list.push_back({{"n", one.n},
                        {"m", one.m},
                        {"ghosts", one.ghosts},
                        {"bytes_sent", one.bytes_sent},
                        {"solver_bytes_sent", one.cost.bytes_sent < 0 ? Json(nullptr) : Json(one.cost.bytes_sent)},
                        {"peak_memory", one.peak_memory},
                        {"seconds", seconds_json(one.cost)}});
    json["processes"] = std::move(list);
    return json_text(json, 2) + "\n";
}

}  // namespace delassus
