// SPDX-License-Identifier: BSD-3-Clause
#include "solver/ranking.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "problem/need_of.hpp"
#include "support/json.hpp"
#include "support/nearest_name.hpp"
#include "support/sentence.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace {

void check_keys(const nlohmann::json& object, const std::vector<std::string_view>& known, std::string_view where) {
    if (!object.is_object()) throw InputError(fmt::format("{} must be an object", where));
    for (const auto& [key, value] : object.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            throw InputError(fmt::format("{} has no key \"{}\"{}", where, key, nearest_name_hint(key, known)));
}

Structure structure_of(const std::string& name) {
    for (const auto structure : {Structure::Reduced, Structure::Diagonal, Structure::Blocks, Structure::Definite,
                                 Structure::Semidefinite, Structure::Indefinite, Structure::Unsymmetric})
        if (name == name_of(structure)) return structure;
    throw InputError(fmt::format("there is no structure \"{}\" of H", name));
}

RowRange read_rows(const nlohmann::json& bounds) {
    RowRange range;
    range.smallest = bounds.at(0).get<std::int32_t>();
    if (!bounds.at(1).is_null()) range.largest = bounds.at(1).get<std::int32_t>();
    return range;
}

RankedStage read_stage(const nlohmann::json& json) {
    check_keys(json,
               {"solver", "options", "tolerance", "sharper", "max_iterations", "watched", "to_goal", "patient",
                "attempt", "last", "law", "m", "reason"},
               "a stage");
    RankedStage ranked;
    ranked.solver = json.at("solver").get<std::string>();
    if (json.contains("options")) ranked.options = json.at("options").get<OptionTexts>();
    ranked.stage.reason = json.at("reason").get<std::string>();
    ranked.stage.tolerance = json.value("tolerance", 0.0);
    ranked.stage.sharper = json.value("sharper", 1.0);
    ranked.stage.max_iterations = json.value("max_iterations", ranked.stage.max_iterations);
    ranked.stage.watched = json.value("watched", false);
    ranked.stage.to_goal = json.value("to_goal", false);
    ranked.stage.patient = json.value("patient", false);
    ranked.stage.attempt = json.value("attempt", false);
    ranked.last = json.value("last", false);
    if (json.contains("m")) ranked.m = read_rows(json.at("m"));
    if (json.contains("law")) ranked.stage.law = law_of(json.at("law").get<std::string>());
    return ranked;
}

RankingRule read_rule(const nlohmann::json& json) {
    check_keys(json, {"name", "when", "stages"}, "a rule");
    RankingRule rule;
    rule.name = json.at("name").get<std::string>();
    const nlohmann::json& when = json.at("when");
    check_keys(when, {"linear", "simulation", "partitioned", "law", "structure", "m", "tolerance"},
               fmt::format("\"when\" of \"{}\"", rule.name));
    if (when.contains("linear")) rule.linear = when.at("linear").get<bool>();
    if (when.contains("simulation")) rule.simulation = when.at("simulation").get<bool>();
    if (when.contains("partitioned")) rule.partitioned = when.at("partitioned").get<bool>();
    if (when.contains("law")) rule.law = law_of(when.at("law").get<std::string>());
    if (when.contains("structure"))
        for (const auto& name : when.at("structure")) rule.structures.push_back(structure_of(name));
    if (when.contains("m")) rule.m = read_rows(when.at("m"));
    if (when.contains("tolerance")) {
        if (!when.at("tolerance").at(0).is_null()) rule.smallest_tolerance = when.at("tolerance").at(0).get<double>();
        if (!when.at("tolerance").at(1).is_null()) rule.largest_tolerance = when.at("tolerance").at(1).get<double>();
    }
    for (const auto& stage : json.at("stages")) rule.stages.push_back(read_stage(stage));
    return rule;
}

}  // namespace

bool RankingRule::matches(const RankedNeeds& asked) const {
    if (linear && *linear != ((asked.needs & sdk::cones_not_linear) == 0)) return false;
    if (simulation && *simulation != asked.simulation) return false;
    if (partitioned && *partitioned != ((asked.needs & DELASSUS_CAN_PARTITIONED) != 0)) return false;
    if (law && (asked.needs & need_of(*law)) == 0) return false;
    if (!structures.empty() && std::none_of(structures.begin(), structures.end(), [&](Structure structure) {
            return (asked.needs & need_of(structure)) != 0;
        }))
        return false;
    return asked.tolerance >= smallest_tolerance && asked.tolerance <= largest_tolerance;
}

Ranking::Ranking(const std::filesystem::path& file) {
    try {
        const nlohmann::json json = parse_json(read_file(file, most_bytes_of_text));
        check_keys(json, {"format", "made_by", "rules"}, "a ranking");
        if (json.at("format") != 1) throw InputError("its format is not 1");
        for (const auto& rule : json.at("rules")) rules_.push_back(read_rule(rule));
        if (rules_.empty() || !json.at("rules").back().at("when").empty())
            throw InputError("its last rule must match everything: \"when\": {}");
    } catch (const nlohmann::json::exception& error) {
        throw InputError(fmt::format("the ranking {} cannot be read: {}", file.string(), sentence_of(error)));
    } catch (const InputError& error) {
        throw InputError(fmt::format("the ranking {} cannot be used: {}", file.string(), error.what()));
    }
}

const RankingRule& Ranking::rule(const RankedNeeds& asked, std::int32_t m) const {
    return *std::find_if(rules_.begin(), rules_.end(),
                         [&](const RankingRule& rule) { return rule.matches(asked) && rule.m.takes(m); });
}

std::vector<const RankingRule*> Ranking::rules(const RankedNeeds& asked) const {
    std::vector<const RankingRule*> found;
    for (const auto& rule : rules_) {
        if (!rule.matches(asked)) continue;
        found.push_back(&rule);
        if (rule.m == RowRange{}) break;  // none comes after it
    }
    return found;
}

}  // namespace delassus
