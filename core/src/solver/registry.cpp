// SPDX-License-Identifier: BSD-3-Clause
// Discovery of plugins by their sidecars, and by the entry points of Python's packages.
#include "delassus/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "delassus/error.hpp"
#include "solver/auto_solver.hpp"
#include "solver/installed_files.hpp"
#include "solver/python_solvers.hpp"
#include "solver/rejection.hpp"
#include "support/library_location.hpp"
#include "support/nearest_name.hpp"
#include "support/platform.hpp"
#include "support/text_file.hpp"

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

bool is_file(const fs::path& path) {
    std::error_code absent;
    return fs::is_regular_file(path, absent);
}

}  // namespace

/// What is found out as plugins are chosen: the solvers of Python's packages, asked for once and loaded where they are
/// chosen, and the libraries whose checksums were compared.
struct Registry::Found {
    std::mutex mutex;
    std::optional<std::vector<PluginInfo>> listed;
    std::map<std::string, std::shared_ptr<const Plugin>> loaded;
    std::set<fs::path> intact;

    void require_intact(const PluginInfo& info) {
        const std::lock_guard lock(mutex);
        if (intact.contains(info.library)) return;
        require_checksums(info);
        intact.insert(info.library);
    }
};

fs::path user_plugin_folder() {
    const auto folder_of = [](const char* variable) {  // what is not absolute does not count, says XDG
        const char* value = std::getenv(variable);
        const fs::path folder = value ? value : "";
        return folder.is_absolute() ? folder : fs::path();
    };
    if (const auto data = folder_of("XDG_DATA_HOME"); !data.empty()) return data / "delassus" / "plugins";
    if (const auto home = folder_of("HOME"); !home.empty()) return home / ".local/share" / "delassus" / "plugins";
    return {};
}

Registry::Registry(std::vector<fs::path> folders) : folders_(std::move(folders)), found_(std::make_shared<Found>()) {
    for (auto& folder : folders_of_environment()) folders_.push_back(std::move(folder));
    const auto user = user_plugin_folder();
    for (const auto& folder : folders_) scan(folder, folder == user ? PluginOrigin::User : PluginOrigin::Folder);
    if (std::error_code absent;
        std::find(folders_.begin(), folders_.end(), user) == folders_.end() && fs::is_directory(user, absent)) {
        folders_.push_back(user);
        scan(user, PluginOrigin::User);
    }
    folders_.push_back(library_directory() / "delassus" / "plugins");
    scan(folders_.back(), PluginOrigin::Delassus);
    std::sort(plugins_.begin(), plugins_.end(), [](const auto& a, const auto& b) { return a.name < b.name; });

    // Written by cmake/DelassusSummary.cmake.
    const fs::path not_built = folders_.back() / "not-built.list";
    if (std::error_code absent; !fs::exists(not_built, absent)) return;
    std::istringstream lines(read_file(not_built, most_bytes_of_text));
    for (std::string kind, name, reason;
         std::getline(lines, kind, '\t') && std::getline(lines, name, '\t') && std::getline(lines, reason);) {
        if (kind == "solver") unbuilt_.push_back({name, reason});
        if (kind == "part") missing_parts_.push_back({name, reason});
    }
}

void Registry::scan(const fs::path& folder, PluginOrigin origin) {
    // A relative folder of the environment would depend on the working directory.
    if (!folder.is_absolute()) {
        rejected_.push_back({folder, "a plugin folder must be given by an absolute path", {}});
        return;
    }
    read(folder, origin);
    for (const auto& installed : installed_plugins(folder))
        read(installed, origin == PluginOrigin::Delassus ? PluginOrigin::System : origin);
}

