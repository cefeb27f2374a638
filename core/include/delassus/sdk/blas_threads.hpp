// SPDX-License-Identifier: BSD-3-Clause
// How many threads the system's BLAS uses: one, but for large work of a solver that has a team.
#pragma once

#include <dlfcn.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <limits>
#include <system_error>
#include <thread>
#include <vector>

#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// While it lives, OpenBLAS uses as many threads as the team of the calling thread's solver has members, if the work is
/// large; afterwards one. Its threads watch for work for some milliseconds after each call, which costs more than they
/// save on fronts of a few hundred rows. Solvers without a team never raise the number, so that those that work side by
/// side do not change each other's. Nothing happens where the process has no OpenBLAS.
class BlasThreads {
public:
    /// flops: of the work to come, about.
    explicit BlasThreads(double flops) : several_(flops >= worth_more_threads && members_ > 1 && can_start()) {
        if (several_) set(std::min(members_, allowed()));
    }
    ~BlasThreads() {
        if (several_) set(1);
    }
    BlasThreads(const BlasThreads&) = delete;
    BlasThreads& operator=(const BlasThreads&) = delete;

    /// The team of what the calling thread is about to do. The first call in a plugin sets the library that the plugin
    /// brings to one thread; what sdk::Blas loads later starts with one.
    static void use(const Team& team) {
        members_ = team.size();
        [[maybe_unused]] static const bool begun = (set(1), true);
    }

private:
    /// OpenBLAS interrupts its process where a thread does not start, and waits for ever where its memory is refused:
    /// whether as many threads as processors start, asked once, and memory is not limited.
    static bool can_start() {
        static const bool answer = [] {
            rlimit memory{};
            if (getrlimit(RLIMIT_AS, &memory) != 0 || memory.rlim_cur != RLIM_INFINITY) return false;
            std::vector<std::jthread> trial;
            try {
                for (unsigned k = 0; k < std::thread::hardware_concurrency(); ++k) trial.emplace_back([] {});
            } catch (const std::system_error&) {
                return false;
            }
            return true;
        }();
        return answer;
    }

    static constexpr double worth_more_threads = 2e8;  // some 20 ms of one thread

    /// By OpenBLAS's own variables.
    static int allowed() {
        for (const char* name : {"OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"})
            if (const char* text = std::getenv(name); text && std::atoi(text) > 0) return std::atoi(text);
        return std::numeric_limits<int>::max();
    }

    static void set(int threads) {
        static std::atomic<void (*)(int)> known = nullptr;  // the library may be loaded later
        auto function = known.load();
        if (!function) {
            void* handle = dlopen("libblas.so.3", RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD);
            if (!handle) return;
            function = reinterpret_cast<void (*)(int)>(dlsym(handle, "openblas_set_num_threads"));
            dlclose(handle);  // who loaded it keeps it
            if (!function) return;
            known = function;
        }
        function(threads);
    }

    inline static thread_local int members_ = 1;
    bool several_;
};

}  // namespace delassus::sdk
