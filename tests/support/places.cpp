// SPDX-License-Identifier: BSD-3-Clause
#include "support/places.hpp"

#ifndef DELASSUS_TEST_PLUGINS
#define DELASSUS_TEST_PLUGINS ""
#endif
#ifndef DELASSUS_PARTS_PLUGINS
#define DELASSUS_PARTS_PLUGINS ""
#endif
#ifndef DELASSUS_FAILING_MALLOC
#define DELASSUS_FAILING_MALLOC ""
#endif
#ifndef DELASSUS_CHROMIUM
#define DELASSUS_CHROMIUM ""
#endif

namespace delassus::tests::places {

const char* const source = DELASSUS_SOURCE_DIR;
const char* const shared_problems = DELASSUS_SHARED_PROBLEMS_DEFAULT;
const char* const command = DELASSUS_COMMAND;
const char* const chromium = DELASSUS_CHROMIUM;
const char* const plugins = DELASSUS_TEST_PLUGINS;
const char* const parts_plugins = DELASSUS_PARTS_PLUGINS;
const char* const failing_malloc = DELASSUS_FAILING_MALLOC;

}  // namespace delassus::tests::places
