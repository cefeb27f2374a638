// SPDX-License-Identifier: BSD-3-Clause
#include "bench/suite_sections.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <sstream>

#include "config/sections.hpp"
#include "delassus/generate.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

bool is_problem(const fs::path& path) {
    const auto ending = path.extension();
    return fs::is_directory(path) ? fs::exists(path / "problem.json")
                                  : fs::is_regular_file(path) && (ending == ".hdf5" || ending == ".h5");
}

double read_number(const Source& source, const YAML::Node& node, const std::string& key, const std::string& text) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size())
        source.refuse(node, fmt::format("parameter \"{}\" is \"{}\"; it must be a number", key, text));
    return number;
}

void add_generated(const Source& source, const YAML::Node& item, const std::string& kind, const std::string& family,
                   const std::vector<Axis>& axes, Suite& suite) {
    // Problems that differ in one swept parameter are a family; the others stand in its name.
    for (const auto& values : combinations(axes)) {
        SuiteProblem problem;
        problem.source.generator = kind;
        std::string all, fixed;
        bool swept = false;
        for (const auto& [key, choices] : axes) {
            const std::string pair = fmt::format("{}={}", key, values.at(key));
            all += (all.empty() ? "" : ",") + pair;
            if (choices.size() > 1 && !swept) {
                swept = true;
            } else {
                fixed += (fixed.empty() ? "" : ",") + pair;
            }
            problem.source.parameters[key] = read_number(source, item, key, values.at(key));
        }
        problem.name = all.empty() ? kind : fmt::format("{}({})", kind, all);
        problem.family = !family.empty() ? family
                         : !swept        ? ""
                         : fixed.empty() ? kind
                                         : fmt::format("{}({})", kind, fixed);
        check_generator(source, item, problem.source);
        suite.problems.push_back(std::move(problem));
    }
}

}  // namespace

fs::path suite_path(const Source& source, const std::string& text) {
    if (text.empty() || text[0] != '$') return (source.folder() / text).lexically_normal();
    const auto slash = text.find('/');
    const char* value = std::getenv(text.substr(1, slash == std::string::npos ? slash : slash - 1).c_str());
    if (!value || !*value) return {};
    return slash == std::string::npos ? fs::path(value) : fs::path(value) / text.substr(slash + 1);
}

void check_generator(const Source& source, const YAML::Node& item, const ProblemSource& problem) {
    const auto table = generators();
    std::vector<std::string_view> names;
    for (const auto& generator : table) names.push_back(generator.name);
    const auto row = std::find_if(table.begin(), table.end(),
                                  [&](const Generator& generator) { return generator.name == problem.generator; });
    if (row == table.end())
        source.refuse(item, fmt::format("there is no generator \"{}\"{}", problem.generator,
                                        nearest_name_hint(problem.generator, names)));
    std::vector<std::string_view> keys;
    for (const auto& parameter : row->parameters) keys.push_back(parameter.key);
    for (const auto& [key, number] : problem.parameters) {
        const auto at = std::find(keys.begin(), keys.end(), key);
        if (at == keys.end())
            source.refuse(item,
                          fmt::format("{} has no parameter \"{}\"{}", row->name, key, nearest_name_hint(key, keys)));
        const auto& parameter = row->parameters[static_cast<std::size_t>(at - keys.begin())];
        if (!(number >= parameter.minimum && number <= parameter.maximum))
            source.refuse(item, fmt::format("{}: {} = {:g} lies outside its range, {:g} to {:g}", row->name, key,
                                            number, parameter.minimum, parameter.maximum));
    }
}

std::string timestepper_text(const Source& source, const YAML::Node& node, const std::string& name,
                             const OptionTexts& options) {
    const auto& table = timesteppers();
    const auto row =
        std::find_if(table.begin(), table.end(), [&](const TimestepperInfo& info) { return info.name == name; });
    std::vector<std::string_view> names;
    for (const auto& info : table) names.emplace_back(info.name);
    if (row == table.end())
        source.refuse(node, fmt::format("there is no timestepper \"{}\"{}", name, nearest_name_hint(name, names)));
    try {
        static_cast<void>(resolve_options(name, row->options, options));
    } catch (const InputError& error) {
        source.refuse(node, error.what());
    }
    SolverConfig same_form;
    same_form.name = name;
    same_form.options = options;
    return label_of(same_form);
}

