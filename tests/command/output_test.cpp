// SPDX-License-Identifier: BSD-3-Clause
// What commands write, where, and what they leave alone.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "simulation/step_columns.hpp"
#include "support/html_page.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::output_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string scene(const std::string& name) {
    return example_scene(name);
}

std::string example(const std::string& name) {
    return std::string(tests::places::source) + "/examples/problems/" + name;
}

std::map<std::string, std::string> snapshot(const fs::path& folder) {
    std::map<std::string, std::string> contents;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        contents[fs::relative(entry.path(), folder).string()] =
            entry.is_directory() ? "a folder" : text_of(entry.path());
    return contents;
}

void write_plainly(const fs::path& file, const std::string& text) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
}

/// The command refuses with a sentence of these words, and everything below the folder is as it was.
void expect_refusal(const std::string& arguments, const fs::path& folder, const std::string& words) {
    const auto before = snapshot(folder);
    const auto result = run_command(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << "\n" << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << arguments << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(snapshot(folder) == before) << arguments;
}

void expect_success(const std::string& arguments) {
    const auto result = run_command(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.err;
}

// A file that gets descriptor 2 would be written over by the first message.
TEST(ClosedDescriptors, ReachNoFile) {
    const ScratchFolder scratch;
    write_plainly(scratch / "bounce.yaml",
                  "step: 0.001\nend: 2\nmaterials: {m: {friction: 0.5, restitution: 0.99}}\nbodies:\n"
                  "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                  "  - {name: b, mass: 1, position: [0, 0, 0.101], shapes: [{sphere: {radius: 0.1}, material: m}]}\n");
    const auto run = [&](const std::string& folder, const std::string& closed) {
        return run_shell("( exec " + closed + "; " + tests::places::command + " run " +
                         (scratch / "bounce.yaml").string() + " -o " + (scratch / folder).string() + " )");
    };
    ASSERT_EQ(run("open", "</dev/null").exit_code, 0);
    const std::string expected = text_of(scratch / "open/trajectory.h5");
    for (const std::string& closed : {std::string("2>&-"), std::string("<&- 2>&-"), std::string("<&-")}) {
        EXPECT_EQ(run("closed", closed).exit_code, 0) << closed;
        EXPECT_EQ(text_of(scratch / "closed/trajectory.h5").size(), expected.size()) << closed;
        if (fs::exists(page_parts() / "echarts.min.js")) expect_success("view " + (scratch / "closed").string());
    }
    // What is printed is lost, which is no success; the files are whole all the same.
    EXPECT_EQ(run("closed", ">&- 2>&-").exit_code, 2);
    EXPECT_EQ(text_of(scratch / "closed/trajectory.h5").size(), expected.size());
    expect_success("compare " + example("chain") + " --solvers cholmod --repeats 1 -o " + (scratch / "c").string() +
                   " <&- 2>&-");
}

TEST(Output, EmptyPathsAreRefused) {
    const std::string run = "run " + scene("pendulum");
    for (const std::string& arguments :
         {run + " -o ''", run + " --output ''", run + " --resume ''", "solve " + example("chain") + " --solution ''",
          "compare " + example("chain") + " -o ''", std::string("bench run quick -o ''"),
          std::string("generate chain ''"), "convert " + example("chain") + " ''", std::string("solve ''")}) {
        const auto result = run_command(arguments);
        EXPECT_EQ(result.exit_code, 2) << arguments;
        EXPECT_NE(result.err.find("is empty"), std::string::npos) << arguments << "\n" << result.err;
    }
}

TEST(Output, NothingOfAUsersIsReplaced) {
    const ScratchFolder scratch;
    const fs::path mine = scratch / "mine";
    const std::string folder = mine.string();
    write_plainly(scratch / "suite.yaml",
                  "title: T\nproblems: [" + example("chain") + "]\nsolvers: [cholmod]\nrepeats: 1\n");
    const std::vector<std::string> fills = {
        "run " + scene("pendulum") + " --end 0.01 -o " + folder,
        "compare " + example("chain") + " --solvers cholmod --repeats 1 -o " + folder,
        "bench run " + (scratch / "suite.yaml").string() + " --cache " + (scratch / "cache").string() + " -o " + folder,
        "generate chain " + folder,
        "convert " + example("chain") + " " + folder,
        "solve " + example("chain") + " --solver cholmod --solution " + folder,
        "equilibrium " + scene("arch") + " -o " + folder};
    for (const char* name : {"problems/thesis.tex", "vtk/picture.vtp", "report.html", "results.json", "report.json",
                             "problem.json", "H.mtx", "x.mtx", "equilibrium.json", "checkpoint.json", "notes"}) {
        SCOPED_TRACE(name);
        write_plainly(mine / name, "mine");
        for (const auto& fill : fills) expect_refusal(fill, mine, "delassus did not write");
        fs::remove_all(mine);
    }
    // Another one's problem is a problem, and not to be replaced either; nor is a solution by a run.
    fs::copy(example("chain"), mine);
    for (const auto& fill : fills) expect_refusal(fill, mine, "delassus did not write");
    fs::remove_all(mine);
    expect_success(fills[5]);
    expect_success(fills[5]);
    for (const auto& fill : fills)
        if (fill != fills[5]) expect_refusal(fill, mine, "as \"solution\"");
    write_plainly(mine, "mine");
}

TEST(Output, FilesOfAUsersAreNotReplaced) {
    const ScratchFolder scratch;
    const fs::path own = scratch / "own", mine = scratch / "mine";
    fs::create_directories(own);
    write_plainly(own / "model.xml",
                  "<mujoco><worldbody><body><joint type='hinge' axis='0 1 0'/><geom type='sphere' size='0.1'/></body>"
                  "</worldbody></mujoco>");
    expect_success("run " + scene("pendulum") + " --end 0.01 -o " + (own / "run").string());
    const std::string chain = example("chain"), name = (mine / "out").string();
    std::vector<std::string> writers = {
        "import " + (own / "model.xml").string() + " -o " + name + ".yaml",
        "generate sphere_pile " + name + ".h5 --set contacts=10", "generate pile " + name + ".h5 --set contacts=10",
        "convert " + chain + " " + name + ".h5", "convert " + chain + " " + name + ".hdf5 --law coulomb"};
    if (fs::exists(page_parts() / "echarts.min.js"))
        writers.push_back("view " + (own / "run").string() + " -o " + name + ".html");
    for (const auto& writer : writers) {
        SCOPED_TRACE(writer);
        fs::remove_all(mine);
        fs::create_directory(mine);
        const auto first = run_command(writer);
        if (first.err.find("this build has no") != std::string::npos) continue;
        ASSERT_EQ(first.exit_code, 0) << first.err;
        ASSERT_EQ(snapshot(mine).size(), 1u);
        const fs::path file = mine / snapshot(mine).begin()->first;
        expect_success(writer);  // its own
        write_plainly(file, "mine");
        expect_refusal(writer, mine, "delassus did not write it");
    }
    // A scene is made to be edited.
    fs::remove(name + ".yaml");
    const auto imported = run_command(writers[0]);
    if (imported.exit_code != 0) GTEST_SKIP() << imported.err;
    std::ofstream(name + ".yaml", std::ios::app) << "# mine\n";
    expect_refusal(writers[0], mine, "delassus did not write it as it is");
}

TEST(Output, ALaterCommandReplacesWhatIsItsOwn) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "run";
    const std::string run = "run " + scene("brick_wall") + " --end 0.02 -o " + folder.string();
    expect_success(run + " --dump-problems 5 --pictures 20");
    write_plainly(folder / "notes", "mine");
    write_plainly(folder / "problems/mine", "mine");
    if (fs::exists(page_parts() / "echarts.min.js")) expect_success("view " + folder.string());
    expect_success(run + " --pictures 0");
    EXPECT_EQ(text_of(folder / "notes") + text_of(folder / "problems/mine"), "minemine");
    std::set<std::string> names;
    for (const auto& [name, content] : snapshot(folder)) names.insert(name);
    EXPECT_EQ(names, (std::set<std::string>{".delassus", "checkpoint.json", "notes", "problems", "problems/mine",
                                            "report.json", "scene.pvd", "scene.yaml", "trajectory.h5", "vtk"}));
}

TEST(Output, OneProcessWritesIntoAFolder) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "run";
    const std::string command = tests::places::command,
                      endless = "run " + scene("sphere_pile") + " --end 1000 --every 100";
    const auto two =
        run_shell(command + " " + endless + " -o " + folder.string() + " >/dev/null 2>&1 & first=$!; " +
                  "while ! [ -e " + (folder / "checkpoint.json").string() + " ]; do sleep 0.05; done; " + command +
                  " " + endless + " -o " + folder.string() + "; echo $?; " + command + " " + endless + " --resume " +
                  folder.string() + "; echo $?; echo $first; " + "kill -9 $first; wait $first; " + command + " run " +
                  scene("pendulum") + " --end 0.01 -o " + folder.string() + " >/dev/null; echo $?");
    std::istringstream lines(two.out);
    std::string second, resumed, first, after;
    lines >> second >> resumed >> first >> after;
    EXPECT_EQ(second, "2");
    EXPECT_EQ(resumed, "2");
    EXPECT_NE(two.err.find(folder.string() + " is being written by process "), std::string::npos) << two.err;
    EXPECT_EQ(after, "0") << two.err;
}

Json state_of(const fs::path& run) {
    const Json system = Json::parse(text_of(run / "checkpoint.json")).at("systems")[0];
    Json state;
    for (const char* key : {"step", "t", "q", "v", "memory", "frame_times", "picture_times"})
        state[key] = system.at(key);
    // Of all datasets but that of wall times.
    std::size_t stored = 0;
    for (const StepColumn& column : step_columns) {
        if (!column.stored) continue;
        if (std::string_view(column.name) == "seconds") break;
        ++stored;
    }
    std::string written = system.at("written");
    state["written"] = written.erase(16 * stored, 16);
    return state;
}

TEST(Resume, KeepsWhatShapesTheOutput) {
    const ScratchFolder scratch;
    const std::vector<std::string> all = {"--pictures 0", "--every 3", "--every 2 --contact-forces --dump-problems 4"};
    for (const std::string& flags : all) {
        SCOPED_TRACE(flags);
        const fs::path whole = scratch / "whole", parts = scratch / "parts";
        const std::string run = "run " + scene("brick_wall") + " ";
        expect_success(run + flags + " --end 0.06 -o " + whole.string());
        expect_success(run + flags + " --end 0.024 -o " + parts.string());
        expect_success(run + "--end 0.06 --resume " + parts.string());
        EXPECT_EQ(state_of(parts), state_of(whole));
        auto a = snapshot(whole), b = snapshot(parts);
        for (const char* differs : {"checkpoint.json", "report.json", "trajectory.h5", ".delassus"}) {
            a.erase(differs);
            b.erase(differs);
        }
        EXPECT_TRUE(a == b);
    }
    const fs::path folder = scratch / "some";
    expect_success("run " + scene("pendulum") + " --pictures 7 --end 0.02 -o " + folder.string());
    expect_success("run " + scene("pendulum") + " --every 2 --end 0.04 --resume " + folder.string());
    expect_success("run " + scene("pendulum") + " --end 0.06 --resume " + folder.string());
    const Json checkpoint = Json::parse(text_of(folder / "checkpoint.json"));
    EXPECT_EQ(checkpoint.at("pictures"), 7);
    EXPECT_EQ(checkpoint.at("every"), 2);
}

TEST(Resume, ThatIsRefusedChangesNothing) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "run";
    const std::string run = "run " + scene("pendulum") + " ", resume = run + "--end 0.05 --resume " + folder.string();
    // A checkpoint of an earlier step, as a killed run leaves it, with the trajectory of later ones.
    const fs::path early = scratch / "early";
    expect_success(run + "--end 0.01 -o " + folder.string());
    fs::create_directory(early);
    fs::copy_file(folder / "checkpoint.json", early / "checkpoint.json");
    expect_success(run + "--end 0.03 --resume " + folder.string());
    fs::copy_file(early / "checkpoint.json", folder / "checkpoint.json", fs::copy_options::overwrite_existing);
    expect_refusal(resume + " --contact-forces", folder, "has no contact forces so far");
    expect_refusal(resume + " --step 0.002", folder, "of another scene, or with other settings");
    write_plainly(folder / "problems", "mine");
    expect_refusal(resume + " --dump-problems 2", folder, "holds problems");
    fs::remove(folder / "problems");
    std::string changed = text_of(folder / "checkpoint.json");
    const auto at = changed.find("\"v\": \"") + 10;
    changed[at] = changed[at] == '1' ? '2' : '1';
    write_plainly(folder / "checkpoint.json", changed);
    expect_refusal(resume, folder, "its checksum is not that of its content");
    // The trajectory: a changed number of a step that is kept, and one whose steps are of another run.
    fs::copy_file(early / "checkpoint.json", folder / "checkpoint.json", fs::copy_options::overwrite_existing);
    const std::string whole = text_of(folder / "trajectory.h5");
    const double third = 0.003;
    std::string spoilt = whole;
    const auto place = spoilt.find(std::string(reinterpret_cast<const char*>(&third), sizeof third));
    ASSERT_NE(place, std::string::npos);
    spoilt[place + 2] = static_cast<char>(spoilt[place + 2] ^ 1);
    write_plainly(folder / "trajectory.h5", spoilt);
    expect_refusal(resume, folder, "is not what the run has written up to its checkpoint");
    if (fs::exists(page_parts() / "echarts.min.js"))
        expect_refusal("view " + folder.string(), folder, "cannot be read");
    write_plainly(folder / "trajectory.h5", whole);
    expect_success(resume);
    const fs::path at_once = scratch / "at_once";
    expect_success(run + "--end 0.05 -o " + at_once.string());
    EXPECT_EQ(state_of(folder), state_of(at_once));
}

