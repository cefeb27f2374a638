// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include "bench/bench_writers.hpp"
#include "bench/csv_text.hpp"
#include "bench/measures.hpp"

namespace delassus::bench {

namespace {

std::string text_in(const Json& row, const char* key) {
    return csv_field(row.at(key).get<std::string>());
}

std::string integer_in(const Json& row, const char* key) {
    return row.contains(key) && row.at(key).is_number() ? std::to_string(row.at(key).get<std::int64_t>()) : "";
}

/// The name of what the hash belongs to.
std::string name_in(const std::vector<Json>& rows, const char* key, const Json& hash) {
    for (const Json& row : rows)
        if (row.at(key) == hash) return csv_field(row.at("name").get<std::string>());
    return {};
}

/// Phases whose seconds results.csv has; the mean over the processes.
constexpr std::array phases = {"products", "projections", "linear_systems", "exchange", "reductions", "waiting"};

/// The columns on processes.
std::string parts_csv(const Json& row) {
    if (!row.contains("method")) return std::string(5 + phases.size(), ',');
    std::string text = fmt::format(",{},{}", text_in(row, "method"), integer_in(row, "processes"));
    const Json& parts = row.at("parts");
    if (parts.is_null()) return text + std::string(3 + phases.size(), ',');
    text += fmt::format(",{},{},{}", csv_number(number_of(parts.at("bytes_an_iteration"))), integer_in(parts, "ghosts"),
                        csv_number(number_of(parts.at("imbalance"))));
    const Json& processes = parts.at("by_process");
    for (const char* phase : phases) {
        double sum = 0.0;
        for (const Json& one : processes) sum += number_of(one.at("seconds").at(phase));
        text += ',' + csv_number(sum / static_cast<double>(processes.size()));
    }
    return text;
}

}  // namespace

std::string solves_csv(const ResultSet& results) {
    std::string text = "problem,hash,n,m,law,solver,tolerance,status,cause,iterations,setup_s,solve_s,slowest_solve_s";
    const bool parts = std::any_of(results.solves.begin(), results.solves.end(),
                                   [](const Json& row) { return row.contains("parts") && !row.at("parts").is_null(); });
    for (const AnswerMeasure& measure : answer_measures())
        if (measure.brief) (text += ',') += measure.name;
    text += ",peak_memory_bytes,message";
    if (parts) {
        text += ",method,processes,bytes_an_iteration,ghosts,imbalance";
        for (const char* phase : phases) text += fmt::format(",{}_s", phase);
    }
    text += "\r\n";
    for (const Json& row : results.solves) {
        std::string n, m;
        for (const Json& problem : results.problems)
            if (problem.at("problem") == row.at("problem")) {
                n = integer_in(problem, "n");
                m = integer_in(problem, "m");
            }
        const Json& seconds = row.at("seconds");
        double slowest = number_of(seconds.at("solve"));
        for (const Json& repeat : seconds.at("repeats")) slowest = std::max(slowest, number_of(repeat.at(1)));
        text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}",
                            name_in(results.problems, "problem", row.at("problem")), text_in(row, "problem"), n, m,
                            text_in(row, "law"), text_in(row, "label"), csv_number(number_of(row.at("tolerance"))),
                            text_in(row, "status"), text_in(row, "cause"), integer_in(row, "iterations"),
                            csv_number(number_of(seconds.at("setup"))), csv_number(number_of(seconds.at("solve"))),
                            csv_number(slowest));
        const Json& error = row.at("error");
        for (const AnswerMeasure& measure : answer_measures()) {
            if (!measure.brief) continue;
            text += ',';
            if (!error.is_null()) text += csv_number(number_of(error.at(std::string(measure.name))));
        }
        text += fmt::format(",{},{}", integer_in(row, "peak_memory"), text_in(row, "message"));
        text += parts ? parts_csv(row) + "\r\n" : "\r\n";
    }
    return text;
}

std::string simulations_csv(const ResultSet& results) {
    std::string text =
        "scene,hash,timestepper,step_s,solver,status,cause,steps,newton_iterations,solver_iterations,setup_s,stepping_"
        "s,"
        "position_error,velocity_error,start_energy,end_energy,drift,penetration,peak_memory_bytes,message\r\n";
    for (const Json& row : results.simulations) {
        const Json& totals = row.at("totals");
        const auto total = [&](const char* key) {
            return totals.contains(key) ? csv_number(number_of(totals.at(key))) : std::string();
        };
        const auto energy = [&](std::size_t index) {
            return totals.contains("energy") ? csv_number(number_of(totals.at("energy").at(index))) : std::string();
        };
        text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\r\n",
                            name_in(results.scenes, "scene", row.at("scene")), text_in(row, "scene"),
                            text_in(row, "timestepper"), csv_number(number_of(row.at("step"))), text_in(row, "solver"),
                            text_in(row, "status"), text_in(row, "cause"), integer_in(totals, "steps"),
                            integer_in(totals, "newton_iterations"), integer_in(totals, "solver_iterations"),
                            csv_number(number_of(row.at("seconds").at("setup"))),
                            csv_number(number_of(row.at("seconds").at("stepping"))),
                            csv_number(number_of(row.at("error").at("position"))),
                            csv_number(number_of(row.at("error").at("velocity"))), energy(0), energy(1), total("drift"),
                            total("penetration"), integer_in(row, "peak_memory"), text_in(row, "message"));
    }
    return text;
}

std::string cells_csv(const ResultSet& results) {
    std::string text =
        "axis,value,method,outcome,status,measure,figure,limit,seconds,peak_memory_bytes,from,sentence\r\n";
    for (const Json& row : results.cells)
        text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\r\n", text_in(row, "axis"),
                            csv_number(number_of(row.at("value"))), text_in(row, "method"), text_in(row, "outcome"),
                            text_in(row, "status"), text_in(row, "measure"), csv_number(number_of(row.at("figure"))),
                            csv_number(number_of(row.at("limit"))), csv_number(number_of(row.at("seconds"))),
                            integer_in(row, "peak_memory"), text_in(row, "from"), text_in(row, "sentence"));
    return text;
}

}  // namespace delassus::bench
