// SPDX-License-Identifier: BSD-3-Clause
#include "partition_report.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

namespace delassus::command {

void print_quality(const PartitionQuality& quality, int processes) {
    if (processes == 1) return;
    fmt::print("  {} processes: {} of {} cones between processes, {} ghost columns ({} at most), imbalance {:.3f}\n",
               processes, quality.cut_cones, quality.cones, quality.ghosts, quality.most_ghosts, quality.imbalance);
}

void print_memory(const Communicator& run) {
    if (run.size() == 1) return;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);  // ru_maxrss in KiB
    const auto peaks = run.all(usage.ru_maxrss);
    if (run.rank() != 0) return;
    fmt::print("  memory at most, MiB:");
    for (const auto peak : peaks) fmt::print(" {:.0f}", static_cast<double>(peak) / 1024.0);
    fmt::print("\n");
}

}  // namespace delassus::command
