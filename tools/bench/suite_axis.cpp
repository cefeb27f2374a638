// SPDX-License-Identifier: BSD-3-Clause
#include "bench/suite_axis.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "bench/formula.hpp"
#include "bench/measures.hpp"
#include "bench/suite.hpp"
#include "bench/suite_sections.hpp"
#include "config/sections.hpp"
#include "solver/name_with_options.hpp"

namespace delassus::bench {

namespace {

double number_in(const Source& source, const YAML::Node& node, std::string_view key, const std::string& text) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(number))
        source.refuse(node, fmt::format("\"{}\" is \"{}\"; it must be a finite number", key, text));
    return number;
}

/// A text with formulas at a value.
std::string filled(const Source& source, const YAML::Node& node, const std::string& text, double value) {
    try {
        return fill_in(text, value);
    } catch (const InputError& error) {
        source.refuse(node, error.what());
    }
}

/// A limit for all values, by formula, or a list with one for each.
std::vector<double> limits_of(const Source& source, const YAML::Node& node, const std::string& measure,
                              const std::vector<double>& values) {
    if (node.IsSequence() && node.size() != values.size())
        source.refuse(node, fmt::format("\"{}\" has {} bounds for {} values", measure, node.size(), values.size()));
    std::vector<double> limits;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const YAML::Node one = node.IsSequence() ? YAML::Node(node[i]) : node;
        const std::string text = filled(source, one, scalar(source, one, measure), values[i]);
        limits.push_back(number_in(source, one, measure, text));
        if (limits.back() < 0.0) source.refuse(one, fmt::format("the bound of \"{}\" is negative", measure));
    }
    return limits;
}

/// A place for all values, or a list with one for each; numbers and formulas.
std::vector<std::array<double, 3>> places_of(const Source& source, const YAML::Node& node,
                                             const std::vector<double>& values) {
    const bool many = node.IsSequence() && node.size() > 0 && node[0].IsSequence();
    if (!node.IsSequence() || (many && node.size() != values.size()))
        source.refuse(node, fmt::format("\"at\" must be [x, y, z], or a list of {} such places", values.size()));
    std::vector<std::array<double, 3>> places;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const YAML::Node one = many ? YAML::Node(node[i]) : node;
        if (!one.IsSequence() || one.size() != 3) source.refuse(one, "\"at\" must be [x, y, z]");
        std::array<double, 3> place{};
        for (std::size_t k = 0; k < 3; ++k)
            place[k] = number_in(source, one, "at", filled(source, one, scalar(source, one[k], "at"), values[i]));
        places.push_back(place);
    }
    return places;
}

void read_bounds(const Source& source, const YAML::Node& node, SuiteAxis& axis, bool scene) {
    if (!node.IsMap() || node.size() == 0)
        source.refuse(node, "\"bounds\" must be a map of measures to what they must not exceed");
    axis.bounds.resize(axis.values.size());
    std::vector<std::string_view> names;
    for (const auto& measure : measures())
        if (scene ? measure.of_scenes : measure.of_problems) names.emplace_back(measure.name);
    for (const auto& entry : node) {
        const std::string name = scalar(source, entry.first, "key");
        if (std::find(names.begin(), names.end(), name) == names.end())
            source.refuse(entry.first, fmt::format("{} have no measure \"{}\"{}", scene ? "scenes" : "problems", name,
                                                   nearest_name_hint(name, names)));
        YAML::Node limit = entry.second;
        if (name == "position") {
            YAML::Node at;
            limit.reset();
            read_map(source, entry.second, "\"position\"",
                     {{"body", [&](const YAML::Node& n) { axis.body = scalar(source, n, "body"); }},
                      {"at", [&](const YAML::Node& n) { at.reset(n); }},
                      {"within", [&](const YAML::Node& n) { limit.reset(n); }}});
            if (axis.body.empty() || at.IsNull() || limit.IsNull())
                source.refuse(entry.second, "\"position\" needs \"body\", \"at\" and \"within\"");
            axis.positions = places_of(source, at, axis.values);
        }
        const auto limits = limits_of(source, limit, name, axis.values);
        for (std::size_t i = 0; i < limits.size(); ++i) axis.bounds[i].push_back({name, limits[i]});
    }
}

std::vector<std::string> list_of_texts(const Source& source, const YAML::Node& node, const std::string& key) {
    if (!node.IsSequence() || node.size() == 0)
        source.refuse(node, fmt::format("\"{}\" must be a list with at least one entry", key));
    return values_of(source, node, key);
}

}  // namespace

const std::vector<Measure>& measures() {
    static const std::vector<Measure> table = [] {
        std::vector<Measure> rows;
        // Of a scene's steps, the natural error alone is kept.
        for (const AnswerMeasure& measure : answer_measures())
            rows.push_back({std::string(measure.name), measure.unit == "1" ? "" : std::string(measure.unit), true,
                            measure.error == &Errors::natural});
        rows.insert(rows.end(), {{"speed", "m/s, rad/s", true, true},
                                 {"end_speed", "m/s, rad/s", false, true},
                                 {"position", "m", false, true},
                                 {"energy_growth", "J", false, true},
                                 {"energy_loss", "J", false, true},
                                 {"momentum", "kg m/s", false, true},
                                 {"angular_momentum", "kg m²/s", false, true},
                                 {"drift", "m, rad", false, true},
                                 {"penetration", "m", false, true},
                                 {"reversal", "m, rad", false, true}});
        return rows;
    }();
    return table;
}

