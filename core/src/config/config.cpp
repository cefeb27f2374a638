// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/config.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "config/sections.hpp"
#include "delassus/error.hpp"
#include "solver/judgement.hpp"
#include "support/text_file.hpp"

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
    const auto named = [&](const YAML::Node& n, const std::string& text) {
        if (text.empty()) return SolverConfig{};
        try {
            return parse_solver(text);
        } catch (const InputError& error) {
            source.refuse(n, error.what());
        }
    };
    if (node.IsScalar()) return named(node, node.Scalar());  // solver: pgs, solver: pgs(omega=1.2)
    OptionTexts of_name;
    read_map(source, node, "\"solver\"",
             {{"name",
               [&](const YAML::Node& n) {
                   const SolverConfig chosen = named(n, scalar(source, n, "name"));
                   solver.name = chosen.name;
                   of_name = chosen.options;
               }},
              {"options", [&](const YAML::Node& n) { solver.options = read_options(source, n); }},
              {"tolerance",
               [&](const YAML::Node& n) { solver.tolerance = value<double>(source, n, "tolerance", "a number"); }},
              {"max_iterations",
               [&](const YAML::Node& n) {
                   solver.max_iterations = value<std::int64_t>(source, n, "max_iterations", "an integer");
               }},
              {"sweeps",
               [&](const YAML::Node& n) {
                   solver.sweeps = value<std::int64_t>(source, n, "sweeps", "an integer");
                   if (*solver.sweeps < 1) source.refuse(n, "\"sweeps\" must be at least 1");
               }},
              {"time_limit",
               [&](const YAML::Node& n) {
                   solver.time_limit = value<double>(source, n, "time_limit", "a number of seconds");
               }},
              {"threads",
               [&](const YAML::Node& n) {
                   solver.threads = value<std::int64_t>(source, n, "threads", "an integer");
                   if (*solver.threads < 1) source.refuse(n, "\"threads\" must be at least 1");
               }},
              {"law", [&](const YAML::Node& n) {
                   try {
                       solver.law = law_of(scalar(source, n, "law"));
                   } catch (const InputError& error) {
                       source.refuse(n, error.what());
                   }
               }}});
    solver.options.merge(of_name);  // a key of "options" counts
    try {
        check_settings(solver.settings());
    } catch (const InputError& error) {
        source.refuse(node, error.what());
    }
    return solver;
}

Config parse_config(const std::string& yaml, std::string_view where) {
    const Source source(where);
    Config config;
    try {
        const YAML::Node root = load_document(source, yaml);
        if (root.IsNull()) throw InputError(fmt::format("{} is empty; it must at least hold \"solver:\"", where));
        read_map(source, root, "the configuration",
                 {{"solver",
                   [&](const YAML::Node& n) {
                       config.solver = read_solver(source, n);
                       if (config.solver.sweeps) source.refuse(n, "\"sweeps\" is for the solvers of scenes");
                   }},
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
    Config config = parse_config(read_file(file, most_bytes_of_text), file.string());
    for (auto& folder : config.plugin_path) folder = std::filesystem::absolute(file).parent_path() / folder;
    return config;
}

}  // namespace delassus
