// SPDX-License-Identifier: BSD-3-Clause
#include "bench/analysis.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bench/statistics.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus::bench {

namespace {

using Rows = std::vector<const Json*>;

bool solved(const Json& row) {
    return row.at("cause").get<std::string>().empty();
}

/// In the order of first appearance.
template <class Of>
std::vector<std::string> distinct(const Rows& rows, Of of) {
    std::vector<std::string> values;
    for (const Json* row : rows)
        if (const std::string value = of(*row); std::find(values.begin(), values.end(), value) == values.end())
            values.push_back(value);
    return values;
}

std::string label_of(const Json& row) {
    return row.at("label");
}

std::string problem_of(const Json& row) {
    return row.at("problem").get<std::string>() + row.at("law").get<std::string>();
}

/// "linear" (or "unsymmetric", "indefinite" by H) where all rows are free, else the law: problems that the same solvers
/// can take.
std::string class_of(const Json& row, const std::map<std::string, const Json*>& problems) {
    const auto problem = problems.find(row.at("problem"));
    if (problem != problems.end()) {
        const Json& cones = problem->second->at("cones");
        const std::string structure = problem->second->at("structure");
        bool linear = true;
        for (const auto& [name, count] : cones.items()) {
            const auto* kind = find_cone_kind(name);
            linear = linear && kind && kind->is_linear;
        }
        if (linear) return structure == "unsymmetric" || structure == "indefinite" ? structure : "linear";
    }
    return row.at("law");
}

/// One tolerance on one class of problems.
Json analyse_tolerance(const Rows& rows, double tolerance, double time_limit) {
    Rows own;
    for (const Json* row : rows)
        if (row->at("tolerance") == tolerance) own.push_back(row);
    const auto problems = distinct(own, problem_of);
    const auto solvers = distinct(own, label_of);
    const auto index = [](const std::vector<std::string>& names, const std::string& name) {
        return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    Times times(problems.size(), std::vector<std::optional<double>>(solvers.size()));
    for (const Json* row : own)
        if (solved(*row))
            times[index(problems, problem_of(*row))][index(solvers, label_of(*row))] = total_seconds(*row);
    const Profiles profiles = performance_profiles(times, least_time);

    Json list = Json::array();
    for (std::size_t s = 0; s < solvers.size(); ++s) {
        std::vector<double> seconds;
        std::int64_t solves = 0, supported = 0, lies = 0, memory = 0;
        for (const auto& row : times)
            if (std::any_of(row.begin(), row.end(), [](const auto& time) { return time.has_value(); }))
                seconds.push_back(row[s].value_or(time_limit));
        for (const Json* row : own) {
            if (label_of(*row) != solvers[s]) continue;
            solves += solved(*row);
            supported += row->at("cause") != "unsupported";
            lies += row->at("cause") == "false_claim";
            memory = std::max(memory, row->at("peak_memory").get<std::int64_t>());
        }
        list.push_back({{"solver", solvers[s]},
                        {"mean", json_number(shifted_geometric_mean(seconds, mean_shift))},
                        {"solved", solves},
                        {"supported", supported},
                        {"false_claims", lies},
                        {"memory", memory},
                        {"ratios", profiles.ratios[s]}});
    }
    return {{"tolerance", tolerance},
            {"problems", problems.size()},
            {"solved_by_any", profiles.problems},
            {"solvers", list}};
}

Json analyse_tolerances(const Rows& rows, const Json& settings) {
    Json tolerances = Json::array();
    for (const auto& tolerance : settings.at("tolerances"))
        tolerances.push_back(analyse_tolerance(rows, tolerance.get<double>(), settings.at("time_limit").get<double>()));
    return tolerances;
}

/// The same for the problems of each decade of sizes; empty where all are of one decade.
Json analyse_sizes(const Rows& rows, const std::map<std::string, const Json*>& problems, const Json& settings) {
    std::map<double, Rows> decades;
    for (const Json* row : rows) {
        const auto problem = problems.find(row->at("problem"));
        const double size = problem == problems.end() ? 0.0 : problem->second->at("size").get<double>();
        if (size > 0.0) decades[std::pow(10.0, std::floor(std::log10(size)))].push_back(row);
    }
    Json sizes = Json::array();
    if (decades.size() < 2) return sizes;
    for (const auto& [from, own] : decades)
        sizes.push_back({{"from", from},
                         {"problems", distinct(own, problem_of).size()},
                         {"tolerances", analyse_tolerances(own, settings)}});
    return sizes;
}

Json analyse_class(const std::string& name, const Rows& rows, const std::map<std::string, const Json*>& problems,
                   const Json& settings) {
    const auto members = distinct(rows, problem_of);
    return {{"name", name},
            {"problems", members.size()},
            {"members", members},
            {"tolerances", analyse_tolerances(rows, settings)},
            {"sizes", analyse_sizes(rows, problems, settings)}};
}

Json fit_json(const std::vector<double>& x, const std::vector<double>& y) {
    const auto fit = fit_power(x, y);
    if (!fit) return nullptr;
    return {{"exponent", json_number(fit->exponent)},
            {"standard_error", json_number(fit->standard_error)},
            {"factor", json_number(fit->factor)}};
}

/// Cost against size, for each family, law, solver and tolerance with two sizes at least.
Json analyse_scaling(const Rows& rows, const std::map<std::string, const Json*>& problems) {
    struct Series {
        std::map<double, std::pair<double, std::int64_t>> points;  // seconds and memory by size
    };
    std::map<std::string, std::pair<Json, Series>> families;
    std::vector<std::string> order;
    for (const Json* row : rows) {
        const auto found = problems.find(row->at("problem"));
        if (found == problems.end() || found->second->at("family").is_null() || !solved(*row)) continue;
        const Json& problem = *found->second;
        const Json head = {{"family", problem.at("family")},
                           {"law", row->at("law")},
                           {"solver", row->at("label")},
                           {"tolerance", row->at("tolerance")}};
        const std::string key = json_text(head);
        if (!families.contains(key)) order.push_back(key);
        auto& [row_head, series] = families[key];
        row_head = head;
        series.points[problem.at("size").get<double>()] = {std::max(total_seconds(*row), least_time),
                                                           row->at("peak_memory").get<std::int64_t>()};
    }
    Json list = Json::array();
    for (const auto& key : order) {
        auto& [head, series] = families.at(key);
        if (series.points.size() < 2) continue;
        std::vector<double> sizes, seconds;
        Json points = Json::array();
        for (const auto& [size, cost] : series.points) {
            sizes.push_back(size);
            seconds.push_back(cost.first);
            points.push_back({size, cost.first, cost.second});
        }
        Json entry = head;
        entry["points"] = points;
        entry["fit"] = fit_json(sizes, seconds);
        list.push_back(entry);
    }
    return list;
}

/// An error below this multiple of the reference's own error says more about the reference than about the run.
constexpr double above_reference = 3.0;

/// Error of a trajectory's end against the step, for each scene, timestepper and solver.
Json analyse_orders(const std::vector<Json>& simulations, const std::vector<Json>& references) {
    std::map<std::string, double> own_errors;
    for (const Json& reference : references)
        if (reference.contains("step") && reference.contains("second"))
            own_errors[reference.at("of")] = number_of(reference.at("second").at("position"));
    std::map<std::string, std::pair<Json, std::map<double, const Json*>>> groups;
    std::vector<std::string> order;
    for (const Json& row : simulations) {
        if (!solved(row)) continue;
        const Json head = {
            {"scene", row.at("scene")}, {"timestepper", row.at("timestepper")}, {"solver", row.at("solver")}};
        const std::string key = json_text(head);
        if (!groups.contains(key)) order.push_back(key);
        groups[key].first = head;
        groups[key].second[row.at("step").get<double>()] = &row;
    }
    Json list = Json::array();
    for (const auto& key : order) {
        auto& [head, by_step] = groups.at(key);
        std::vector<double> steps, errors;
        for (const auto& [step, row] : by_step) {
            const double error = number_of(row->at("error").at("position"));
            const auto own = own_errors.find(row->at("scene"));
            if (!(error > 0.0) || (own != own_errors.end() && !(error > above_reference * own->second))) continue;
            steps.push_back(step);
            errors.push_back(error);
        }
        Json entry = head;
        entry["fit"] = fit_json(steps, errors);
        list.push_back(entry);
    }
    return list;
}

/// How often each solver failed for which cause, and how many of those runs were left out.
Json count_failures(const Rows& rows) {
    struct Count {
        int all = 0, skipped = 0;
    };
    std::map<std::pair<std::string, std::string>, Count> counts;
    for (const Json* row : rows) {
        if (solved(*row)) continue;
        Count& count = counts[{row->at("label"), row->at("cause")}];
        ++count.all;
        count.skipped += row->contains("skipped_after");
    }
    Json list = Json::array();
    for (const auto& [what, count] : counts)
        list.push_back(
            {{"solver", what.first}, {"cause", what.second}, {"count", count.all}, {"skipped", count.skipped}});
    return list;
}

/// The cost of recording the error and of being the first run: the median, over runs long enough for a clock, of the
/// recorded run's solve seconds over the least of the repeats.
Json recording_ratio(const Rows& rows) {
    std::vector<double> ratios;
    for (const Json* row : rows) {
        const double least = number_of(row->at("seconds").at("solve"));
        const double recorded = number_of(row->at("seconds").at("recorded").at(1));
        if (solved(*row) && !row->at("seconds").at("repeats").empty() && least > 1e-2)
            ratios.push_back(recorded / least);
    }
    if (ratios.empty()) return {{"ratio", nullptr}, {"runs", 0}};
    std::sort(ratios.begin(), ratios.end());
    return {{"ratio", ratios[ratios.size() / 2]}, {"runs", ratios.size()}};
}

}  // namespace

double total_seconds(const Json& solve) {
    return number_of(solve.at("seconds").at("setup")) + number_of(solve.at("seconds").at("solve"));
}

Json analyse(const ResultSet& results) {
    std::map<std::string, const Json*> problems;
    for (const Json& problem : results.problems) problems[problem.at("problem")] = &problem;
    Rows rows;
    for (const Json& row : results.solves) rows.push_back(&row);
    const Json& settings = results.session.at("settings");
    Json classes = Json::array();
    const auto names = distinct(rows, [&](const Json& row) { return class_of(row, problems); });
    for (const auto& name : names) {
        Rows own;
        for (const Json* row : rows)
            if (class_of(*row, problems) == name) own.push_back(row);
        classes.push_back(analyse_class(name, own, problems, settings));
    }
    if (names.size() > 1) classes.push_back(analyse_class("all", rows, problems, settings));
    return {{"classes", classes},
            {"scaling", analyse_scaling(rows, problems)},
            {"orders", analyse_orders(results.simulations, results.references)},
            {"failures", count_failures(rows)},
            {"recording", recording_ratio(rows)},
            {"processes", analyse_processes(results)}};
}

}  // namespace delassus::bench
