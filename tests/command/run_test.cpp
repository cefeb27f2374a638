// SPDX-License-Identifier: BSD-3-Clause
// `delassus run` and `delassus plan` as a user would call them.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::run_test {
namespace {

using Json = nlohmann::json;

std::string scene(const std::string& name) {
    return (std::filesystem::path(tests::places::source) / "examples" / "scenes" / (name + ".yaml")).string();
}

Json json_of(const std::filesystem::path& file) {
    return Json::parse(text_of(file));
}

TEST(Run, WritesWhatTheDocumentationSays) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const auto result = run_command("run " + scene("bouncing_ball") + " --end 0.05 --every 10 -o " + folder.string());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("main: 100 steps of euler_implicit_linearized to t = 0.05 s"), std::string::npos)
        << result.out;
    EXPECT_TRUE(result.err.empty()) << result.err;  // no progress where there is no terminal
    for (const char* name : {"scene.yaml", "trajectory.h5", "scene.pvd", "report.json", "checkpoint.json"})
        EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
    std::size_t frames = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "vtk")) {
        ++frames;
        EXPECT_NE(text_of(entry.path()).find("NumberOfPolys"), std::string::npos);
    }
    EXPECT_EQ(frames, 11u);
    const std::string collection = text_of(folder / "scene.pvd");
    EXPECT_NE(collection.find("file=\"vtk/main_000010.vtp\""), std::string::npos);
    EXPECT_EQ(text_of(folder / "scene.yaml"), text_of(scene("bouncing_ball")));
    const Json report = json_of(folder / "report.json");
    EXPECT_EQ(report.at("status"), "finished");
    EXPECT_EQ(report.at("systems")[0].at("steps"), 100);
}

TEST(Run, PicturesAreFewAndEvenlyInTime) {
    const ScratchFolder scratch;
    const auto times = [&](const std::string& more) {
        const auto folder = scratch / "run";
        const auto result = run_command("run " + scene("bouncing_ball") + " --end 0.3 -o " + folder.string() + more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        const std::string collection = text_of(folder / "scene.pvd"), word = "timestep=\"";
        std::vector<double> found;
        for (auto at = collection.find(word); at != std::string::npos; at = collection.find(word, at + 1))
            found.push_back(std::stod(collection.substr(at + word.size())));
        const auto files = std::filesystem::directory_iterator(folder / "vtk");
        EXPECT_EQ(std::distance(begin(files), end(files)), static_cast<std::ptrdiff_t>(found.size()));
        return found;
    };
    const auto all = times("");  // 600 steps
    ASSERT_EQ(all.size(), 201u);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_NEAR(all[i], 0.0015 * static_cast<double>(i), 1e-9);
    EXPECT_EQ(times(" --pictures 7").size(), 7u);  // of 0.043 s each, in steps
    EXPECT_EQ(times(" --pictures 0 ").size(), 0u);
    EXPECT_EQ(times(" --pictures 5000").size(), 601u);
}

TEST(Run, JsonIsTheReport) {
    const auto result = run_command("run " + scene("box_on_incline") + " --end 0.05 --json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json report = Json::parse(result.out);
    ASSERT_EQ(report.at("systems").size(), 2u);
    EXPECT_EQ(report.at("systems")[0].at("name"), "sticks");
    EXPECT_EQ(report.at("systems")[1].at("most_contacts"), 4);
    EXPECT_GT(report.at("systems")[1].at("effort").at("iterations"), 0);
}

TEST(Run, CheckSaysHowWrongTheRunIs) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const std::string arguments = "run " + scene("bouncing_ball") + " --end 0.05 --check";
    const auto result = run_command(arguments + " -o " + folder.string());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("main: with half the step bodies end"), std::string::npos) << result.out;
    const Json check = json_of(folder / "report.json").at("systems")[0].at("check");
    // Before it lands the ball is ½ g h t too low, as implicit Euler is.
    const double off = 0.5 * 9.81 * 0.0005 * 0.05;
    EXPECT_NEAR(check.at("error").get<double>() * check.at("extent").get<double>(), off, 0.01 * off);
    EXPECT_TRUE(check.at("apart_from").is_number() || check.at("apart_from").is_null());
    const auto resumed = run_command(arguments + " --resume " + folder.string());
    EXPECT_EQ(resumed.exit_code, 2);
    EXPECT_NE(resumed.err.find("leave out --resume"), std::string::npos) << resumed.err;
}

