// SPDX-License-Identifier: BSD-3-Clause
#include "support/output_folder.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "support/atomic_file.hpp"
#include "support/full_disk.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::output_folder_test {
namespace {
namespace fs = std::filesystem;

void write_plainly(const fs::path& file, const std::string& text) {
    std::ofstream(file) << text;
}

std::set<std::string> names_in(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        names.insert(fs::relative(entry.path(), folder).string());
    return names;
}

/// As a run fills it.
void fill(const fs::path& folder, const std::string& text) {
    OutputFolder output(folder, "test");
    output.clear();
    output.add_folder("vtk");
    output.write("vtk/1", text);
    output.write("report", text);
    AtomicFolder inner(output.add("inner"), "problem");
    write_file_atomically(inner.path() / "H", text);
    inner.commit();
    output.keep();
}

TEST(OutputFolder, IsReplacedAndLeavesWhatIsNotItsOwn) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "out";
    fill(folder, "1");
    write_plainly(folder / "notes", "mine");
    write_plainly(folder / "vtk/mine", "mine");
    write_plainly(folder / "inner/mine", "mine");
    {
        OutputFolder output(folder, "test");
        output.clear();
        EXPECT_EQ(names_in(folder),
                  (std::set<std::string>{".delassus", "inner", "inner/mine", "notes", "vtk", "vtk/mine"}));
        expect_sentence(sentence_of<InputError>([&] { output.write("notes", "x"); }), "holds notes|did not write");
        expect_sentence(sentence_of<InputError>([&] { output.add_folder("notes"); }), "holds notes|did not write");
        output.add_folder("vtk");
        output.write("vtk/2", "x");
    }  // not kept
    EXPECT_EQ(names_in(folder), (std::set<std::string>{"inner", "inner/mine", "notes", "vtk", "vtk/mine"}));
    EXPECT_EQ(text_of(folder / "notes"), "mine");
    expect_sentence(sentence_of<InputError>([&] { OutputFolder(folder, "test"); }), "holds inner|did not write");
}

TEST(OutputFolder, IsForOneKind) {
    const ScratchFolder scratch;
    fill(scratch / "out", "1");
    expect_sentence(sentence_of<InputError>([&] { OutputFolder(scratch / "out", "other"); }), "\"test\"|\"other\"");
    expect_sentence(sentence_of<InputError>([&] { require_replaceable(scratch / "out", "other"); }), "\"test\"");
    write_plainly(scratch / "file", "x");
    expect_sentence(sentence_of<InputError>([&] { OutputFolder(scratch / "file", "test"); }), "file is a file");
}

TEST(OutputFolder, OfNothingLeavesNothing) {
    const ScratchFolder scratch;
    { const OutputFolder output(scratch / "deep/out", "test"); }
    EXPECT_FALSE(fs::exists(scratch / "deep/out"));
    fs::create_directory(scratch / "there");
    { const OutputFolder output(scratch / "there", "test"); }
    EXPECT_TRUE(fs::is_empty(scratch / "there"));
    {
        const FileSizeLimit full(0);
        expect_sentence(sentence_of<InputError>([&] { OutputFolder(scratch / "full", "test"); }), "cannot be written");
    }
    EXPECT_FALSE(fs::exists(scratch / "full"));
}

TEST(OutputFolder, RemovesNothingBehindLinks) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "out", elsewhere = scratch / "elsewhere";
    fill(folder, "1");
    fs::create_directory(elsewhere);
    write_plainly(elsewhere / "1", "mine");
    fs::remove_all(folder / "vtk");
    fs::create_directory_symlink(elsewhere, folder / "vtk");
    fs::remove(folder / "report");
    fs::create_symlink(elsewhere / "1", folder / "report");
    {
        OutputFolder output(folder, "test");
        output.clear();
    }
    EXPECT_EQ(text_of(elsewhere / "1"), "mine");
}

TEST(OutputFolder, TakesNoNamesThatLeadElsewhere) {
    const ScratchFolder scratch;
    fs::create_directory(scratch / "out");
    write_plainly(scratch / "mine", "mine");
    const std::vector<std::string> names = {"../mine", (scratch / "mine").string(), "a/../../mine", ".delassus", ""};
    for (const std::string& name : names) {
        write_plainly(scratch / "out/.delassus", "delassus test\n" + name + "\n");
        expect_sentence(sentence_of<InputError>([&] { OutputFolder(scratch / "out", "test").clear(); }), "is damaged");
    }
    EXPECT_EQ(text_of(scratch / "mine"), "mine");
}

