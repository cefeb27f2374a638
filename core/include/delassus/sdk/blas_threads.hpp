// SPDX-License-Identifier: BSD-3-Clause
// One thread of the system's BLAS for small work, where its threads would only wait for one another.
#pragma once

#include <dlfcn.h>

namespace delassus::sdk {

/// While it lives, OpenBLAS uses one thread if the work is small; afterwards as many as before. Its threads watch for
/// work for some milliseconds after each call, which costs more than they save on fronts of a few hundred rows.
/// Nothing happens where the process has no OpenBLAS.
class BlasThreads {
public:
    /// flops: of the work to come, about.
    explicit BlasThreads(double flops) : one_(flops < worth_more_threads && library().most > 1) {
        if (one_) library().set(1);
    }
    ~BlasThreads() {
        if (one_) library().set(library().most);
    }
    BlasThreads(const BlasThreads&) = delete;
    BlasThreads& operator=(const BlasThreads&) = delete;

private:
    static constexpr double worth_more_threads = 2e8;  // some 20 ms of one thread

    struct Library {
        void (*set)(int) = nullptr;
        int most = 1;
    };
    // The number is asked for once, so that two solves at the same time do not take each other's 1 for it.
    static const Library& library() {
        static const Library found = [] {
            Library result;
            void* handle = dlopen("libblas.so.3", RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD);
            if (!handle) return result;
            const auto get = reinterpret_cast<int (*)()>(dlsym(handle, "openblas_get_num_threads"));
            result.set = reinterpret_cast<void (*)(int)>(dlsym(handle, "openblas_set_num_threads"));
            if (get && result.set) result.most = get();
            dlclose(handle);  // who loaded it keeps it
            return result;
        }();
        return found;
    }

    bool one_;
};

}  // namespace delassus::sdk
