// SPDX-License-Identifier: BSD-3-Clause
// Discovery of plugins by their sidecars.
#include "delassus/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>
#include <set>
#include <sstream>
#include <system_error>

#include "delassus/error.hpp"
#include "solver/auto_solver.hpp"
#include "support/library_location.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> folders_of_environment() {
    std::vector<fs::path> folders;
    const char* variable = std::getenv("DELASSUS_PLUGIN_PATH");
    std::istringstream text(variable ? variable : "");
    for (std::string folder; std::getline(text, folder, ':');)
        if (!folder.empty()) folders.emplace_back(folder);
    return folders;
}

}  // namespace

Registry::Registry(std::vector<fs::path> folders) : folders_(std::move(folders)) {
    for (auto& folder : folders_of_environment()) folders_.push_back(std::move(folder));
    folders_.push_back(library_directory() / "delassus" / "plugins");
    for (const auto& folder : folders_) scan(folder);
    std::sort(plugins_.begin(), plugins_.end(), [](const auto& a, const auto& b) { return a.name < b.name; });

    // Written by cmake/DelassusSummary.cmake.
    std::ifstream left_out(folders_.back() / "not-built.list");
    for (std::string kind, name, reason;
         std::getline(left_out, kind, '\t') && std::getline(left_out, name, '\t') && std::getline(left_out, reason);) {
        if (kind == "solver") unbuilt_.push_back({name, reason});
        if (kind == "part") missing_parts_.push_back({name, reason});
    }
}

void Registry::scan(const fs::path& folder) {
    std::error_code error;
    std::set<fs::path> libraries, sidecars;
    // A relative folder of the environment would depend on the working directory.
    if (!folder.is_absolute()) {
        rejected_.push_back({folder, "a plugin folder must be given by an absolute path"});
        return;
    }
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".json" && entry.path().filename() != ranking_file_name)
            sidecars.insert(entry.path());
        if (entry.path().extension() == ".so") libraries.insert(entry.path());
    }
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    if (error) {
        rejected_.push_back({folder, fmt::format("cannot be read: {}", error.message())});
        return;
    }
    for (const auto& sidecar : sidecars) {
        try {
            PluginInfo info = read_sidecar(sidecar);
            const bool listed_before = std::any_of(plugins_.begin(), plugins_.end(),
                                                   [&](const PluginInfo& other) { return other.name == info.name; });
            if (libraries.erase(info.library) == 0) {
                rejected_.push_back(
                    {sidecar, fmt::format("its library {} is missing", info.library.filename().string())});
            } else if (info.abi_major != DELASSUS_ABI_MAJOR) {
                rejected_.push_back(
                    {info.library,
                     fmt::format("built for version {}.{} of the plugin interface; this is {}.{}", info.abi_major,
                                 info.abi_minor, DELASSUS_ABI_MAJOR, DELASSUS_ABI_MINOR)});
            } else if (listed_before) {
                rejected_.push_back({info.library, fmt::format("another plugin named \"{}\" comes first", info.name)});
            } else {
                plugins_.push_back(std::move(info));
            }
        } catch (const PluginError& problem) {
            rejected_.push_back({sidecar, problem.what()});
        }
    }
    for (const auto& library : libraries)
        rejected_.push_back({library, "it has no sidecar; `delassus plugins describe FILE --sidecar` writes one"});
}

void Registry::add(std::shared_ptr<const Plugin> plugin) {
    const std::string& name = plugin->info().name;
    const auto place = std::lower_bound(plugins_.begin(), plugins_.end(), name,
                                        [](const PluginInfo& info, const std::string& key) { return info.name < key; });
    if (name == auto_name || (place != plugins_.end() && place->name == name))
        throw InputError(fmt::format("there is a solver \"{}\" already", name));
    plugins_.insert(place, plugin->info());
    own_.push_back(std::move(plugin));
}

const PluginInfo& Registry::find(const std::string& name) const {
    for (const auto& plugin : plugins_)
        if (plugin.name == name) return plugin;
    for (const auto& plugin : unbuilt_)
        if (plugin.name == name)
            throw InputError(fmt::format("the solver {} was not built here: {}", name, plugin.reason));
    std::vector<std::string_view> names;
    for (const auto& plugin : plugins_) names.push_back(plugin.name);
    if (names.empty())
        throw InputError(
            fmt::format("there is no solver \"{}\": no plugin was found in {}", name, folders_.back().string()));
    throw InputError(fmt::format("there is no solver \"{}\"{}", name, nearest_name_hint(name, names)));
}

std::shared_ptr<const Plugin> Registry::load(const std::string& name_or_path) const {
    if (is_library_path(name_or_path)) return Plugin::load(name_or_path);
    for (const auto& plugin : own_)
        if (plugin->info().name == name_or_path) return plugin;
    const PluginInfo& listed = find(name_or_path);
    auto plugin = Plugin::load(listed.library);
    if (sidecar_text(plugin->info()) != sidecar_text(listed))
        throw PluginError(
            fmt::format("the sidecar of {} does not match it; `delassus plugins describe {} --sidecar` renews it",
                        listed.library.string(), listed.library.string()));
    return plugin;
}

std::vector<std::string> Registry::capable(std::uint64_t needs) const {
    std::vector<std::string> names;
    const bool in_parts = (needs & DELASSUS_CAN_PARTITIONED) != 0;
    for (const auto& plugin : plugins_) {
        const bool made_for_parts = (plugin.capabilities & DELASSUS_CAN_PARTITIONED) != 0;
        if (plugin.missing(needs) == 0 && made_for_parts == in_parts) names.push_back(plugin.name);
    }
    return names;
}

}  // namespace delassus
