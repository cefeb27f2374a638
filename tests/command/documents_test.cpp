// SPDX-License-Identifier: BSD-3-Clause
// The manual page and the completions of shells.
#include <gtest/gtest.h>

#include <sstream>

#include "support/run_command.hpp"

namespace delassus::tests::documents_test {
namespace {

std::string document(const std::string& kind) {
    const auto result = run_command("documents " + kind);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
}

/// What the function of the completions offers for the words, the last of which is being typed.
std::string offered(const ScratchFolder& scratch, const std::string& words, int current) {
    std::ofstream(scratch / "completions") << document("bash");
    const std::string folder = std::filesystem::path(DELASSUS_COMMAND).parent_path().string();
    const auto result =
        run_shell("cd " + scratch.path().string() + " && touch scene.yaml && PATH=" + folder +
                  ":$PATH bash -c 'complete() { :; }; . ./completions; COMP_WORDS=(" + words +
                  "); COMP_CWORD=" + std::to_string(current) + "; _delassus; printf \"%s \" \"${COMPREPLY[@]}\"'");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return result.out;
}

TEST(Documents, BashOffersCommandsOptionsNamesAndFiles) {
    const ScratchFolder scratch;
    EXPECT_EQ(offered(scratch, "delassus so", 1), "solve ");
    EXPECT_EQ(offered(scratch, "delassus plugins che", 2), "check ");
    EXPECT_EQ(offered(scratch, "delassus run --integ", 2), "--integrator ");
    EXPECT_EQ(offered(scratch, "delassus run --integrator moreau", 3), "moreau_jean ");
    EXPECT_EQ(offered(scratch, "delassus solve --solver minr", 3), "minres ");
    EXPECT_EQ(offered(scratch, "delassus run --law cou", 3), "coulomb ");
    EXPECT_EQ(offered(scratch, "delassus run sce", 2), "scene.yaml ");
    EXPECT_EQ(offered(scratch, "delassus work", 1).find("worker"), std::string::npos) << "hidden";
}

TEST(Documents, TheManualHasEveryOptionOfEveryCommand) {
    const std::string manual = document("man");
    EXPECT_EQ(manual.rfind(".TH DELASSUS 1", 0), 0U);
    const auto plain = [](std::string text) {
        for (std::size_t at; (at = text.find("\\-")) != std::string::npos;) text.replace(at, 2, "-");
        return text;
    };
    for (const std::string command : {"solve", "run", "compare", "inspect", "convert", "generate"}) {
        const auto begin = manual.find(".SS delassus " + command + "\n");
        ASSERT_NE(begin, std::string::npos) << command;
        const std::string section = plain(manual.substr(begin, manual.find(".SS", begin + 3) - begin));
        std::istringstream help(run_command(command + " --help").out);
        int count = 0;
        for (std::string word; help >> word;)
            if (word.rfind("--", 0) == 0 && word.size() > 2 && word.find_first_of("=[<") == std::string::npos) {
                const std::string flag = word.substr(0, word.find_first_of(",.;"));
                EXPECT_NE(section.find(flag), std::string::npos) << command << " " << flag;
                ++count;
            }
        EXPECT_GE(count, 1) << command;
    }
    if (run_shell("command -v groff").exit_code != 0) return;
    const ScratchFolder scratch;
    std::ofstream(scratch / "delassus.1") << manual;
    const auto set = run_shell("groff -man -ww -Tutf8 -K utf8 " + (scratch / "delassus.1").string());
    EXPECT_EQ(set.exit_code, 0);
    EXPECT_EQ(set.err, "");
}

TEST(Documents, OtherShellsHaveTheSameWords) {
    const std::string zsh = document("zsh"), fish = document("fish");
    EXPECT_EQ(zsh.rfind("#compdef delassus\n", 0), 0U);
    for (const std::string option : {"integrator", "plugin-path", "pictures", "tolerance"}) {
        EXPECT_NE(zsh.find("--" + option + "["), std::string::npos) << option;
        EXPECT_NE(fish.find(" -l " + option + " "), std::string::npos) << option;
    }
    for (const auto& [shell, text] : {std::pair{"zsh", zsh}, {"fish", fish}}) {
        if (run_shell(std::string("command -v ") + shell).exit_code != 0) continue;
        const ScratchFolder scratch;
        std::ofstream(scratch / "completions") << text;
        const auto checked = run_shell(std::string(shell) + " -n " + (scratch / "completions").string());
        EXPECT_EQ(checked.exit_code, 0) << shell << ": " << checked.err;
    }
}

TEST(Documents, OthersAreRefused) {
    const auto result = run_command("documents html");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err,
              "delassus: there is no document \"html\"; it must be man, bash, zsh, fish, solvers or integrators\n");
}

}  // namespace
}  // namespace delassus::tests::documents_test