TEST(Run, ResumedRunEndsInTheSameFiles) {
    const ScratchFolder scratch;
    const auto whole = scratch / "whole", parts = scratch / "parts";
    const std::string arguments = "run " + scene("brick_wall") + " --every 2 ";
    ASSERT_EQ(run_command(arguments + "--end 0.04 -o " + whole.string()).exit_code, 0);
    ASSERT_EQ(run_command(arguments + "--end 0.018 -o " + parts.string()).exit_code, 0);
    const auto resumed = run_command(arguments + "--end 0.04 --resume " + parts.string());
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    Json a = json_of(whole / "checkpoint.json").at("systems")[0];
    Json b = json_of(parts / "checkpoint.json").at("systems")[0];
    for (const char* key : {"t", "q", "v", "memory", "frame_times", "step"}) EXPECT_EQ(a.at(key), b.at(key)) << key;
    EXPECT_EQ(a.at("step"), 20);
    for (const auto& entry : std::filesystem::directory_iterator(whole / "vtk"))
        EXPECT_EQ(text_of(entry.path()), text_of(parts / "vtk" / entry.path().filename().string())) << entry.path();
    EXPECT_EQ(text_of(whole / "scene.pvd"), text_of(parts / "scene.pvd"));
}

TEST(Run, ResumeRefusesAnotherScene) {
    const ScratchFolder scratch;
    const auto folder = (scratch / "run").string();
    ASSERT_EQ(run_command("run " + scene("pendulum") + " --end 0.01 -o " + folder).exit_code, 0);
    const auto result = run_command("run " + scene("pendulum") + " --step 0.002 --end 0.02 --resume " + folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("was of another scene, or with other settings"), std::string::npos) << result.err;
    EXPECT_EQ(run_command("run " + scene("pendulum") + " --resume " + (scratch / "none").string()).exit_code, 2);
}

TEST(Run, ResumeSaysWhereItIsAndNamesTheSolver) {
    const ScratchFolder scratch;
    const auto folder = (scratch / "run").string(), arguments = "run " + scene("brick_wall") + " ";
    const auto whole = run_command(arguments + "--end 0.02 -o " + folder);
    ASSERT_EQ(whole.exit_code, 0) << whole.err;
    const auto passed = run_command(arguments + "--end 0.01 --resume " + folder);
    EXPECT_EQ(passed.exit_code, 2);
    EXPECT_EQ(passed.err, "delassus: " + folder + " has come to t = 0.02 s, beyond the --end of 0.01 s\n");
    const auto again = run_command(arguments + "--end 0.02 --resume " + folder);  // nothing is left to do
    EXPECT_EQ(again.exit_code, 0) << again.err;
    EXPECT_NE(again.out.find(" solves, "), std::string::npos) << again.out;
    EXPECT_EQ(again.out.find("\n  : "), std::string::npos) << again.out;
}

TEST(Run, LeavesForeignFilesAlone) {
    const ScratchFolder scratch;
    std::ofstream(scratch / "thesis.tex") << "x";
    const auto result = run_command("run " + scene("pendulum") + " --end 0.01 -o " + scratch.path().string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("holds thesis.tex, which delassus did not write"), std::string::npos) << result.err;
    EXPECT_TRUE(std::filesystem::exists(scratch / "thesis.tex"));
}

