// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// What an exception says, for a person: that of the library as it is, those of the standard library, of files and of
/// JSON without their own words for where they come from.
DELASSUS_API std::string sentence_of(const std::exception& error);

}  // namespace delassus
