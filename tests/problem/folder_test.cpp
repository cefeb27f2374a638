// SPDX-License-Identifier: BSD-3-Clause
// Problem and solution folders: what is written reads back bit by bit, and what is malformed is refused in a sentence.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"
#include "support/shared_problems.hpp"

namespace delassus::tests::folder_test {
namespace {
namespace fs = std::filesystem;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Every kind of cone, awkward numbers, explicit zeros.
Problem awkward() {
    Problem problem;
    problem.H = SparseMatrix::from_triplets(
        2, 2, {{0, 0, 0.1}, {0, 1, 5e-324}, {1, 0, 5e-324}, {1, 1, std::numeric_limits<double>::max()}});
    problem.D = SparseMatrix::from_triplets(13, 2, {{0, 1, 1.0 / 3.0}, {7, 0, -0.0}, {12, 1, -1e-300}});
    problem.E = SparseMatrix::from_triplets(13, 13, {{0, 0, 2.0}, {3, 1, 0.7}, {1, 3, 0.7}, {4, 4, 0.0}});
    problem.a = {-0.0, 123456789.123456789};
    problem.b = std::vector<double>(13, 0.1);
    problem.cones = {Cone::free(2),          Cone::friction(0.1),  Cone::friction(0.30000000000000004),
                     Cone::friction(0.5, 2), Cone::nonnegative(1), Cone::box({-infinity}, {-0.0}),
                     Cone::box({1.0}, {2.0})};
    problem.law = Law::Coulomb;
    problem.source = "a \"test\"\nwith Υ";
    problem.notes = "odd";
    return problem;
}

TEST(ProblemFolder, RoundTripOfEveryBit) {
    const ScratchFolder scratch;
    const Problem problem = awkward();
    write_problem(problem, scratch / "one");
    const Problem read = read_problem(scratch / "one/");
    EXPECT_EQ(read.name, "one");
    expect_same(problem, read);
    EXPECT_NE(text_of(scratch / "one/H.mtx").find("symmetric"), std::string::npos);
    write_problem(read, scratch / "two");
    for (const char* name : {"problem.json", "H.mtx", "D.mtx", "E.mtx", "a.mtx", "b.mtx"}) {
        EXPECT_EQ(text_of(scratch / "one" / name), text_of(scratch / "two" / name)) << name;
    }
}

TEST(ProblemFolder, ReplacesOnlyProblemFolders) {
    const ScratchFolder scratch;
    write_problem(awkward(), scratch / "p");
    Problem reduced = awkward();
    reduced.H = reduced.D = SparseMatrix();
    reduced.a.clear();
    write_problem(reduced, scratch / "p");
    EXPECT_FALSE(fs::exists(scratch / "p/H.mtx"));
    expect_same(reduced, read_problem(scratch / "p"));
    expect_sentence(sentence_of<InputError>([&] { write_solution({{}, {1.0}}, "", scratch / "p"); }), "as \"problem\"");
    Problem invalid = awkward();
    invalid.b[0] = infinity;
    EXPECT_THROW(write_problem(invalid, scratch / "p"), InputError);
    expect_same(reduced, read_problem(scratch / "p"));
}

TEST(ProblemFolder, UnsymmetricHStaysSo) {
    const ScratchFolder scratch;
    Problem problem;
    problem.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {0, 1, 2.0}, {1, 1, 1.0}});
    problem.a = {1.0, 1.0};
    write_problem(problem, scratch / "p");
    expect_same(problem, read_problem(scratch / "p"));
}

TEST(ProblemFolder, EmptyProblem) {
    const ScratchFolder scratch;
    write_problem({}, scratch / "p");
    expect_same(Problem{}, read_problem(scratch / "p"));
}

TEST(ProblemFolder, EverySharedProblemReadsAndComesBack) {
    DELASSUS_REQUIRE_SHARED_PROBLEMS();
    const ScratchFolder scratch;
    for (const fs::path& folder : shared_problem_folders()) {
        SCOPED_TRACE(folder.filename().string());
        const Problem problem = read_problem(folder);
        EXPECT_NO_THROW(validate(problem));
        EXPECT_EQ(problem.name, folder.filename());
        EXPECT_GT(problem.m(), 0);
        write_problem(problem, scratch / "copy");
        expect_same(problem, read_problem(scratch / "copy"));
    }
}

