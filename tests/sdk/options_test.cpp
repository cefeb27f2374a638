// SPDX-License-Identifier: BSD-3-Clause
// Rows of an option table.
#include "delassus/sdk/options.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <string_view>

namespace delassus::tests::options_test {
namespace {

/// Whether boolean_option takes a default of that type.
template <class Standard>
concept TakenAsDefault = requires(Standard standard) {
    sdk::boolean_option("key", standard, "doc");
};

static_assert(TakenAsDefault<bool> && TakenAsDefault<const char*>);
static_assert(!TakenAsDefault<int> && !TakenAsDefault<double> && !TakenAsDefault<void*> && !TakenAsDefault<std::byte>);

TEST(BooleanOption, TakesItsDefaultAsTextOrAsABool) {
    static constexpr delassus_option rows[] = {sdk::boolean_option("a", "false", ""),
                                               sdk::boolean_option("b", "true", ""),
                                               sdk::boolean_option("c", false, ""), sdk::boolean_option("d", true, "")};
    for (const auto& row : rows) EXPECT_EQ(row.type, DELASSUS_OPTION_BOOLEAN);
    EXPECT_EQ(std::string_view(rows[0].default_value), "false");
    EXPECT_EQ(std::string_view(rows[1].default_value), "true");
    EXPECT_EQ(std::string_view(rows[2].default_value), "false");
    EXPECT_EQ(std::string_view(rows[3].default_value), "true");
}

}  // namespace
}  // namespace delassus::tests::options_test
