// SPDX-License-Identifier: BSD-3-Clause
#include "bench/csv_text.hpp"
#include "bench/measures.hpp"
#include "bench/writers.hpp"

namespace delassus::bench {

std::string csv_text(const Comparison& comparison) {
    std::string text = "problem,n,m,law,structure,solver,status,iterations,setup_s,solve_s,slowest_solve_s";
    for (const AnswerMeasure& measure : answer_measures()) (text += ',') += measure.name;
    text += ",peak_memory_bytes,message\r\n";
    for (const auto& problem : comparison.problems)
        for (const auto& row : problem.results) {
            double slowest = row.solve;
            for (const auto& repeat : row.repeats) slowest = std::max(slowest, repeat.solve);
            text += fmt::format("{},{},{},{},{},{},{},{}", csv_field(problem.facts.name), problem.facts.n,
                                problem.facts.m, problem.facts.law, problem.facts.structure, csv_field(row.label),
                                row.status, row.iterations ? std::to_string(*row.iterations) : "");
            for (const double value : {row.setup, row.solve, slowest}) (text += ',') += csv_number(value);
            for (const AnswerMeasure& measure : answer_measures()) (text += ',') += csv_number(value_of(row, measure));
            text += fmt::format(",{},{}\r\n", row.peak_memory, csv_field(row.message));
        }
    return text;
}

}  // namespace delassus::bench
