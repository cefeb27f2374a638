// SPDX-License-Identifier: BSD-3-Clause
#include "support/atomic_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "delassus/error.hpp"
#include "support/full_disk.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::atomic_file_test {
namespace {
namespace fs = std::filesystem;

void write_plainly(const fs::path& file, const std::string& text) {
    std::ofstream(file) << text;
}

std::ptrdiff_t entries_of(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

TEST(AtomicFile, WritesAndReplaces) {
    const ScratchFolder scratch;
    write_file_atomically(scratch / "file", "one");
    write_file_atomically(scratch / "file", "two");
    EXPECT_EQ(text_of(scratch / "file"), "two");
    EXPECT_EQ(entries_of(scratch.path()), 1);
}

TEST(AtomicFile, AFailingWriteLeavesTheOldFile) {
    const ScratchFolder scratch;
    write_file_atomically(scratch / "file", "old");
    std::string sentence;
    {
        const FileSizeLimit full(1000);
        sentence = sentence_of<InputError>([&] { write_file_atomically(scratch / "file", std::string(100000, 'x')); });
    }
    expect_sentence(sentence, "file cannot be written|large");
    EXPECT_EQ(text_of(scratch / "file"), "old");
    EXPECT_EQ(entries_of(scratch.path()), 1);
}

TEST(AtomicFile, OfSeveralAllOrNone) {
    const ScratchFolder scratch;
    write_files_atomically({{scratch / "one", "1"}, {scratch / "two", "2"}});
    std::string sentence;
    {
        const FileSizeLimit full(1000);
        sentence = sentence_of<InputError>([&] {
            write_files_atomically({{scratch / "one", "new"}, {scratch / "two", std::string(100000, 'x')}});
        });
    }
    expect_sentence(sentence, "two cannot be written|large");
    EXPECT_EQ(text_of(scratch / "one") + text_of(scratch / "two"), "12");
    write_files_atomically({{scratch / "one", "new"}, {scratch / "two", "newer"}});
    EXPECT_EQ(text_of(scratch / "one") + text_of(scratch / "two"), "newnewer");
    EXPECT_EQ(entries_of(scratch.path()), 2);
}

TEST(AtomicFile, AppendsAllOrNothing) {
    const ScratchFolder scratch;
    append_to_file(scratch / "file", "one\n");
    std::string sentence;
    {
        const FileSizeLimit full(1000);
        sentence = sentence_of<InputError>([&] { append_to_file(scratch / "file", std::string(100000, 'x')); });
    }
    expect_sentence(sentence, "file cannot be written|large");
    append_to_file(scratch / "file", "two\n");
    EXPECT_EQ(text_of(scratch / "file"), "one\ntwo\n");
}

TEST(AtomicFile, RefusesFoldersAndMissingParents) {
    const ScratchFolder scratch;
    expect_sentence(sentence_of<InputError>([&] { write_file_atomically(scratch.path(), "x"); }), "is a folder");
    expect_sentence(sentence_of<InputError>([&] { write_file_atomically(scratch / "none/file", "x"); }),
                    "there is no folder|none");
}

TEST(AtomicFolder, AppearsOnCommitOnly) {
    const ScratchFolder scratch;
    {
        AtomicFolder folder(scratch / "out", "test");
        write_plainly(folder.path() / "own", "1");
        EXPECT_FALSE(fs::exists(scratch / "out"));
        folder.commit();
    }
    EXPECT_EQ(text_of(scratch / "out/own"), "1");
    {
        AtomicFolder folder(scratch / "out/", "test");  // abandoned
        write_plainly(folder.path() / "own", "2");
    }
    EXPECT_EQ(text_of(scratch / "out/own"), "1");
    {
        AtomicFolder folder(scratch / "out/", "test");
        write_plainly(folder.path() / "own", "3");
        folder.commit();
    }
    EXPECT_EQ(text_of(scratch / "out/own"), "3");
    EXPECT_EQ(entries_of(scratch.path()), 1);
}

TEST(AtomicFolder, NeverReplacesWhatIsNotItsOwn) {
    const ScratchFolder scratch;
    fs::create_directory(scratch / "out");
    EXPECT_NO_THROW(AtomicFolder(scratch / "out", "test"));  // empty
    write_plainly(scratch / "out/thesis.tex", "years of work");
    expect_sentence(sentence_of<InputError>([&] { AtomicFolder(scratch / "out", "test"); }),
                    "thesis.tex|did not write");
    write_plainly(scratch / "file", "");
    expect_sentence(sentence_of<InputError>([&] { AtomicFolder(scratch / "file", "test"); }), "did not write it");
    fs::create_directories(scratch / "deep/own");
    expect_sentence(sentence_of<InputError>([&] { AtomicFolder(scratch / "deep", "test"); }), "own|did not write");
}

}  // namespace
}  // namespace delassus::tests::atomic_file_test
