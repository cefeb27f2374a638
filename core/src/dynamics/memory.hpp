// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <delassus/error.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace delassus {

/// The next `count` numbers of a memory that a timestepper saved, which `rest` is then without. owner: whose memory,
/// for the message. Throws InputError where it is too short.
[[nodiscard]] inline std::span<const double> take_from(std::span<const double>& rest, std::size_t count,
                                                       std::string_view owner) {
    if (rest.size() < count) throw InputError("the memory of " + std::string(owner) + " is too short");
    const auto taken = rest.first(count);
    rest = rest.subspan(count);
    return taken;
}

}  // namespace delassus
