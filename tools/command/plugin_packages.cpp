// SPDX-License-Identifier: BSD-3-Clause
// delassus plugins install | remove: plugins as packages, each in a folder of its own that appears and disappears whole
// (solver/installed_files.hpp).
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "command.hpp"
#include "delassus/error.hpp"
#include "process/stdout_guard.hpp"
#include "solver/auto_solver.hpp"
#include "solver/installed_files.hpp"
#include "solver/python_solvers.hpp"
#include "solver/sidecar.hpp"
#include "support/atomic_file.hpp"
#include "support/call_in_child.hpp"
#include "support/library_location.hpp"
#include "support/nearest_name.hpp"
#include "support/output_folder.hpp"
#include "support/platform.hpp"
#include "support/text_file.hpp"

namespace delassus::command {

namespace fs = std::filesystem;

namespace {

struct PackageArguments {
    std::string source, name;
    bool user = false, system = false;
};

/// What is to be installed.
struct Source {
    fs::path code;      ///< a shared library, or a module of Python: a file or a folder
    fs::path manifest;  ///< empty if there is none
    bool python = false;
};

fs::path system_folder() {
    return library_directory() / "delassus" / "plugins";
}

bool is_package(const fs::path& folder) {
    return fs::is_regular_file(folder / package_file);
}

/// The module that a file or a folder is; a folder of a package by its own name.
Source module_of(const fs::path& path) {
    const std::string name = (fs::is_directory(path) ? path.filename() : path.stem()).string();
    const bool fits = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_';
    }) && std::isdigit(static_cast<unsigned char>(name[0])) == 0;
    if (!fits) throw InputError(fmt::format("{}: \"{}\" is no name of a module of Python", path.string(), name));
    return {path, {}, true};
}

Source source_of_manifest(const fs::path& manifest) {
    const PluginInfo info = read_sidecar(manifest);
    if (info.python.empty()) return {info.library, manifest, false};
    require_checksums(info);
    return module_of(info.library.filename() == package_file ? info.library.parent_path() : info.library);
}

/// The library with its manifest, if there is one beside it.
Source source_of_library(const fs::path& library) {
    const fs::path manifest = fs::path(library).replace_extension(".json");
    return {library, fs::exists(manifest) ? manifest : fs::path(), false};
}

/// Other programs have files of this kind, too.
bool is_manifest(const fs::path& file) {
    return file.extension() == ".json" && fs::is_regular_file(file) &&
           read_file(file, most_bytes_of_text).find("\"delassus-plugin\"") != std::string::npos;
}

Source source_in_folder(const fs::path& folder) {
    if (is_package(folder)) return module_of(folder);
    if (fs::exists(folder / "pyproject.toml") || fs::exists(folder / "setup.py"))
        throw InputError(
            fmt::format("{} is a project of Python: `python3 -m pip install {}` installs it, and its entry "
                        "points delassus.solvers are found then",
                        folder.string(), folder.string()));
    std::vector<fs::path> libraries, manifests, modules;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const fs::path& path = entry.path();
        if (path.extension() == ".so") libraries.push_back(path);
        if (is_manifest(path)) manifests.push_back(path);
        if (path.extension() == ".py" || is_package(path)) modules.push_back(path);
    }
    auto& found = !libraries.empty() ? libraries : !manifests.empty() ? manifests : modules;
    if (found.empty())
        throw InputError(
            fmt::format("{} holds no plugin: neither a shared library nor a module of Python", folder.string()));
    std::sort(found.begin(), found.end());
    if (found.size() > 1)
        throw InputError(fmt::format("{} holds several plugins, {} and {} among them: name one of them",
                                     folder.string(), found[0].filename().string(), found[1].filename().string()));
    if (!libraries.empty()) return source_of_library(found.front());
    return manifests.empty() ? module_of(found.front()) : source_of_manifest(found.front());
}

Source find_source(const fs::path& given) {
    fs::path path = fs::absolute(given).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();
    if (fs::is_directory(path)) return source_in_folder(path);
    if (path.extension() == ".so") return source_of_library(path);
    if (path.extension() == ".json") return source_of_manifest(path);
    if (path.extension() == ".py") return module_of(path);
    throw InputError(fmt::format(
        "{} is neither a shared library (.so), nor a manifest (.json), nor a module of Python (.py)", given.string()));
}

