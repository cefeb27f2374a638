// SPDX-License-Identifier: BSD-3-Clause
// Finding and loading plugins.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/plugin_info.hpp"

namespace delassus {

/// A loaded plugin. The library stays loaded until the process ends: PETSc and MPI are not safe to unload.
class Plugin {
public:
    /// Loads the shared library at this path (made absolute) and checks its handshake. Throws PluginError.
    [[nodiscard]] DELASSUS_API static std::shared_ptr<const Plugin> load(const std::filesystem::path& library);

    /// A solver that the program itself brings. What the descriptor points at lasts as long as the process. Throws
    /// PluginError if its handshake fails.
    [[nodiscard]] DELASSUS_API static std::shared_ptr<const Plugin> of(const delassus_plugin_descriptor& descriptor);
    /// The same of a plugin that was found: info() says where, as `found` does.
    [[nodiscard]] DELASSUS_API static std::shared_ptr<const Plugin> of(const delassus_plugin_descriptor& descriptor,
                                                                       const PluginInfo& found);

    [[nodiscard]] const PluginInfo& info() const { return info_; }
    /// A copy; fields that the plugin's version of the border does not have are zero.
    [[nodiscard]] const delassus_plugin_descriptor& descriptor() const { return descriptor_; }

private:
    Plugin() = default;
    PluginInfo info_;
    delassus_plugin_descriptor descriptor_{};
};

/// The names of the plugins that were loaded so far from libraries built without optimisation: their times say little.
[[nodiscard]] DELASSUS_API std::vector<std::string> unoptimized_plugins();

/// Whether a solver's name is the path of a shared library: it has a slash or ends in .so.
[[nodiscard]] inline bool is_library_path(std::string_view name) {
    return name.find('/') != std::string_view::npos || name.ends_with(".so");
}

/// A plugin, or a file meant to be one, that cannot be used.
struct RejectedPlugin {
    std::filesystem::path path;
    std::string reason;
    std::string name;  ///< that it would be chosen by; empty: a folder that was not searched
};

/// A solver of this project that the build left out.
struct UnbuiltPlugin {
    std::string name, reason;
};

/// A library that the build did not find, and what goes without it; the solvers that need it are UnbuiltPlugins.
struct MissingPart {
    std::string name, reason;
};

/// Where `delassus plugins install` puts what one user installs: $XDG_DATA_HOME/delassus/plugins, or
/// ~/.local/share/delassus/plugins; empty if there is no home.
[[nodiscard]] DELASSUS_API std::filesystem::path user_plugin_folder();

/// The plugins that can be chosen by name. Folders are searched in order, the first plugin of a name wins:
/// the folders given, then those of DELASSUS_PLUGIN_PATH (separated by colons), then the user's, then the plugin folder
/// beside libdelassus; in each its own files, then the folders of installed plugins. Never the working directory. Reads
/// sidecars only; nothing is loaded before it is chosen. A name that no folder has is looked for among the entry points
/// `delassus.solvers` of Python's packages: only then a python3 is started.
class Registry {
public:
    DELASSUS_API explicit Registry(std::vector<std::filesystem::path> folders = {});

    /// A solver that the program itself brings can be chosen by its name from now on. Throws InputError if there is a
    /// plugin of that name.
    DELASSUS_API void add(std::shared_ptr<const Plugin> plugin);

    /// By name, in alphabetical order.
    [[nodiscard]] const std::vector<PluginInfo>& plugins() const { return plugins_; }
    [[nodiscard]] const std::vector<RejectedPlugin>& rejected() const { return rejected_; }
    [[nodiscard]] const std::vector<UnbuiltPlugin>& unbuilt() const { return unbuilt_; }
    [[nodiscard]] const std::vector<MissingPart>& missing_parts() const { return missing_parts_; }
    [[nodiscard]] const std::vector<std::filesystem::path>& folders() const { return folders_; }
    /// Those that packages of Python bring, by their entry points. What only the solver itself knows (capabilities,
    /// options) is empty. Throws PluginError if Python cannot be asked.
    [[nodiscard]] DELASSUS_API std::vector<PluginInfo> packaged() const;

    /// Throws InputError if there is none: with the reason where a plugin of that name was rejected or not built, else
    /// with the nearest name or all names.
    [[nodiscard]] DELASSUS_API const PluginInfo& find(const std::string& name) const;

    /// Loads a plugin by name, or by path if the text has a slash or ends in .so. Throws InputError or PluginError.
    [[nodiscard]] DELASSUS_API std::shared_ptr<const Plugin> load(const std::string& name_or_path) const;

    /// The names of the plugins that meet the needs. Those that are made for problems in parts are among them only if
    /// that is one of the needs: elsewhere they start MPI for nothing, and work where they are named.
    [[nodiscard]] DELASSUS_API std::vector<std::string> capable(std::uint64_t needs) const;

private:
    struct Found;
    void scan(const std::filesystem::path& folder, PluginOrigin origin);
    void read(const std::filesystem::path& folder, PluginOrigin origin);
    [[nodiscard]] std::shared_ptr<const Plugin> find_packaged(const std::string& name) const;

    std::vector<std::filesystem::path> folders_;
    std::vector<PluginInfo> plugins_;
    std::vector<std::shared_ptr<const Plugin>> own_;  // those of add()
    std::vector<RejectedPlugin> rejected_;
    std::vector<UnbuiltPlugin> unbuilt_;
    std::vector<MissingPart> missing_parts_;
    std::shared_ptr<Found> found_;  // as plugins are chosen
};

}  // namespace delassus
