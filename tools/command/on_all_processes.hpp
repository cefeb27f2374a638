// SPDX-License-Identifier: BSD-3-Clause
// How the processes of one run end together.
#pragma once

#include <functional>
#include <memory>

#include "delassus/communicator.hpp"

namespace delassus::command {

/// The exit code of body, which all processes of this run do at once. What all of them throw, process 0 says alone,
/// with the exit code that it has in one process; whoever throws alone ends the others within seconds, with its
/// sentence and exit code 3.
[[nodiscard]] int on_all_processes(const std::function<int(const std::shared_ptr<const Communicator>& run)>& body);

}  // namespace delassus::command