TEST(OutputFolder, IsLockedUntilItsProcessEnds) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "out";
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        std::optional<OutputFolder> output(std::in_place, folder, "test");
        output->write("half", "1");
        write_plainly(folder / "half.partial-left-by-a-kill", "mine, as the name is no process's");
        if (write(pipe_ends[1], "x", 1) != 1) _exit(1);
        pause();
    }
    char byte = 0;
    ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
    expect_sentence(sentence_of<InputError>([&] { OutputFolder(folder, "test"); }),
                    "out is being written by process " + std::to_string(child));
    EXPECT_EQ(text_of(folder / "half"), "1");
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    OutputFolder(folder, "test").clear();
    EXPECT_FALSE(fs::exists(folder / "half"));
    close(pipe_ends[0]);
    close(pipe_ends[1]);
}

/// A child that is killed while it writes the target under its temporary name.
void leave_a_half(const fs::path& target, bool of_folder) {
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        std::optional<AtomicFile> file;
        std::optional<AtomicFolder> folder;
        if (of_folder) {
            folder.emplace(target, "problem");
            write_file_atomically(folder->path() / "H", "x");
        } else {
            file.emplace(target);
            file->write("x");
        }
        if (write(pipe_ends[1], "x", 1) != 1) _exit(1);
        pause();
    }
    char byte = 0;
    ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
    const auto count = [&] { return names_in(target.parent_path()).size(); };
    const auto with_half = count();
    remove_leftovers(target);
    EXPECT_EQ(count(), with_half) << "of a process that is at work";
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    EXPECT_EQ(count(), with_half);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
}

TEST(OutputFolder, HalvesOfKilledProcessesGo) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "out";
    fill(folder, "1");
    leave_a_half(folder / "report", false);
    leave_a_half(folder / "vtk/1", false);
    leave_a_half(folder / "inner", true);
    fill(folder, "2");
    EXPECT_EQ(names_in(folder),
              (std::set<std::string>{".delassus", "inner", "inner/.delassus", "inner/H", "report", "vtk", "vtk/1"}));
    leave_a_half(scratch / "file", false);
    leave_a_half(scratch / "folder", true);
    require_replaceable(scratch / "file", "problem");
    require_replaceable(scratch / "folder/", "problem");
    EXPECT_FALSE(fs::exists(scratch / "file"));
    for (const auto& name : names_in(scratch.path())) EXPECT_EQ(name.find("partial"), std::string::npos) << name;
}

TEST(OutputFolder, OfAnOlderVersionIsTakenByItsNames) {
    const ScratchFolder scratch;
    fs::create_directories(scratch / "out/dumps");
    write_plainly(scratch / "out/rows", "1");
    expect_sentence(sentence_of<InputError>([&] { OutputFolder(scratch / "out", "test"); }), "holds dumps");
    { OutputFolder(scratch / "out", "test", {"rows", "dumps"}).write("rows", "2"); }
    EXPECT_EQ(text_of(scratch / "out/rows"), "2");
    EXPECT_EQ(text_of(scratch / "out/.delassus"), "delassus test\ndumps/\nrows\n");
}

TEST(OwnFile, IsToldByItsMarkAndChecksum) {
    const ScratchFolder scratch;
    const fs::path file = scratch / "scene.yaml";
    write_plainly(file, marked_text("#", "step: 1\n"));
    EXPECT_NO_THROW(require_replaceable(file, "scene"));
    write_plainly(file, marked_text("#", "step: 1\n") + "# mine\n");
    expect_sentence(sentence_of<InputError>([&] { require_replaceable(file, "scene"); }), "did not write it as it is");
    write_plainly(file, "<!doctype html>\n<!-- written by delassus -->\n<html>");
    EXPECT_NO_THROW(require_replaceable(file, "page"));
    write_plainly(file, "# written by delassus, and by me\n");
    expect_sentence(sentence_of<InputError>([&] { require_replaceable(file, "scene"); }), "did not write it");
    write_plainly(file, "step: 1\n");
    expect_sentence(sentence_of<InputError>([&] { require_replaceable(file, "scene"); }), "did not write it");
    EXPECT_NO_THROW(require_replaceable(scratch / "none", "scene"));
}

}  // namespace
}  // namespace delassus::tests::output_folder_test
