// SPDX-License-Identifier: BSD-3-Clause
// Where the tests find the project's files and what is built beside them. Of all sources only places.cpp has them as
// texts, so that every clone takes the others' objects from one compiler cache.
#pragma once

namespace delassus::tests::places {

extern const char* const source;           ///< the project's folder
extern const char* const shared_problems;  ///< the folder of problems that are not the project's, if it is there
extern const char* const command;          ///< the program `delassus`
extern const char* const chromium;         ///< the browser's program; empty: there is none
extern const char* const plugins;  ///< the folder of the plugins that belong to this executable; empty: it has none
extern const char* const parts_plugins;   ///< that of the plugins of tests/partitioned, likewise
extern const char* const failing_malloc;  ///< the library that tests/faults preloads, likewise

}  // namespace delassus::tests::places