/// What a manifest says, looked through before anything is loaded.
PluginInfo checked_manifest(const Source& source) {
    PluginInfo info = read_sidecar(source.manifest);
    if (info.library.filename() != source.code.filename())
        throw InputError(fmt::format("{} is the manifest of {}, not of {}", source.manifest.string(),
                                     info.library.filename().string(), source.code.filename().string()));
    if (!info.platform.empty() && info.platform != this_platform())
        throw InputError(
            fmt::format("{} was built for {}; this is {}", source.code.string(), info.platform, this_platform()));
    if (info.abi_major != DELASSUS_ABI_MAJOR)
        throw InputError(fmt::format("{} was built for version {}.{} of the plugin interface; this is {}.{}",
                                     source.code.string(), info.abi_major, info.abi_minor, DELASSUS_ABI_MAJOR,
                                     DELASSUS_ABI_MINOR));
    require_checksums(info);
    return info;
}

/// What the library says, loaded in a child process: it may crash or print.
PluginInfo info_in_child(const fs::path& library) {
    const std::string platform = platform_of_library(library), here = this_platform();
    if (platform.empty()) throw InputError(fmt::format("{} is no shared library", library.string()));
    if (platform != here)
        throw InputError(fmt::format("{} was built for {}; this is {}", library.string(), platform, here));
    constexpr unsigned seconds = 60;
    const std::string answer = call_in_child(library, "the loader", seconds, [&] {
        try {
            return "+" + sidecar_text(Plugin::load(library)->info());
        } catch (const PluginError& refusal) {
            return "-" + std::string(refusal.what());
        }
    });
    if (answer.front() == '-') throw PluginError(answer.substr(1));
    return parse_sidecar(answer.substr(1), library);
}

PluginInfo info_of_source(const Source& source) {
    if (source.python) {
        PluginInfo module;
        module.library = fs::is_directory(source.code) ? source.code / package_file : source.code;
        module.python = source.code.stem().string() + ":";
        return python_solvers().load(module)->info();
    }
    std::optional<PluginInfo> stated;
    if (!source.manifest.empty()) stated = checked_manifest(source);
    PluginInfo info = info_in_child(source.code);
    if (stated && descriptor_text(*stated) != descriptor_text(info))
        throw InputError(fmt::format("{} does not match {}; `delassus plugins describe {} --sidecar` renews it",
                                     source.manifest.string(), source.code.string(), source.code.string()));
    return info;
}

/// Copies a file, or a folder without what Python compiled and without hidden files; adds the names and checksums.
void copy_code(const fs::path& from, const fs::path& folder, const std::string& name, PluginInfo& info) {
    if (fs::is_directory(from)) {
        fs::create_directory(folder / name);
        for (const auto& entry : fs::directory_iterator(from)) {
            const std::string inner = entry.path().filename().string();
            if (inner.front() != '.' && inner != "__pycache__")
                copy_code(entry.path(), folder, name + "/" + inner, info);
        }
        return;
    }
    require_regular_file(from);
    fs::copy_file(from, folder / name);
    fs::permissions(folder / name,
                    fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read | fs::perms::others_read);
    info.checksums[name] = checksum_of_file(folder / name);
}

/// Throws InputError where the name is taken by what this command did not install. The plugin that will come before the
/// new one in the search, or that the new one will come before; null if there is none.
const PluginInfo* other_of_name(const Registry& registry, const std::string& name, const fs::path& place) {
    if (name == auto_name) throw InputError("a plugin cannot be named \"auto\": that is the choice among all");
    const auto& plugins = registry.plugins();
    const auto other =
        std::find_if(plugins.begin(), plugins.end(), [&](const auto& info) { return info.name == name; });
    if (other == plugins.end() || import_folder(*other) == place) return nullptr;
    if (other->origin == PluginOrigin::Delassus)
        throw InputError(fmt::format("there is a solver \"{}\" already, {}, which this command did not install", name,
                                     other->library.string()));
    return &*other;
}

void require_writable(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || access(folder.c_str(), W_OK) != 0)
        throw InputError(
            fmt::format("{} cannot be written{}", folder.string(),
                        folder == system_folder() ? ": use sudo, or install for yourself with --user" : ""));
}

