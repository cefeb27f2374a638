// SPDX-License-Identifier: BSD-3-Clause
// An order of elimination by nested dissection: METIS, found at run time, so that authors of plugins need not link it.
#pragma once

#include <dlfcn.h>
#include <signal.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <numeric>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// METIS 5 with 32-bit indices. The library stays loaded until the process ends.
class Metis {
public:
    /// Null where it is not installed, or has 64-bit indices.
    static const Metis* find() {
        static const Metis metis;
        return metis.order_ ? &metis : nullptr;
    }

    /// New positions of the nodes of a graph (Karypis and Kumar, A fast and high quality multilevel scheme for
    /// partitioning irregular graphs, SIAM J. Sci. Comput. 20, 1998), the same in each call; empty if METIS fails.
    /// start, neighbour: compressed rows of the symmetric adjacency, without the diagonal.
    [[nodiscard]] std::vector<std::int32_t> order(std::vector<std::int32_t>& start,
                                                  std::vector<std::int32_t>& neighbour) const {
        // METIS draws from the C library's random numbers, of which there is one stream in a process, and would take a
        // request to terminate for an error of its own.
        static std::mutex one_at_a_time;
        const std::lock_guard lock(one_at_a_time);
        std::array<char, 128> stream;
        char* const stream_of_host = initstate(1, stream.data(), stream.size());
        sigset_t termination, mask_of_host;
        sigemptyset(&termination);
        sigaddset(&termination, SIGTERM);
        pthread_sigmask(SIG_BLOCK, &termination, &mask_of_host);

        auto nodes = static_cast<std::int32_t>(start.size() - 1);
        std::vector<std::int32_t> node(start.size() - 1), position(start.size() - 1);
        Options options{};
        set_defaults_(options.data());
        options[seed_option] = 1;
        const int status =
            order_(&nodes, start.data(), neighbour.data(), nullptr, options.data(), node.data(), position.data());

        pthread_sigmask(SIG_SETMASK, &mask_of_host, nullptr);
        setstate(stream_of_host);
        if (status != succeeded) position.clear();
        return position;
    }

private:
    // Of metis.h.
    static constexpr std::size_t option_count = 40, seed_option = 8;
    static constexpr int succeeded = 1;
    using Options = std::array<std::int32_t, 2 * option_count>;
    using SetDefaults = int (*)(std::int32_t*);
    using Order = int (*)(std::int32_t*, std::int32_t*, std::int32_t*, std::int32_t*, std::int32_t*, std::int32_t*,
                          std::int32_t*);

    Metis() {
        void* library = dlopen("libmetis.so.5", RTLD_NOW | RTLD_LOCAL);
        if (!library) return;
        set_defaults_ = reinterpret_cast<SetDefaults>(dlsym(library, "METIS_SetDefaultOptions"));
        const auto order = reinterpret_cast<Order>(dlsym(library, "METIS_NodeND"));
        if (!set_defaults_ || !order) return;
        // Options of 64 bits would reach beyond the first half.
        Options options{};
        set_defaults_(options.data());
        if (options[option_count - 1] != 0 && options[option_count] == 0) order_ = order;
    }

    SetDefaults set_defaults_ = nullptr;
    Order order_ = nullptr;
};

/// New positions of the rows of a symmetric matrix, of which the lower triangle's pattern is read: rows of a separator
/// come after the two parts that it keeps apart, down to small parts (George and Liu, An automatic nested dissection
/// algorithm for irregular finite element problems, SIAM J. Numer. Anal. 15, 1978). Empty without METIS.
[[nodiscard]] inline std::vector<std::int32_t> nested_dissection(const Eigen::Ref<const SparseColumns>& lower) {
    const Metis* metis = Metis::find();
    if (!metis) return {};
    const std::int32_t *column = lower.outerIndexPtr(), *row = lower.innerIndexPtr();
    const auto for_each_pair = [&](auto&& visit) {
        for (std::int32_t j = 0; j < lower.cols(); ++j)
            for (std::int32_t k = column[j]; k < column[j + 1]; ++k)
                if (row[k] > j) visit(static_cast<std::size_t>(row[k]), static_cast<std::size_t>(j));
    };
    std::vector<std::int32_t> start(static_cast<std::size_t>(lower.cols()) + 1, 0);
    for_each_pair([&](std::size_t i, std::size_t j) { ++start[i + 1], ++start[j + 1]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<std::int32_t> neighbour(static_cast<std::size_t>(start.back())), next = start;
    for_each_pair([&](std::size_t i, std::size_t j) {
        neighbour[static_cast<std::size_t>(next[i]++)] = static_cast<std::int32_t>(j);
        neighbour[static_cast<std::size_t>(next[j]++)] = static_cast<std::int32_t>(i);
    });
    return metis->order(start, neighbour);
}

}  // namespace delassus::sdk
