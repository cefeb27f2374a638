// SPDX-License-Identifier: BSD-3-Clause
#include "bench/suite.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "bench/suite_sections.hpp"
#include "config/sections.hpp"
#include "solver/name_with_options.hpp"
#include "support/library_location.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

double positive(const Source& source, const YAML::Node& node, std::string_view key) {
    const double number = value<double>(source, node, key, "a positive number");
    if (!(number > 0.0) || !std::isfinite(number))
        source.refuse(node, fmt::format("\"{}\" is {}; it must be positive and finite", key, node.Scalar()));
    return number;
}

std::vector<double> positive_list(const Source& source, const YAML::Node& node, std::string_view key) {
    if (node.IsScalar()) return {positive(source, node, key)};
    if (!node.IsSequence() || node.size() == 0)
        source.refuse(node, fmt::format("\"{}\" must be a number or a list of numbers", key));
    std::vector<double> numbers;
    for (const auto& item : node) numbers.push_back(positive(source, item, key));
    return numbers;
}

std::vector<int> process_counts(const Source& source, const YAML::Node& node) {
    constexpr int most = 4096;
    std::vector<int> counts;
    const auto add = [&](const YAML::Node& item) {
        const int count = value<int>(source, item, "processes", "a whole number");
        if (count < 1 || count > most)
            source.refuse(item, fmt::format("\"processes\" must lie between 1 and {}", most));
        counts.push_back(count);
    };
    if (node.IsScalar()) {
        add(node);
    } else {
        if (!node.IsSequence() || node.size() == 0)
            source.refuse(node, "\"processes\" must be a whole number or a list of whole numbers");
        for (const auto& item : node) add(item);
    }
    std::sort(counts.begin(), counts.end());
    if (std::adjacent_find(counts.begin(), counts.end()) != counts.end())
        source.refuse(node, "a number of \"processes\" is listed twice");
    return counts;
}

void each(const Source& source, const YAML::Node& list, std::string_view key, const Handler& handler) {
    if (!list.IsSequence()) source.refuse(list, fmt::format("\"{}\" must be a list", key));
    for (const auto& item : list) handler(item);
}

std::vector<std::string> texts(const Source& source, const YAML::Node& node, const std::string& key) {
    return values_of(source, node, key);
}

std::vector<SuiteTimestepper> read_timesteppers(const Source& source, const YAML::Node& list) {
    std::vector<SuiteTimestepper> result;
    each(source, list, "timesteppers", [&](const YAML::Node& item) {
        if (item.IsScalar()) {
            const auto [name, options] = parse_name_with_options(item.Scalar(), "timestepper");
            result.push_back({timestepper_text(source, item, name, options), {}});
            return;
        }
        std::vector<Axis> axes = axes_of(source, item, "timesteppers");
        std::string name;
        std::vector<double> steps;
        if (const auto node = item["name"]; node.IsDefined()) name = scalar(source, node, "name");
        if (name.empty()) source.refuse(item, "a timestepper needs its \"name\"");
        if (const auto node = item["steps"]; node.IsDefined()) steps = positive_list(source, node, "steps");
        std::erase_if(axes, [](const Axis& axis) { return axis.first == "name" || axis.first == "steps"; });
        for (const auto& options : combinations(axes))
            result.push_back({timestepper_text(source, item, name, options), steps});
    });
    return result;
}

void read_references(const Source& source, const YAML::Node& node, SuiteReferences& references) {
    if (node.IsScalar()) {
        if (node.Scalar() != "none") source.refuse(node, "\"references\" must be \"none\" or a map of keys to values");
        references.solvers.clear();
        return;
    }
    read_map(source, node, "\"references\"",
             {{"solvers", [&](const YAML::Node& n) { references.solvers = texts(source, n, "solvers"); }},
              {"confirm", [&](const YAML::Node& n) { references.confirm = texts(source, n, "confirm"); }},
              {"timestepper",
               [&](const YAML::Node& n) {
                   const auto [name, options] =
                       parse_name_with_options(scalar(source, n, "timestepper"), "timestepper");
                   references.timestepper = timestepper_text(source, n, name, options);
               }},
              {"step_fraction",
               [&](const YAML::Node& n) {
                   references.step_fraction = positive(source, n, "step_fraction");
                   if (references.step_fraction >= 1.0) source.refuse(n, "\"step_fraction\" must be below 1");
               }},
              {"time_limit", [&](const YAML::Node& n) { references.time_limit = positive(source, n, "time_limit"); }}});
}

