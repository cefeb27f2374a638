// SPDX-License-Identifier: BSD-3-Clause
// delassus worker: the other side of `delassus compare` and `delassus bench`, with "relations" of
// `delassus bench run relations`; not for people.
#include "bench/worker.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "bench/parts_worker.hpp"
#include "command.hpp"
#include "delassus/distributed.hpp"
#include "relations/worker.hpp"

namespace delassus::command {

void add_worker(CLI::App& program, Action& action) {
    auto* command = program.add_subcommand("worker", "Answers one request of `delassus compare`");
    command->group("");  // hidden from --help
    auto what = std::make_shared<std::string>();
    command->add_option("what", *what)->type_name("NAME");
    command->callback([&action, what] {
        action.run = [what] {
            const int channel = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 10);
            if (process_count() > 1) return bench::run_worker_together(channel);
            const std::string request(std::istreambuf_iterator<char>(std::cin), {});
            if (*what == "relations") return relations::run_worker(request, channel);
            return bench::run_worker(request, channel);
        };
    });
}

}  // namespace delassus::command
