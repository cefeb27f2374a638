// SPDX-License-Identifier: BSD-3-Clause
// Strong and weak scaling of solvers that share a problem among processes, and what they send (docs/benchmarks.md).
#include <algorithm>
#include <cmath>
#include <map>

#include "bench/analysis.hpp"
#include "bench/statistics.hpp"

namespace delassus::bench {

namespace {

/// Contacts a process that differ by no more than this factor count as equal: a generated pile has the number of
/// contacts that was asked for only nearly.
constexpr double same_load = 1.1;

struct Run {
    const Json* row;
    const Json* problem;
    [[nodiscard]] int processes() const { return row->at("processes"); }
    [[nodiscard]] double size() const { return problem->at("size"); }
    [[nodiscard]] double load() const { return size() / processes(); }
};
using Runs = std::vector<Run>;

/// Seconds of each phase, the mean over the processes; what no phase has is "other". Empty if the solver tells none.
Json mean_phases(const Json& by_process) {
    Json mean = Json::object();
    double other = 0.0;
    bool told = false;
    for (const Json& one : by_process) {
        double rest = number_of(one.at("seconds").at("solve"));
        for (const auto& [phase, seconds] : one.at("seconds").items()) {
            const double value = number_of(seconds);
            if (phase == "solve" || std::isnan(value)) continue;
            mean[phase] = mean.value(phase, 0.0) + value / static_cast<double>(by_process.size());
            if (phase == "setup") continue;
            told = true;
            rest -= value;
        }
        other += std::max(0.0, rest) / static_cast<double>(by_process.size());
    }
    if (!told) return nullptr;
    mean["other"] = other;
    return mean;
}

double iteration_seconds(const Json& row) {
    const Json& iterations = row.at("iterations");
    const double count = iterations.is_null() ? 0.0 : iterations.get<double>();
    return count > 0.0 ? number_of(row.at("seconds").at("solve")) / count : std::nan("");
}

/// The first run is what the others are compared with. share(first, run): what an ideal run would take of its time,
/// inverted: the ratio of processes for strong scaling, 1 for weak scaling.
template <class Share>
Json points_of(const Runs& runs, const Share& share) {
    Json points = Json::array();
    for (const Run& run : runs) {
        const Json& row = *run.row;
        const Json& parts = row.at("parts");
        const double factor = share(runs.front(), run);
        points.push_back({{"problem", run.problem->at("name")},
                          {"size", run.size()},
                          {"processes", run.processes()},
                          {"seconds", json_number(total_seconds(row))},
                          {"efficiency", json_number(total_seconds(*runs.front().row) / (factor * total_seconds(row)))},
                          {"iterations", row.at("iterations")},
                          {"efficiency_of_an_iteration",
                           json_number(iteration_seconds(*runs.front().row) / (factor * iteration_seconds(row)))},
                          {"bytes_an_iteration", parts.is_null() ? Json(nullptr) : parts.at("bytes_an_iteration")},
                          {"peak_memory", row.at("peak_memory")},
                          {"ghosts", parts.is_null() ? Json(0) : parts.at("ghosts")},
                          {"imbalance", parts.is_null() ? Json(1.0) : parts.at("imbalance")},
                          {"phases", parts.is_null() ? Json(nullptr) : mean_phases(parts.at("by_process"))}});
    }
    return points;
}

Json head_of(const Run& run) {
    return {{"law", run.row->at("law")}, {"solver", run.row->at("method")}, {"tolerance", run.row->at("tolerance")}};
}

/// Runs that agree in what the key says, in the order of their first.
template <class Key>
std::vector<Runs> grouped(const Runs& runs, const Key& key) {
    std::vector<std::pair<std::string, Runs>> groups;
    for (const Run& run : runs) {
        const std::string text = json_text(key(run));
        auto found = std::find_if(groups.begin(), groups.end(), [&](const auto& group) { return group.first == text; });
        if (found == groups.end()) found = groups.insert(groups.end(), {text, {}});
        found->second.push_back(run);
    }
    std::vector<Runs> all;
    for (auto& group : groups) all.push_back(std::move(group.second));
    return all;
}

void by_processes(Runs& runs) {
    std::stable_sort(runs.begin(), runs.end(),
                     [](const Run& a, const Run& b) { return a.processes() < b.processes(); });
}

/// Of one family, law, solver and tolerance: the sets of runs, one for each number of processes, with equal loads.
std::vector<Runs> equal_loads(Runs runs) {
    std::stable_sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.load() < b.load(); });
    std::vector<Runs> sets;
    for (std::size_t first = 0; first < runs.size();) {
        Runs set;
        std::size_t next = first;
        for (; next < runs.size() && runs[next].load() <= same_load * runs[first].load(); ++next)
            if (std::none_of(set.begin(), set.end(),
                             [&](const Run& other) { return other.processes() == runs[next].processes(); }))
                set.push_back(runs[next]);
        first = next;
        by_processes(set);
        if (set.size() > 1) sets.push_back(std::move(set));
    }
    return sets;
}