/// timesteppers: whether the scene is for comparing them, and has keys for that.
SuiteScene read_scene_item(const Source& source, const YAML::Node& item, bool timesteppers) {
    SuiteScene scene;
    if (item.IsScalar()) {
        scene.source.file = suite_path(source, item.Scalar());
    } else {
        std::vector<std::pair<std::string_view, Handler>> keys = {
            {"path", [&](const YAML::Node& n) { scene.source.file = suite_path(source, scalar(source, n, "path")); }},
            {"name", [&](const YAML::Node& n) { scene.name = scalar(source, n, "name"); }},
            {"set", [&](const YAML::Node& n) { scene.source.settings = read_options(source, n); }},
            {"end", [&](const YAML::Node& n) { scene.source.end = positive(source, n, "end"); }}};
        if (timesteppers) {
            keys.emplace_back("steps", [&](const YAML::Node& n) { scene.steps = positive_list(source, n, "steps"); });
            keys.emplace_back("timesteppers",
                              [&](const YAML::Node& n) { scene.timesteppers = read_timesteppers(source, n); });
            keys.emplace_back("reference", [&](const YAML::Node& n) {
                read_map(source, n, "\"reference\"",
                         {{"timestepper",
                           [&](const YAML::Node& t) {
                               const auto [name, options] =
                                   parse_name_with_options(scalar(source, t, "timestepper"), "timestepper");
                               scene.reference_timestepper = timestepper_text(source, t, name, options);
                           }},
                          {"step", [&](const YAML::Node& t) { scene.reference_step = positive(source, t, "step"); }}});
            });
        }
        read_map(source, item, "a scene of the suite", keys);
    }
    if (scene.source.file.empty()) source.refuse(item, "a scene of the suite needs its \"path\"");
    if (!fs::is_regular_file(scene.source.file))
        source.refuse(item, fmt::format("there is no scene {}", scene.source.file.string()));
    if (scene.name.empty()) scene.name = scene.source.file.stem().string();
    return scene;
}

std::string law_text(const Source& source, const YAML::Node& node) {
    const std::string text = scalar(source, node, "laws");
    if (text == "own") return {};
    try {
        static_cast<void>(law_of(text));
    } catch (const InputError& error) {
        source.refuse(node, fmt::format("{}, or \"own\" for each problem's", error.what()));
    }
    return text;
}

/// Files with the solvers of references; the first of the plugin folders that has one counts, as with the other lists.
void default_references(const Registry& registry, SuiteReferences& references) {
    for (const auto& folder : registry.folders()) {
        if (!fs::exists(folder / "references.txt")) continue;
        std::string line;
        for (const char c : read_file(folder / "references.txt") + "\n") {
            if (c != '\n') {
                line += c;
                continue;
            }
            if (!line.empty() && line[0] != '#') references.confirm.push_back(line);
            line.clear();
        }
        return;
    }
}

}  // namespace

