// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/solver_config.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "delassus/error.hpp"
#include "solver/auto_solver.hpp"
#include "solver/finished_solver.hpp"
#include "solver/name_with_options.hpp"

namespace delassus {

SolveSettings SolverConfig::settings() const {
    SolveSettings settings;
    if (tolerance) settings.tolerance = *tolerance;
    if (max_iterations) settings.max_iterations = *max_iterations;
    if (time_limit) settings.time_limit = *time_limit;
    settings.team = ThreadTeam::for_threads(threads);
    if (sweeps) {
        settings.max_iterations = *sweeps;
        settings.fixed_iterations = true;
    }
    return settings;
}

NameWithOptions parse_name_with_options(std::string_view text, std::string_view what) {
    NameWithOptions result;
    auto open = text.find('(');
    // The folders of a library's path may have brackets of their own.
    if (text.substr(0, open).find('/') != std::string_view::npos) {
        const auto end = text.find(".so(");
        open = end == std::string_view::npos ? end : end + 3;
    }
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

void choose(SolverConfig& config, std::string_view text) {
    auto [name, options] = parse_name_with_options(text, "solver");
    if (name != (config.name.empty() ? auto_name : config.name)) config.options.clear();
    config.name = std::move(name);
    for (auto& [key, value] : options) config.options.insert_or_assign(key, std::move(value));
}

PluginInfo solver_info(const Registry& registry, const std::string& name) {
    return name == auto_name ? auto_info(registry) : registry.find(name);
}

void check_solver(const Registry& registry, const SolverConfig& config) {
    if (config.sweeps && config.name == auto_name)
        throw InputError("\"sweeps\" needs the name of a solver that iterates, e.g. {name: pgs, sweeps: 20}");
    if (config.sweeps && (config.tolerance || config.max_iterations))
        throw InputError(
            "\"sweeps\" does so many iterations whatever error they leave: give no \"tolerance\" and no "
            "\"max_iterations\" beside it");
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

Solver make_solver(const Registry& registry, const SolverConfig& config, const Communicator& run) {
    std::optional<Solver> solver;
    together(run, [&] { solver = make_solver(registry, config); });
    return std::move(*solver);
}

}  // namespace delassus
