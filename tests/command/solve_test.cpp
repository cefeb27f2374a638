// SPDX-License-Identifier: BSD-3-Clause
// `delassus solve` as its users run it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "support/run_command.hpp"

namespace delassus::tests::solve_test {
namespace {

using Json = nlohmann::json;

TEST(SolveCommand, ReportsInJson) {
    const auto result = run_command("solve " + example("box_stack") + " --solver apgd --tolerance 1e-7 --json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json report = Json::parse(result.out);
    EXPECT_EQ(report["solver"], "apgd");
    EXPECT_EQ(report["problem"], "box_stack");
    EXPECT_EQ(report["status"], "solved");
    EXPECT_GT(report["iterations"], 0);
    EXPECT_GE(report["seconds"]["setup"], 0.0);
    EXPECT_GT(report["seconds"]["solve"], 0.0);
    EXPECT_LE(report["error"]["natural"], 1e-7);
    for (const char* name : {"siconos", "balance", "cone", "dual", "gap"})
        EXPECT_TRUE(report["error"][name].is_number()) << name;
    EXPECT_TRUE(result.err.empty()) << "nothing is shown when piped: " << result.err;
}

TEST(SolveCommand, ExitCodesTellWhatHappened) {
    const std::string stack = example("box_stack");
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd").exit_code, 0);
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd --max-iterations 2").exit_code, 3);
    const auto refused = run_command("solve " + stack + " --solver minres");
    EXPECT_EQ(refused.exit_code, 4);
    EXPECT_NE(refused.err.find("minres cannot solve \"box_stack\": 40 friction cones"), std::string::npos)
        << refused.err;
    EXPECT_NE(refused.err.find("Can: admm, apgd"), std::string::npos) << refused.err;
    const auto unknown = run_command("solve " + stack + " --solver apgb");
    EXPECT_EQ(unknown.exit_code, 2);
    EXPECT_NE(unknown.err.find("did you mean \"apgd\"?"), std::string::npos) << unknown.err;
    EXPECT_EQ(run_command("solve " + stack).exit_code, 0) << "auto chooses";
    EXPECT_EQ(run_command("solve").exit_code, 2);
    EXPECT_EQ(run_command("").exit_code, 2);
    EXPECT_EQ(run_command("solve no/such/folder --solver apgd").exit_code, 2);
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd --tolerance -1").exit_code, 2);
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd --tolerance nan").exit_code, 2);
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd --law dry").exit_code, 2);
    EXPECT_EQ(run_command("solve " + stack + " --solver apgd --set nonsense").exit_code, 2);
    EXPECT_EQ(run_command("solve " + stack + " --solver ./no-such-library.so").exit_code, 2);
}

TEST(SolveCommand, TakesOptionsBehindTheName) {
    const std::string base = "solve " + example("box_stack") + " --tolerance 1e-4 --json --solver ";
    const auto options = [&](const std::string& arguments) {
        const auto result = run_command(base + arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out)["options"];
    };
    EXPECT_EQ(options("'pgs(omega=1.2)'"), (Json{{"omega", "1.2"}}));
    EXPECT_EQ(options("'ssn(follow_law=false)' --law coulomb"), (Json{{"follow_law", "false"}}));
    EXPECT_EQ(options("'pgs(omega=1.2,variant=symmetric)' --set omega=1.1"),
              (Json{{"omega", "1.1"}, {"variant", "symmetric"}}));
    const auto wrong = run_command(base + "'pgs(omga=1.2)'");
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.err.find("did you mean \"omega\"?"), std::string::npos) << wrong.err;
}

TEST(Command, NamesTheNearestCommandAndOption) {
    const std::string stack = example("box_stack");
    const std::pair<std::string, std::string> cases[] = {
        {"runn scene.yaml", "`delassus` has no command \"runn\"; did you mean \"run\"?"},
        {"Solve " + stack, "`delassus` has no command \"Solve\"; did you mean \"solve\"?"},
        {"xyzzyplugh", "`delassus` has no command \"xyzzyplugh\"; there are solve, run, "},
        {"plugins", "`delassus plugins` needs a command: list, info, check, describe"},
        {"plugins lst", "`delassus plugins` has no command \"lst\"; did you mean \"list\"?"},
        {"bench rnu quick", "`delassus bench` has no command \"rnu\"; did you mean \"run\"?"},
        {"--versoin", "`delassus` has no option \"--versoin\"; did you mean \"--version\"?"},
        {"solve " + stack + " --tolerence 1e-4",
         "`delassus solve` has no option \"--tolerence\"; did you mean \"--tolerance\"?"},
        {"solve " + stack + " --tolerence=1e-4",
         "`delassus solve` has no option \"--tolerence\"; did you mean \"--tolerance\"?"},
        {"solve --tolerence 1e-4 " + stack,
         "`delassus solve` has no option \"--tolerence\"; did you mean \"--tolerance\"?"},
        {"compare --solver pgs " + stack, "`delassus compare` has no option \"--solver\"; did you mean \"--solvers\"?"},
        {"plugins list --jsno", "`delassus plugins list` has no option \"--jsno\"; did you mean \"--json\"?"},
        {"solve " + stack + " two", "`delassus solve` has no use for \"two\""},
    };
    for (const auto& [arguments, sentence] : cases) {
        const auto result = run_command(arguments);
        EXPECT_EQ(result.exit_code, 2) << arguments;
        EXPECT_NE(result.err.find("delassus: " + sentence), std::string::npos) << arguments << ": " << result.err;
    }
    EXPECT_EQ(run_command("nothing").err.find("worker"), std::string::npos) << "what is hidden stays hidden";
}

TEST(SolveCommand, EveryLevelHasHelp) {
    for (const char* level : {"", "solve", "compare", "plugins", "plugins list", "plugins info", "plugins check",
                              "convert", "inspect", "generate"}) {
        const auto result = run_command(std::string(level) + " --help");
        EXPECT_EQ(result.exit_code, 0) << level;
        EXPECT_NE(result.out.find("Usage"), std::string::npos) << level << result.out;
    }
    EXPECT_EQ(run_command("--version").out.rfind("delassus ", 0), 0u);
}

TEST(SolveCommand, WarmStartFromItsOwnSolution) {
    const ScratchFolder scratch;
    const std::string base = "solve " + example("box_stack") + " --solver apgd --json ";
    const auto first = run_command(base + "--solution " + (scratch / "s").string());
    ASSERT_EQ(first.exit_code, 0) << first.err;
    const auto second = run_command(base + "--warm-start " + (scratch / "s").string());
    ASSERT_EQ(second.exit_code, 0) << second.err;
    EXPECT_EQ(Json::parse(second.out)["iterations"], 0);
    EXPECT_EQ(Json::parse(text_of(scratch / "s" / "report.json"))["status"], "solved");
    const auto wrong =
        run_command("solve " + example("chain") + " --solver apgd --warm-start " + (scratch / "s").string());
    EXPECT_EQ(wrong.exit_code, 2) << wrong.err;
}

TEST(SolveCommand, ConfigurationIsOverriddenByFlags) {
    const ScratchFolder scratch;
    std::ofstream(scratch / "c.yaml") << "solver:\n  name: spg\n  tolerance: 1e-5\n  max_iterations: 7000\n";
    const std::string base = "solve " + example("box_stack") + " --json --config " + (scratch / "c.yaml").string();
    const Json plain = Json::parse(run_command(base).out);
    EXPECT_EQ(plain["solver"], "spg");
    EXPECT_EQ(plain["tolerance"], 1e-5);
    const Json flagged = Json::parse(run_command(base + " --solver apgd --tolerance 1e-6").out);
    EXPECT_EQ(flagged["solver"], "apgd");
    EXPECT_EQ(flagged["tolerance"], 1e-6);
    std::ofstream(scratch / "bad.yaml") << "solver:\n  nam: spg\n";
    const auto bad = run_command("solve " + example("box_stack") + " --config " + (scratch / "bad.yaml").string());
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_NE(bad.err.find("line 2"), std::string::npos) << bad.err;
}

TEST(SolveCommand, CurveStandsInTheReport) {
    const auto result = run_command("solve " + example("sphere_pile") + " --solver apgd --json --curve");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json samples = Json::parse(result.out)["curve"]["samples"];
    ASSERT_GT(samples.size(), 10u);
    for (std::size_t k = 1; k < samples.size(); ++k)
        EXPECT_GE(samples[k][1], samples[k - 1][1]) << "time runs forwards";
    EXPECT_LE(samples.back()[2], 1e-8);
    EXPECT_GT(samples.front()[2], 0.1);
}

TEST(SolveCommand, TimeLimitEndsASolveWithWhatWasReached) {
    const auto result = run_command("solve " + example("sphere_pile") +
                                    " --solver apgd --tolerance 1e-300 --max-iterations 1000000000 "
                                    "--time-limit 0.2 --json");
    EXPECT_EQ(result.exit_code, 3);
    const Json report = Json::parse(result.out);
    EXPECT_TRUE(report["status"] == "time_limit" || report["status"] == "stalled") << report["status"];
    EXPECT_LT(report["error"]["natural"], 1e-3);
}

TEST(Convert, RoundTripsThroughFclib) {
    const ScratchFolder scratch;
    const auto hdf5 = (scratch / "pile.hdf5").string(), folder = (scratch / "pile").string();
    const auto unsaid = run_command("convert " + example("sphere_pile") + " " + hdf5);
    EXPECT_EQ(unsaid.exit_code, 2);
    EXPECT_NE(unsaid.err.find("--law coulomb"), std::string::npos) << unsaid.err;
    ASSERT_EQ(run_command("convert --law coulomb " + example("sphere_pile") + " " + hdf5).exit_code, 0);
    ASSERT_EQ(run_command("convert " + hdf5 + " " + folder).exit_code, 0);
    for (const char* file : {"H.mtx", "D.mtx", "a.mtx", "b.mtx"})
        EXPECT_EQ(text_of(scratch / "pile" / file), text_of(std::filesystem::path(example("sphere_pile")) / file))
            << file;
    EXPECT_EQ(run_command("solve " + hdf5 + " --solver apgd --law associated").exit_code, 0);
    const auto refused = run_command("convert " + example("walker") + " " + (scratch / "walker.hdf5").string());
    EXPECT_EQ(refused.exit_code, 2) << "FCLib has no boxes";
    EXPECT_FALSE(std::filesystem::exists(scratch / "walker.hdf5"));
}

TEST(Inspect, TellsWhatAProblemNeeds) {
    const auto result = run_command("inspect " + example("walker") + " --json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    for (const char* kind : {"free", "nonnegative", "box", "friction"})
        EXPECT_TRUE(json["cones"].contains(kind)) << kind;
    const auto needs = json["needs"].get<std::vector<std::string>>();
    EXPECT_NE(std::find(needs.begin(), needs.end(), "compliance"), needs.end());
    const Json tops = Json::parse(run_command("inspect " + example("tops") + " --json").out);
    EXPECT_EQ(tops["structure"], "unsymmetric");
    const Json chain = Json::parse(run_command("inspect " + example("chain") + " --json").out);
    EXPECT_EQ(chain["rank"], 120);
    EXPECT_EQ(chain["m"], 240);
}

TEST(Examples, AreWhatTheirLinesMake) {
    const ScratchFolder scratch;
    std::istringstream table(text_of(std::filesystem::path(example("README.md"))));
    int made = 0;
    for (std::string line; std::getline(table, line);) {
        const auto begin = line.find("| `");
        if (line.rfind("| ", 0) != 0 || begin == std::string::npos) continue;
        const std::string name = line.substr(2, line.find(' ', 2) - 2);
        const std::string call = line.substr(begin + 3, line.find('`', begin + 3) - begin - 3);
        const auto space = call.find(' ');
        const std::string kind = call.substr(0, space), settings = space == std::string::npos ? "" : call.substr(space);
        ASSERT_EQ(run_command("generate " + kind + " " + (scratch / name).string() + settings).exit_code, 0) << line;
        for (const char* file : {"problem.json", "H.mtx", "D.mtx", "a.mtx", "b.mtx"})
            EXPECT_EQ(text_of(scratch / name / file), text_of(std::filesystem::path(example(name)) / file))
                << name << " " << file;
        ++made;
    }
    EXPECT_EQ(made, 8);
}

}  // namespace
}  // namespace delassus::tests::solve_test
