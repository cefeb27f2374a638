// SPDX-License-Identifier: BSD-3-Clause
// Loading a plugin and checking its handshake.
#include <fmt/format.h>

#include <algorithm>
#include <boost/dll/shared_library.hpp>
#include <cstddef>
#include <cstring>
#include <mutex>
#include <new>
#include <set>

#include "delassus/error.hpp"
#include "delassus/registry.hpp"
#include "delassus/sdk/blas_memory.hpp"
#include "support/crash_signals.hpp"
#include "support/module.hpp"
#include "support/platform.hpp"
#include "support/process_record.hpp"
#include "support/sentence.hpp"

namespace delassus {

namespace {

// The descriptor of version 2.0, whose last field is last_error: a plugin must have at least these fields.
constexpr std::uint32_t smallest_descriptor =
    offsetof(delassus_plugin_descriptor, last_error) + sizeof(delassus_plugin_descriptor::last_error);

/// Keeps a library loaded until the process ends: PETSc and MPI are not safe to unload.
void keep_forever(const boost::dll::shared_library& library) {
    static std::mutex mutex;
    static auto* const libraries = new std::vector<boost::dll::shared_library>;
    const std::lock_guard lock(mutex);
    libraries->push_back(library);
}

/// The names of plugins loaded from libraries that were built without optimisation.
class UnoptimizedNames {
public:
    void add(const std::string& name) {
        const std::lock_guard lock(mutex_);
        names_.insert(name);
    }
    [[nodiscard]] std::vector<std::string> list() {
        const std::lock_guard lock(mutex_);
        return {names_.begin(), names_.end()};
    }

private:
    std::mutex mutex_;
    std::set<std::string> names_;
};

UnoptimizedNames& unoptimized_names() {
    static auto* const names = new UnoptimizedNames;
    return *names;
}

boost::dll::shared_library open(const std::filesystem::path& path, bool global) {
    using boost::dll::load_mode::rtld_global;
    using boost::dll::load_mode::rtld_local;
    using boost::dll::load_mode::rtld_now;
    // The overload with an error_code loses the loader's message, so the exception is caught instead.
    try {
        return boost::dll::shared_library(path, rtld_now | (global ? rtld_global : rtld_local));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw PluginError(fmt::format("cannot load the plugin {}: {}", path.string(), error.what()));
    }
}

std::string text_of(const char* text) {
    return text ? text : "";
}

bool is_plugin_name(const std::string& name) {
    return !name.empty() && name.size() <= 64 && name[0] >= 'a' && name[0] <= 'z' &&
           std::all_of(name.begin(), name.end(),
                       [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; });
}

std::vector<OptionInfo> read_options(const delassus_plugin_descriptor& descriptor) {
    std::vector<OptionInfo> options;
    std::set<std::string> keys;
    if (descriptor.option_count < 0 || (descriptor.option_count > 0 && !descriptor.options))
        throw PluginError("its option table is missing");
    for (std::int32_t k = 0; k < descriptor.option_count; ++k) {
        const delassus_option& row = descriptor.options[k];
        OptionInfo option;
        option.key = text_of(row.key);
        if (option.key.empty() || !keys.insert(option.key).second)
            throw PluginError(fmt::format("row {} of its option table has no key, or one used before", k));
        if (row.type < DELASSUS_OPTION_BOOLEAN || row.type > DELASSUS_OPTION_TEXT)
            throw PluginError(fmt::format("its option \"{}\" has an unknown type", option.key));
        option.type = static_cast<delassus_option_type>(row.type);
        if (!row.default_value && row.type != DELASSUS_OPTION_TEXT)
            throw PluginError(fmt::format("its option \"{}\" has no default", option.key));
        option.default_value = text_of(row.default_value);
        option.minimum = row.minimum;
        option.maximum = row.maximum;
        for (std::int32_t c = 0; row.choices && c < row.choice_count; ++c)
            option.choices.push_back(text_of(row.choices[c]));
        option.unit = text_of(row.unit);
        option.doc = text_of(row.doc);
        options.push_back(std::move(option));
    }
    return options;
}

const char* missing_operation(const delassus_plugin_descriptor& descriptor) {
    if (!descriptor.create) return "create";
    if (!descriptor.destroy) return "destroy";
    if (!descriptor.analyze) return "analyze";
    if (!descriptor.factorize) return "factorize";
    if (!descriptor.solve) return "solve";
    if (!descriptor.last_error) return "last_error";
    if ((descriptor.capabilities & DELASSUS_CAN_PARTITIONED) == 0) return nullptr;
    if (!descriptor.analyze_partitioned) return "analyze_partitioned";
    if (!descriptor.factorize_partitioned) return "factorize_partitioned";
    if (!descriptor.solve_partitioned) return "solve_partitioned";
    return nullptr;
}

/// Checks the handshake. Returns a copy without what a later minor version appended, and with zeros for what an earlier
/// one does not have. Throws PluginError with the part after "the plugin X: ".
delassus_plugin_descriptor shake_hands(const delassus_plugin_descriptor* descriptor) {
    if (!descriptor) throw PluginError("delassus_plugin() returned nothing");
    if (descriptor->magic != DELASSUS_PLUGIN_MAGIC)
        throw PluginError(
            fmt::format("its descriptor does not begin with the magic number {:#x}", DELASSUS_PLUGIN_MAGIC));
    if (descriptor->abi_major != DELASSUS_ABI_MAJOR)
        throw PluginError(fmt::format("it was built for version {}.{} of the plugin interface; this is version {}.{}",
                                      descriptor->abi_major, descriptor->abi_minor, DELASSUS_ABI_MAJOR,
                                      DELASSUS_ABI_MINOR));
    if (descriptor->struct_size < smallest_descriptor)
        throw PluginError(
            fmt::format("its descriptor has {} bytes; {} are needed", descriptor->struct_size, smallest_descriptor));
    delassus_plugin_descriptor copy{};
    std::memcpy(&copy, descriptor, std::min<std::size_t>(descriptor->struct_size, sizeof copy));
    return copy;
}

/// What the descriptor says. Throws as shake_hands().
PluginInfo read_descriptor(const delassus_plugin_descriptor& descriptor) {
    PluginInfo info;
    info.name = text_of(descriptor.name);
    if (!is_plugin_name(info.name))
        throw PluginError(
            fmt::format("its name \"{}\" is not a word of a–z, 0–9, _ and - that begins with a letter", info.name));
    if (const char* operation = missing_operation(descriptor))
        throw PluginError(fmt::format("it lacks the operation {}", operation));
    info.version = text_of(descriptor.version);
    info.description = text_of(descriptor.description);
    info.licence = text_of(descriptor.licence);
    info.abi_major = descriptor.abi_major;
    info.abi_minor = descriptor.abi_minor;
    info.flags = descriptor.flags;
    info.capabilities = descriptor.capabilities;
    info.build = descriptor.build <= DELASSUS_BUILD_UNOPTIMIZED ? descriptor.build : DELASSUS_BUILD_UNKNOWN;
    info.options = read_options(descriptor);
    static_cast<void>(resolve_options(info.name, info.options, {}));  // the defaults must lie in their own domains
    return info;
}

}  // namespace

std::shared_ptr<const Plugin> Plugin::load(const std::filesystem::path& path) {
    const auto absolute = std::filesystem::absolute(path).lexically_normal();
    if (!std::filesystem::is_regular_file(absolute))
        throw PluginError(fmt::format("there is no plugin {}", absolute.string()));
    const CrashSignals kept;
    const ForeignCall call("the plugin " + absolute.string(), "while it was loaded", ForeignCall::patience);
    auto library = open(absolute, false);
    keep_forever(library);
    if (!library.has(DELASSUS_PLUGIN_SYMBOL))
        throw PluginError(fmt::format("{} is not a Delassus plugin: it does not export {}", absolute.string(),
                                      DELASSUS_PLUGIN_SYMBOL));
    if (!sdk::openblas_has_memory())
        throw PluginError(no_memory_for_blas(fmt::format("the plugin {}", absolute.string())));
    std::shared_ptr<Plugin> plugin(new Plugin);
    try {
        plugin->descriptor_ = shake_hands(library.get<const delassus_plugin_descriptor*()>(DELASSUS_PLUGIN_SYMBOL)());
        plugin->info_ = read_descriptor(plugin->descriptor_);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw PluginError(fmt::format("the plugin {}: {}", absolute.string(), sentence_of(error)));
    } catch (...) {
        throw PluginError(
            fmt::format("the plugin {} threw an exception from {}", absolute.string(), DELASSUS_PLUGIN_SYMBOL));
    }
    plugin->info_.library = absolute;
    plugin->info_.platform = this_platform();
    if (plugin->info_.flags & DELASSUS_FLAG_GLOBAL_SYMBOLS) keep_forever(open(absolute, true));
    if (plugin->info_.build == DELASSUS_BUILD_UNOPTIMIZED) unoptimized_names().add(plugin->info_.name);
    return plugin;
}

std::vector<std::string> unoptimized_plugins() {
    return unoptimized_names().list();
}

std::shared_ptr<const Plugin> Plugin::of(const delassus_plugin_descriptor& descriptor) {
    return of(descriptor, PluginInfo());
}

std::shared_ptr<const Plugin> Plugin::of(const delassus_plugin_descriptor& descriptor, const PluginInfo& found) {
    std::shared_ptr<Plugin> plugin(new Plugin);
    try {
        plugin->descriptor_ = shake_hands(&descriptor);
        plugin->info_ = read_descriptor(plugin->descriptor_);
    } catch (const Error& error) {
        throw PluginError(fmt::format("the plugin {}: {}", text_of(descriptor.name), error.what()));
    }
    plugin->info_.library = found.library;
    plugin->info_.platform = found.platform;
    plugin->info_.python = found.python;
    plugin->info_.checksums = found.checksums;
    plugin->info_.installed_from = found.installed_from;
    plugin->info_.origin = found.origin;
    return plugin;
}

}  // namespace delassus
