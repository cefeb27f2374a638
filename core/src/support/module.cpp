// SPDX-License-Identifier: BSD-3-Clause
#include "support/module.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "delassus/error.hpp"
#include "delassus/sdk/blas_memory.hpp"
#include "support/crash_signals.hpp"
#include "support/library_location.hpp"
#include "support/process_record.hpp"

namespace delassus {

namespace {

std::filesystem::path path_of(std::string_view module) {
    return library_directory() / "delassus" / fmt::format("{}.so", module);
}

}  // namespace

std::string no_memory_for_blas(std::string_view who) {
    return fmt::format(
        "out of memory: OpenBLAS, which {} uses, needs {} MiB of address space more than the limit (ulimit -v) leaves",
        who, sdk::openblas_mebibytes);
}

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
    const CrashSignals kept;
    const ForeignCall call("the library " + path.string(), "while it was loaded", ForeignCall::patience);
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);  // the loader counts; nothing is loaded twice
    if (!handle) throw InputError(fmt::format("{}: {}", refusal, dlerror()));
    if (!sdk::openblas_has_memory()) throw InputError(no_memory_for_blas(fmt::format("the library {}", path.string())));
    void* address = dlsym(handle, symbol);
    if (!address)
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew", path.string()));
    return address;
}

}  // namespace delassus
