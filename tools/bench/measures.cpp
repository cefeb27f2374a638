// SPDX-License-Identifier: BSD-3-Clause
#include "bench/measures.hpp"

namespace delassus::bench {

const std::vector<AnswerMeasure>& answer_measures() {
    static const std::vector<AnswerMeasure> table = [] {
        std::vector<AnswerMeasure> rows;
        for (const ErrorMeasure& measure : error_measures)
            if (measure.is_error)
                rows.push_back({measure.name, measure.unit, measure.title, measure.brief, measure.value});
        rows.push_back({"velocity", "1", "velocity error, in the norm of the kinetic energy", true, nullptr});
        return rows;
    }();
    return table;
}

double value_of(const Measurement& run, const AnswerMeasure& measure) {
    if (!measure.error) return run.velocity;
    return run.error ? (*run.error).*measure.error : unknown;
}

Json answer_measures_json() {
    Json rows = Json::array();
    for (const AnswerMeasure& measure : answer_measures())
        rows.push_back({{"name", measure.name}, {"title", measure.title}, {"brief", measure.brief}});
    return rows;
}

}  // namespace delassus::bench