TEST(Run, DumpedProblemsCanBeSolved) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const auto result =
        run_command("run " + scene("brick_wall") + " --end 0.02 --dump-problems 5 -o " + folder.string());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "problems"))
        names.insert(entry.path().filename().string());
    EXPECT_EQ(names, (std::set<std::string>{"main_000005", "main_000010"}));
    const auto solved = run_command("solve " + (folder / "problems" / "main_000010").string() +
                                    " --solver ssn --tolerance 1e-6 --json");
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    EXPECT_EQ(Json::parse(solved.out).at("status"), "solved");
}

TEST(Run, EmptySceneLetsTimePass) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const auto empty = scratch / "empty.yaml";
    std::ofstream(empty) << "step: 0.1\nend: 1\nbodies: []\n";
    const auto result = run_command("run " + empty.string() + " --end 0.5 --contact-forces -o " + folder.string());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("main: 5 steps of euler_implicit_linearized to t = 0.5 s"), std::string::npos)
        << result.out;
    const auto resumed = run_command("run " + empty.string() + " --resume " + folder.string());
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    const Json report = json_of(folder / "report.json");
    EXPECT_EQ(report.at("status"), "finished");
    EXPECT_EQ(report.at("systems")[0].at("steps"), 10);
    EXPECT_EQ(report.at("systems")[0].at("bodies"), Json::object());
    EXPECT_TRUE(std::filesystem::exists(folder / "trajectory.h5"));
    EXPECT_EQ(run_command("view " + folder.string()).exit_code, 0);
    EXPECT_EQ(run_command("plan " + empty.string()).exit_code, 0);
    for (const char* integrator : {"trapezoidal", "generalized_alpha", "rk4"})
        EXPECT_EQ(run_command("run " + empty.string() + " --integrator " + integrator).exit_code, 0) << integrator;
    EXPECT_EQ(run_command("run " + empty.string() + " --tolerance 1e-3").exit_code, 0);
}

TEST(Run, ContactForcesAreWrittenAndGoOn) {
    const ScratchFolder scratch;
    const auto whole = scratch / "whole", parts = scratch / "parts";
    const std::string arguments = "run " + scene("brick_wall") + " --every 2 ";
    ASSERT_EQ(run_command(arguments + "--contact-forces --end 0.016 -o " + whole.string()).exit_code, 0);
    ASSERT_EQ(run_command(arguments + "--contact-forces --end 0.008 -o " + parts.string()).exit_code, 0);
    const auto resumed = run_command(arguments + "--end 0.016 --resume " + parts.string());
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_EQ(text_of(whole / "scene.pvd"), text_of(parts / "scene.pvd"));
    EXPECT_NE(text_of(whole / "scene.pvd").find("part=\"1\" file=\"vtk/main.contacts_000004.vtp\""), std::string::npos);
    for (const auto& entry : std::filesystem::directory_iterator(whole / "vtk"))
        EXPECT_EQ(text_of(entry.path()), text_of(parts / "vtk" / entry.path().filename().string())) << entry.path();

    const auto without = scratch / "without";
    ASSERT_EQ(run_command(arguments + "--end 0.008 -o " + without.string()).exit_code, 0);
    EXPECT_FALSE(std::filesystem::exists(without / "vtk" / "main.contacts_000001.vtp"));
    const auto late = run_command(arguments + "--contact-forces --end 0.016 --resume " + without.string());
    EXPECT_EQ(late.exit_code, 2);
    EXPECT_NE(late.err.find("has no contact forces so far"), std::string::npos) << late.err;
    EXPECT_EQ(run_command("run " + scene("pendulum") + " --contact-forces").exit_code, 2);
}

