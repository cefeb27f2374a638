// SPDX-License-Identifier: BSD-3-Clause
// Problem folders that engines write by delassus/dump.h: what is read has the same bits, what is wrong is not written.
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "delassus/dump.h"
#include "delassus/problem_files.hpp"
#include "support/full_disk.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"

extern "C" int dump_in_c(const char* folder, const delassus_dump_problem* problem, char* message, std::size_t size);

namespace delassus::tests::dump_test {
namespace {

namespace fs = std::filesystem;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A problem with all kinds of cones in arrays of its own, and what it is. H comes by compressed rows with columns in
/// any order, D dense with a stride, E by triplets of which some share a place.
struct Engine {
    std::vector<int> H_start = {0, 2, 4}, H_column = {1, 0, 1, 0};
    std::vector<double> H_value = {0.1, 1.0 / 3.0, 2.0 / 3.0, 0.1};
    std::vector<double> D = {1.0,  0.0, 99.0, 0.0, -0.7, 99.0, 1e-300, 5e-324, 99.0,
                             1e21, 0.0, 99.0, 0.0, 0.3,  99.0, -1.0,   0.0,    99.0};
    std::vector<int> E_row = {5, 0, 0, 0}, E_column = {5, 0, 0, 0};
    std::vector<double> E_value = {0.25, 0.1, 0.2, 0.3};
    std::vector<double> a = {-1.0 / 7.0, 1.7976931348623157e308}, b = {0.0, -0.0, 1.0, 2.0, 3.0, 0.1};
    std::vector<double> lo = {-infinity}, hi = {0.1};
    std::vector<delassus_dump_cone> cones = {{DELASSUS_DUMP_FRICTION, 3, 0.1, nullptr, nullptr},
                                             {DELASSUS_DUMP_BOX, 1, 0.0, lo.data(), hi.data()},
                                             {DELASSUS_DUMP_FREE, 1, 0.0, nullptr, nullptr},
                                             {DELASSUS_DUMP_NONNEGATIVE, 1, 0.0, nullptr, nullptr}};

    [[nodiscard]] delassus_dump_problem problem() const {
        delassus_dump_problem result;
        std::memset(&result, 0, sizeof result);
        result.n = 2;
        result.m = 6;
        result.coulomb = 1;
        result.H = delassus_dump_csr(H_start.data(), H_column.data(), H_value.data());
        result.D = delassus_dump_dense(D.data(), 3);
        result.E = delassus_dump_triplets(E_value.size(), E_row.data(), E_column.data(), E_value.data());
        result.a = a.data();
        result.b = b.data();
        result.cones = cones.data();
        result.cone_count = cones.size();
        result.source = "an \"engine\"\t\\";
        return result;
    }

    [[nodiscard]] Problem expected() const {
        Problem result;
        result.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0 / 3.0}, {0, 1, 0.1}, {1, 0, 0.1}, {1, 1, 2.0 / 3.0}});
        result.D = SparseMatrix::from_triplets(
            6, 2, {{0, 0, 1.0}, {1, 1, -0.7}, {2, 0, 1e-300}, {2, 1, 5e-324}, {3, 0, 1e21}, {4, 1, 0.3}, {5, 0, -1.0}});
        result.E = SparseMatrix::from_triplets(6, 6, {{0, 0, 0.1 + 0.2 + 0.3}, {5, 5, 0.25}});
        result.a = a;
        result.b = b;
        result.cones = {Cone::friction(0.1), Cone::box(lo, hi), Cone::free(1), Cone::nonnegative(1)};
        result.law = Law::Coulomb;
        result.source = "an \"engine\"\t\\";
        return result;
    }
};

/// The sentence of the refusal, of C and C++ alike; empty if it was written.
std::string refusal(const fs::path& folder, const delassus_dump_problem& problem) {
    char message[300] = "", in_c[300] = "";
    const int failed = delassus_dump(folder.c_str(), &problem, message, sizeof message);
    if (failed == 0) fs::remove_all(folder);
    EXPECT_EQ(dump_in_c(folder.c_str(), &problem, in_c, sizeof in_c), failed);
    EXPECT_STREQ(message, in_c);
    EXPECT_EQ(failed == 0, std::string(message).empty());
    return message;
}

