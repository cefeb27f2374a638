// SPDX-License-Identifier: BSD-3-Clause
#include "bench/compare_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/analysis.hpp"
#include "bench/statistics.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

namespace {

void check_comparable(const ResultSet& before, const ResultSet& after, bool any_machine) {
    const Json &a = before.session, &b = after.session;
    for (const char* what : {"processor", "cores"})
        if (!any_machine && a.at("machine").at(what) != b.at("machine").at(what))
            throw InputError(
                fmt::format("the sets come from different machines ({} {} and {}), so ratios of their times say "
                            "nothing about a change; --any-machine compares them anyway",
                            what, json_text(a.at("machine").at(what)), json_text(b.at("machine").at(what))));
    for (const char* what : {"time_limit", "memory_limit", "max_iterations"})
        if (a.at("settings").at(what) != b.at("settings").at(what))
            throw InputError(fmt::format("the sets have different limits ({} {} and {}), so they cannot be compared",
                                         what, json_text(a.at("settings").at(what)),
                                         json_text(b.at("settings").at(what))));
}

/// The key by which two runs are the same, whatever the code.
std::string identity(const Json& row) {
    if (row.at("kind") == "solve")
        return json_text(Json{row.at("problem"), row.at("law"), row.at("label"), row.at("tolerance")});
    return json_text(Json{row.at("scene"), row.at("timestepper"), row.at("step"), row.at("solver")});
}

std::vector<double> seconds_of(const Json& row) {
    std::vector<double> seconds;
    for (const Json& repeat : row.at("seconds").at("repeats"))
        seconds.push_back(repeat.is_array() ? number_of(repeat.at(0)) + number_of(repeat.at(1)) : number_of(repeat));
    if (seconds.empty())
        seconds.push_back(row.at("kind") == "solve" ? total_seconds(row) : number_of(row.at("seconds").at("stepping")));
    std::erase_if(seconds, [](double value) { return !(value > 0.0); });
    return seconds;
}

Json ratio_json(const Ratio& ratio) {
    return {{"ratio", ratio.value}, {"low", ratio.low}, {"high", ratio.high}, {"certain", ratio.certain()}};
}

struct Sum {
    int runs = 0, faster = 0, slower = 0;
    double value = 0.0, low = 0.0, high = 0.0;  // of logarithms
};

}  // namespace

Json compare_sets(const ResultSet& before, const ResultSet& after, bool any_machine) {
    check_comparable(before, after, any_machine);
    std::map<std::string, const Json*> old;
    for (const Json& row : before.solves) old[identity(row)] = &row;
    for (const Json& row : before.simulations) old[identity(row)] = &row;
    std::map<std::string, std::string> names;
    for (const ResultSet* set : {&before, &after}) {
        for (const Json& problem : set->problems) names[problem.at("problem")] = problem.at("name");
        for (const Json& scene : set->scenes) names[scene.at("scene")] = scene.at("name");
    }

    Json result = {{"solvers", Json::array()},
                   {"runs", Json::array()},
                   {"changed", Json::array()},
                   {"simulations", Json::array()}};
    std::map<std::string, Sum> sums;
    std::size_t common = 0;
    const auto compare = [&](const Json& row) {
        const auto found = old.find(identity(row));
        if (found == old.end()) return;
        ++common;
        const Json& was = *found->second;
        const bool solve = row.at("kind") == "solve";
        Json entry = solve ? Json{{"problem", names[row.at("problem")]},
                                  {"law", row.at("law")},
                                  {"solver", row.at("label")},
                                  {"tolerance", row.at("tolerance")}}
                           : Json{{"scene", names[row.at("scene")]},
                                  {"timestepper", row.at("timestepper")},
                                  {"step", row.at("step")},
                                  {"solver", row.at("solver")}};
        if (was.at("cause") != row.at("cause")) {
            entry["a"] = was.at("cause") == "" ? Json("solved") : was.at("cause");
            entry["b"] = row.at("cause") == "" ? Json("solved") : row.at("cause");
            result["changed"].push_back(entry);
        }
        if (was.at("cause") != "" || row.at("cause") != "") return;
        const auto a = seconds_of(was), b = seconds_of(row);
        if (a.empty() || b.empty()) return;
        const Ratio ratio = ratio_of(b, a);
        entry["a"] = *std::min_element(a.begin(), a.end());
        entry["b"] = *std::min_element(b.begin(), b.end());
        entry.update(ratio_json(ratio));
        result[solve ? "runs" : "simulations"].push_back(entry);
        Sum& sum = sums[solve ? row.at("label").get<std::string>()
                              : "timestepper " + row.at("timestepper").get<std::string>()];
        ++sum.runs;
        sum.value += std::log(ratio.value);
        sum.low += std::log(ratio.low);
        sum.high += std::log(ratio.high);
        sum.faster += ratio.certain() && ratio.value < 1.0;
        sum.slower += ratio.certain() && ratio.value > 1.0;
    };
    for (const Json& row : after.solves) compare(row);
    for (const Json& row : after.simulations) compare(row);
    if (common == 0)
        throw InputError(
            "the sets have no run in common: no problem (by its content) with the same law, solver and tolerance");
    for (const auto& [name, sum] : sums)
        result["solvers"].push_back({{"solver", name},
                                     {"runs", sum.runs},
                                     {"ratio", std::exp(sum.value / sum.runs)},
                                     {"low", std::exp(sum.low / sum.runs)},
                                     {"high", std::exp(sum.high / sum.runs)},
                                     {"faster", sum.faster},
                                     {"slower", sum.slower}});
    return result;
}

