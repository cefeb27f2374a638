// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <fstream>

#include "bench/results.hpp"
#include "delassus/version.hpp"

namespace delassus::bench {

namespace {

/// The value on the first line of the file that begins with key, without the separators and quotes around it.
std::string value_in(const char* file, const std::string& key) {
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);) {
        if (!line.starts_with(key)) continue;
        const auto first = line.find_first_not_of("\t :=\"", key.size());
        const auto last = line.find_last_not_of("\t \"");
        return first == std::string::npos ? "" : line.substr(first, last + 1 - first);
    }
    return {};
}

}  // namespace

Machine this_machine() {
    Machine machine;
    machine.processor = value_in("/proc/cpuinfo", "model name");
    utsname name{};
    if (uname(&name) == 0) {
        if (machine.processor.empty()) machine.processor = name.machine;
        machine.system = std::string(name.sysname) + " " + name.release;
    }
    if (const auto distribution = value_in("/etc/os-release", "PRETTY_NAME"); !distribution.empty())
        machine.system = distribution + ", " + machine.system;
    machine.cores = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
    machine.memory = static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE);
    double load = 0.0;
    if (getloadavg(&load, 1) == 1) machine.load = load;
    return machine;
}

Build this_build() {
#if defined(__clang__)
    const std::string compiler = __VERSION__;
#else
    const std::string compiler = "GCC " __VERSION__;
#endif
    return {DELASSUS_VERSION, compiler, DELASSUS_BUILD_TYPE, DELASSUS_BUILD_FLAGS};
}

std::string now() {
    const std::time_t seconds = std::time(nullptr);
    return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(seconds));
}

}  // namespace delassus::bench
