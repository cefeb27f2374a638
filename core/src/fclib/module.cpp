// SPDX-License-Identifier: BSD-3-Clause
// What libdelassus looks up in the module; see problem/fclib_loader.hpp.
#include <type_traits>

#include "fclib/fclib.hpp"
#include "fclib/isolated.hpp"
#include "hdf5/hdf5.hpp"
#include "problem/fclib_loader.hpp"
#include "support/call_in_child.hpp"

extern "C" DELASSUS_API void delassus_fclib_read(const std::filesystem::path& file, delassus::Problem& problem) {
    problem = delassus::fclib::read_isolated(file);
}

extern "C" DELASSUS_API void delassus_fclib_write(const delassus::Problem& problem, const std::filesystem::path& file,
                                                  const std::string& name_in_messages) {
    delassus::write_in_child(name_in_messages, "HDF5", [&] {
        delassus::hdf5::require_memory();
        delassus::fclib::write_file(problem, file, name_in_messages);
        return std::int64_t{0};
    });
}

static_assert(std::is_same_v<decltype(&delassus_fclib_read), DelassusFclibRead>);
static_assert(std::is_same_v<decltype(&delassus_fclib_write), DelassusFclibWrite>);
