// SPDX-License-Identifier: BSD-3-Clause
// What is known of a plugin without loading it: its sidecar, and the option table in it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/plugin.h"

namespace delassus {

/// One row of a plugin's option table; see delassus_option.
struct OptionInfo {
    std::string key{};
    delassus_option_type type = DELASSUS_OPTION_TEXT;
    std::string default_value{};
    double minimum = 0.0, maximum = 0.0;
    std::vector<std::string> choices{};
    std::string unit{}, doc{};

    /// "real in [0, 2]", "one of a, b": for messages, help and docs.
    [[nodiscard]] DELASSUS_API std::string domain() const;
};

/// Option values as a user writes them, by key.
using OptionTexts = std::map<std::string, std::string>;

/// A value checked against its row of the table.
struct OptionValue {
    std::string key;
    delassus_option_type type = DELASSUS_OPTION_TEXT;
    std::int64_t integer = 0;
    double real = 0.0;
    std::string text;
};

/// Every row of the table with the chosen or the default value. Throws InputError on an unknown key (naming the
/// nearest) or a value outside its domain; solver names the plugin in the sentence.
[[nodiscard]] DELASSUS_API std::vector<OptionValue> resolve_options(std::string_view solver,
                                                                    const std::vector<OptionInfo>& table,
                                                                    const OptionTexts& chosen);

/// A JSON Schema of the "options" object of a configuration, from the table.
[[nodiscard]] DELASSUS_API std::string options_schema(std::string_view solver, const std::vector<OptionInfo>& table);

/// Where a plugin was found.
enum class PluginOrigin {
    Program,        ///< the program brings it, or it was named by its path
    Delassus,       ///< it comes with the library
    Folder,         ///< a folder of the caller or of DELASSUS_PLUGIN_PATH
    User,           ///< installed for one user
    System,         ///< installed for all, beside those of the library
    PythonPackage,  ///< an entry point of an installed package of Python, in the group delassus.solvers
};
/// "delassus", "user", "python package", … as `delassus plugins list --json` has it.
[[nodiscard]] DELASSUS_API std::string_view name_of(PluginOrigin origin);

/// What the descriptor says, copied, and what a manifest (the sidecar) says beyond it.
struct PluginInfo {
    std::string name, version, description, licence;
    std::uint16_t abi_major = 0, abi_minor = 0;
    std::uint32_t flags = 0;                       ///< DELASSUS_FLAG_*
    std::uint64_t capabilities = 0;                ///< DELASSUS_CAN_*
    std::uint32_t build = DELASSUS_BUILD_UNKNOWN;  ///< DELASSUS_BUILD_*
    std::vector<OptionInfo> options;
    std::filesystem::path library;  ///< absolute path of the shared library; empty: the program's own

    std::string platform;  ///< that the library was built for, "linux_x86_64"; empty where nobody says
    /// "module:Class" of a solver that is written in Python; `library` is then the file of that module, or empty where
    /// Python itself finds it.
    std::string python;
    std::map<std::string, std::string> checksums;  ///< "crc32:1a2b3c4d" of files beside the manifest, by their names
    std::string installed_from;                    ///< the path given to the installer; "numpy 1.24" of a package
    PluginOrigin origin = PluginOrigin::Program;

    /// The needs that this plugin does not meet.
    [[nodiscard]] std::uint64_t missing(std::uint64_t needs) const { return needs & ~capabilities; }
};

/// What a person should know of a plugin with DELASSUS_BUILD_UNOPTIMIZED.
inline constexpr std::string_view unoptimized_build =
    "built without optimisation (-O2, or CMAKE_BUILD_TYPE=Release): its times say little";

/// The sidecar's text (JSON) for a plugin, and back. reading throws PluginError with a sentence.
[[nodiscard]] DELASSUS_API std::string sidecar_text(const PluginInfo& info);
/// What the descriptor alone says: equal texts, equal descriptors.
[[nodiscard]] DELASSUS_API std::string descriptor_text(const PluginInfo& info);
[[nodiscard]] DELASSUS_API PluginInfo read_sidecar(const std::filesystem::path& sidecar);

}  // namespace delassus