// A run that was killed while it wrote a chunk leaves it with the checksum of before. What was kept of it counts.
TEST(Resume, GoesOnFromATornChunk) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "run", at_once = scratch / "at_once";
    const std::string run = "run " + scene("pendulum") + " ";
    expect_success(run + "--end 0.01 -o " + folder.string());
    std::string torn = text_of(folder / "trajectory.h5");
    const double begin[] = {0.0, 0.001, 0.002};  // of steps/t, in a chunk of 4096
    const auto place = torn.find(std::string(reinterpret_cast<const char*>(begin), sizeof begin));
    ASSERT_NE(place, std::string::npos);
    const auto sum = place + 4096 * sizeof(double);
    ASSERT_LT(sum, torn.size());
    torn[sum] = static_cast<char>(torn[sum] ^ 1);
    write_plainly(folder / "trajectory.h5", torn);
    if (fs::exists(page_parts() / "echarts.min.js"))
        expect_refusal("view " + folder.string(), folder, "cannot be read");
    expect_success(run + "--end 0.02 --resume " + folder.string());
    expect_success(run + "--end 0.02 -o " + at_once.string());
    EXPECT_EQ(state_of(folder), state_of(at_once));
    if (fs::exists(page_parts() / "echarts.min.js")) expect_success("view " + folder.string());
}

