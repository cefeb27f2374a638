// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "bench/bench_writers.hpp"
#include "bench/measures.hpp"
#include "support/html_page.hpp"

namespace delassus::bench {

namespace {

/// On the page, samples of a curve are this factor apart in time; results.jsonl holds all.
constexpr double page_spacing = 1.06;

Json thinned(const Json& samples) {
    Json kept = Json::array();
    double next = 0.0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const double seconds = number_of(samples[k].at(1));
        if (k + 1 < samples.size() && seconds < next) continue;
        next = seconds * page_spacing;
        kept.push_back(samples[k]);
    }
    return kept;
}

/// The rows, curves thinned and kept only at the tightest tolerance that each solver was run to on each problem.
std::vector<Json> page_rows(std::vector<Json> rows) {
    const auto run_of = [](const Json& row) {
        return json_text(Json{row.at("problem"), row.at("law"), row.at("label")});
    };
    std::map<std::string, double> tightest;
    for (const Json& row : rows) {
        if (row.contains("skipped_after")) continue;
        const auto tolerance = row.at("tolerance").get<double>();
        const auto [entry, added] = tightest.emplace(run_of(row), tolerance);
        if (!added) entry->second = std::min(entry->second, tolerance);
    }
    for (Json& row : rows) {
        Json& samples = row["curve"]["samples"];
        const bool shown = !row.contains("skipped_after") && row.at("tolerance") == tightest.at(run_of(row));
        samples = shown ? thinned(samples) : Json::array();
    }
    return rows;
}

}  // namespace

std::string bench_page(const ResultSet& results, const Json& analysis) {
    Json session = results.session;
    session.erase("keys");
    const Json page = {{"session", session},
                       {"measures", answer_measures_json()},
                       {"problems", results.problems},
                       {"references", results.references},
                       {"libraries", results.libraries},
                       {"scenes", results.scenes},
                       {"solves", page_rows(results.solves)},
                       {"simulations", results.simulations},
                       {"leaving_out", results.leaving_out},
                       {"axes", results.axes},
                       {"cells", results.cells},
                       {"missing", results.missing},
                       {"analysis", analysis}};
    return html_page(page_parts(), "bench.html", json_text(page));
}

}  // namespace delassus::bench