TEST(Run, SummaryAndPlanSayWhetherBodiesSleep) {
    const std::string settings = " --set 'sleeping={time: 0.02}' ";
    const auto off = run_command("run " + scene("brick_wall") + " --end 0.01");
    EXPECT_EQ(off.out.find("sleeping"), std::string::npos) << off.out;
    const auto on = run_command("run " + scene("brick_wall") + settings + "--end 0.1");
    EXPECT_NE(on.out.find("sleeping: 14 bodies and nodes at the end"), std::string::npos) << on.out;
    const auto report = run_command("run " + scene("brick_wall") + settings + "--end 0.1 --json");
    const Json sleeping = Json::parse(report.out).at("systems")[0].at("sleeping");
    EXPECT_EQ(sleeping.at("bodies"), 14);
    EXPECT_EQ(sleeping.at("time"), 0.02);
    EXPECT_GT(sleeping.at("resting_parts"), 20);
    EXPECT_NE(run_command("plan " + scene("brick_wall")).out.find("sleeping: off"), std::string::npos);
    EXPECT_NE(run_command("plan " + scene("brick_wall") + settings).out.find("sleeping bodies: parts slower than"),
              std::string::npos);
    EXPECT_EQ(run_command("run " + scene("pendulum") + " --set sleeping=true --integrator rk4").exit_code, 4);
}

// A step that takes long: its tolerance is beyond double precision, and `pgs` gives up after a million sweeps, which in
// a wall ten times as long are some twenty seconds.
TEST(Run, InterruptEndsAStepWithinASecond) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    std::string wall = text_of(scene("brick_wall"));
    for (const char* count : {"[4,", "[3,"}) wall.insert(wall.find(count) + 2, "0");
    std::ofstream(scratch / "wall.yaml") << wall;
    const std::string arguments =
        "run " + (scratch / "wall.yaml").string() +
        " --solver pgs --set solver.tolerance=1e-300 --set solver.max_iterations=1000000000000 -o " + folder.string();
    const auto result = run_shell(std::string(tests::places::command) + " " + arguments +
                                  " & sleep 3; kill -INT $!; sleep 1.5; kill -0 $! 2>/dev/null && echo late; wait $!");
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(result.out.find("late"), std::string::npos);
    EXPECT_NE(result.err.find("stopped at t = 0 s; --resume goes on from there"), std::string::npos) << result.err;
    EXPECT_EQ(json_of(folder / "report.json").at("status"), "interrupted");
    EXPECT_EQ(json_of(folder / "checkpoint.json").at("systems")[0].at("step"), 0);
}

TEST(Run, FailedStepSaysWhenAndLeavesTheLastState) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const auto result = run_command("run " + scene("pendulum") +
                                    " --integrator 'euler_implicit(max_newton_iterations=1)' -o " + folder.string());
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("system \"main\", step "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(" from t = "), std::string::npos) << result.err;
    EXPECT_EQ(json_of(folder / "report.json").at("status"), "failed");
    EXPECT_FALSE(json_of(folder / "checkpoint.json").at("systems")[0].at("q").get<std::string>().empty());
}

TEST(Run, MissedToleranceIsNotSuccess) {
    const auto result =
        run_command("run " + scene("brick_wall") + " --end 0.01 --set solver.max_iterations=1 --solver auto");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("such an answer is not used"), std::string::npos) << result.err;
    // What was asked of a named solver is done by auto.
    const auto repeated =
        run_command("run " + scene("brick_wall") + " --end 0.01 --set solver.max_iterations=1 --solver pgs");
    EXPECT_EQ(repeated.exit_code, 0) << repeated.err;
    EXPECT_NE(repeated.out.find("repeated with auto"), std::string::npos) << repeated.out;
}

TEST(Run, SolverThatCannotIsRefusedWithTheTime) {
    const auto result = run_command("run " + scene("brick_wall") + " --solver minres");
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_NE(result.err.find("step 1 from t = 0 s: minres cannot solve"), std::string::npos) << result.err;
}

TEST(Run, InterruptKeepsWhatWasReached) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run";
    const auto result =
        run_shell("timeout -s INT 1 " + std::string(tests::places::command) + " run " + scene("sphere_pile") +
                  " --end 1000 --every 100 -o " + folder.string() + "; test $? = 124");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("--resume goes on from there"), std::string::npos) << result.err;
    EXPECT_EQ(json_of(folder / "report.json").at("status"), "interrupted");
    EXPECT_GT(json_of(folder / "checkpoint.json").at("systems")[0].at("step"), 0);
}

