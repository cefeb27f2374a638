// SPDX-License-Identifier: BSD-3-Clause
// The generated parts of the documentation are what the plugins say now.
#include <gtest/gtest.h>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::docs_test {
namespace {

TEST(Docs, TablesAreUpToDate) {
#ifdef DELASSUS_TEST_CONE
    GTEST_SKIP() << "the tables do not show the kind of cone that only tests know";
#endif
    const auto listed = run_command("plugins list --json");
    if (listed.out.find("\"not_built\": []") == std::string::npos)
        GTEST_SKIP() << "the tables show all solvers; this build leaves some out";
    const auto result = run_shell(std::string("DELASSUS_COMMAND=") + tests::places::command + " " +
                                  tests::places::source + "/scripts/update-docs --check");
    EXPECT_EQ(result.exit_code, 0) << "run scripts/update-docs\n" << result.out << result.err;
}

}  // namespace
}  // namespace delassus::tests::docs_test