Json traffic_of(const Runs& runs) {
    std::map<double, double> bytes;
    for (const Run& run : runs)
        if (const Json& parts = run.row->at("parts"); !parts.is_null())
            if (const double sent = number_of(parts.at("bytes_an_iteration")); sent > 0.0) bytes[run.size()] = sent;
    std::vector<double> sizes, sent;
    Json points = Json::array();
    for (const auto& [size, one] : bytes) {
        sizes.push_back(size);
        sent.push_back(one);
        points.push_back({size, one});
    }
    Json fit = nullptr;
    if (const auto power = fit_power(sizes, sent))
        fit = {{"exponent", json_number(power->exponent)}, {"standard_error", json_number(power->standard_error)}};
    return {{"points", points}, {"fit", fit}};
}

}  // namespace

Json analyse_processes(const ResultSet& results) {
    Runs runs;
    for (const Json& row : results.solves) {
        if (row.value("method", "").empty() || !row.at("cause").get<std::string>().empty()) continue;
        for (const Json& problem : results.problems)
            if (problem.at("problem") == row.at("problem")) runs.push_back({&row, &problem});
    }
    Json strong = Json::array(), weak = Json::array(), traffic = Json::array();
    const auto same_problem = [](const Run& run) {
        Json key = head_of(run);
        key["problem"] = run.row->at("problem");
        return key;
    };
    for (Runs& group : grouped(runs, same_problem)) {
        by_processes(group);
        if (group.back().processes() == group.front().processes()) continue;
        Json one = head_of(group.front());
        one["problem"] = group.front().problem->at("name");
        one["size"] = group.front().size();
        one["points"] = points_of(group, [](const Run& first, const Run& run) {
            return static_cast<double>(run.processes()) / first.processes();
        });
        strong.push_back(std::move(one));
    }
    Runs members;
    for (const Run& run : runs)
        if (!run.problem->at("family").is_null()) members.push_back(run);
    const auto same_family = [](const Run& run) {
        Json key = head_of(run);
        key["family"] = run.problem->at("family");
        return key;
    };
    for (const Runs& group : grouped(members, same_family))
        for (const Runs& set : equal_loads(group)) {
            Json one = same_family(set.front());
            one["load"] = set.front().load();
            one["points"] = points_of(set, [](const Run&, const Run&) { return 1.0; });
            weak.push_back(std::move(one));
        }
    const auto same_count = [&](const Run& run) {
        Json key = same_family(run);
        key["processes"] = run.processes();
        return key;
    };
    for (const Runs& group : grouped(members, same_count)) {
        if (group.front().processes() == 1) continue;
        Json one = same_count(group.front());
        one.update(traffic_of(group));
        if (one.at("points").size() > 1) traffic.push_back(std::move(one));
    }
    const Json& machine = results.session.at("machine");
    int most = 1;
    for (const Run& run : runs) most = std::max(most, run.processes());
    return {{"strong", strong},
            {"weak", weak},
            {"traffic", traffic},
            {"beyond_cores", most > machine.at("cores").get<int>() ? Json(most) : Json(nullptr)}};
}

}  // namespace delassus::bench