TEST(Run, BadUseIsExplained) {
    EXPECT_EQ(run_command("run nowhere.yaml").exit_code, 2);
    const auto dump = run_command("run " + scene("pendulum") + " --dump-problems 2");
    EXPECT_EQ(dump.exit_code, 2);
    EXPECT_NE(dump.err.find("--dump-problems writes into the folder of -o"), std::string::npos);
    const auto solver = run_command("run " + scene("pendulum") + " --solver cholmd");
    EXPECT_EQ(solver.exit_code, 2);
    EXPECT_NE(solver.err.find("cholmod"), std::string::npos) << solver.err;
    EXPECT_EQ(run_command("run " + scene("pendulum") + " --solver 'pgs(omega=99)'").exit_code, 2);
}

/// The libraries among these that the dynamic loader maps during a run.
std::set<std::string> mapped(const std::string& arguments) {
    const std::string log = loader_log(arguments);
    std::set<std::string> found;
    for (const char* library :
         {"admm.so", "apgd.so", "cholmod.so", "ipm.so", "minres.so", "mumps.so", "petsc.so", "pgs.so", "spg.so",
          "ssn.so", "delassus_collision.so", "delassus_trajectory.so", "libhdf5", "libfcl"})
        if (log.find(std::string("/") + library) != std::string::npos) found.insert(library);
    return found;
}

/// The libraries that a system's plan names; of the solvers that may begin only those that were loaded, which one must
/// be: who begins depends on the number of rows, which the plan does not know.
std::set<std::string> planned_libraries(const Json& system, const std::set<std::string>& loaded) {
    std::set<std::string> planned;
    for (const auto& library : system.at("libraries")) planned.insert(library.get<std::string>());
    bool begun = system.at("solvers").empty();
    for (const auto& solver : system.at("solvers")) {
        const std::string library = solver.get<std::string>() + ".so";
        if (loaded.contains(library))
            begun = true;
        else
            planned.erase(library);
    }
    EXPECT_TRUE(begun) << system;
    return planned;
}

class PlanAgrees : public testing::TestWithParam<const char*> {};

