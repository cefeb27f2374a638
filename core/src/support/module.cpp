// SPDX-License-Identifier: BSD-3-Clause
#include "support/module.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "delassus/error.hpp"
#include "support/library_location.hpp"

namespace delassus {

namespace {

std::filesystem::path path_of(std::string_view module) {
    return library_directory() / "delassus" / fmt::format("{}.so", module);
}

}  // namespace

bool has_module(std::string_view module) {
    std::error_code error;
    return std::filesystem::exists(path_of(module), error);
}

void* module_symbol(std::string_view module, const char* symbol, std::string_view refusal, std::string_view dependency,
                    std::string_view advice) {
    const auto path = path_of(module);
    if (!has_module(module))
        throw InputError(
            fmt::format("{}: this build has no {} ({} is missing){}", refusal, dependency, path.string(), advice));
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);  // the loader counts; nothing is loaded twice
    if (!handle) throw InputError(fmt::format("{}: {}", refusal, dlerror()));
    void* address = dlsym(handle, symbol);
    if (!address)
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew", path.string()));
    return address;
}

}  // namespace delassus
