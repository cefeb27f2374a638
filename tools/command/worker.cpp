// SPDX-License-Identifier: BSD-3-Clause
// delassus worker: the other side of `delassus compare` and `delassus bench`; not for people.
#include "bench/worker.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <iostream>
#include <iterator>

#include "bench/parts_worker.hpp"
#include "command.hpp"
#include "delassus/distributed.hpp"

namespace delassus::command {

void add_worker(CLI::App& program, Action& action) {
    auto* command = program.add_subcommand("worker", "Answers one request of `delassus compare`");
    command->group("");  // hidden from --help
    command->callback([&action] {
        action.run = [] {
            const int channel = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 10);
            if (process_count() > 1) return bench::run_worker_together(channel);
            const std::string request(std::istreambuf_iterator<char>(std::cin), {});
            return bench::run_worker(request, channel);
        };
    });
}

}  // namespace delassus::command
