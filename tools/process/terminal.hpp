// SPDX-License-Identifier: BSD-3-Clause
// What reaches a terminal: names and messages come from files, plugins and libraries, and may hold its control
// characters.
#pragma once

#include <string_view>

namespace delassus {

/// From now on everything written to stdout and stderr shows control characters other than \n and \t, and bytes that
/// are no UTF-8, as "\x1b". To be called at the start of a program, before anything is written.
void make_output_printable();

/// Replaces the line on which the cursor of the terminal of standard error stands; "" clears it. The text is made
/// printable as well.
void show_line(std::string_view text);

}  // namespace delassus
