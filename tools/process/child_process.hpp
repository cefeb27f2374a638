// SPDX-License-Identifier: BSD-3-Clause
// A program run as a child process: watched, limited, and killed with everything it started.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace delassus {

struct ChildSettings {
    std::filesystem::path program;                                 ///< absolute
    std::vector<std::string> arguments;                            ///< without the program's own name
    std::string input;                                             ///< what it reads on standard input
    std::vector<std::pair<std::string, std::string>> environment;  ///< set on top of this process's own

    double timeout = 0.0;            ///< wall seconds until it is killed; infinity for never
    std::uint64_t memory_limit = 0;  ///< bytes of address space (RLIMIT_AS); 0 for none
    /// Bytes resident (of it alone) beyond which it is killed; looked at about twenty times a second, and once more at
    /// the end. 0 for none.
    std::uint64_t resident_limit = 0;
    /// It starts processes that do the work (mpirun), maybe in process groups of their own: resident_limit holds for
    /// each of them, and they are killed with it.
    bool is_launcher = false;
    std::optional<int> core;  ///< the only core that it may run on, as far as the system grants that

    /// Called with each piece of standard output. Returns the seconds that the child has from now on, in place of those
    /// it had left. May be empty: the output is then collected in ChildResult.
    std::function<double(std::string_view)> on_output;
    /// Asked about twenty times a second; true: the child is sent SIGINT, and killed if it is still there after
    /// cancel_grace. May be empty.
    std::function<bool()> cancelled;
    double cancel_grace = 2.0;  ///< seconds
};

struct ChildResult {
    std::optional<int> exit_code;  ///< if it ended by itself
    int signal = 0;                ///< the signal that ended it, or 0
    bool timed_out = false;        ///< killed after its time
    bool over_memory = false;      ///< killed above, or ended after it had been above, resident_limit
    bool cancelled = false;        ///< asked to stop by `cancelled`
    double seconds = 0.0;          ///< wall time
    std::int64_t peak_memory = 0;  ///< bytes resident at most (of it alone; of a launcher, of the largest process)
    std::string output;            ///< standard output, unless on_output took it
    std::string errors;            ///< the last 64 KiB of standard error
};

/// Runs the program to its end in a process group of its own, then kills what is left of the group. The child dies with
/// this process and leaves no core dump. Throws Error if it cannot be started.
ChildResult run_child(const ChildSettings& settings);

/// So many MiB in bytes, as far as a number holds them; 0 for what is no positive size.
[[nodiscard]] std::uint64_t bytes_of_mebibytes(double mebibytes);

/// The cores that this process may run on.
[[nodiscard]] std::vector<int> allowed_cores();

/// "SIGSEGV (Segmentation fault)".
[[nodiscard]] std::string signal_name(int signal_number);

/// The path of this program.
[[nodiscard]] std::filesystem::path own_program();

}  // namespace delassus
