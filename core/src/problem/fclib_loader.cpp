// SPDX-License-Identifier: BSD-3-Clause
#include "problem/fclib_loader.hpp"

#include <mutex>

#include "support/atomic_file.hpp"
#include "support/module.hpp"
#include "support/output_folder.hpp"

namespace delassus {
namespace {

void* symbol(const char* name) {
    return module_symbol("delassus_fclib", name, "FCLib files cannot be read or written", "HDF5",
                         "; use problem folders");
}

}  // namespace

std::mutex& hdf5_mutex() {
    static std::mutex mutex;
    return mutex;
}

Problem read_fclib(const std::filesystem::path& file) {
    const auto read = reinterpret_cast<DelassusFclibRead>(symbol("delassus_fclib_read"));
    const std::lock_guard lock(hdf5_mutex());
    Problem problem;
    read(file, problem);
    return problem;
}

void write_fclib(const Problem& problem, const std::filesystem::path& file) {
    const auto write = reinterpret_cast<DelassusFclibWrite>(symbol("delassus_fclib_write"));
    const std::lock_guard lock(hdf5_mutex());
    require_replaceable(file, "");
    AtomicFile target(file);
    write(problem, target.path(), file.string());
    target.commit();
}

}  // namespace delassus
