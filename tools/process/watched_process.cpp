// SPDX-License-Identifier: BSD-3-Clause
#include "process/watched_process.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "delassus/error.hpp"
#include "process/child_process.hpp"

namespace delassus {

namespace {

volatile pid_t watched_child = 0;
volatile std::sig_atomic_t asked_to_end = 0;

void pass_on(int signal_number) {
    asked_to_end = 1;
    if (watched_child > 0) kill(watched_child, signal_number);
}

}  // namespace

void continue_in_watched_child(const std::string& who, int exit_code) {
    std::fflush(nullptr);
    const pid_t parent = getpid(), child = fork();
    if (child < 0) throw Error("no process could be started beside this one: " + std::string(std::strerror(errno)));
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(exit_code);
        return;
    }
    prctl(PR_SET_NAME, "delassus-watch");
    watched_child = child;
    std::signal(SIGINT, pass_on);
    std::signal(SIGTERM, pass_on);
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR) _exit(exit_code);
    if (WIFEXITED(status)) _exit(WEXITSTATUS(status));
    const int killer = WTERMSIG(status);
    if (asked_to_end) _exit(exit_code);  // the launcher's own doing, or the user's
    std::fprintf(stderr, "delassus: %s was ended by %s%s; so the others end too\n", who.c_str(),
                 signal_name(killer).c_str(), killer == SIGKILL ? ", as when its node is out of memory" : "");
    std::fflush(stderr);
    _exit(exit_code);
}

}  // namespace delassus
