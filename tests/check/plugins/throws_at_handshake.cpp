// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "delassus/plugin.h"

extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() {
    throw std::runtime_error("thrown at the handshake");
}