TEST(SolutionFolder, RoundTripAndSizes) {
    const ScratchFolder scratch;
    const Solution solution{{0.1, -0.0}, {1e-310, 2.0, 3.0}};
    write_solution(solution, "{}\n", scratch / "s");
    EXPECT_EQ(text_of(scratch / "s/report.json"), "{}\n");
    const Solution read = read_solution(scratch / "s", 2, 3);
    EXPECT_TRUE(same_bits(read.x, solution.x));
    EXPECT_TRUE(same_bits(read.lambda, solution.lambda));
    expect_sentence(sentence_of<InputError>([&] { (void)read_solution(scratch / "s", 2, 4); }),
                    "lambda.mtx|line 2|4 × 1");
    write_solution({{}, {1.0}}, "", scratch / "s");
    EXPECT_FALSE(fs::exists(scratch / "s/report.json"));
    EXPECT_TRUE(read_solution(scratch / "s", 0, 1).x.empty());
    EXPECT_THROW(write_solution({{}, {infinity}}, "", scratch / "s"), InputError);
    EXPECT_THROW((void)read_solution(scratch / "none", 0, 1), InputError);
}

TEST(MatrixMarket, AcceptsCommentsBlankLinesAndCrlf) {
    const ScratchFolder scratch;
    fs::create_directory(scratch / "p");
    const auto write = [&](const char* name, const char* text) { std::ofstream(scratch / "p" / name) << text; };
    write("problem.json",
          R"({"format": "delassus-problem", "version": 1, "n": 2, "m": 0, "cones": [], "extra": {"any": 1}})");
    write("H.mtx",
          "%%MatrixMarket MATRIX coordinate Integer symmetric\r\n% a comment\r\n\r\n2 2 3\r\n2 2 +4\r\n% another\r\n"
          " 1\t1 2 \r\n2 1 -1");
    write("a.mtx", "%%MatrixMarket matrix array real general\n%\n\n2 1\n 1.5\n\n-2e0\n\n");
    const Problem problem = read_problem(scratch / "p");
    EXPECT_EQ(problem.H.value, (std::vector<double>{2.0, -1.0, -1.0, 4.0}));
    EXPECT_EQ(problem.a, (std::vector<double>{1.5, -2.0}));
}

/// A file of an otherwise valid folder (n = 2, m = 3: one contact) is replaced by this text.
struct Malformed {
    const char* name;
    const char* file;
    std::string text;
    const char* words;
};

class FolderRefuses : public testing::TestWithParam<Malformed> {};

TEST_P(FolderRefuses, InOneSentence) {
    const ScratchFolder scratch;
    Problem problem;
    problem.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {1, 0, 0.5}, {0, 1, 0.5}, {1, 1, 1.0}});
    problem.D = SparseMatrix::from_triplets(3, 2, {{0, 0, 1.0}, {1, 1, 1.0}});
    problem.a = {1.0, 2.0};
    problem.b = {1.0, 2.0, 3.0};
    problem.cones = {Cone::friction(0.5)};
    write_problem(problem, scratch / "p");
    ASSERT_NO_THROW((void)read_problem(scratch / "p"));
    std::ofstream(scratch / "p" / GetParam().file, std::ios::binary) << GetParam().text;
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "p"); }), GetParam().words);
}

const std::string general = "%%MatrixMarket matrix coordinate real general\n";
const std::string symmetric = "%%MatrixMarket matrix coordinate real symmetric\n";
const std::string array = "%%MatrixMarket matrix array real general\n";

std::string json(const std::string& sizes, const std::string& cones) {
    return R"({"format": "delassus-problem", "version": 1, "law": "coulomb", )" + sizes + R"(, "cones": )" + cones +
           "}";
}
const std::string sizes = R"("n": 2, "m": 3)";

