// SPDX-License-Identifier: BSD-3-Clause
// The border's create() has no argument that names a class. Where a program makes plugins as it runs, each gets a
// create() of its own out of this table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "delassus/plugin.h"

namespace delassus {

inline constexpr std::size_t most_created_plugins = 64;

using CreateFunction = std::int32_t (*)(const delassus_option_value*, std::int32_t, void**);
using NumberedCreate = std::int32_t (*)(std::size_t number, const delassus_option_value*, std::int32_t, void**);

template <NumberedCreate create, std::size_t number>
std::int32_t create_slot(const delassus_option_value* values, std::int32_t count, void** solver) {
    return create(number, values, count, solver);
}

template <NumberedCreate create, std::size_t... numbers>
constexpr std::array<CreateFunction, sizeof...(numbers)> make_create_slots(std::index_sequence<numbers...>) {
    return {&create_slot<create, numbers>...};
}

/// The functions that call create(number, …), by their numbers.
template <NumberedCreate create>
inline constexpr auto create_slots = make_create_slots<create>(std::make_index_sequence<most_created_plugins>());

}  // namespace delassus
