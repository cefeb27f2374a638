// SPDX-License-Identifier: BSD-3-Clause
// A solver used straight through the C border, for checks of what the host's Solver would smooth over.
#pragma once

#include <functional>

#include "check/subject.hpp"

namespace delassus::check {

/// What came back from one raw solve.
struct RawResult {
    std::int32_t status = DELASSUS_ERROR;
    delassus_outcome outcome{};
    Solution solution;
};

class RawSolver {
public:
    /// With the default options. Throws Failure if there is no solver.
    explicit RawSolver(const Subject& subject);
    ~RawSolver();
    RawSolver(const RawSolver&) = delete;
    RawSolver& operator=(const RawSolver&) = delete;

    /// analyze and factorize; the first status that is not DELASSUS_SOLVED.
    std::int32_t set_up(const delassus_problem& problem);

    /// Called with iteration, x and λ; returns a delassus_answer.
    using Listener = std::function<std::int32_t(std::int64_t, const double*, const double*)>;

    /// Solves from zero. Guards around x and λ show whether the plugin wrote beyond them, which throws Failure, as does
    /// a value that is not finite. An empty listener passes a null progress.
    RawResult solve(const delassus_problem& problem, const SolveSettings& settings, const Listener& listener);

    /// Throws Failure if last_error gives NULL.
    [[nodiscard]] std::string last_error() const;

private:
    const delassus_plugin_descriptor& border_;
    void* solver_ = nullptr;
};

}  // namespace delassus::check
