// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/config.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <sstream>

#include "config/sections.hpp"
#include "delassus/error.hpp"
#include "solver/auto_solver.hpp"
#include "solver/finished_solver.hpp"

namespace delassus {

OptionTexts read_options(const Source& source, const YAML::Node& node) {
    OptionTexts options;
    if (node.IsNull()) return options;
    if (!node.IsMap()) source.refuse(node, "\"options\" must be a map of keys to values");
    for (const auto& entry : node) {
        const auto key = scalar(source, entry.first, "key");
        options[key] = scalar(source, entry.second, key);
    }
    return options;
}

SolverConfig read_solver(const Source& source, const YAML::Node& node) {
    SolverConfig solver;
    if (node.IsScalar()) {  // solver: pgs
        solver.name = node.Scalar();
        return solver;
    }
    read_map(source, node, "\"solver\"",
             {{"name", [&](const YAML::Node& n) { solver.name = scalar(source, n, "name"); }},
              {"options", [&](const YAML::Node& n) { solver.options = read_options(source, n); }},
              {"tolerance",
               [&](const YAML::Node& n) { solver.tolerance = value<double>(source, n, "tolerance", "a number"); }},
              {"max_iterations",
               [&](const YAML::Node& n) {
                   solver.max_iterations = value<std::int64_t>(source, n, "max_iterations", "an integer");
               }},
              {"time_limit",
               [&](const YAML::Node& n) {
                   solver.time_limit = value<double>(source, n, "time_limit", "a number of seconds");
               }},
              {"law", [&](const YAML::Node& n) {
                   try {
                       solver.law = law_of(scalar(source, n, "law"));
                   } catch (const InputError& error) {
                       source.refuse(n, error.what());
                   }
               }}});
    return solver;
}

SolveSettings SolverConfig::settings() const {
    SolveSettings settings;
    if (tolerance) settings.tolerance = *tolerance;
    if (max_iterations) settings.max_iterations = *max_iterations;
    if (time_limit) settings.time_limit = *time_limit;
    return settings;
}

Config parse_config(const std::string& yaml, std::string_view where) {
    const Source source(where);
    Config config;
    try {
        const YAML::Node root = YAML::Load(yaml);
        if (root.IsNull()) throw InputError(fmt::format("{} is empty; it must at least hold \"solver:\"", where));
        read_map(source, root, "the configuration",
                 {{"solver", [&](const YAML::Node& n) { config.solver = read_solver(source, n); }},
                  {"plugin_path", [&](const YAML::Node& n) {
                       if (!n.IsSequence()) source.refuse(n, "\"plugin_path\" must be a list of folders");
                       for (const auto& folder : n)
                           config.plugin_path.emplace_back(scalar(source, folder, "plugin_path"));
                   }}});
    } catch (const YAML::Exception& error) {
        throw InputError(fmt::format("{}: not valid YAML: {}", source.at(error.mark), error.msg));
    }
    return config;
}

Config read_config(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::ostringstream text;
    text << stream.rdbuf();
    if (!stream || !std::filesystem::is_regular_file(file))
        throw InputError(fmt::format("cannot read the configuration {}", file.string()));
    Config config = parse_config(text.str(), file.string());
    for (auto& folder : config.plugin_path) folder = std::filesystem::absolute(file).parent_path() / folder;
    return config;
}

NameWithOptions parse_name_with_options(std::string_view text, std::string_view what) {
    NameWithOptions result;
    const auto open = text.find('(');
    result.name = text.substr(0, open);
    if (result.name.empty()) throw InputError(fmt::format("\"{}\" names no {}", text, what));
    if (open == std::string_view::npos) return result;
    if (text.back() != ')') throw InputError(fmt::format("\"{}\" lacks its closing bracket", text));
    std::string_view rest = text.substr(open + 1, text.size() - open - 2);
    while (!rest.empty()) {
        const auto comma = rest.find(',');
        const auto pair = rest.substr(0, comma);
        const auto equals = pair.find('=');
        if (equals == std::string_view::npos || equals == 0)
            throw InputError(fmt::format("\"{}\" in \"{}\" is not of the form key=value", pair, text));
        result.options[std::string(pair.substr(0, equals))] = pair.substr(equals + 1);
        rest = comma == std::string_view::npos ? std::string_view{} : rest.substr(comma + 1);
    }
    return result;
}

SolverConfig parse_solver(std::string_view text) {
    auto [name, options] = parse_name_with_options(text, "solver");
    SolverConfig solver;
    solver.name = std::move(name);
    solver.options = std::move(options);
    return solver;
}

PluginInfo solver_info(const Registry& registry, const std::string& name) {
    return name == auto_name ? auto_info(registry) : registry.find(name);
}

void check_solver(const Registry& registry, const SolverConfig& config) {
    OptionTexts options = config.options;
    const FinishOptions finish = take_finish(options);
    if (!finish.solver.empty()) check_solver(registry, parse_solver(finish.solver));
    if (is_library_path(config.name)) {
        if (!std::filesystem::is_regular_file(config.name))
            throw InputError(fmt::format("there is no plugin {}", config.name));
        return;
    }
    const PluginInfo info = solver_info(registry, config.name);
    static_cast<void>(resolve_options(info.name, info.options, options));
}

Solver make_solver(const Registry& registry, const SolverConfig& config) {
    if (config.name.empty()) throw InputError("no solver was named");
    OptionTexts options = config.options;
    const FinishOptions finish = take_finish(options);
    const auto make_one = [&](const std::string& name, OptionTexts chosen) {
        return name == auto_name ? make_auto(registry, std::move(chosen))
                                 : Solver(registry.load(name), std::move(chosen), &registry);
    };
    Solver main = make_one(config.name, std::move(options));
    if (finish.solver.empty()) return main;
    const SolverConfig last = parse_solver(finish.solver);
    return make_finished(std::move(main), make_one(last.name, last.options), finish.tolerance, config.options);
}

}  // namespace delassus