TEST_P(PlanAgrees, WithWhatTheRunLoads) {
    const auto result = run_command("plan " + scene(GetParam()) + " --json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::set<std::string> planned;
    const Json plan = Json::parse(result.out);
    // Long enough for the ball to meet the ground.
    const auto loaded = mapped("run " + scene(GetParam()) + " --end 0.5");
    for (const auto& system : plan.at("systems")) planned.merge(planned_libraries(system, loaded));
    if (planned.contains("delassus_collision.so")) planned.insert("libfcl");
    EXPECT_EQ(loaded, planned);
}

INSTANTIATE_TEST_SUITE_P(Scenes, PlanAgrees,
                         testing::Values("pendulum", "slider_crank", "heavy_top", "bouncing_ball", "box_on_incline"),
                         [](const auto& chosen) { return std::string(chosen.param); });

TEST(Plan, SaysWhatIsLeftOutAndWhy) {
    const auto pendulum = run_command("plan " + scene("pendulum"));
    EXPECT_NE(pendulum.out.find("a solver for cones: no contact, stop or limited motor"), std::string::npos);
    EXPECT_NE(pendulum.out.find("collision detection: no body has a shape"), std::string::npos);
    EXPECT_NE(pendulum.out.find("factorisation of H: no stiffness couples bodies"), std::string::npos);
    const auto ball = run_command("plan " + scene("bouncing_ball"));
    EXPECT_NE(ball.out.find("2 of 3 rows of each contact, rubber on rubber: friction is zero"), std::string::npos);
    EXPECT_NE(ball.out.find("1 fixed body: no unknowns, no columns: ground"), std::string::npos);
    EXPECT_NE(ball.out.find("friction cones: no pair of materials has friction"), std::string::npos);
}

TEST(Plan, SaysWhoComesLater) {
    const auto plan = Json::parse(run_command("plan --json " + scene("brick_wall")).out).at("systems")[0];
    ASSERT_FALSE(plan.at("solvers").empty()) << plan;
    const auto later = plan.at("later_solvers").get<std::set<std::string>>();
    EXPECT_FALSE(later.empty());
    const auto run = mapped("run " + scene("brick_wall") + " --end 0.02");
    for (const auto& solver : plan.at("solvers").get<std::vector<std::string>>()) EXPECT_FALSE(later.contains(solver));
    for (const auto& library : planned_libraries(plan, run)) EXPECT_TRUE(run.contains(library)) << library;
    for (const auto& name : later) EXPECT_FALSE(run.contains(name + ".so")) << name;
    // Whoever is named is alone.
    const auto named = Json::parse(run_command("plan --json " + scene("brick_wall") + " --solver pgs").out);
    EXPECT_EQ(named.at("systems")[0].at("later_solvers"), Json::array());
}

TEST(Plan, DoesNotDependOnTheEnd) {
    EXPECT_EQ(run_command("plan --end 0 " + scene("pendulum")).out, run_command("plan " + scene("pendulum")).out);
}

TEST(Plan, FreeBodyNeedsNoSolver) {
    const ScratchFolder scratch;
    std::ofstream(scratch / "free.yaml")
        << "step: 0.1\nend: 1\nbodies: [{name: stone, mass: 1, inertia: {xx: 1, yy: 2, zz: 2}}]\n";
    const auto file = (scratch / "free.yaml").string();
    const auto plan = Json::parse(run_command("plan --json " + file).out).at("systems")[0];
    EXPECT_EQ(plan.at("libraries"), Json::array());
    EXPECT_EQ(plan.at("left_out")[0].at("what"), "a solver");
    EXPECT_EQ(mapped("run " + file), std::set<std::string>{});
    EXPECT_EQ(mapped("run " + file + " -o " + (scratch / "out").string()),
              (std::set<std::string>{"delassus_trajectory.so", "libhdf5"}));
}

class NothingLeftOut : public testing::TestWithParam<const char*> {};

TEST_P(NothingLeftOut, LoadsWhatTheSceneCouldDoWithout) {
    const auto plan =
        Json::parse(run_command("plan --json " + scene(GetParam()) + " --set leave_out=false").out).at("systems")[0];
    for (const auto& line : plan.at("left_out"))
        for (const char* what : {"factorisation of H", "collision detection", "a solver", "2 of 3 rows"})
            EXPECT_FALSE(line.at("what").get<std::string>().starts_with(what)) << line;
    auto loaded = mapped("run " + scene(GetParam()) + " --end 0.02 --set leave_out=false");
    for (const auto& name : plan.at("later_solvers")) loaded.erase(name.get<std::string>() + ".so");
    auto planned = planned_libraries(plan, loaded);
    EXPECT_TRUE(planned.contains("delassus_collision.so"));
    planned.insert("libfcl");
    EXPECT_EQ(loaded, planned);
    EXPECT_FALSE(loaded.contains("cholmod.so"));  // one for linear problems would not do
}

INSTANTIATE_TEST_SUITE_P(Scenes, NothingLeftOut, testing::Values("pendulum", "heavy_top", "bouncing_ball"));

TEST(Run, LeaveOutIsTrueOrFalse) {
    const auto run = run_command("run " + scene("pendulum") + " --set leave_out=perhaps");
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("\"leave_out\" is \"perhaps\"; it must be true or false"), std::string::npos) << run.err;
}

TEST(LeaveOut, SolvingAProblemMapsNeitherHdf5NorFcl) {
    EXPECT_EQ(mapped("solve " + example("box_stack") + " --solver apgd"), std::set<std::string>{"apgd.so"});
}

}  // namespace
}  // namespace delassus::tests::run_test
