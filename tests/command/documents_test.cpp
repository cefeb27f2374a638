// SPDX-License-Identifier: BSD-3-Clause
// The manual page, and the completions in the shells themselves.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::documents_test {
namespace {

using Words = std::set<std::string>;

Words words_of(const std::string& text) {
    std::istringstream stream(text);
    Words result;
    for (std::string word; stream >> word;) result.insert(word);
    return result;
}

bool is_installed(const std::string& program) {
    return run_shell("command -v " + program).exit_code == 0;
}

std::string document(const std::string& kind) {
    const auto result = run_command("documents " + kind);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
}

/// The subcommands that people have, by their words, and the options that --help lists of each.
std::map<std::string, Words> options_by_command() {
    std::map<std::string, Words> result;
    for (const std::string command : {"",
                                      "solve",
                                      "run",
                                      "equilibrium",
                                      "view",
                                      "plan",
                                      "compare",
                                      "bench",
                                      "bench run",
                                      "bench report",
                                      "bench compare",
                                      "bench list",
                                      "plugins",
                                      "plugins list",
                                      "plugins info",
                                      "plugins check",
                                      "plugins describe",
                                      "plugins install",
                                      "plugins remove",
                                      "inspect",
                                      "convert",
                                      "import",
                                      "generate",
                                      "documents"}) {
        std::istringstream help(run_command(command + " --help").out);
        for (std::string line; std::getline(help, line);) {
            if (line.rfind("  -", 0) != 0) continue;
            std::istringstream names(line.substr(0, line.find(' ', 2)));
            for (std::string name; std::getline(names, name, ',');) {
                while (name.front() == ' ') name.erase(0, 1);
                result[command].insert(name);
            }
        }
        EXPECT_TRUE(result[command].count("--help")) << command;
    }
    return result;
}

/// A folder with files of all kinds, in which a shell completes lines.
class Shells : public ::testing::Test {
protected:
    Shells() {
        for (const std::string kind : {"bash", "zsh", "fish"}) {
            std::filesystem::create_directories(scratch_ / kind);
            std::ofstream(scratch_ / kind / (kind == "zsh" ? "_delassus" : "delassus")) << document(kind);
        }
        std::filesystem::create_directories(scratch_ / "here" / "folder");
        for (const std::string name : {"scene.yaml", "problem.h5", "solver.so", "robot.urdf", "notes.txt"})
            std::ofstream(scratch_ / "here" / name) << "";
    }

    [[nodiscard]] std::string in_folder(const std::string& line) const {
        return "cd " + (scratch_ / "here").string() +
               " && PATH=" + std::filesystem::path(tests::places::command).parent_path().string() + ":$PATH " + line;
    }

    /// What bash offers for the last word of the line; one that ends with a space has an empty last word.
    [[nodiscard]] Words bash(const std::string& line) const {
        const std::string words = line.back() == ' ' ? line + R"("")" : line;
        const auto result = run_shell(in_folder("bash -u -c '. ../bash/delassus; COMP_WORDS=(delassus " + words +
                                                "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _delassus; "
                                                "printf \"%s\\n\" \"${COMPREPLY[@]}\"'"));
        EXPECT_EQ(result.exit_code, 0) << line;
        EXPECT_EQ(result.err, "") << line;
        return words_of(result.out);
    }
    [[nodiscard]] Words fish(const std::string& line) const {
        const auto result = run_shell(in_folder("HOME=" + scratch_.path().string() +
                                                " fish --no-config -c 'source ../fish/delassus; "
                                                "complete -C \"delassus " +
                                                line + "\"' | cut -f1"));
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(result.err, "") << line;
        return words_of(result.out);
    }
    [[nodiscard]] Words zsh(const std::string& line) const {
        const ScratchFolder own;
        const auto result =
            run_shell(in_folder(std::string("zsh -f ") + tests::places::source + "/tests/command/zsh-offers.zsh " +
                                (scratch_ / "zsh").string() + " " + own.path().string() + " 'delassus " + line + "'"));
        EXPECT_EQ(result.exit_code, 0) << line << "\n" << result.out << result.err;
        return words_of(result.out);
    }

