// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/config.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"

namespace delassus::config_test {
namespace {

std::string refusal(const std::string& yaml) {
    try {
        static_cast<void>(parse_config(yaml, "test.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(Config, ReadsASolverSection) {
    const Config config = parse_config(
        "solver:\n  name: pgs\n  tolerance: 1e-6\n  max_iterations: 50\n  time_limit: 2.5\n  law: coulomb\n"
        "  options: {omega: 1.2, order: symmetric}\n",
        "test.yaml");
    EXPECT_EQ(config.solver.name, "pgs");
    EXPECT_EQ(config.solver.tolerance, 1e-6);
    EXPECT_EQ(config.solver.max_iterations, 50);
    EXPECT_EQ(config.solver.time_limit, 2.5);
    EXPECT_EQ(config.solver.law, Law::Coulomb);
    EXPECT_EQ(config.solver.options, (OptionTexts{{"omega", "1.2"}, {"order", "symmetric"}}));
    EXPECT_EQ(parse_config("solver: apgd", "x").solver.name, "apgd");
}

TEST(Config, RefusesWithFileLineAndKey) {
    EXPECT_EQ(refusal("solver:\n  name: pgs\n  toleranc: 1e-6\n"),
              "test.yaml, line 3: \"solver\" has no key \"toleranc\"; did you mean \"tolerance\"?");
    EXPECT_NE(refusal("solver:\n  tolerance: much\n").find("line 2: \"tolerance\" is \"much\"; it must be a number"),
              std::string::npos);
    EXPECT_NE(refusal("solver: {name: a, name: b}").find("given twice"), std::string::npos);
    EXPECT_NE(refusal("solver: [a\n").find("not valid YAML"), std::string::npos);
    EXPECT_NE(refusal("solver: {law: dry}").find("dry"), std::string::npos);
    EXPECT_NE(refusal("").find("empty"), std::string::npos);
    EXPECT_NE(refusal("- 1\n").find("must be a map"), std::string::npos);
}

TEST(Config, ReadsTheShortForm) {
    const auto solver = parse_solver("pgs(omega=1.2,order=symmetric)");
    EXPECT_EQ(solver.name, "pgs");
    EXPECT_EQ(solver.options, (OptionTexts{{"omega", "1.2"}, {"order", "symmetric"}}));
    EXPECT_TRUE(parse_solver("apgd").options.empty());
    EXPECT_THROW(static_cast<void>(parse_solver("pgs(omega")), InputError);
    EXPECT_THROW(static_cast<void>(parse_solver("pgs(omega)")), InputError);
    EXPECT_THROW(static_cast<void>(parse_solver("(a=b)")), InputError);
}

TEST(Config, TakesOptionsBehindTheName) {
    const auto solver = [](const std::string& text) { return parse_config("solver: " + text, "x").solver; };
    EXPECT_EQ(solver("pgs(omega=1.2)").name, "pgs");
    EXPECT_EQ(solver("pgs(omega=1.2)").options, (OptionTexts{{"omega", "1.2"}}));
    const auto both = solver("{name: \"pgs(omega=1.2,order=symmetric)\", options: {omega: 1.5}}");
    EXPECT_EQ(both.name, "pgs");
    EXPECT_EQ(both.options, (OptionTexts{{"omega", "1.5"}, {"order", "symmetric"}}));
    EXPECT_NE(refusal("solver:\n  name: pgs(omega\n").find("test.yaml, line 2"), std::string::npos);
}

TEST(Config, APathMayHaveBrackets) {
    EXPECT_EQ(parse_solver("/home/me (old)/a(b)/mine.so").name, "/home/me (old)/a(b)/mine.so");
    const auto chosen = parse_solver("/home/me (old)/mine.so(step=0.5)");
    EXPECT_EQ(chosen.name, "/home/me (old)/mine.so");
    EXPECT_EQ(chosen.options, (OptionTexts{{"step", "0.5"}}));
    EXPECT_EQ(parse_solver("auto(ranking=/a/b.json)").name, "auto");
}

TEST(Config, ANewChoiceKeepsTheOptionsOfTheSameSolver) {
    SolverConfig config = parse_solver("pgs(omega=1.2,order=symmetric)");
    choose(config, "pgs(omega=1.5)");
    EXPECT_EQ(config.options, (OptionTexts{{"omega", "1.5"}, {"order", "symmetric"}}));
    choose(config, "apgd");
    EXPECT_TRUE(config.options.empty());
    SolverConfig unnamed;
    unnamed.options = {{"ranking", "file"}};
    choose(unnamed, "auto");
    EXPECT_EQ(unnamed.options, (OptionTexts{{"ranking", "file"}})) << "who names none means auto";
}

TEST(Options, AreCheckedAgainstTheTable) {
    const std::vector<OptionInfo> table = {
        {"omega", DELASSUS_OPTION_REAL, "1", 0.0, 2.0, {}, "", ""},
        {"sweeps", DELASSUS_OPTION_INTEGER, "10", 1.0, INFINITY, {}, "", ""},
        {"order", DELASSUS_OPTION_CHOICE, "forward", 0.0, 0.0, {"forward", "symmetric"}, "", ""},
        {"exact", DELASSUS_OPTION_BOOLEAN, "false", 0.0, 1.0, {}, "", ""}};
    const auto values = resolve_options("pgs", table, {{"omega", "1.5"}, {"exact", "true"}});
    EXPECT_EQ(values[0].real, 1.5);
    EXPECT_EQ(values[1].integer, 10);
    EXPECT_EQ(values[2].text, "forward");
    EXPECT_EQ(values[3].integer, 1);
    const auto message = [&](const OptionTexts& chosen) -> std::string {
        try {
            static_cast<void>(resolve_options("pgs", table, chosen));
        } catch (const InputError& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(message({{"omga", "1"}}), "pgs has no option \"omga\"; did you mean \"omega\"?");
    EXPECT_EQ(message({{"omega", "3"}}), "option \"omega\" of pgs cannot be \"3\": it is a number from 0 to 2");
    EXPECT_EQ(message({{"omega", "nan"}}), "option \"omega\" of pgs cannot be \"nan\": it is a number from 0 to 2");
    EXPECT_EQ(message({{"sweeps", "1.5"}}), "option \"sweeps\" of pgs cannot be \"1.5\": it is an integer, at least 1");
    EXPECT_EQ(message({{"order", "up"}}), "option \"order\" of pgs cannot be \"up\": it is one of forward, symmetric");
    EXPECT_EQ(message({{"exact", "1"}}), "option \"exact\" of pgs cannot be \"1\": it is true or false");
}

}  // namespace
}  // namespace delassus::config_test
