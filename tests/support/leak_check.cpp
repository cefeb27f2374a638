// SPDX-License-Identifier: BSD-3-Clause
// Linked into the tests of the sanitizers' build: LeakSanitizer asks this when a test's process ends.
#include <link.h>

#include <cstdlib>
#include <string_view>

namespace {

/// Libraries that keep memory until the process ends. Stacks that are walked by frame pointers, which is fast, do not
/// show that they allocated it: they have none.
bool keeps_memory(std::string_view library) {
    return library.find("/libmpi.so") != library.npos || library.find("/libngcore.so") != library.npos;
}

}  // namespace

/// Whether leaks are left unreported: where such a library is loaded and tests/lsan.supp, which names it, cannot work.
/// The preset `sanitize-mpi` walks whole stacks (fast_unwind_on_malloc=0), and says so.
extern "C" [[gnu::visibility("default")]] int __lsan_is_turned_off() {  // NOLINT(bugprone-reserved-identifier)
    if (std::getenv("DELASSUS_WHOLE_STACKS")) return 0;
    return dl_iterate_phdr([](dl_phdr_info* info, std::size_t, void*) { return keeps_memory(info->dlpi_name) ? 1 : 0; },
                           nullptr);
}
