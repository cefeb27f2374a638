// SPDX-License-Identifier: BSD-3-Clause
// A solver for the tests of the comparison. It can solve: by plain projected gradient steps on the diagonal of a
// reduced problem with nonnegative rows, or misbehave as its option says.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "delassus/sdk/solver.hpp"

namespace {

using namespace delassus::sdk;

constexpr const char* behaviours[] = {"solve", "slow",  "crash", "crash_late", "hang",    "deaf", "lie",
                                      "nan",   "print", "exit",  "throw",      "despair", "eat"};

class Misbehaving : public Solver {
public:
    explicit Misbehaving(const OptionValues& options) : behaviour_(options.choice("behaviour")) {}

    void analyze(const ProblemView&) override {}
    void factorize(const ProblemView&) override {}

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        if (behaviour_ == "crash") std::abort();
        if (behaviour_ == "exit") std::_Exit(7);
        if (behaviour_ == "throw") throw std::runtime_error("the matrix is on fire");
        if (behaviour_ == "print") std::puts("{\"event\":\"done\"}");
        if (behaviour_ == "lie") return {DELASSUS_SOLVED, 1, 0.0, ""};
        if (behaviour_ == "despair") return {DELASSUS_INFEASIBLE, 1, 0.0, "there is no solution"};
        if (behaviour_ == "nan") {
            lambda.setConstant(std::nan(""));
            return {DELASSUS_SOLVED, 1, 0.0, ""};
        }
        std::vector<std::vector<char>> eaten;
        while (behaviour_ == "eat" && eaten.size() < 1024) {  // 4 GiB in all, with time to be seen
            eaten.emplace_back(4U << 20U, 'x');
            usleep(1000);
        }
        Vector diagonal(problem.m);
        for (Eigen::Index i = 0; i < problem.m; ++i) diagonal[i] = problem.E.coeff(i, i);
        for (std::int64_t k = 0;; ++k) {
            const auto answer = request.progress(k, x.data(), lambda.data());
            if (answer != DELASSUS_CONTINUE && behaviour_ != "deaf") return {status_of(answer), k, NAN, ""};
            if (behaviour_ == "crash_late" && k == 5) std::abort();
            if (k == 5 && (behaviour_ == "slow" || behaviour_ == "hang")) say_at_work();
            while (behaviour_ == "hang" && k == 5) usleep(1000);
            if (behaviour_ == "slow" || behaviour_ == "deaf") {
                usleep(1000);
                continue;
            }
            if (k == 60) return {DELASSUS_SOLVED, k, NAN, ""};
            if (k >= request.max_iterations()) return {DELASSUS_ITERATION_LIMIT, k, NAN, ""};
            const Vector u = problem.E * lambda + problem.b;
            for (Eigen::Index i = 0; i < problem.m; ++i)
                lambda[i] = std::max(0.0, lambda[i] - 0.5 * u[i] / diagonal[i]);
        }
    }

private:
    /// Makes the file that a test waits for before it interrupts: $DELASSUS_TEST_AT_WORK.
    static void say_at_work() {
        if (const char* file = std::getenv("DELASSUS_TEST_AT_WORK")) std::fclose(std::fopen(file, "w"));
    }

    std::string behaviour_;
};

constexpr delassus_option options[] = {choice_option("behaviour", "solve", behaviours, "What it does")};

}  // namespace

DELASSUS_SOLVER_PLUGIN(Misbehaving,
                       (PluginInfo{.name = "misbehaving",
                                   .version = "1.0.0",
                                   .description = "Misbehaves as it is told",
                                   .licence = "BSD-3-Clause",
                                   .capabilities = DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_REDUCED}),
                       options)
