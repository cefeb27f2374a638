// SPDX-License-Identifier: BSD-3-Clause
// Runs one check in a process of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>

#include "check/conformance.hpp"

namespace delassus::check {

/// Thrown by a check that does not apply; what() says why.
class Skip : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Thrown by a check of what the rules allow and a person should know; what() is one sentence.
class Warning : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Thrown by a check that failed; what() is one sentence.
class Failure : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// How the child process ends after the check.
enum class Leave {
    AtOnce,  ///< no destructors, no exit handlers
    ByExit   ///< as a program ends; MPI asks for it
};

struct IsolatedOutcome {
    CheckResult::Verdict verdict = CheckResult::Verdict::Failed;
    std::string detail;
    std::size_t bytes_printed = 0;  ///< to standard output, by whoever
    bool returned = true;           ///< false: it was killed after the time limit
};

/// Forks; body runs in the child and returns the detail of success, or throws Skip, Warning, Failure or any other
/// exception, which fails with its sentence. A crash, an exit and a run longer than `seconds` fail with theirs. Output
/// of the child to standard output is caught and counted.
[[nodiscard]] IsolatedOutcome run_isolated(double seconds, Leave leave, const std::function<std::string()>& body);

}  // namespace delassus::check
