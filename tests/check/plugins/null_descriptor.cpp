// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/plugin.h"

extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() {
    return nullptr;
}