const Malformed malformed[] = {
    {"JsonEmpty", "problem.json", "", "problem.json is not valid JSON"},
    {"JsonTruncated", "problem.json", R"({"format": "delassus-pro)", "not valid JSON|line 1"},
    {"JsonDeep", "problem.json", std::string(200000, '['), "not valid JSON"},
    {"JsonList", "problem.json", "[1]", "must be an object"},
    {"JsonNotText", "problem.json", std::string("{\"format\": \"\xff\xfe\"}"), "not valid JSON"},
    {"JsonOtherFormat", "problem.json", R"({"format": "x"})", "format|delassus-problem"},
    {"JsonLaterVersion", "problem.json", R"({"format": "delassus-problem", "version": 2})", "version|2|1"},
    {"JsonUnknownKey", "problem.json", R"({"formt": "delassus-problem"})", "\"formt\"|did you mean \"format\""},
    {"JsonWithoutM", "problem.json", json(R"("n": 2)", "[]"), "lacks the key \"m\""},
    {"JsonNegativeN", "problem.json", json(R"("n": -1, "m": 3)", "[]"), "\"n\"|-1"},
    {"JsonFractionalN", "problem.json", json(R"("n": 2.5, "m": 3)", "[]"), "\"n\"|integer|2.5"},
    {"JsonHugeM", "problem.json", json(R"("n": 2, "m": 1000000000000)", "[]"), "\"m\"|1000000000000"},
    {"JsonLargestM", "problem.json", json(R"("n": 2, "m": 2000000000)", R"([{"kind": "free", "rows": 2000000000}])"),
     "b.mtx|3 × 1|2000000000 × 1"},
    {"JsonCountOverflows", "problem.json", json(sizes, R"([{"kind": "friction", "count": 2147483646, "mu": 0.5}])"),
     "cones|rows, but m is 3"},
    {"JsonUncovered", "problem.json", json(sizes, R"([{"kind": "free", "rows": 2}])"), "cover 2 rows, but m is 3"},
    {"JsonEmptyRun", "problem.json", json(sizes, R"([{"kind": "free", "rows": 0}])"), "cones[0]|rows|0"},
    {"JsonUnknownKind", "problem.json", json(sizes, R"([{"kind": "frictoin"}])"), "frictoin|did you mean \"friction\""},
    {"JsonRunWithUnknownKey", "problem.json", json(sizes, R"([{"kind": "free", "row": 3, "rows": 3}])"),
     "\"row\"|did you mean \"rows\""},
    {"JsonRunNoObject", "problem.json", json(sizes, "[7]"), "cones[0]|object"},
    {"JsonMuNegative", "problem.json", json(sizes, R"([{"kind": "friction", "count": 1, "mu": -1}])"),
     "mu|-1|at least 0"},
    {"JsonMuHuge", "problem.json", json(sizes, R"([{"kind": "friction", "count": 1, "mu": 1e10}])"),
     "mu|10000000000|at most 10000"},
    {"JsonMuList", "problem.json", json(sizes, R"([{"kind": "friction", "count": 1, "mu": [1, 2]}])"), "mu|2 numbers"},
    {"JsonMuNull", "problem.json", json(sizes, R"([{"kind": "friction", "count": 1, "mu": null}])"), "mu|null"},
    {"JsonDimension", "problem.json", json(sizes, R"([{"kind": "friction", "count": 1, "mu": 1, "dimension": 4}])"),
     "dimension|4|3, or 2"},
    {"JsonBoxTurned", "problem.json", json(sizes, R"([{"kind": "box", "rows": 3, "lo": 1, "hi": 0}])"),
     "lo = 1|hi = 0"},
    {"JsonBoxText", "problem.json", json(sizes, R"([{"kind": "box", "rows": 3, "lo": "-inf", "hi": 0}])"),
     "lo|numbers or null"},
    {"JsonLaw", "problem.json",
     R"({"format": "delassus-problem", "version": 1, "n": 0, "m": 0, "cones": [], "law": "coulom"})",
     "coulom|did you mean coulomb"},
    {"MatrixEmpty", "H.mtx", "", "H.mtx, line 1|%%MatrixMarket matrix coordinate real general"},
    {"MatrixBinary", "H.mtx", std::string("\x89HDF\r\n\x1a\n\0\0", 10), "H.mtx, line 1|must begin with"},
    {"MatrixComplex", "H.mtx", "%%MatrixMarket matrix coordinate complex general\n2 2 0\n", "line 1|real or integer"},
    {"MatrixPattern", "H.mtx", "%%MatrixMarket matrix coordinate pattern general\n2 2 0\n", "line 1|real or integer"},
    {"MatrixSkew", "H.mtx", "%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 0\n", "line 1|symmetric"},
    {"MatrixDense", "H.mtx", array + "2 2\n1\n0\n0\n1\n", "line 1|coordinate"},
    {"MatrixWithoutSizes", "H.mtx", general + "% only comments\n", "rows columns entries|missing"},
    {"MatrixOfOtherSize", "H.mtx", general + "3 2 0\n", "line 2|3 × 2|2 × 2"},
    {"MatrixOfHugeSize", "H.mtx", general + "1000000000000 1000000000000 1\n1 1 1\n",
     "line 2|1000000000000 × 1000000000000"},
    {"MatrixSizeOverflows", "H.mtx", general + "99999999999999999999 2 1\n1 1 1\n", "line 2|too large"},
    {"MatrixNegativeEntries", "H.mtx", general + "2 2 -1\n", "line 2|-1 entries"},
    {"MatrixManyEntries", "H.mtx", general + "2 2 1000000000000\n1 1 1\n", "line 2|1000000000000 entries|room"},
    {"MatrixWrappingEntries", "H.mtx", general + "2 2 4294967298\n1 1 1\n2 2 1\n", "line 2|4294967298|room"},
    {"MatrixTooFew", "H.mtx", general + "2 2 2\n1 1 1.00000000000\n", "H.mtx, line 4|ends after 1 of 2"},
    {"MatrixTooMany", "H.mtx", general + "2 2 1\n1 1 1\n2 2 1\n", "H.mtx, line 4|goes on after the 1"},
    {"MatrixRowZero", "H.mtx", general + "2 2 1\n0 1 1\n", "line 3|row 0|1 to 2"},
    {"MatrixRowOutside", "H.mtx", general + "2 2 1\n3 1 1\n", "line 3|row 3"},
    {"MatrixColumnOutside", "H.mtx", general + "2 2 1\n1 -7 1\n", "line 3|column -7"},
    {"MatrixFractionalRow", "H.mtx", general + "2 2 1\n1.5 1 1\n", "line 3|the row must be an integer"},
    {"MatrixWithoutValue", "H.mtx", general + "2 2 1\n1 1    \n", "line 3|ended"},
    {"MatrixFourFields", "H.mtx", general + "2 2 1\n1 1 1 1\n", "line 3|too much"},
    {"MatrixWord", "H.mtx", general + "2 2 1\n1 1 one\n", "line 3|\"one\""},
    {"MatrixNan", "H.mtx", general + "2 2 1\n1 1 nan\n", "line 3|nan|finite"},
    {"MatrixInfinity", "H.mtx", general + "2 2 1\n1 1 -inf\n", "line 3|-inf|finite"},
    {"MatrixOverflow", "H.mtx", general + "2 2 1\n1 1 1e999\n", "line 3|1e999|range"},
    {"MatrixZeroByte", "H.mtx", general + std::string("2 2 1\n1 1 1\0\n", 13), "line 3|1?"},
    {"MatrixRepeated", "H.mtx", general + "2 2 3\n1 1 1\n2 2 1\n% again\n1 1 2\n", "line 6|row 1, column 1|line 3"},
    {"MatrixRepeatedSymmetric", "H.mtx", symmetric + "2 2 3\n2 1 1\n2 2 1\n2 1 1\n", "line 5|row 2, column 1|line 3"},
    {"MatrixUpperTriangle", "H.mtx", symmetric + "2 2 1\n1 2 1\n", "line 3|above the diagonal"},
    {"MatrixSymmetricButNotSquare", "D.mtx", symmetric + "3 2 1\n1 1 1\n", "D.mtx, line 2|square"},
    {"MatrixUnsymmetricH", "H.mtx", general + "2 2 1\n2 1 1\n", "H is not symmetric"},
    {"MatrixUnsymmetricE", "E.mtx", general + "3 3 1\n2 1 1\n", "E is not symmetric"},
    {"VectorTooShort", "b.mtx", array + "3 1\n1.0\n2.0\n", "b.mtx, line 5|ends after 2 of 3"},
    {"VectorTooLong", "b.mtx", array + "3 1\n1\n2\n3\n4\n", "b.mtx, line 6|goes on"},
    {"VectorOfTwoColumns", "b.mtx", array + "3 2\n1\n2\n3\n1\n2\n3\n", "line 2|3 × 2|3 × 1"},
    {"VectorSparse", "b.mtx", general + "3 1 1\n1 1 1\n", "line 1|array"},
    {"VectorNan", "a.mtx", array + "2 1\n1\nnan\n", "a.mtx, line 4|nan|finite"},
    {"VectorHuge", "a.mtx", array + "1000000000000 1\n1\n", "a.mtx, line 2|1000000000000"},
    {"VectorIntegerWithFraction", "a.mtx", "%%MatrixMarket matrix array integer general\n2 1\n1\n1.5\n",
     "line 4|integer"},
};

INSTANTIATE_TEST_SUITE_P(All, FolderRefuses, testing::ValuesIn(malformed),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(FolderRefuses, SizesThatNoVectorProves) {
    const ScratchFolder scratch;
    fs::create_directory(scratch / "p");
    std::ofstream(scratch / "p/problem.json")
        << json(R"("n": 0, "m": 2000000000)", R"([{"kind": "free", "rows": 2000000000}])");
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "p"); }), "b.mtx|2000000000|1000000");
}

TEST(FolderRefuses, WhatIsNoProblemFolder) {
    const ScratchFolder scratch;
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "none"); }), "no such file or folder");
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch.path()); }), "holds no problem.json");
    std::ofstream(scratch / "file.txt") << "text";
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "file.txt"); }), "not a problem folder");
    fs::create_directories(scratch / "p/problem.json");
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "p"); }), "not a regular file");
}

}  // namespace
}  // namespace delassus::tests::folder_test