TEST(Dump, WhatIsReadHasTheSameBits) {
    const ScratchFolder scratch;
    const Engine engine;
    ASSERT_EQ(refusal(scratch / "step", engine.problem()), "");
    expect_same(read_problem(scratch / "step"), engine.expected());
    EXPECT_FALSE(fs::exists(scratch / "step.partial"));
}

TEST(Dump, AReducedProblemIsComparedByTheCommand) {
    const ScratchFolder scratch;
    const std::vector<double> E = {2, 0.5, 0, 0.5, 1, 0, 0, 0, 1}, b = {-1, 0.25, 0.5};
    const delassus_dump_cone cone = {DELASSUS_DUMP_FRICTION, 3, 0.5, nullptr, nullptr};
    delassus_dump_problem problem;
    std::memset(&problem, 0, sizeof problem);
    problem.m = 3;
    problem.coulomb = 1;
    problem.E = delassus_dump_dense(E.data(), 3);
    problem.b = b.data();
    problem.cones = &cone;
    problem.cone_count = 1;
    ASSERT_EQ(refusal(scratch / "reduced/", problem), "");
    const auto inspected = run_command("inspect " + (scratch / "reduced").string());
    EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
    EXPECT_NE(inspected.out.find("coulomb"), std::string::npos) << inspected.out;
    const auto compared = run_command("compare " + (scratch / "reduced").string() + " --solvers pgs,ssn -o " +
                                      (scratch / "compared").string());
    EXPECT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_NE(compared.out.find("solved"), std::string::npos) << compared.out;
}

TEST(Dump, AnEmptyProblemAndMatricesWithoutEntries) {
    const ScratchFolder scratch;
    delassus_dump_problem problem;
    std::memset(&problem, 0, sizeof problem);
    EXPECT_EQ(refusal(scratch / "empty", problem), "");
    EXPECT_EQ(read_problem(scratch / "empty").m(), 0);
    const std::vector<int> start = {0, 0};
    const double mass = 3.0;
    problem.n = 1;
    problem.H = delassus_dump_dense(&mass, 1);
    problem.D = delassus_dump_csr(start.data(), nullptr, nullptr);
    problem.E = delassus_dump_triplets(0, nullptr, nullptr, nullptr);
    EXPECT_EQ(refusal(scratch / "free", problem), "");
    EXPECT_EQ(read_problem(scratch / "free").H.value, std::vector<double>{3.0});
}

