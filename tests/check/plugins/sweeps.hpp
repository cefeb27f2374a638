// SPDX-License-Identifier: BSD-3-Clause
// A small solver that keeps all the rules: block Gauss-Seidel on the dense Delassus operator, for definite H. The
// misbehaving plugins take its descriptor and spoil one thing, so that each breaks one rule and no other.
#pragma once

#include "delassus/plugin.h"

namespace fixture {

/// The well-behaved descriptor under another name.
delassus_plugin_descriptor sweeps(const char* name, const char* description);

/// Its operations, to call on from those that replace them.
inline const delassus_plugin_descriptor& original() {
    static const delassus_plugin_descriptor descriptor = sweeps("original", "");
    return descriptor;
}

}  // namespace fixture

/// Exports that descriptor, changed by the statements.
#define FIXTURE_PLUGIN(name, description, ...)                                              \
    extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() { \
        static const delassus_plugin_descriptor changed = [] {                              \
            delassus_plugin_descriptor descriptor = fixture::sweeps(name, description);     \
            __VA_ARGS__;                                                                    \
            return descriptor;                                                              \
        }();                                                                                \
        return &changed;                                                                    \
    }
