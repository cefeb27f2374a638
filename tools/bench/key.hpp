// SPDX-License-Identifier: BSD-3-Clause
// Keys of content: what a result or a reference is known by.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "problem/structure.hpp"

namespace delassus::bench {

/// 16 hexadecimal digits of the parts, in order.
inline std::string key_of(const std::vector<std::string>& parts) {
    Hash hash;
    for (const auto& part : parts) hash.add(std::vector<char>(part.begin(), part.end()));
    return fmt::format("{:016x}", hash.value());
}

/// The digits that read back as the same number.
inline std::string digits(double value) {
    return fmt::format("{}", value);
}

}  // namespace delassus::bench
