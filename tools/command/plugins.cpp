// SPDX-License-Identifier: BSD-3-Clause
// delassus plugins list | info | check | describe; plugin_packages.cpp has install and remove
#include <fmt/format.h>

#include <algorithm>

#include "check/conformance.hpp"
#include "command.hpp"
#include "delassus/config.hpp"
#include "delassus/error.hpp"
#include "delassus/needs.hpp"
#include "delassus/sdk/cones.hpp"
#include "measuring.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "solver/installed_files.hpp"
#include "solver/rejection.hpp"
#include "support/atomic_file.hpp"
#include "support/json.hpp"
#include "support/text_file.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

struct PluginsArguments {
    std::vector<std::filesystem::path> plugin_path;
    std::string plugin;
    bool json = false, sidecar = false, checksum = false, schema = false, markdown = false;
};

/// The table solver × what it can take, for the README: one row a plugin.
void print_capability_table(const Registry& registry) {
    struct Column {
        std::string title;
        std::uint64_t bits;
    };
    std::vector<Column> columns;
    for (const sdk::ConeOperations& kind : sdk::cone_table) {
        if (kind.has_law()) {
            columns.push_back({fmt::format("{}, associated", kind.name), kind.capability() | DELASSUS_CAN_ASSOCIATED});
            columns.push_back({fmt::format("{}, Coulomb", kind.name), kind.capability() | DELASSUS_CAN_COULOMB});
        } else {
            columns.push_back({std::string(kind.name), kind.capability()});
        }
    }
    const Column others[] = {
        {"H diagonal or blocks", DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS},
        {"H sparse definite", DELASSUS_CAN_H_DEFINITE},
        {"H semidefinite", DELASSUS_CAN_H_SEMIDEFINITE},
        {"H indefinite", DELASSUS_CAN_H_INDEFINITE},
        {"H unsymmetric", DELASSUS_CAN_H_UNSYMMETRIC},
        {"reduced", DELASSUS_CAN_REDUCED},
        {"compliance E", DELASSUS_CAN_COMPLIANCE},
        {"redundant rows", DELASSUS_CAN_REDUNDANT},
        {"warm start", DELASSUS_CAN_WARM_START},
        {"MPI, whole problems", DELASSUS_CAN_DISTRIBUTED},
        {"MPI, in parts", DELASSUS_CAN_PARTITIONED},
    };
    columns.insert(columns.end(), std::begin(others), std::end(others));
    fmt::print("| solver |");
    for (const auto& column : columns) fmt::print(" {} |", column.title);
    fmt::print("\n|---|");
    for (std::size_t k = 0; k < columns.size(); ++k) fmt::print(":-:|");
    fmt::print("\n");
    for (const auto& plugin : registry.plugins()) {
        fmt::print("| [{0}](plugins/{0}/README.md) |", plugin.name);
        for (const auto& column : columns) fmt::print(" {} |", plugin.missing(column.bits) == 0 ? "●" : "");
        fmt::print("\n");
    }
}

/// A section of docs/solvers.md: what the descriptor says, as Markdown.
void print_section(const PluginInfo& plugin) {
    fmt::print("## {}\n\n{}. Licence: {}.\n\nTakes: {}.\n\n", plugin.name, plugin.description, plugin.licence,
               fmt::join(capability_names(plugin.capabilities), ", "));
    if (plugin.options.empty()) return;
    fmt::print("| option | default | value | |\n|---|---|---|---|\n");
    for (const auto& option : plugin.options)
        fmt::print("| `{}` | `{}` | {}{}{} | {} |\n", option.key, option.default_value, option.domain(),
                   option.unit.empty() ? "" : ", ", option.unit, option.doc);
    fmt::print("\n");
}

/// What `plugins list` shows.
struct Listing {
    std::vector<PluginInfo> plugins;
    std::vector<RejectedPlugin> rejected;

