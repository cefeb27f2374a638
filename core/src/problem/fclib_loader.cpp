// SPDX-License-Identifier: BSD-3-Clause
#include "problem/fclib_loader.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <mutex>

#include "delassus/error.hpp"
#include "support/atomic_file.hpp"
#include "support/library_location.hpp"

namespace delassus {
namespace {

struct Module {
    DelassusFclibRead read = nullptr;
    DelassusFclibWrite write = nullptr;
};

/// Loads the module once; it stays loaded. A failure is tried again next time.
const Module& module() {
    static std::mutex mutex;
    static Module loaded;
    const std::lock_guard lock(mutex);
    if (loaded.read != nullptr) return loaded;
    const std::filesystem::path path = library_directory() / "delassus" / "delassus_fclib.so";
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
        throw InputError(
            fmt::format("FCLib files cannot be read or written: this build has no HDF5 ({} is missing); "
                        "use problem folders.",
                        path.string()));
    }
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
        throw InputError(fmt::format("FCLib files cannot be read or written: {}.", dlerror()));
    }
    const auto read = reinterpret_cast<DelassusFclibRead>(dlsym(handle, "delassus_fclib_read"));
    const auto write = reinterpret_cast<DelassusFclibWrite>(dlsym(handle, "delassus_fclib_write"));
    if (read == nullptr || write == nullptr) {
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew.", path.string()));
    }
    loaded = {read, write};
    return loaded;
}

/// HDF5's serial library is not safe for several threads.
std::mutex& hdf5_mutex() {
    static std::mutex mutex;
    return mutex;
}

}  // namespace

Problem read_fclib(const std::filesystem::path& file) {
    const Module& hdf5 = module();
    const std::lock_guard lock(hdf5_mutex());
    Problem problem;
    hdf5.read(file, problem);
    return problem;
}

void write_fclib(const Problem& problem, const std::filesystem::path& file) {
    const Module& hdf5 = module();
    const std::lock_guard lock(hdf5_mutex());
    AtomicFile target(file);
    hdf5.write(problem, target.path(), file.string());
    target.commit();
}

}  // namespace delassus
