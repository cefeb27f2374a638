// SPDX-License-Identifier: BSD-3-Clause
// Memory of OpenBLAS, which asks for its buffer again for ever where the system refuses it.
#pragma once

#include <dlfcn.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cstddef>
#include <initializer_list>

namespace delassus::sdk {

/// MiB of address space that OpenBLAS maps at its first use with one thread: 128, and some to spare.
inline constexpr std::size_t openblas_mebibytes = 144;

/// Whether the OpenBLAS that is loaded in this process, if there is one, has the memory that it needs. Under a limit of
/// the address space (ulimit -v) it takes it here, since it waits for ever if that fails later.
inline bool openblas_has_memory() {
    rlimit space{};
    if (getrlimit(RLIMIT_AS, &space) != 0 || space.rlim_cur == RLIM_INFINITY) return true;
    for (const char* file : {"libblas.so.3", "libopenblas.so.0"}) {
        void* library = dlopen(file, RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD);
        if (!library) continue;
        const auto allocate = reinterpret_cast<void* (*)(int)>(dlsym(library, "blas_memory_alloc"));
        const auto release = reinterpret_cast<void (*)(void*)>(dlsym(library, "blas_memory_free"));
        dlclose(library);  // who loaded it keeps it
        if (!allocate || !release) continue;
        static bool taken = false;
        if (taken) return true;
        void* const probe = mmap(nullptr, openblas_mebibytes << 20U, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (probe == MAP_FAILED) return false;
        munmap(probe, openblas_mebibytes << 20U);
        release(allocate(0));
        taken = true;
    }
    return true;
}

}  // namespace delassus::sdk