void read_problem_item(const Source& source, const YAML::Node& item, Suite& suite) {
    std::string path, folder, kind, scene, name, family;
    bool optional = false;
    std::vector<Axis> axes;
    SuiteDump dump;
    if (item.IsScalar()) {
        path = item.Scalar();
    } else {
        read_map(
            source, item, "a problem of the suite",
            {{"path", [&](const YAML::Node& n) { path = scalar(source, n, "path"); }},
             {"folder", [&](const YAML::Node& n) { folder = scalar(source, n, "folder"); }},
             {"optional", [&](const YAML::Node& n) { optional = value<bool>(source, n, "optional", "true or false"); }},
             {"generate", [&](const YAML::Node& n) { kind = scalar(source, n, "generate"); }},
             {"scene", [&](const YAML::Node& n) { scene = scalar(source, n, "scene"); }},
             {"set", [&](const YAML::Node& n) { axes = axes_of(source, n, "set"); }},
             {"name", [&](const YAML::Node& n) { name = scalar(source, n, "name"); }},
             {"family", [&](const YAML::Node& n) { family = scalar(source, n, "family"); }},
             {"every",
              [&](const YAML::Node& n) {
                  dump.every = value<std::int64_t>(source, n, "every", "a number of steps");
                  if (dump.every < 1) source.refuse(n, "\"every\" must be at least 1");
              }},
             {"end", [&](const YAML::Node& n) { dump.scene.end = value<double>(source, n, "end", "a time in s"); }}});
    }
    if (is_generated_problem(path)) {  // "pile:contacts=…", as for `delassus solve`
        SuiteProblem problem;
        problem.source.generator = "pile";
        problem.name = name.empty() ? path : name;
        problem.family = family;
        const std::string rest = path.size() > 5 ? path.substr(5) : "";
        std::istringstream pairs(rest);
        for (std::string pair; std::getline(pairs, pair, ',');) {
            const auto equals = pair.find('=');
            if (equals == std::string::npos)
                source.refuse(item, fmt::format("\"{}\" in \"{}\" must be KEY=VALUE", pair, path));
            const std::string key = pair.substr(0, equals);
            problem.source.parameters[key] = read_number(source, item, key, pair.substr(equals + 1));
        }
        check_generator(source, item, problem.source);
        suite.problems.push_back(std::move(problem));
        return;
    }
    const int kinds = !path.empty() + !folder.empty() + !kind.empty() + !scene.empty();
    if (kinds != 1)
        source.refuse(item, "a problem of the suite has one of \"path\", \"folder\", \"generate\" and \"scene\"");
    if (!kind.empty()) {
        add_generated(source, item, kind, family, axes, suite);
        return;
    }
    const std::string text = !path.empty() ? path : !folder.empty() ? folder : scene;
    const fs::path file = suite_path(source, text);
    if (file.empty() || !fs::exists(file)) {
        const std::string sentence = file.empty()
                                         ? fmt::format("{} begins with an environment variable that is not set", text)
                                         : fmt::format("there is no {}", file.string());
        if (!optional) source.refuse(item, sentence);
        suite.left_out.push_back(sentence);
        return;
    }
    if (!scene.empty()) {
        dump.scene.file = file;
        for (const auto& [key, values] : axes) {
            if (values.size() != 1)
                source.refuse(item, "a scene whose problems are used must have single values in \"set\"");
            dump.scene.settings[key] = values.front();
        }
        dump.place = source.at(item);
        suite.dumps.push_back(std::move(dump));
        return;
    }
    if (!path.empty()) {
        if (!is_problem(file))
            source.refuse(item, fmt::format("{} is neither a problem folder nor an HDF5 file", file.string()));
        suite.problems.push_back({file, name, family});
        return;
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(file))
        if (is_problem(entry.path())) found.push_back(entry.path());
    if (found.empty()) source.refuse(item, fmt::format("{} holds no problem", file.string()));
    std::sort(found.begin(), found.end());
    for (const auto& one : found) suite.problems.push_back({one, {}, family});
}

void read_solver_item(const Source& source, const YAML::Node& item, const Registry& registry, Suite& suite) {
    std::vector<SolverConfig> solvers;
    if (item.IsScalar()) {
        try {
            solvers.push_back(parse_solver(item.Scalar()));
        } catch (const InputError& error) {
            source.refuse(item, error.what());
        }
    } else {
        std::vector<Axis> axes = axes_of(source, item, "solvers");
        if (!item["name"].IsDefined()) source.refuse(item, "a solver needs its \"name\"");
        const std::string name = scalar(source, item["name"], "name");
        std::erase_if(axes, [](const Axis& axis) { return axis.first == "name"; });
        for (const auto& options : combinations(axes)) {
            solvers.emplace_back();
            solvers.back().name = name;
            solvers.back().options = options;
        }
    }
    for (const auto& unbuilt : registry.unbuilt())
        if (unbuilt.name == solvers.front().name) {
            suite.left_out.push_back(fmt::format("{} was not built: {}", unbuilt.name, unbuilt.reason));
            return;
        }
    for (auto& solver : solvers) {
        try {
            check_solver(registry, solver);
        } catch (const InputError& error) {
            source.refuse(item, error.what());
        }
        if (is_library_path(solver.name)) solver.name = fs::absolute(solver.name).lexically_normal().string();
        for (const auto& other : suite.solvers)
            if (label_of(other) == label_of(solver))
                source.refuse(item, fmt::format("the solver {} is listed twice", label_of(solver)));
        suite.solvers.push_back(std::move(solver));
    }
}

}  // namespace delassus::bench