std::string compare_text(const Json& comparison) {
    const auto number = [](const Json& row, const char* key) { return row.at(key).get<double>(); };
    const auto text = [](const Json& row, const char* key) { return row.at(key).get<std::string>(); };
    std::size_t width = 6;
    for (const Json& row : comparison.at("solvers")) width = std::max(width, text(row, "solver").size());
    std::string result = fmt::format("{:<{}}  {:>5}  {:>7}  {:>15}  {:>6}  {:>6}\n", "solver", width, "runs", "B / A",
                                     "spread", "faster", "slower");
    for (const Json& row : comparison.at("solvers"))
        result += fmt::format("{:<{}}  {:>5}  {:>7.3f}  {:>6.3f} … {:>6.3f}  {:>6}  {:>6}\n", text(row, "solver"),
                              width, row.at("runs").get<int>(), number(row, "ratio"), number(row, "low"),
                              number(row, "high"), row.at("faster").get<int>(), row.at("slower").get<int>());
    std::vector<const Json*> certain;
    for (const char* part : {"runs", "simulations"})
        for (const Json& row : comparison.at(part))
            if (row.at("certain") == true) certain.push_back(&row);
    std::sort(certain.begin(), certain.end(), [&](const Json* a, const Json* b) {
        return std::abs(std::log(number(*a, "ratio"))) > std::abs(std::log(number(*b, "ratio")));
    });
    const auto what = [&](const Json& row) {
        return row.contains("problem") ? fmt::format("{} ({}), {}, {:g}", text(row, "problem"), text(row, "law"),
                                                     text(row, "solver"), number(row, "tolerance"))
                                       : fmt::format("{}, {}, h = {:g} s", text(row, "scene"), text(row, "timestepper"),
                                                     number(row, "step"));
    };
    if (!certain.empty()) result += "\nbeyond the spread of the repeats, the largest first:\n";
    for (std::size_t k = 0; k < std::min<std::size_t>(certain.size(), 20); ++k)
        result += fmt::format("  {:>7.3f}  ({:.3g} s, was {:.3g} s)  {}\n", number(*certain[k], "ratio"),
                              number(*certain[k], "b"), number(*certain[k], "a"), what(*certain[k]));
    if (!comparison.at("changed").empty()) result += "\nended differently:\n";
    for (const Json& row : comparison.at("changed"))
        result += fmt::format("  {}: {}, was {}\n", what(row), text(row, "b"), text(row, "a"));
    return result;
}

}  // namespace delassus::bench
