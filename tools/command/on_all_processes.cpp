// SPDX-License-Identifier: BSD-3-Clause
#include "on_all_processes.hpp"

#include <cstdio>
#include <new>

#include "command.hpp"
#include "delassus/error.hpp"
#include "process/out_of_memory.hpp"
#include "support/sentence.hpp"

namespace delassus::command {

int on_all_processes(const std::function<int(const std::shared_ptr<const Communicator>& run)>& body) {
    const auto run = communicator_of_run(), last_words = communicator_of_run();
    // A launcher ends all processes when the first ends with an exit code: none does before the sentence is out.
    const auto end = [&](const char* sentence, int exit_code) {
        meet_in_failure(*last_words, sentence);
        if (run->rank() == 0) {
            std::fprintf(stderr, "delassus: %s\n", sentence);
            std::fflush(stderr);
        }
        meet_in_failure(*last_words, sentence);
        return exit_code;
    };
    try {
        return body(run);
    } catch (const Unsupported& error) {
        return end(error.what(), exit_unsupported);
    } catch (const std::bad_alloc&) {
        return end("out of memory while solving", exit_bad_input);
    } catch (const std::exception& error) {
        return end(delassus::sentence_of(error).c_str(), exit_bad_input);
    }
}

}  // namespace delassus::command
