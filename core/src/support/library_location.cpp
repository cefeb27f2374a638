// SPDX-License-Identifier: BSD-3-Clause
#include "support/library_location.hpp"

#include <dlfcn.h>

#include <system_error>

#include "delassus/error.hpp"

namespace delassus {

std::filesystem::path library_directory() {
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&library_directory), &info) == 0 || info.dli_fname == nullptr) {
        throw Error("The loader cannot say where libdelassus was loaded from.");
    }
    std::error_code error;
    const std::filesystem::path file = std::filesystem::canonical(info.dli_fname, error);
    if (error) {
        throw Error("libdelassus was loaded from " + std::string(info.dli_fname) +
                    ", which is no longer there: " + error.message() + ".");
    }
    return file.parent_path();
}

}  // namespace delassus