SuiteAxis read_axis(const Source& source, const YAML::Node& item, const Registry& registry,
                    std::vector<std::string>& left_out) {
    SuiteAxis axis;
    std::string generator, scene;
    YAML::Node set, bounds;
    bool of_problems = false, of_scenes = false;  // keys that only one of the two has
    read_map(source, item, "an axis of the suite",
             {{"name", [&](const YAML::Node& n) { axis.name = scalar(source, n, "name"); }},
              {"title", [&](const YAML::Node& n) { axis.title = scalar(source, n, "title"); }},
              {"unit", [&](const YAML::Node& n) { axis.unit = scalar(source, n, "unit"); }},
              {"reason", [&](const YAML::Node& n) { axis.reason = scalar(source, n, "reason"); }},
              {"generate", [&](const YAML::Node& n) { generator = scalar(source, n, "generate"); }},
              {"scene", [&](const YAML::Node& n) { scene = scalar(source, n, "scene"); }},
              {"values",
               [&](const YAML::Node& n) {
                   if (!n.IsSequence() || n.size() == 0) source.refuse(n, "\"values\" must be a list of numbers");
                   for (const auto& one : n)
                       axis.values.push_back(number_in(source, one, "values", scalar(source, one, "values")));
               }},
              {"set", [&](const YAML::Node& n) { set = n; }},
              {"bounds", [&](const YAML::Node& n) { bounds = n; }},
              {"solvers",
               [&](const YAML::Node& n) {
                   of_problems = true;
                   if (!n.IsSequence() || n.size() == 0) source.refuse(n, "\"solvers\" must be a list of solvers");
                   Suite own;
                   for (const auto& one : n) read_solver_item(source, one, registry, own);
                   axis.solvers = own.solvers;
                   left_out.insert(left_out.end(), own.left_out.begin(), own.left_out.end());
               }},
              {"law",
               [&](const YAML::Node& n) {
                   of_problems = true;
                   axis.law = scalar(source, n, "law");
                   try {
                       static_cast<void>(law_of(axis.law));
                   } catch (const InputError& error) {
                       source.refuse(n, error.what());
                   }
               }},
              {"tolerance",
               [&](const YAML::Node& n) {
                   of_problems = true;
                   axis.tolerance = value<double>(source, n, "tolerance", "a positive number");
                   if (!(axis.tolerance > 0.0)) source.refuse(n, "\"tolerance\" must be positive");
               }},
              {"timesteppers",
               [&](const YAML::Node& n) {
                   of_scenes = true;
                   axis.timesteppers.clear();
                   for (const auto& text : list_of_texts(source, n, "timesteppers")) {
                       const auto [name, options] = parse_name_with_options(text, "timestepper");
                       axis.timesteppers.push_back(timestepper_text(source, n, name, options));
                   }
               }},
              {"step_solvers",
               [&](const YAML::Node& n) {
                   of_scenes = true;
                   axis.step_solvers.clear();
                   for (const auto& text : list_of_texts(source, n, "step_solvers")) {
                       try {
                           check_solver(registry, parse_solver(text));
                       } catch (const InputError& error) {
                           source.refuse(n, error.what());
                       }
                       axis.step_solvers.push_back(text);
                   }
               }},
              {"time_limit", [&](const YAML::Node& n) {
                   axis.time_limit = value<double>(source, n, "time_limit", "a time in s");
                   if (!(axis.time_limit > 0.0)) source.refuse(n, "\"time_limit\" must be positive");
               }}});
    if (axis.name.empty()) source.refuse(item, "an axis needs its \"name\"");
    if (axis.title.empty()) axis.title = axis.name;
    if (axis.values.empty()) source.refuse(item, "an axis needs its \"values\"");
    if (bounds.IsNull()) source.refuse(item, "an axis needs \"bounds\": without them no answer is correct");
    if (generator.empty() == scene.empty()) source.refuse(item, "an axis has one of \"generate\" and \"scene\"");
    if (generator.empty() && of_problems)
        source.refuse(
            item,
            "\"solvers\", \"law\" and \"tolerance\" are keys of problems; a scene has its own, and \"step_solvers\"");
    if (scene.empty() && of_scenes)
        source.refuse(item, "\"timesteppers\" and \"step_solvers\" are keys of scenes; problems have \"solvers\"");
    read_bounds(source, bounds, axis, generator.empty());

    const auto changes = set.IsNull() ? std::vector<Axis>{} : axes_of(source, set, "set");
    const bool varies = std::any_of(changes.begin(), changes.end(), [](const Axis& change) {
        return change.second.size() == 1 && change.second.front().find("$(") != std::string::npos;
    });
    if (!varies && axis.values.size() > 1)
        source.refuse(item, "nothing in \"set\" depends on the value: write $(value) where it belongs");
    for (const double value : axis.values) {
        std::map<std::string, std::string> texts;
        for (const auto& [key, choices] : changes) {
            if (choices.size() != 1)
                source.refuse(set, fmt::format("\"{}\" must be a single value; write a vector in quotes", key));
            texts[key] = filled(source, set, choices.front(), value);
        }
        if (!generator.empty()) {
            ProblemSource problem;
            problem.generator = generator;
            for (const auto& [key, text] : texts) problem.parameters[key] = number_in(source, set, key, text);
            check_generator(source, item, problem);
            axis.problems.push_back(std::move(problem));
        } else {
            SceneSource one;
            one.file = suite_path(source, scene);
            if (!std::filesystem::is_regular_file(one.file))
                source.refuse(item, fmt::format("there is no scene {}", one.file.string()));
            one.settings = texts;
            axis.scenes.push_back(std::move(one));
        }
    }
    return axis;
}

}  // namespace delassus::bench