void Registry::read(const fs::path& folder, PluginOrigin origin) {
    std::error_code error;
    std::set<fs::path> libraries, sidecars;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".json" && entry.path().filename() != ranking_file_name)
            sidecars.insert(entry.path());
        if (entry.path().extension() == ".so") libraries.insert(entry.path());
    }
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    if (error) {
        rejected_.push_back({folder, fmt::format("cannot be read: {}", error.message()), {}});
        return;
    }
    std::vector<std::pair<fs::path, PluginInfo>> described;
    for (const auto& sidecar : sidecars) {
        try {
            described.emplace_back(sidecar, read_sidecar(sidecar));
        } catch (const PluginError& problem) {
            rejected_.push_back({sidecar, problem.what(), sidecar.stem().string()});
            libraries.erase(fs::path(sidecar).replace_extension(".so"));
        }
    }
    // Of several sidecars of one library the one with its own name counts.
    std::stable_partition(described.begin(), described.end(),
                          [](const auto& entry) { return entry.first.stem() == entry.second.library.stem(); });
    std::map<fs::path, fs::path> sidecar_of;
    for (auto& [sidecar, info] : described) {
        const auto reject = [&, &info = info](const fs::path& path, std::string reason) {
            rejected_.push_back({path, std::move(reason), info.name});
        };
        const std::string file = info.library.filename().string();
        const std::string here = this_platform();
        info.origin = origin;
        if (info.python.empty() ? !libraries.contains(info.library) : !is_file(info.library)) {
            reject(sidecar, fmt::format("its library {} is missing", file));
        } else if (const auto [other, first] = sidecar_of.emplace(info.library, sidecar); !first) {
            reject(sidecar,
                   fmt::format("its library {} has another sidecar, {}", file, other->second.filename().string()));
        } else if (!info.platform.empty() && !here.empty() && info.platform != here) {
            reject(info.library, fmt::format("built for {}; this is {}", info.platform, here));
        } else if (info.abi_major != DELASSUS_ABI_MAJOR) {
            reject(info.library, fmt::format("built for version {}.{} of the plugin interface; this is {}.{}",
                                             info.abi_major, info.abi_minor, DELASSUS_ABI_MAJOR, DELASSUS_ABI_MINOR));
        } else if (std::any_of(plugins_.begin(), plugins_.end(),
                               [&name = info.name](const PluginInfo& listed) { return listed.name == name; })) {
            reject(info.library, fmt::format("another plugin named \"{}\" comes first", info.name));
        } else {
            plugins_.push_back(std::move(info));
        }
    }
    for (const auto& library : libraries) {
        if (sidecar_of.contains(library)) continue;
        const std::string describe = fmt::format("`delassus plugins describe {} --sidecar`", library.string());
        rejected_.push_back(
            {library,
             fmt::format("it has no sidecar, by which it is listed without being loaded; {} writes one", describe),
             library.stem().string()});
    }
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
    for (const auto& row : rejected_)
        if (!row.name.empty() && (row.name == name || row.path.stem() == name))
            throw InputError(fmt::format("the plugin \"{}\" was rejected: {}", name, sentence_of(row)));
    if (const auto plugin = find_packaged(name)) return plugin->info();
    for (const auto& plugin : unbuilt_)
        if (plugin.name == name)
            throw InputError(fmt::format("the solver {} was not built here: {}", name, plugin.reason));
    std::string unsearched;
    for (const auto& row : rejected_)
        if (row.name.empty())
            unsearched += fmt::format("; the folder {} was not searched: {}", row.path.string(), row.reason);
    std::vector<std::string_view> names;
    for (const auto& plugin : plugins_) names.push_back(plugin.name);
    if (const std::lock_guard lock(found_->mutex); found_->listed)  // which then stays as it is
        for (const auto& plugin : *found_->listed) names.push_back(plugin.name);
    if (names.empty())
        throw InputError(fmt::format("there is no solver \"{}\": no plugin was found in {}{}", name,
                                     folders_.back().string(), unsearched));
    throw InputError(fmt::format("there is no solver \"{}\"{}{}", name, nearest_name_hint(name, names), unsearched));
}

std::shared_ptr<const Plugin> Registry::load(const std::string& name_or_path) const {
    if (is_library_path(name_or_path)) return Plugin::load(name_or_path);
    for (const auto& plugin : own_)
        if (plugin->info().name == name_or_path) return plugin;
    const PluginInfo& listed = find(name_or_path);
    if (listed.origin == PluginOrigin::PythonPackage) return find_packaged(name_or_path);
    found_->require_intact(listed);
    auto plugin = listed.python.empty() ? Plugin::load(listed.library) : python_solvers().load(listed);
    PluginInfo expected = listed;
    if (!listed.python.empty()) expected.abi_minor = plugin->info().abi_minor;  // the border is the host's own
    if (descriptor_text(plugin->info()) != descriptor_text(expected))
        throw PluginError(
            listed.python.empty()
                ? fmt::format("the sidecar of {} does not match it; `delassus plugins describe {} --sidecar` renews it",
                              listed.library.string(), listed.library.string())
                : fmt::format("the manifest of {} does not match it; install it again", listed.library.string()));
    return plugin;
}

std::vector<PluginInfo> Registry::packaged() const {
    {
        const std::lock_guard lock(found_->mutex);
        if (found_->listed) return *found_->listed;
    }
    auto listed = python_solvers().packaged();  // without the lock: Python has one of its own
    const std::lock_guard lock(found_->mutex);
    found_->listed = std::move(listed);
    return *found_->listed;
}

/// Null if no package brings it. Throws PluginError if it does and cannot be loaded.
std::shared_ptr<const Plugin> Registry::find_packaged(const std::string& name) const {
    {
        const std::lock_guard lock(found_->mutex);
        if (const auto found = found_->loaded.find(name); found != found_->loaded.end()) return found->second;
    }
    std::vector<PluginInfo> listed;
    try {
        listed = packaged();
    } catch (const PluginError&) {  // `delassus plugins list` says why
        return nullptr;
    }
    const auto place = std::find_if(listed.begin(), listed.end(), [&](const auto& info) { return info.name == name; });
    if (place == listed.end()) return nullptr;
    auto plugin = python_solvers().load(*place);
    if (plugin->info().name != name)
        throw PluginError(fmt::format("the entry point \"{}\" of {} leads to a solver that is named \"{}\"", name,
                                      place->installed_from, plugin->info().name));
    const std::lock_guard lock(found_->mutex);
    return found_->loaded.emplace(name, std::move(plugin)).first->second;
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