int install(const PackageArguments& arguments) {
    if (!fs::exists(arguments.source)) throw InputError(fmt::format("there is no {}", arguments.source));
    const Source source = find_source(arguments.source);
    const fs::path folder = arguments.system ? system_folder() : user_plugin_folder();
    if (folder.empty())
        throw InputError("there is no folder for plugins of this user: HOME and XDG_DATA_HOME are not set");
    PluginInfo info = [&] {
        const StdoutGuard guard;
        return info_of_source(source);
    }();
    const fs::path place = folder / info.name;
    if (arguments.system) umask(022);  // all are to read it, whatever root keeps to itself
    const Registry registry;
    const PluginInfo* other = other_of_name(registry, info.name, place);
    require_writable(folder);

    AtomicFolder package(place, plugin_kind);
    const std::string file = source.code.filename().string();
    info.checksums.clear();
    copy_code(source.code, package.path(), file, info);
    info.library = fs::is_directory(source.code) ? place / file / package_file : place / file;
    info.platform = source.python ? "" : this_platform();
    info.installed_from = fs::absolute(arguments.source).lexically_normal().string();
    write_file_atomically(package.path() / (info.name + ".json"), sidecar_text(info));
    const bool replaces = fs::exists(place);
    package.commit();
    fmt::print("{} {} {} for {}: {}\n", replaces ? "replaced" : "installed", info.name, info.version,
               arguments.system ? "all" : "this user", place.string());
    if (other) {
        const bool hidden = other->origin == PluginOrigin::Folder || arguments.system;
        fmt::print(stderr, "delassus: note: {} is searched {} it\n", other->library.string(),
                   hidden ? "before" : "after");
    }
    return exit_solved;
}

[[noreturn]] void refuse_to_remove(const std::string& name, const std::string& for_whom,
                                   const std::vector<std::string>& installed) {
    const Registry registry;
    for (const auto& plugin : registry.plugins())
        if (plugin.name == name && plugin.origin != PluginOrigin::User && plugin.origin != PluginOrigin::System)
            throw InputError(
                fmt::format("{} was not installed by `delassus plugins install`, which removes nothing else",
                            plugin.library.string()));
    for (const auto& plugin : registry.packaged())
        if (plugin.name == name)
            throw InputError(fmt::format("the solver {} comes with the Python package {}: remove it by pip", name,
                                         plugin.installed_from));
    throw InputError(fmt::format("no plugin \"{}\" is installed {}{}", name, for_whom,
                                 installed.empty() ? std::string()
                                                   : nearest_name_hint(name, std::vector<std::string_view>(
                                                                                 installed.begin(), installed.end()))));
}

int remove(const PackageArguments& arguments) {
    std::vector<std::string> installed;
    for (const auto& folder : {user_plugin_folder(), system_folder()}) {
        const bool system = folder == system_folder();
        if (folder.empty() || (system ? arguments.user : arguments.system)) continue;
        for (const auto& place : installed_plugins(folder)) {
            installed.push_back(place.filename().string());
            if (installed.back() != arguments.name) continue;
            require_writable(folder);
            remove_folder_atomically(place, plugin_kind);
            fmt::print("removed {} for {}: {}\n", arguments.name, system ? "all" : "this user", place.string());
            return exit_solved;
        }
    }
    refuse_to_remove(arguments.name,
                     arguments.user     ? "for this user"
                     : arguments.system ? "for all"
                                        : "for this user or for all",
                     installed);
}

void add_scope(CLI::App& command, PackageArguments& arguments, const std::string& user, const std::string& system) {
    auto* for_user = command.add_flag("--user", arguments.user, user);
    command.add_flag("--system", arguments.system, system)->excludes(for_user);
}

}  // namespace

void add_plugin_packages(CLI::App& plugins, Action& action) {
    auto arguments = std::make_shared<PackageArguments>();
    auto* install_command =
        plugins.add_subcommand("install", "Install a plugin: a shared library, or a solver written in Python");
    install_command
        ->add_option("source", arguments->source,
                     "The library (.so), its manifest (.json), a module of Python (.py), or a folder with one of them")
        ->required()
        ->type_name("FILE|DIR");
    add_scope(*install_command, *arguments, "For this user, in ~/.local/share/delassus/plugins [the default]",
              "For all, in the folder of plugins beside libdelassus");
    install_command->callback([arguments, &action] { action.run = [arguments] { return install(*arguments); }; });

    auto* remove_command = plugins.add_subcommand("remove", "Remove a plugin that was installed by `plugins install`");
    remove_command->add_option("plugin", arguments->name, "Its name")->required()->type_name("PLUGIN");
    add_scope(*remove_command, *arguments, "That of this user only", "That for all only");
    remove_command->callback([arguments, &action] { action.run = [arguments] { return remove(*arguments); }; });
}

}  // namespace delassus::command
