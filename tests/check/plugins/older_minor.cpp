// SPDX-License-Identifier: BSD-3-Clause
// Built for version 2.0, whose descriptor ends with last_error. Nothing may be read behind it: here lies an address
// that crashes whoever calls it.
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "sweeps.hpp"

namespace {

constexpr std::size_t size_2_0 = offsetof(delassus_plugin_descriptor, accepts);

struct Memory {
    alignas(delassus_plugin_descriptor) unsigned char bytes[sizeof(delassus_plugin_descriptor)];
};

}  // namespace

extern "C" DELASSUS_PLUGIN_EXPORT const delassus_plugin_descriptor* delassus_plugin() {
    static const Memory memory = [] {
        delassus_plugin_descriptor descriptor = fixture::sweeps("older_minor", "built for version 2.0");
        descriptor.abi_minor = 0;
        descriptor.struct_size = size_2_0;
        Memory filled;
        std::memset(filled.bytes, 0x5a, sizeof filled.bytes);
        std::memcpy(filled.bytes, &descriptor, size_2_0);
        return filled;
    }();
    return reinterpret_cast<const delassus_plugin_descriptor*>(memory.bytes);
}
