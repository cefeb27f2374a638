// SPDX-License-Identifier: BSD-3-Clause
// The JSON sidecar beside a plugin, by which it is listed without being loaded: its manifest.
#include "solver/sidecar.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <string>

#include "delassus/error.hpp"
#include "delassus/needs.hpp"
#include "support/json.hpp"
#include "support/json_number.hpp"
#include "support/sentence.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view sidecar_format = "delassus-plugin";
constexpr int sidecar_version = 1;
constexpr std::string_view type_names[] = {"boolean", "integer", "real", "choice", "text"};

delassus_option_type type_of(const std::string& name) {
    for (std::size_t k = 0; k < std::size(type_names); ++k)
        if (name == type_names[k]) return static_cast<delassus_option_type>(k);
    throw PluginError(fmt::format("\"{}\" is not an option type", name));
}

/// "optimized" in a sidecar: true, false, or null where the plugin does not say. Those of ABI 2.4 and before lack the
/// key.
Json optimized_of(std::uint32_t build) {
    if (build == DELASSUS_BUILD_UNKNOWN) return nullptr;
    return build == DELASSUS_BUILD_OPTIMIZED;
}

std::uint32_t build_of(const Json& optimized) {
    if (optimized.is_null()) return DELASSUS_BUILD_UNKNOWN;
    return optimized.get<bool>() ? DELASSUS_BUILD_OPTIMIZED : DELASSUS_BUILD_UNOPTIMIZED;
}

/// The name of the library, or of the module of Python, which may be a folder.
std::filesystem::path file_of(const PluginInfo& info) {
    const auto name = info.library.filename();
    return !info.python.empty() && name == package_file ? info.library.parent_path().filename() : name;
}

OptionInfo read_option(const Json& json) {
    const auto number = [&](const char* key, double open) {
        return json.at(key).is_null() ? open : json.at(key).get<double>();
    };
    constexpr double infinity = std::numeric_limits<double>::infinity();
    return {json.at("key"),
            type_of(json.at("type")),
            json.at("default"),
            number("minimum", -infinity),
            number("maximum", infinity),
            json.at("choices").get<std::vector<std::string>>(),
            json.at("unit"),
            json.at("doc")};
}

}  // namespace

std::string_view name_of(PluginOrigin origin) {
    constexpr std::array<std::string_view, 6> names = {"program", "delassus", "folder",
                                                       "user",    "system",   "python package"};
    return names.at(static_cast<std::size_t>(origin));
}

std::string descriptor_text(const PluginInfo& info) {
    PluginInfo alone = info;
    alone.platform.clear();
    alone.checksums.clear();
    alone.installed_from.clear();
    return sidecar_text(alone);
}

std::string sidecar_text(const PluginInfo& info) {
    Json options = Json::array();
    for (const auto& option : info.options) {
        options.push_back({{"key", option.key},
                           {"type", type_names[option.type]},
                           {"default", option.default_value},
                           {"minimum", json_number(option.minimum)},
                           {"maximum", json_number(option.maximum)},
                           {"choices", option.choices},
                           {"unit", option.unit},
                           {"doc", option.doc}});
    }
    Json sidecar = {{"format", sidecar_format},
                    {"version", sidecar_version},
                    {"library", file_of(info).string()},
                    {"abi", {info.abi_major, info.abi_minor}},
                    {"name", info.name},
                    {"plugin_version", info.version},
                    {"description", info.description},
                    {"licence", info.licence},
                    {"flags", info.flags},
                    {"optimized", optimized_of(info.build)},
                    {"capabilities", capability_names(info.capabilities)},
                    {"options", options}};
    if (!info.platform.empty()) sidecar["platform"] = info.platform;
    if (!info.python.empty()) sidecar["python"] = info.python;
    if (!info.checksums.empty()) sidecar["checksums"] = info.checksums;
    if (!info.installed_from.empty()) sidecar["installed_from"] = info.installed_from;
    return json_text(sidecar, 2) + "\n";
}

PluginInfo parse_sidecar(const std::string& text, const std::filesystem::path& sidecar) {
    try {
        const Json json = parse_ordered_json(text);
        if (json.at("format") != sidecar_format || json.at("version") != sidecar_version)
            throw PluginError(
                fmt::format("{} is not a plugin sidecar of version {}", sidecar.string(), sidecar_version));
        PluginInfo info;
        info.name = json.at("name");
        info.version = json.at("plugin_version");
        info.description = json.at("description");
        info.licence = json.at("licence");
        info.abi_major = json.at("abi").at(0);
        info.abi_minor = json.at("abi").at(1);
        info.flags = json.at("flags");
        info.build = build_of(json.value("optimized", Json()));
        info.capabilities = capabilities_of(json.at("capabilities").get<std::vector<std::string>>());
        for (const auto& option : json.at("options")) info.options.push_back(read_option(option));
        info.platform = json.value("platform", std::string());
        info.python = json.value("python", std::string());
        info.checksums = json.value("checksums", std::map<std::string, std::string>());
        info.installed_from = json.value("installed_from", std::string());
        const std::filesystem::path library = json.at("library").get<std::string>();
        if (library.has_parent_path())
            throw PluginError(fmt::format("{} names a library in another folder", sidecar.string()));
        info.library = std::filesystem::absolute(sidecar).parent_path() / library;
        std::error_code absent;
        if (!info.python.empty() && std::filesystem::is_directory(info.library, absent)) info.library /= package_file;
        return info;
    } catch (const nlohmann::json::exception& error) {
        throw PluginError(fmt::format("{} is not a valid sidecar: {}", sidecar.string(), sentence_of(error)));
    } catch (const InputError& error) {
        throw PluginError(fmt::format("{}: {}", sidecar.string(), error.what()));
    }
}

PluginInfo read_sidecar(const std::filesystem::path& sidecar) {
    try {
        return parse_sidecar(read_file(sidecar, most_bytes_of_text), sidecar);
    } catch (const InputError& error) {
        throw PluginError(error.what());
    }
}

}  // namespace delassus