TEST(Resume, AfterAKillGivesTheSameBits) {
    const ScratchFolder scratch;
    const fs::path whole = scratch / "whole";
    const std::string run = "run " + scene("sphere_pile") + " --contact-forces ";
    expect_success(run + "--end 0.5 -o " + whole.string());
    for (int k = 0; k < 4; ++k) {
        const fs::path folder = scratch / "killed";
        run_shell(std::string("timeout -s KILL ") + std::to_string(0.15 + 0.2 * k) + " " + tests::places::command +
                  " " + run + "--end 0.5 -o " + folder.string());
        if (fs::exists(folder / "checkpoint.json")) {
            expect_success("run " + scene("sphere_pile") + " --end 0.5 --resume " + folder.string());
            EXPECT_EQ(state_of(folder), state_of(whole));
        } else {
            expect_success(run + "--end 0.5 -o " + folder.string());
        }
    }
}

TEST(Input, ASecondDocumentIsRefused) {
    const ScratchFolder scratch;
    write_plainly(scratch / "s.yaml", text_of(scene("pendulum")) + "\n---\nstep: 1\n");
    expect_refusal("run " + (scratch / "s.yaml").string(), scratch.path(), "a second YAML document");
    write_plainly(scratch / "c.yaml", "solver: {name: apgd}\n---\nsolver: {name: pgs}\n");
    expect_refusal("solve " + example("chain") + " --config " + (scratch / "c.yaml").string(), scratch.path(),
                   "c.yaml, line 3: here begins a second YAML document");
    write_plainly(scratch / "b.yaml", "title: T\nproblems: [" + example("chain") + "]\n---\nsolvers: [pgs]\n");
    expect_refusal("bench run " + (scratch / "b.yaml").string() + " -o " + (scratch / "b").string(), scratch.path(),
                   "a second YAML document");
    write_plainly(scratch / "one.yaml", "---\n" + text_of(scene("pendulum")) + "\n...\n");
    expect_success("run " + (scratch / "one.yaml").string() + " --end 0.01");
}

TEST(Input, AnUnreadableFileIsSaidToBeUnreadable) {
    const ScratchFolder scratch;
    const auto reads = [&](const fs::path& file) {
        // root may read everything; nobody may not
        const std::string command = std::string(tests::places::command) + " inspect " + file.string();
        return run_shell(geteuid() == 0 ? "setpriv --reuid 65534 --clear-groups " + command : command);
    };
    fs::permissions(scratch.path(), fs::perms::all);
    for (const char* name : {"p.h5", "p.hdf5"}) {
        const auto made =
            run_command("convert " + example("chain") + " " + (scratch / name).string() + " --law coulomb");
        if (made.exit_code != 0) GTEST_SKIP() << made.err;
        if (reads(scratch / name).exit_code != 0) GTEST_SKIP() << "nobody cannot start the command here";
        fs::permissions(scratch / name, fs::perms::none);
        const auto result = reads(scratch / name);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_NE(result.err.find("cannot be opened: Permission denied"), std::string::npos) << result.err;
    }
}

}  // namespace
}  // namespace delassus::tests::output_test
