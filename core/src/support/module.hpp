// SPDX-License-Identifier: BSD-3-Clause
// Modules: parts of the library with a heavy dependency, loaded when a file or a scene first asks for them.
#pragma once

#include <string>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// The sentence for `who`, "the library x.so" say, where !sdk::openblas_has_memory().
[[nodiscard]] std::string no_memory_for_blas(std::string_view who);

/// Whether this installation has the module.
[[nodiscard]] DELASSUS_API bool has_module(std::string_view module);

/// A symbol of <folder of libdelassus>/delassus/<module>.so, which is loaded if it is not yet and stays loaded.
/// Throws InputError: "<refusal>: this build has no <dependency> (… is missing)<advice>", or with the loader's reason.
[[nodiscard]] DELASSUS_API void* module_symbol(std::string_view module, const char* symbol, std::string_view refusal,
                                               std::string_view dependency, std::string_view advice = "");

}  // namespace delassus
