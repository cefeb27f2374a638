// SPDX-License-Identifier: BSD-3-Clause
// Interrupts by the user as requests.
#pragma once

namespace delassus {

/// Makes Ctrl-C a request: interrupted() turns true. A second Ctrl-C, more than half a second later, ends the process
/// at once; an earlier one belongs to the same request (`timeout -s INT` sends two).
void install_interrupt_handler();
[[nodiscard]] bool interrupted();

}  // namespace delassus
