// SPDX-License-Identifier: BSD-3-Clause
// What the build left out is told whole, whatever characters a reason has.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::not_built_test {
namespace {

namespace fs = std::filesystem;

/// The command with a libdelassus of its own, beside which not-built.list has the text.
std::string command_with(const ScratchFolder& scratch, const std::string& text) {
    const auto listed = run_shell(std::string("ldd ") + tests::places::command +
                                  " | sed -n 's/.* => \\(.*libdelassus[.]so[^ ]*\\) .*/\\1/p' | tr -d '\\n'");
    const fs::path library = listed.out;
    fs::create_directories(scratch / "delassus/plugins");
    fs::copy_file(library, scratch / library.filename().string());
    std::ofstream(scratch / "delassus/plugins/not-built.list") << text;
    return "LD_LIBRARY_PATH=" + scratch.path().string() + " " + tests::places::command + " ";
}

TEST(NotBuilt, IsListedWhole) {
    const ScratchFolder scratch;
    const std::string reason = "Some [library; 3.1 was not found: \"x\" (Debian: libsome-dev or libsome3-dev)";
    const auto command =
        command_with(scratch, "solver\tsome\t" + reason + "\npart\tSome\t" + reason + ": no files of some, no more\n");
    const auto shown = run_shell(command + "plugins list");
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
    EXPECT_NE(shown.out.find("\nsome       " + reason + "\n"), std::string::npos) << shown.out;
    EXPECT_NE(shown.out.find("\n" + reason + ": no files of some, no more\n"), std::string::npos) << shown.out;

    const auto json = nlohmann::json::parse(run_shell(command + "plugins list --json").out);
    EXPECT_EQ(json["not_built"][0]["name"], "some");
    EXPECT_EQ(json["not_built"][0]["reason"], reason);
    EXPECT_EQ(json["left_out"][0]["name"], "Some");

    const auto refused = run_shell(command + "solve " + example("box_stack") + " --solver some");
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find(reason), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace delassus::tests::not_built_test
