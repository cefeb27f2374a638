// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>

#include "delassus/partitioned_solver.hpp"
#include "solver/report_json.hpp"

namespace delassus {

std::vector<ProcessReport> process_reports(const PreparedPart& problem) {
    const Communicator& run = problem.communicator();
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto n = run.all(problem.raw().n), m = run.all(problem.raw().m), ghosts = run.all(problem.ghosts()),
               bytes = run.all(run.bytes_sent()), memory = run.all(static_cast<std::int64_t>(usage.ru_maxrss) * 1024);
    std::vector<ProcessReport> reports;
    for (std::size_t p = 0; p < n.size(); ++p) reports.push_back({n[p], m[p], ghosts[p], bytes[p], memory[p]});
    return reports;
}

std::string to_json(const SolveReport& report, const std::vector<ProcessReport>& processes) {
    auto json = report_json(report);
    auto list = nlohmann::ordered_json::array();
    for (const auto& one : processes)
        list.push_back({{"n", one.n},
                        {"m", one.m},
                        {"ghosts", one.ghosts},
                        {"bytes_sent", one.bytes_sent},
                        {"peak_memory", one.peak_memory}});
    json["processes"] = std::move(list);
    return json_text(json, 2) + "\n";
}

}  // namespace delassus