Suite read_suite(const fs::path& file, const Registry& registry) {
    Suite suite;
    suite.file = file;
    suite.text = read_file(file);
    suite.references.solvers = {"auto"};
    default_references(registry, suite.references);
    const Source source(file.string());
    bool solvers_given = false;
    try {
        const YAML::Node root = load_document(source, suite.text);
        if (root.IsNull()) throw InputError(fmt::format("{} is empty; a suite has problems or scenes", file.string()));
        read_map(
            source, root, "a suite",
            {{"title", [&](const YAML::Node& n) { suite.title = scalar(source, n, "title"); }},
             {"description", [&](const YAML::Node& n) { suite.description = scalar(source, n, "description"); }},
             {"problems",
              [&](const YAML::Node& n) {
                  each(source, n, "problems", [&](const YAML::Node& item) { read_problem_item(source, item, suite); });
              }},
             {"solvers",
              [&](const YAML::Node& n) {
                  solvers_given = true;
                  each(source, n, "solvers",
                       [&](const YAML::Node& item) { read_solver_item(source, item, registry, suite); });
              }},
             {"laws",
              [&](const YAML::Node& n) {
                  suite.laws.clear();
                  if (n.IsScalar()) {
                      suite.laws.push_back(law_text(source, n));
                  } else {
                      each(source, n, "laws", [&](const YAML::Node& l) { suite.laws.push_back(law_text(source, l)); });
                  }
              }},
             {"tolerances",
              [&](const YAML::Node& n) {
                  auto& tolerances = suite.tolerances = positive_list(source, n, "tolerances");
                  std::sort(tolerances.rbegin(), tolerances.rend());
                  tolerances.erase(std::unique(tolerances.begin(), tolerances.end()), tolerances.end());
              }},
             {"processes", [&](const YAML::Node& n) { suite.processes = process_counts(source, n); }},
             {"skip_after_failure",
              [&](const YAML::Node& n) {
                  suite.skip_after_failure = value<bool>(source, n, "skip_after_failure", "true or false");
              }},
             {"scenes",
              [&](const YAML::Node& n) {
                  each(source, n, "scenes",
                       [&](const YAML::Node& item) { suite.scenes.push_back(read_scene_item(source, item, true)); });
              }},
             {"leaving_out",
              [&](const YAML::Node& n) {
                  each(source, n, "leaving_out", [&](const YAML::Node& item) {
                      suite.leaving_out.push_back(read_scene_item(source, item, false));
                  });
              }},
             {"timesteppers", [&](const YAML::Node& n) { suite.timesteppers = read_timesteppers(source, n); }},
             {"steps", [&](const YAML::Node& n) { suite.steps = positive_list(source, n, "steps"); }},
             {"step_solvers",
              [&](const YAML::Node& n) {
                  suite.step_solvers.clear();
                  each(source, n, "step_solvers", [&](const YAML::Node& item) {
                      const std::string text = scalar(source, item, "step_solvers");
                      try {
                          check_solver(registry, parse_solver(text));
                      } catch (const InputError& error) {
                          source.refuse(item, error.what());
                      }
                      suite.step_solvers.push_back(text);
                  });
              }},
             {"axes",
              [&](const YAML::Node& n) {
                  each(source, n, "axes", [&](const YAML::Node& item) {
                      suite.axes.push_back(read_axis(source, item, registry, suite.left_out));
                      for (const auto& axis : suite.axes)
                          if (&axis != &suite.axes.back() && axis.name == suite.axes.back().name)
                              source.refuse(item, fmt::format("the axis \"{}\" is listed twice", axis.name));
                  });
              }},
             {"references", [&](const YAML::Node& n) { read_references(source, n, suite.references); }},
             {"repeats",
              [&](const YAML::Node& n) {
                  suite.repeats = value<int>(source, n, "repeats", "a whole number");
                  if (suite.repeats < 1) source.refuse(n, "\"repeats\" must be at least 1");
              }},
             {"time_limit", [&](const YAML::Node& n) { suite.time_limit = positive(source, n, "time_limit"); }},
             {"memory_limit", [&](const YAML::Node& n) { suite.memory_limit = positive(source, n, "memory_limit"); }},
             {"max_iterations", [&](const YAML::Node& n) {
                  suite.max_iterations = value<std::int64_t>(source, n, "max_iterations", "a whole number");
                  if (suite.max_iterations < 0) source.refuse(n, "\"max_iterations\" must not be negative");
              }}});
        if (suite.problems.empty() && suite.dumps.empty() && suite.scenes.empty() && suite.axes.empty() &&
            suite.leaving_out.empty() && suite.left_out.empty())
            throw InputError(
                fmt::format("{} has neither problems nor scenes nor axes: there is nothing to run", file.string()));
    } catch (const YAML::Exception& error) {
        throw InputError(fmt::format("{}: not valid YAML: {}", source.at(error.mark), error.msg));
    }
    if (!solvers_given)
        for (const auto& plugin : registry.plugins()) {
            suite.solvers.emplace_back();
            suite.solvers.back().name = plugin.name;
        }
    for (auto& axis : suite.axes) {
        if (axis.solvers.empty()) axis.solvers = suite.solvers;
        if (!(axis.time_limit > 0.0)) axis.time_limit = suite.time_limit;
    }
    return suite;
}

void keep_axes(Suite& suite, const std::vector<std::string>& names) {
    std::vector<std::string_view> known;
    for (const auto& axis : suite.axes) known.emplace_back(axis.name);
    for (const auto& name : names)
        if (std::find(known.begin(), known.end(), name) == known.end())
            throw InputError(
                fmt::format("{} has no axis \"{}\"{}", suite.file.string(), name, nearest_name_hint(name, known)));
    std::erase_if(suite.axes, [&](const SuiteAxis& axis) {
        return std::find(names.begin(), names.end(), axis.name) == names.end();
    });
    suite.problems.clear();
    suite.dumps.clear();
    suite.scenes.clear();
    suite.leaving_out.clear();
}

fs::path suite_folder() {
    return library_directory() / "delassus" / "examples" / "suites";
}

std::vector<ShippedSuite> shipped_suites(const Registry& registry) {
    std::vector<ShippedSuite> suites;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(suite_folder(), ignored)) {
        if (entry.path().extension() != ".yaml") continue;
        ShippedSuite suite{entry.path().stem().string(), {}, {}, entry.path()};
        try {
            const Suite read = read_suite(entry.path(), registry);
            suite.title = read.title;
            suite.description = read.description;
        } catch (const InputError& error) {
            suite.description = error.what();
        }
        suites.push_back(std::move(suite));
    }
    std::sort(suites.begin(), suites.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return suites;
}

fs::path find_suite(const std::string& name_or_path) {
    if (fs::is_regular_file(name_or_path)) return name_or_path;
    std::vector<std::string> names;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(suite_folder(), ignored))
        if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
    if (std::find(names.begin(), names.end(), name_or_path) != names.end())
        return fs::weakly_canonical(suite_folder() / (name_or_path + ".yaml"));
    std::sort(names.begin(), names.end());
    const std::vector<std::string_view> views(names.begin(), names.end());
    throw InputError(fmt::format(
        "there is no suite {}: no such file{}", name_or_path,
        names.empty() ? "" : ", and of those that come with the library" + nearest_name_hint(name_or_path, views)));
}

}  // namespace delassus::bench
