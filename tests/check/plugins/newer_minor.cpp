// SPDX-License-Identifier: BSD-3-Clause
// Built for a later minor version, whose descriptor has fields that this host does not know.
#include "sweeps.hpp"

namespace {

struct LaterDescriptor {
    delassus_plugin_descriptor known;
    double (*later_operation)(void* solver);
    const char* later_text;
};

}  // namespace

extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() {
    static const LaterDescriptor later = [] {
        LaterDescriptor descriptor{fixture::sweeps("newer_minor", "built for a later minor version"), nullptr, "later"};
        descriptor.known.abi_minor = DELASSUS_ABI_MINOR + 7;
        descriptor.known.struct_size = sizeof descriptor;
        return descriptor;
    }();
    return &later.known;
}
