// SPDX-License-Identifier: BSD-3-Clause
#include "bench/outcome.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/measures.hpp"

namespace delassus::bench {

namespace {

std::string spoken(std::string name) {
    std::replace(name.begin(), name.end(), '_', ' ');
    return name;
}

std::string unit_of(const std::string& measure) {
    for (const auto& one : measures())
        if (one.name == measure) return one.unit;
    return {};
}

/// Sets the figures of a claimed result against the bounds.
void compare(Judgement& judgement, const std::vector<Bound>& bounds) {
    judgement.outcome = "correct";
    double worst = -1.0;
    std::string beyond, unjudged;
    for (const auto& bound : bounds) {
        const double figure =
            judgement.measures.contains(bound.measure) ? number_of(judgement.measures.at(bound.measure)) : unknown;
        if (std::isnan(figure) && bound.measure == "velocity") {
            unjudged = "the velocity was not judged: there is no confirmed reference";
            continue;
        }
        // A bound of 0 is met by 0 only.
        const double ratio = figure <= bound.limit ? (bound.limit > 0.0 ? figure / bound.limit : 0.0)
                                                   : (bound.limit > 0.0 ? figure / bound.limit : HUGE_VAL);
        if (!std::isfinite(figure)) {
            judgement.outcome = "wrong";
            judgement.measure = bound.measure;
            judgement.figure = figure;
            judgement.limit = bound.limit;
            judgement.sentence = fmt::format("claimed as solved, but its {} is not finite", spoken(bound.measure));
            return;
        }
        if (!(figure <= bound.limit)) {
            judgement.outcome = "inaccurate";
            beyond +=
                fmt::format("{}{} {:.2e}{}{}, bound {:.2e}", beyond.empty() ? "" : "; ", spoken(bound.measure), figure,
                            unit_of(bound.measure).empty() ? "" : " ", unit_of(bound.measure), bound.limit);
        }
        if (ratio > worst) {
            worst = ratio;
            judgement.measure = bound.measure;
            judgement.figure = figure;
            judgement.limit = bound.limit;
        }
    }
    judgement.sentence = !beyond.empty() && !unjudged.empty() ? beyond + "; " + unjudged : beyond + unjudged;
}

/// For a run that did not claim a result: how far it came.
void show(Judgement& judgement, const char* measure) {
    if (!judgement.measures.contains(measure)) return;
    judgement.measure = measure;
    judgement.figure = number_of(judgement.measures.at(measure));
}

/// For a run that did not claim a result: what it did instead. wrong: the status of a claim that the core refutes.
void explain(Judgement& judgement, const std::string& status, const std::string& message, const char* wrong) {
    const bool refused = status == "unsupported" || status == "input";
    judgement.outcome = refused                                   ? "refused"
                        : status == wrong                         ? "wrong"
                        : status == "crashed" || status == "hung" ? status
                                                                  : "failed";
    judgement.sentence = refused           ? message
                         : message.empty() ? spoken(status)
                                           : fmt::format("{}: {}", spoken(status), message);
}

}  // namespace

Judgement judge(const Measurement& run, const std::vector<Bound>& bounds) {
    Judgement judgement;
    if (run.error) {
        for (const AnswerMeasure& measure : answer_measures())
            judgement.measures[std::string(measure.name)] = json_number(value_of(run, measure));
        judgement.measures["speed"] = json_number(run.speed);
    }
    if (run.status == "solved") {
        compare(judgement, bounds);
        const bool finite = run.error && std::isfinite(run.error->natural) && std::isfinite(run.speed);
        if (!finite) {
            judgement.outcome = "wrong";
            judgement.sentence = "claimed as solved, but its result is not finite";
        }
        return judgement;
    }
    explain(judgement, run.status, run.message, "false_claim");
    show(judgement, "natural");
    return judgement;
}

Judgement judge(const SimulationMeasurement& run, const std::vector<Bound>& bounds,
                const std::optional<std::array<double, 3>>& place) {
    Judgement judgement;
    judgement.measures = run.watched;
    judgement.measures.erase("place");
    if (place && run.watched.contains("place")) {
        const Json& at = run.watched.at("place");
        const auto off = [&](std::size_t k) { return number_of(at.at(k)) - (*place)[k]; };
        judgement.measures["position"] = json_number(std::hypot(off(0), off(1), off(2)));
    }
    if (run.status == "finished") {
        compare(judgement, bounds);
        return judgement;
    }
    // The measuring process says "diverged"; the run itself took the state for good.
    explain(judgement, run.status, run.message, "diverged");
    if (run.status == "unsolved") show(judgement, "natural");
    return judgement;
}

std::vector<Breakdown> breakdowns(const std::vector<Json>& cells) {
    std::vector<Breakdown> all;
    for (const Json& cell : cells) {
        const std::string axis = cell.at("axis"), method = cell.at("method"), outcome = cell.at("outcome");
        auto one = std::find_if(all.begin(), all.end(),
                                [&](const Breakdown& other) { return other.axis == axis && other.method == method; });
        if (one == all.end()) {
            all.emplace_back();
            one = all.end() - 1;
            one->axis = axis;
            one->method = method;
        }
        const double value = cell.at("value");
        if (outcome == "correct") {
            if (one->first_not) {
                one->correct_again.push_back(value);
            } else {
                one->last_correct = value;
            }
        } else if (!one->first_not) {
            one->first_not = value;
            one->outcome = outcome;
            one->sentence = cell.at("sentence");
        }
    }
    return all;
}

}  // namespace delassus::bench
