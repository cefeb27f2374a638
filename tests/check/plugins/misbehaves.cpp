// SPDX-License-Identifier: BSD-3-Clause
// A solver that does to its process what DELASSUS_TEST_DEED says, "solve exit" say: an operation and a deed.
#include <sys/types.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sweeps.hpp"

namespace {

void act(const std::string& operation) {
    const char* text = std::getenv("DELASSUS_TEST_DEED");
    const std::string wanted = text ? text : "";
    const auto is = [&](const char* deed) { return wanted == operation + " " + deed; };
    if (is("exit")) std::exit(0);
    if (is("_exit")) _exit(0);
    if (is("exit7")) std::exit(7);
    if (is("abort")) std::abort();
    if (is("fault")) std::raise(SIGSEGV);
    if (is("kill")) std::raise(SIGKILL);
    if (is("alarm")) std::raise(SIGALRM);
    if (is("stop")) std::raise(SIGSTOP);
    if (is("fork")) static_cast<void>(fork() == 0);
    if (is("close"))
        for (int k = 3; k < 64; ++k) close(k);
    if (is("hang") || is("deaf")) {
        sigset_t all;
        sigfillset(&all);
        if (is("deaf")) sigprocmask(SIG_BLOCK, &all, nullptr);
        for (;;) pause();
    }
}

[[gnu::constructor]] void at_load() {
    act("load");
}
[[gnu::destructor]] void at_unload() {
    act("unload");
}

std::int32_t create(const delassus_option_value* values, std::int32_t count, void** solver) {
    act("create");
    return fixture::original().create(values, count, solver);
}
void destroy(void* solver) {
    act("destroy");
    fixture::original().destroy(solver);
}
std::int32_t analyze(void* solver, const delassus_problem* problem) {
    act("analyze");
    return fixture::original().analyze(solver, problem);
}
std::int32_t factorize(void* solver, const delassus_problem* problem) {
    act("factorize");
    return fixture::original().factorize(solver, problem);
}
std::int32_t solve(void* solver, const delassus_problem* problem, const delassus_request* request, double* x,
                   double* lambda, delassus_outcome* outcome) {
    act("solve");
    return fixture::original().solve(solver, problem, request, x, lambda, outcome);
}

}  // namespace

FIXTURE_PLUGIN("misbehaves", "does what it is told to its process", descriptor.create = create;
               descriptor.destroy = destroy; descriptor.analyze = analyze; descriptor.factorize = factorize;
               descriptor.solve = solve)