TEST(Dump, WhatIsWrongIsNotWritten) {
    const ScratchFolder scratch;
    const auto expect = [&](const char* words, auto change) {
        Engine engine;
        delassus_dump_problem problem = engine.problem();
        change(engine, problem);
        const std::string sentence = refusal(scratch / "wrong", problem);
        expect_sentence(sentence, "wrong cannot be written");
        expect_sentence(sentence, words);
        EXPECT_TRUE(fs::is_empty(scratch.path())) << words;
    };
    using Given = delassus_dump_problem;
    expect("n or m is negative", [](Engine&, Given& p) { p.n = -1; });
    expect("a, at place 1, is not finite", [](Engine& e, Given&) { e.a[1] = infinity; });
    expect("b, at place 5, is not finite", [](Engine& e, Given&) { e.b[5] = std::nan(""); });
    expect("H, at place 2, has a value that is not finite", [](Engine& e, Given&) { e.H_value[2] = std::nan(""); });
    expect("H, at place 1, has a row or a column out of range", [](Engine& e, Given&) { e.H_column[1] = 2; });
    expect("H.row_start, at place 2, descends", [](Engine& e, Given&) { e.H_start[2] = 1; });
    expect("H.row_start, at place 0, is not 0", [](Engine& e, Given&) { e.H_start[0] = 1; });
    expect("H has entries, but lacks an array", [](Engine&, Given& p) { p.H.column = nullptr; });
    expect("D has a stride below its number of columns", [](Engine&, Given& p) { p.D.stride = 1; });
    expect("E, at place 0, has a row or a column out of range", [](Engine& e, Given&) { e.E_row[0] = 6; });
    expect("E, at place 3, is not symmetric", [](Engine& e, Given&) { e.E_column[3] = 1; });
    expect("E, at place 0, is negative on the diagonal", [](Engine& e, Given&) { e.E_value[0] = -1; });
    expect("E, at place 1, has a sum that is not finite",
           [](Engine& e, Given&) { e.E_value[1] = e.E_value[2] = 1.7e308; });
    expect("cones do not have m rows", [](Engine&, Given& p) { p.cone_count = 3; });
    expect("cones are missing", [](Engine&, Given& p) { p.cones = nullptr; });
    expect("cones, at place 0, has a wrong number of rows", [](Engine& e, Given&) { e.cones[0].rows = 4; });
    expect("cones, at place 0, has a mu", [](Engine& e, Given&) { e.cones[0].mu = -0.1; });
    expect("cones, at place 1, is a box without bounds", [](Engine& e, Given&) { e.cones[1].lo = nullptr; });
    expect("cones, at place 1, is a box without lo <= hi", [](Engine& e, Given&) { e.hi[0] = -infinity; });
    expect("cones, at place 2, is of no kind", [](Engine& e, Given&) { e.cones[2].kind = 7; });
}

TEST(Dump, AFolderThatIsThereStays) {
    const ScratchFolder scratch;
    const Engine engine;
    fs::create_directory(scratch / "step");
    expect_sentence(refusal(scratch / "step", engine.problem()), "step cannot be written|is there");
    EXPECT_TRUE(fs::is_empty(scratch / "step"));
    expect_sentence(refusal(scratch / "no/such", engine.problem()), "no/such cannot be written|No such file");
    // What an interrupted dump left is in nobody's way.
    fs::create_directory(scratch / "next.partial");
    std::ofstream(scratch / "next.partial" / "E.mtx") << "half";
    EXPECT_EQ(refusal(scratch / "next", engine.problem()), "");
    expect_same(read_problem(scratch / "next"), engine.expected());
}

TEST(Dump, AFullDiskLeavesNothing) {
    const ScratchFolder scratch;
    const std::vector<double> b(5000, 1.0 / 3.0);
    const delassus_dump_cone cone = {DELASSUS_DUMP_FREE, 5000, 0.0, nullptr, nullptr};
    delassus_dump_problem problem;
    std::memset(&problem, 0, sizeof problem);
    problem.m = 5000;
    problem.b = b.data();
    problem.cones = &cone;
    problem.cone_count = 1;
    {
        const FileSizeLimit limit(10000);
        expect_sentence(refusal(scratch / "big", problem), "big cannot be written|b.mtx could not be written");
    }
    EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST(Dump, NumbersHaveAPointInEveryLocale) {
    const ScratchFolder scratch;
    const std::string compile = "localedef -i de_DE -f UTF-8 " + (scratch / "de_DE.UTF-8").string();
    if (run_shell(compile).exit_code != 0) GTEST_SKIP() << "no locale with a comma can be made here";
    setenv("LOCPATH", scratch.path().c_str(), 1);
    const bool set = std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr;
    const std::string comma = std::localeconv()->decimal_point;
    const Engine engine;
    const std::string sentence = refusal(scratch / "step", engine.problem());
    std::setlocale(LC_NUMERIC, "C");
    unsetenv("LOCPATH");
    ASSERT_TRUE(set);
    ASSERT_EQ(comma, ",");
    ASSERT_EQ(sentence, "");
    expect_same(read_problem(scratch / "step"), engine.expected());
}

}  // namespace
}  // namespace delassus::tests::dump_test