    explicit Listing(const Registry& registry) : rejected(registry.rejected()) {
        for (const auto& plugin : registry.plugins()) take(plugin);
        try {
            for (const auto& plugin : registry.packaged()) {
                const auto same = [&](const PluginInfo& other) { return other.name == plugin.name; };
                if (std::none_of(plugins.begin(), plugins.end(), same)) {
                    plugins.push_back(plugin);
                } else {
                    rejected.push_back({plugin.installed_from, "another plugin of this name comes first", plugin.name});
                }
            }
        } catch (const PluginError& error) {
            rejected.push_back({"entry points of Python", error.what(), {}});
        }
        std::sort(plugins.begin(), plugins.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    }

private:
    /// A file that changed since it was installed is found here, and where the plugin is loaded.
    void take(const PluginInfo& plugin) {
        try {
            require_checksums(plugin);
            plugins.push_back(plugin);
        } catch (const Error& error) {
            rejected.push_back({plugin.library, error.what(), plugin.name});
        }
    }
};

std::string where_from(const PluginInfo& plugin) {
    switch (plugin.origin) {
        case PluginOrigin::User:
            return fmt::format("installed for this user{}", plugin.python.empty() ? "" : ", Python");
        case PluginOrigin::System:
            return fmt::format("installed for all{}", plugin.python.empty() ? "" : ", Python");
        case PluginOrigin::Folder:
            return plugin.library.parent_path().string();
        case PluginOrigin::PythonPackage:
            return fmt::format("Python package {}", plugin.installed_from);
        default:
            return {};
    }
}

Json json_of(const Listing& listing, const Registry& registry) {
    Json json = {{"plugins", Json::array()},
                 {"rejected", Json::array()},
                 {"not_built", Json::array()},
                 {"left_out", Json::array()}};
    for (const auto& plugin : listing.plugins) {
        Json row = parse_ordered_json(sidecar_text(plugin));
        row["path"] = plugin.library.string();
        row["origin"] = name_of(plugin.origin);
        json["plugins"].push_back(std::move(row));
    }
    for (const auto& row : listing.rejected)
        json["rejected"].push_back({{"name", row.name}, {"path", row.path.string()}, {"reason", row.reason}});
    for (const auto& row : registry.unbuilt())
        json["not_built"].push_back({{"name", row.name}, {"reason", row.reason}});
    for (const auto& row : registry.missing_parts())
        json["left_out"].push_back({{"name", row.name}, {"reason", row.reason}});
    return json;
}

void print_row(const PluginInfo& plugin) {
    const std::string where = where_from(plugin);
    fmt::print("{:<10} {:<8} {}{}{}\n", plugin.name, plugin.version, plugin.description,
               where.empty() ? "" : fmt::format(" [{}]", where),
               plugin.build == DELASSUS_BUILD_UNOPTIMIZED ? " [built without optimisation]" : "");
}

int list(const PluginsArguments& arguments) {
    const Registry registry(absolute(arguments.plugin_path));
    if (arguments.markdown) {
        print_capability_table(registry);
        return exit_solved;
    }
    const Listing listing(registry);
    if (arguments.json) {
        fmt::print("{}\n", json_text(json_of(listing, registry), 2));
        return exit_solved;
    }
    for (const auto& plugin : listing.plugins) print_row(plugin);
    if (!registry.plugins().empty()) print_row(solver_info(registry, "auto"));
    if (registry.plugins().empty()) fmt::print("no plugins were found in {}\n", registry.folders().back().string());
    if (!registry.unbuilt().empty()) fmt::print("\nNot built here:\n");
    for (const auto& row : registry.unbuilt()) fmt::print("{:<10} {}\n", row.name, row.reason);
    if (!registry.missing_parts().empty()) fmt::print("\nLeft out here:\n");
    for (const auto& row : registry.missing_parts()) fmt::print("{}\n", row.reason);
    if (!listing.rejected.empty()) fmt::print("\nRejected:\n");
    for (const auto& row : listing.rejected) fmt::print("{}\n", sentence_of(row));
    return exit_solved;
}

/// Loads a library that may crash or print.
PluginInfo info_of_library(const std::string& library) {
    const StdoutGuard guard;
    return Plugin::load(library)->info();
}

PluginInfo info_of(const PluginsArguments& arguments) {
    if (is_library_path(arguments.plugin)) return info_of_library(arguments.plugin);
    PluginInfo plugin = solver_info(Registry(absolute(arguments.plugin_path)), arguments.plugin);
    require_checksums(plugin);
    return plugin;
}

int info(const PluginsArguments& arguments) {
    const PluginInfo plugin = info_of(arguments);
    if (arguments.schema) {
        fmt::print("{}", options_schema(plugin.name, plugin.options));
        return exit_solved;
    }
    if (arguments.markdown) {
        print_section(plugin);
        return exit_solved;
    }
    if (arguments.json) {
        fmt::print("{}", sidecar_text(plugin));
        return exit_solved;
    }
    fmt::print("{} {}: {}\n", plugin.name, plugin.version, plugin.description);
    if (!plugin.library.empty()) fmt::print("library  {}\n", plugin.library.string());
    if (!plugin.python.empty()) fmt::print("Python   {}\n", plugin.python);
    if (const auto where = where_from(plugin); !where.empty()) fmt::print("origin   {}\n", where);
    if (!plugin.platform.empty()) fmt::print("platform {}\n", plugin.platform);
    if (plugin.build != DELASSUS_BUILD_UNKNOWN)
        fmt::print("build    {}\n", plugin.build == DELASSUS_BUILD_OPTIMIZED ? "with optimisation" : unoptimized_build);
    fmt::print("licence  {}\ncan      {}\n", plugin.licence, fmt::join(capability_names(plugin.capabilities), " "));
    if (!plugin.options.empty()) fmt::print("options\n");
    for (const auto& option : plugin.options)
        fmt::print("  {}={}\n      {} ({}{}{})\n", option.key, option.default_value, option.doc, option.domain(),
                   option.unit.empty() ? "" : ", in ", option.unit);
    return exit_solved;
}

/// The library to check, by its path or its name.
std::filesystem::path library_of(const PluginsArguments& arguments) {
    if (is_library_path(arguments.plugin)) return arguments.plugin;
    const Registry registry(absolute(arguments.plugin_path));
    const PluginInfo& plugin = registry.find(arguments.plugin);
    if (!plugin.python.empty())
        throw InputError(
            fmt::format("the solver {} is written in Python; the conformance suite runs over shared "
                        "libraries",
                        plugin.name));
    return plugin.library;
}

int check(const PluginsArguments& arguments) {
    const std::filesystem::path library = library_of(arguments);
    const auto report = check::run_conformance(std::filesystem::absolute(library));
    if (arguments.json) {
        fmt::print("{}", check::to_json(report));
    } else {
        check::print(report);
    }
    return report.passed() ? exit_solved : exit_not_converged;
}

int describe(const PluginsArguments& arguments) {
    PluginInfo info = info_of_library(arguments.plugin);
    if (arguments.checksum) info.checksums[info.library.filename().string()] = checksum_of_file(info.library);
    const auto text = sidecar_text(info);
    if (arguments.sidecar) {
        const std::filesystem::path file = std::filesystem::path(info.library).replace_extension(".json");
        const Json old =
            std::filesystem::exists(file) ? try_parse_ordered_json(read_file(file)) : parse_ordered_json(text);
        if (!old.is_object() || old.value("format", Json()) != parse_ordered_json(text).at("format"))
            throw InputError(
                fmt::format("{} exists and is no sidecar; remove it or give the library another name", file.string()));
        write_file_atomically(file, text);
    } else {
        fmt::print("{}", text);
    }
    if (info.build == DELASSUS_BUILD_UNOPTIMIZED) warn_of_unoptimized(info.name);
    return exit_solved;
}

}  // namespace

