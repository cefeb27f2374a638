// SPDX-License-Identifier: BSD-3-Clause
// Files that are none, and texts of files that would steer a terminal.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::hostile_files_test {
namespace {

namespace fs = std::filesystem;
using tests::run_shell;

void write(const fs::path& file, const std::string& text) {
    std::ofstream(file) << text;
}

/// The command, which has a minute.
tests::CommandResult command(const std::string& arguments) {
    return run_shell("timeout -s KILL 60 " + std::string(tests::places::command) + " " + arguments + " </dev/null");
}

constexpr const char* description =
    R"({"format": "delassus-problem", "version": 1, "n": 1, "m": 1, "law": "coulomb",
        "cones": [{"kind": "nonnegative", "rows": 1}]})";

class HostileFiles : public testing::Test {
protected:
    void SetUp() override {
        fs::create_directories(folder_ / "problem");
        fs::create_directories(folder_ / "plugins");
        write(problem("problem.json"), description);
        for (const char* name : {"H.mtx", "D.mtx"})
            write(problem(name), "%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 1\n");
        for (const char* name : {"a.mtx", "b.mtx"})
            write(problem(name), "%%MatrixMarket matrix array real general\n1 1\n-1\n");
        write(folder_ / "scene.yaml",
              "step: 0.01\nend: 0.02\nbodies:\n  - {name: b, density: 1, shapes: [{sphere: {radius: 1}}]}\n");
    }
    [[nodiscard]] fs::path problem(const std::string& name) const { return folder_ / "problem" / name; }

    tests::ScratchFolder folder_;
};

// A pipe without a writer hangs whoever opens it; a device never ends.
TEST_F(HostileFiles, PipesAndDevicesAreRefused) {
    const fs::path mesh = folder_ / "m.obj", terrain = folder_ / "t.pgm", config = folder_ / "c.yaml",
                   ranking = folder_ / "ranking.json", sidecar = folder_ / "plugins" / "x.json";
    write(folder_ / "mesh.yaml",
          "step: 0.01\nend: 0.02\nbodies:\n  - {name: b, density: 1, shapes: [{mesh: {file: m.obj}}]}\n");
    write(folder_ / "terrain.yaml",
          "step: 0.01\nend: 0.02\nbodies:\n  - {name: g, fixed: true, shapes: [{terrain: {file: t.pgm}}]}\n");
    const std::string solve = "solve " + (folder_ / "problem").string();
    const std::pair<fs::path, std::string> cases[] = {
        {problem("problem.json"), solve},
        {problem("H.mtx"), solve},
        {problem("a.mtx"), solve},
        {folder_ / "p.h5", "solve " + (folder_ / "p.h5").string()},
        {folder_ / "p.hdf5", "inspect " + (folder_ / "p.hdf5").string()},
        {config, solve + " --config " + config.string()},
        {ranking, solve + " --solver auto --set ranking=" + ranking.string()},
        {folder_ / "s.yaml", "run " + (folder_ / "s.yaml").string()},
        {mesh, "plan " + (folder_ / "mesh.yaml").string()},
        {terrain, "run " + (folder_ / "terrain.yaml").string()},
        {folder_ / "model.xml", "import " + (folder_ / "model.xml").string() + " -o " + (folder_ / "o.yaml").string()}};
    for (const auto& [file, arguments] : cases)
        for (const bool pipe : {true, false}) {
            const fs::path kept = file.string() + ".kept";
            const bool existed = fs::exists(file);
            if (existed) fs::rename(file, kept);
            if (pipe) {
                ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
            } else {
                fs::create_symlink("/dev/zero", file);
            }
            const auto result = command(arguments);
            EXPECT_EQ(result.exit_code, 2) << arguments << (pipe ? ", pipe: " : ", device: ") << result.err;
            EXPECT_NE(result.err.find(file.filename().string()), std::string::npos) << result.err;
            fs::remove(file);
            if (existed) fs::rename(kept, file);
        }
    // A sidecar that cannot be read is a plugin that is not listed.
    ASSERT_EQ(mkfifo(sidecar.c_str(), 0600), 0);
    const auto solved = command(solve + " --plugin-path " + (folder_ / "plugins").string());
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    const auto listed = command("plugins list --plugin-path " + (folder_ / "plugins").string());
    EXPECT_NE(listed.out.find("not a regular file"), std::string::npos) << listed.out << listed.err;
}