    ScratchFolder scratch_;
};

TEST_F(Shells, BashOffersCommandsNamesAndFiles) {
    EXPECT_EQ(bash("so"), Words{"solve"});
    EXPECT_EQ(bash("work"), Words{}) << "hidden";
    EXPECT_EQ(bash("plugins che"), Words{"check"});
    EXPECT_EQ(bash("run --integrator moreau"), Words{"moreau_jean"});
    EXPECT_EQ(bash("run --law "), (Words{"associated", "coulomb"}));
    EXPECT_EQ(bash("run --law = cou"), Words{"coulomb"});  // bash splits --law=cou
    EXPECT_EQ(bash("solve --partition s"), Words{"scotch"});
    EXPECT_EQ(bash("solve --solver minr"), Words{"minres"});
    EXPECT_EQ(bash("compare problem.h5 --solvers apgd,sp"), Words{"apgd,spg"});
    EXPECT_EQ(bash("run "), (Words{"folder", "scene.yaml"}));
    EXPECT_EQ(bash("run --set run --json sc"), Words{"scene.yaml"}) << "a value that looks like a command";
    EXPECT_EQ(bash("solve "), (Words{"folder", "problem.h5"}));
    EXPECT_EQ(bash("compare folder folder p"), Words{"problem.h5"});
    EXPECT_EQ(bash("solve folder "), Words{});
    EXPECT_EQ(bash("import r"), Words{"robot.urdf"});
    EXPECT_EQ(bash("plugins info ss"), (Words{"ssn"}));
    EXPECT_EQ(bash("plugins info so"), (Words{"solver.so"}));
    EXPECT_EQ(bash("bench run quic"), Words{"quick"});
    EXPECT_EQ(bash("generate sphere_p"), Words{"sphere_pile"});
    EXPECT_EQ(bash("generate sphere_pile n"), Words{"notes.txt"});
    EXPECT_EQ(bash("view "), Words{"folder"});
}

TEST_F(Shells, EveryOptionOfHelpIsOffered) {
    const std::string zsh_text = document("zsh");
    const bool has_fish = is_installed("fish");
    for (const auto& [command, options] : options_by_command()) {
        const std::string before = command.empty() ? "" : command + " ";
        EXPECT_EQ(bash(before + "-"), options) << command;
        if (has_fish) {
            EXPECT_EQ(fish(before + "-"), options) << command;
        }
        std::string name = command.empty() ? "" : "_" + command;
        std::replace(name.begin(), name.end(), ' ', '_');
        const auto begin = zsh_text.find("\n_delassus" + name + "() {");
        ASSERT_NE(begin, std::string::npos) << command;
        const std::string table = zsh_text.substr(begin, zsh_text.find("\n}\n", begin) - begin);
        for (const auto& option : options)
            EXPECT_NE(table.find(option + "["), std::string::npos) << command << " " << option;
    }
}

TEST_F(Shells, FishOffersTheSame) {
    if (!is_installed("fish")) GTEST_SKIP() << "there is no fish";
    EXPECT_EQ(fish("so"), Words{"solve"});
    EXPECT_EQ(fish("plugins che"), Words{"check"});
    EXPECT_EQ(fish("bench "), (Words{"run", "report", "compare", "list"}));
    EXPECT_EQ(fish("run --law "), (Words{"associated", "coulomb"}));
    EXPECT_EQ(fish("solve --solver minr"), Words{"minres"});
    EXPECT_EQ(fish("compare problem.h5 --solvers apgd,sp"), Words{"apgd,spg"});
    EXPECT_EQ(fish("run "), (Words{"folder/", "scene.yaml"}));
    EXPECT_EQ(fish("plugins info s"), (Words{"siconos", "spg", "ssn", "solver.so"}));
    EXPECT_EQ(fish("bench run quic"), Words{"quick"});
    EXPECT_EQ(fish("generate sphere_pile n"), Words{"notes.txt"});
}

TEST_F(Shells, ZshOffersTheSame) {
    if (!is_installed("zsh")) GTEST_SKIP() << "there is no zsh";
    EXPECT_EQ(zsh("so"), Words{"solve"});
    EXPECT_EQ(zsh("bench "), (Words{"run", "report", "compare", "list"}));
    EXPECT_EQ(zsh("bench run --o"), (Words{"--only", "--output"}));
    EXPECT_EQ(zsh("run --law "), (Words{"associated", "coulomb"}));
    EXPECT_EQ(zsh("compare problem.h5 --solvers apgd,sp"), Words{"spg"});
    EXPECT_EQ(zsh("run "), (Words{"folder", "scene.yaml"}));
    EXPECT_EQ(zsh("plugins info s"), (Words{"siconos", "spg", "ssn", "solver.so"}));
}

TEST(Documents, TheManualHasEveryOptionOfEveryCommand) {
    std::string manual = document("man");
    EXPECT_EQ(manual.rfind(".TH DELASSUS 1", 0), 0U);
    const ScratchFolder scratch;
    std::ofstream(scratch / "delassus.1") << manual;
    for (std::size_t at; (at = manual.find("\\-")) != std::string::npos;) manual.replace(at, 2, "-");
    for (const auto& [command, options] : options_by_command()) {
        const auto begin = manual.find(command.empty() ? ".SH OPTIONS\n" : ".SS delassus " + command + "\n");
        ASSERT_NE(begin, std::string::npos) << command;
        const std::string section = manual.substr(begin, manual.find("\n.S", begin + 3) - begin);
        for (const auto& option : options)
            EXPECT_NE(section.find("\\fB" + option + "\\fR"), std::string::npos) << command << " " << option;
    }
    const std::string page = (scratch / "delassus.1").string();
    for (const std::string& checker : {"groff -man -ww -Tutf8 -K utf8 -z " + page, "mandoc -Tlint -W all " + page}) {
        if (!is_installed(checker.substr(0, checker.find(' ')))) continue;
        const auto checked = run_shell(checker);
        EXPECT_EQ(checked.exit_code, 0) << checker;
        EXPECT_EQ(checked.out + checked.err, "");
    }
}

TEST(Documents, APackageCanSayTheDayOfTheManual) {
    const auto result = run_shell(std::string("SOURCE_DATE_EPOCH=86400 ") + tests::places::command + " documents man");
    EXPECT_EQ(result.out.rfind(".TH DELASSUS 1 \"1970-01-02\"", 0), 0U) << result.out.substr(0, 80);
}

TEST(Documents, OthersAreRefused) {
    const auto result = run_command("documents html");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err,
              "delassus: there is no document \"html\"; it must be one of "
              "man|bash|zsh|fish|solvers|integrators|kinds|suites\n");
}

}  // namespace
}  // namespace delassus::tests::documents_test