void add_plugins(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<PluginsArguments>();
    auto* plugins = program.add_subcommand("plugins", "List, describe, check, install and remove solver plugins");
    plugins->require_subcommand(1);
    const auto on_call = [&action, arguments](int (*run)(const PluginsArguments&)) {
        return [&action, arguments, run] { action.run = [arguments, run] { return run(*arguments); }; };
    };

    auto* list_command =
        plugins->add_subcommand("list", "List the plugins that can be chosen by name, and those rejected");
    add_plugin_path(*list_command, arguments->plugin_path);
    list_command->add_flag("--json", arguments->json, "Print JSON");
    list_command->add_flag("--markdown", arguments->markdown,
                           "Print a Markdown table of the solvers and what they can take");
    list_command->callback(on_call(list));

    auto* info_command = plugins->add_subcommand("info", "Show what a plugin can take, and its options");
    info_command->add_option("plugin", arguments->plugin, "Name of a plugin, or path of a shared library")
        ->required()
        ->type_name("NAME|LIB");
    add_plugin_path(*info_command, arguments->plugin_path);
    info_command->add_flag("--json", arguments->json, "Print JSON");
    info_command->add_flag("--schema", arguments->schema, "Print the JSON Schema of its options");
    info_command->add_flag("--markdown", arguments->markdown, "Print a section of the documentation as Markdown");
    info_command->callback(on_call(info));

    auto* check_command = plugins->add_subcommand("check", "Run the conformance suite over a plugin");
    check_command->add_option("plugin", arguments->plugin, "Name of a plugin, or path of a shared library")
        ->required()
        ->type_name("NAME|LIB");
    add_plugin_path(*check_command, arguments->plugin_path);
    check_command->add_flag("--json", arguments->json, "Print JSON");
    check_command->callback(on_call(check));

    auto* describe_command =
        plugins->add_subcommand("describe", "Print the sidecar of a shared library, or write it beside it");
    describe_command->add_option("plugin", arguments->plugin, "Path of a shared library")->required()->type_name("LIB");
    describe_command->add_flag("--sidecar", arguments->sidecar, "Write it beside the library");
    describe_command->add_flag("--checksum", arguments->checksum,
                               "With the checksum of the library, for handing both on");
    describe_command->callback(on_call(describe));
    add_plugin_packages(*plugins, action);
}

}  // namespace delassus::command
