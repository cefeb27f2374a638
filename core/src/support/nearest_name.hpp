// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// The choice that differs from name by the fewest insertions, deletions, replacements and swaps of neighbours
/// (restricted Damerau–Levenshtein distance, case ignored); empty if even that one shares too little with it.
DELASSUS_API std::string_view nearest_name(std::string_view name, std::span<const std::string_view> choices);

/// `; did you mean "rows"?`, or `; there are kind, rows, lo, hi` if none is near. For the end of a sentence.
DELASSUS_API std::string nearest_name_hint(std::string_view name, std::span<const std::string_view> choices);

}  // namespace delassus