TEST_F(HostileFiles, TextsOfLibrariesStayInside) {
    write(folder_ / "ranking.json", "{\"format\": 1,");
    write(folder_ / "plugins" / "x.json", "{\"format\": [");
    const auto broken = command("solve " + (folder_ / "problem").string() +
                                " --solver auto --set ranking=" + (folder_ / "ranking.json").string());
    EXPECT_EQ(broken.exit_code, 2);
    const auto listed = command("plugins list --plugin-path " + (folder_ / "plugins").string());
    const auto unwritable = command("generate box_stack -o /proc/nowhere/there");
    EXPECT_NE(unwritable.exit_code, 0);
    for (const std::string& text : {broken.err, listed.out, listed.err, unwritable.err})
        for (const char* foreign : {"json.exception", "std::", "filesystem error", "terminate called"})
            EXPECT_EQ(text.find(foreign), std::string::npos) << text;
}

TEST_F(HostileFiles, TerminalsGetNoControlCharacters) {
    const std::string evil = "\\u001b]0;owned\\u0007\\u001b[2J\\u009b31m\\u202e";
    std::string text = description;
    text.insert(1, "\"source\": \"" + evil + "\", \"notes\": \"" + evil + "\", ");
    write(problem("problem.json"), text);
    write(folder_ / "evil.yaml",
          "title: \"\\e[31m\"\nstep: 0.01\nend: 0.02\nbodies:\n  - {name: \"\\e[2J\", density: 1, "
          "shapes: [{sphere: {radius: -1}}]}\n");
    const std::array<tests::CommandResult, 4> results = {
        command("solve " + (folder_ / "problem").string()), command("inspect " + (folder_ / "problem").string()),
        command("run " + (folder_ / "evil.yaml").string()), command("solve \"$(printf '\\033[31mx')\"")};
    EXPECT_EQ(results[0].exit_code, 0) << results[0].err;
    for (const auto& result : results)
        for (const std::string& output : {result.out, result.err}) {
            EXPECT_TRUE(std::ranges::none_of(output, [](char c) {
                return (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f;
            })) << output;
            EXPECT_EQ(output.find("\xc2\x9b"), std::string::npos) << output;
            EXPECT_EQ(output.find("\xe2\x80\xae"), std::string::npos) << output;
        }
    EXPECT_NE(results[1].out.find("\\x1b]0;owned\\x07"), std::string::npos) << results[1].out;
}

// UTF-8 passes as it is, in whatever pieces it is written.
TEST_F(HostileFiles, OtherLettersPass) {
    std::string text = description;
    text.insert(1, R"("source": "Größe λ 漢字 🙂", )");
    write(problem("problem.json"), text);
    const auto result = command("inspect " + (folder_ / "problem").string());
    EXPECT_NE(result.out.find("Größe λ 漢字 🙂"), std::string::npos) << result.out;
}

// OpenBLAS asks for memory for ever where the system refuses it, and interrupts its process if a thread does not start.
TEST_F(HostileFiles, LittleMemoryIsASentence) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers take terabytes of addresses";
#endif
    for (const char* solver : {"mumps", "siconos", "ipm", "cholmod", "auto"})
        for (const int mebibytes : {80, 120, 160, 200, 300, 400}) {
            const auto result =
                run_shell("ulimit -v " + std::to_string(1024 * mebibytes) + "; timeout -s KILL 60 " +
                          tests::places::command + " solve " + (folder_ / "problem").string() + " --solver " + solver);
            EXPECT_TRUE(result.exit_code >= 0 && result.exit_code <= 4)
                << solver << ", " << mebibytes << " MiB: " << result.exit_code << result.err;
            EXPECT_TRUE(result.exit_code == 0 || !(result.err + result.out).empty()) << solver << ", " << mebibytes;
            EXPECT_EQ(result.out.find("cancelled"), std::string::npos) << solver << ", " << mebibytes << result.out;
        }
}

}  // namespace
}  // namespace delassus::hostile_files_test
