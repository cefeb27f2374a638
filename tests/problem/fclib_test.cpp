// SPDX-License-Identifier: BSD-3-Clause
// FCLib HDF5 files: all storages, both forms, bilateral rows, what is written reads back, what lies is refused.
#include <gtest/gtest.h>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "support/places.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"
#include "support/shared_problems.hpp"

#ifdef DELASSUS_HAS_HDF5
#include <hdf5.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>

namespace delassus::tests::fclib_test {
namespace {
namespace fs = std::filesystem;

/// An FCLib file by the paths of its datasets, for tests to spoil.
struct Fixture {
    std::map<std::string, std::vector<int>> integers;
    std::map<std::string, std::vector<double>> numbers;

    void matrix(const std::string& path, int m, int n, int nz, std::vector<int> p, std::vector<int> i,
                std::vector<double> x) {
        integers[path + "/m"] = {m};
        integers[path + "/n"] = {n};
        integers[path + "/nz"] = {nz};
        integers[path + "/nzmax"] = {static_cast<int>(x.size())};
        integers[path + "/p"] = std::move(p);
        integers[path + "/i"] = std::move(i);
        numbers[path + "/x"] = std::move(x);
    }

    void write(const fs::path& file) const {
        const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        for (const auto& [path, values] : integers) put(id, path, H5T_NATIVE_INT, values.size(), values.data());
        for (const auto& [path, values] : numbers) put(id, path, H5T_NATIVE_DOUBLE, values.size(), values.data());
        H5Fclose(id);
    }

    static void put(hid_t file, const std::string& path, hid_t type, hsize_t size, const void* data) {
        const hid_t links = H5Pcreate(H5P_LINK_CREATE);
        H5Pset_create_intermediate_group(links, 1);
        const hid_t space = H5Screate_simple(1, &size, nullptr);
        const hid_t set = H5Dcreate2(file, path.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT);
        if (size > 0) H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
        H5Dclose(set);
        H5Sclose(space);
        H5Pclose(links);
    }
};

/// W = [2 1; 1 3] in the plane with V = {4; 5}, R = 6, q = {7, 8}, s = 9, by compressed columns.
Fixture local() {
    Fixture file;
    file.integers["fclib_local/spacedim"] = {2};
    file.matrix("fclib_local/W", 2, 2, -1, {0, 2, 4}, {0, 1, 0, 1}, {2, 1, 1, 3});
    file.matrix("fclib_local/V", 2, 1, -1, {0, 2}, {0, 1}, {4, 5});
    file.matrix("fclib_local/R", 1, 1, -1, {0, 1}, {0}, {6});
    file.numbers["fclib_local/vectors/q"] = {7, 8};
    file.numbers["fclib_local/vectors/s"] = {9};
    file.numbers["fclib_local/vectors/mu"] = {0.5};
    return file;
}

/// M = diag(1, 2), one contact in space, one bilateral row.
Fixture global() {
    Fixture file;
    file.integers["fclib_global/spacedim"] = {3};
    file.matrix("fclib_global/M", 2, 2, -1, {0, 1, 2}, {0, 1}, {1, 2});
    file.matrix("fclib_global/H", 2, 3, -1, {0, 1, 2, 2}, {0, 1}, {3, 4});
    file.matrix("fclib_global/G", 2, 1, -1, {0, 1}, {1}, {5});
    file.numbers["fclib_global/vectors/f"] = {1, 2};
    file.numbers["fclib_global/vectors/w"] = {3, 4, 5};
    file.numbers["fclib_global/vectors/b"] = {6};
    file.numbers["fclib_global/vectors/mu"] = {0.25};
    return file;
}

Problem read(const Fixture& fixture) {
    const ScratchFolder scratch;
    fixture.write(scratch / "file.hdf5");
    return read_problem(scratch / "file.hdf5");
}

TEST(FclibFile, LocalWithBilateralRows) {
    const Problem problem = read(local());
    EXPECT_EQ(problem.name, "file");
    EXPECT_EQ(problem.law, Law::Coulomb);
    EXPECT_EQ(problem.n(), 0);
    EXPECT_EQ(problem.b, (std::vector<double>{7, 8, 9}));
    expect_same(
        problem.E,
        SparseMatrix::from_triplets(
            3, 3, {{0, 0, 2}, {0, 1, 1}, {0, 2, 4}, {1, 0, 1}, {1, 1, 3}, {1, 2, 5}, {2, 0, 4}, {2, 1, 5}, {2, 2, 6}}),
        "E");
    ASSERT_EQ(problem.cones.size(), 2U);
    EXPECT_EQ(problem.cones[0].rows, 2);
    EXPECT_EQ(problem.cones[0].parameters[0], 0.5);
    EXPECT_EQ(problem.cones[1].kind, ConeKind::Free);
}

TEST(FclibFile, GlobalWithBilateralRows) {
    const Problem problem = read(global());
    EXPECT_EQ(problem.a, (std::vector<double>{1, 2}));
    EXPECT_EQ(problem.b, (std::vector<double>{3, 4, 5, 6}));
    expect_same(problem.H, SparseMatrix::from_triplets(2, 2, {{0, 0, 1}, {1, 1, 2}}), "H");
    expect_same(problem.D, SparseMatrix::from_triplets(4, 2, {{0, 0, 3}, {1, 1, 4}, {3, 1, 5}}), "D");
    EXPECT_EQ(problem.E.rows, 0);
    ASSERT_EQ(problem.cones.size(), 2U);
    EXPECT_EQ(problem.cones[0].parameters[0], 0.25);
    EXPECT_EQ(problem.cones[1].rows, 1);
}

TEST(FclibFile, AllStoragesMeanTheSame) {
    const Problem columns = read(global());
    Fixture rows = global();
    rows.matrix("fclib_global/H", 2, 3, -2, {0, 1, 2}, {0, 1}, {3, 4});
    expect_same(columns, read(rows));
    Fixture triplets = global();
    // csparse's way: columns in p. The third contact row is empty, so an entry in column 2 would not fit as a row.
    triplets.matrix("fclib_global/H", 2, 3, 2, {1, 0}, {1, 0}, {4, 3});
    triplets.matrix("fclib_global/G", 2, 1, 3, {0, 0, 0}, {1, 1, 0}, {2, 3, 0});  // added up
    const Problem read_triplets = read(triplets);
    EXPECT_EQ(read_triplets.D.value, (std::vector<double>{3, 4, 0, 5}));
    Fixture longer = global();
    longer.matrix("fclib_global/H", 2, 3, -1, {0, 1, 2, 2}, {0, 1, 99}, {3, 4, 99});  // room to spare beyond p
    expect_same(columns, read(longer));
}

TEST(FclibFile, TripletsEitherWay) {
    Fixture csparse = global();
    csparse.matrix("fclib_global/H", 2, 3, 1, {2}, {0}, {7});
    Fixture documented = global();
    documented.matrix("fclib_global/H", 2, 3, 1, {0}, {2}, {7});
    expect_same(read(csparse), read(documented));
    EXPECT_EQ(read(csparse).D.row_start, (std::vector<std::int32_t>{0, 0, 0, 1, 2}));
}

TEST(FclibFile, SymmetrisesAndSaysSo) {
    Fixture file = local();
    file.numbers["fclib_local/W/x"] = {2, 1, 1.3, 3};
    const Problem problem = read(file);
    EXPECT_DOUBLE_EQ(problem.E.value[1], 1.15);
    EXPECT_EQ(problem.E.value[1], problem.E.value[3]);
    EXPECT_EQ(problem.notes, "E was asymmetric by 5.0e-02 (relative) and is symmetrised");
    file.numbers["fclib_local/W/x"] = {2, 1, 1 + 1e-15, 3};
    EXPECT_EQ(read(file).notes, "");
}

TEST(FclibFile, RoundTrip) {
    const ScratchFolder scratch;
    for (const Fixture& fixture : {local(), global()}) {
        Problem problem = read(fixture);
        problem.source = "by hand";
        problem.notes = "Υ";
        write_problem(problem, scratch / "copy.hdf5");
        expect_same(problem, read_problem(scratch / "copy.hdf5"));
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), fs::directory_iterator()), 1);
}

TEST(FclibFile, FreeRowsComeLast) {
    const ScratchFolder scratch;
    Problem problem;
    problem.E = SparseMatrix::from_triplets(4, 4, {{0, 0, 1}, {0, 2, 9}, {1, 1, 2}, {2, 0, 9}, {2, 2, 3}, {3, 3, 4}});
    problem.b = {1, 2, 3, 4};
    problem.cones = {Cone::free(1), Cone::friction(0.5, 2), Cone::free(1)};
    problem.law = Law::Coulomb;
    write_problem(problem, scratch / "p.hdf5");
    const Problem read_back = read_problem(scratch / "p.hdf5");
    EXPECT_EQ(read_back.b, (std::vector<double>{2, 3, 1, 4}));
    expect_same(read_back.E,
                SparseMatrix::from_triplets(4, 4, {{0, 0, 2}, {1, 1, 3}, {1, 2, 9}, {2, 1, 9}, {2, 2, 1}, {3, 3, 4}}),
                "E");
}

TEST(FclibFile, RefusesToWriteWhatDoesNotFit) {
    const ScratchFolder scratch;
    const auto refused = [&](const std::function<void(Problem&)>& change, const char* words) {
        Problem problem = read(global());
        change(problem);
        expect_sentence(sentence_of<InputError>([&] { write_problem(problem, scratch / "p.hdf5"); }), words);
        EXPECT_FALSE(fs::exists(scratch / "p.hdf5"));
    };
    refused([](Problem& p) { p.law = Law::Associated; }, "p.hdf5|coulomb|associated");
    refused([](Problem& p) { p.cones[1] = Cone::nonnegative(1); }, "cone 1 is nonnegative");
    refused([](Problem& p) { p.cones[1] = Cone::box({0}, {1}); }, "cone 1 is box");
    refused(
        [](Problem& p) {
            p.cones = {Cone::friction(1, 2), Cone::friction(1, 3)};
            p.b.push_back(0);
            p.D = SparseMatrix::zero(5, 2);
        },
        "one dimension|cone 1 has 3 rows");
    refused([](Problem& p) { p.E = SparseMatrix::from_triplets(4, 4, {{0, 0, 1}}); }, "E is not zero");
    expect_sentence(sentence_of<InputError>([&] { write_problem(read(global()), scratch / "none/p.hdf5"); }),
                    "there is no folder");
}

TEST(FclibFile, EqualsTheFolderOfTheSameName) {
    DELASSUS_REQUIRE_SHARED_PROBLEMS();
    const ScratchFolder scratch;
    int count = 0;
    for (const auto& entry : fs::directory_iterator(shared_problems_root() / "fclib")) {
        SCOPED_TRACE(entry.path().filename().string());
        ++count;
        const Problem file = read_problem(entry.path());
        Problem folder = read_problem(shared_problems_root() / entry.path().stem());
        EXPECT_EQ(file.n(), folder.n());
        ASSERT_EQ(file.m(), folder.m());
        EXPECT_EQ(file.a, folder.a);
        EXPECT_EQ(file.b, folder.b);
        ASSERT_EQ(file.cones.size(), folder.cones.size());
        for (std::size_t c = 0; c < file.cones.size(); ++c) {
            EXPECT_EQ(file.cones[c].rows, folder.cones[c].rows);
            EXPECT_EQ(file.cones[c].parameters[0], folder.cones[c].parameters[0]);
        }
        // Explicit zeros aside; the folders were symmetrised by another program, which may have rounded otherwise.
        const auto compare = [](const SparseMatrix& left, const SparseMatrix& right, const char* name) {
            double largest = 0.0;
            double difference = 0.0;
            for (std::int32_t row = 0; row < left.rows; ++row) {
                std::map<std::int32_t, double> values;
                for (auto k = left.row_start[row]; k < left.row_start[row + 1]; ++k)
                    values[left.column[k]] = left.value[k];
                for (auto k = right.row_start[row]; k < right.row_start[row + 1]; ++k) {
                    values[right.column[k]] -= right.value[k];
                    largest = std::max(largest, std::abs(right.value[k]));
                }
                for (const auto& [column, value] : values) difference = std::max(difference, std::abs(value));
            }
            EXPECT_LE(difference, 1e-15 * largest) << name;
        };
        compare(file.H, folder.H, "H");
        if (folder.n() > 0) compare(file.D, folder.D, "D");
        if (folder.n() == 0) compare(file.E, folder.E, "E");
        if (entry.path().stem() == "Capsules-i125-1213") {
            EXPECT_EQ(file.notes, folder.notes);
        }
        write_problem(file, scratch / "copy.hdf5");
        expect_same(file, read_problem(scratch / "copy.hdf5"));
    }
    EXPECT_EQ(count, 5);
}

struct Lie {
    const char* name;
    std::function<void(Fixture&)> spoil;
    const char* words;
};

class FclibRefuses : public testing::TestWithParam<Lie> {};

TEST_P(FclibRefuses, InOneSentence) {
    Fixture fixture = global();
    GetParam().spoil(fixture);
    expect_sentence(sentence_of<InputError>([&] { (void)read(fixture); }), GetParam().words);
}

const std::string top = "fclib_global/";

const Lie lies[] = {
    {"NoProblem", [](Fixture& f) { f = {}; }, "neither /fclib_local nor /fclib_global"},
    {"NoMatrix",
     [](Fixture& f) {
         std::erase_if(f.integers, [](auto& e) { return e.first.find("/M/") != e.first.npos; });
         f.numbers.erase(top + "M/x");
     },
     "/fclib_global/M is missing"},
    {"NoSpacedim", [](Fixture& f) { f.integers.erase(top + "spacedim"); }, "spacedim is missing"},
    {"SpacedimFour", [](Fixture& f) { f.integers[top + "spacedim"] = {4}; }, "spacedim is 4|2 to 3"},
    {"SpacedimDoesNotDivide", [](Fixture& f) { f.integers[top + "spacedim"] = {2}; }, "w has 3 elements|2 for each"},
    {"SpacedimReal",
     [](Fixture& f) {
         f.integers.erase(top + "spacedim");
         f.numbers[top + "spacedim"] = {3};
     },
     "spacedim must hold integers"},
    {"SpacedimList",
     [](Fixture& f) {
         f.integers[top + "spacedim"] = {3, 3};
     },
     "spacedim has 2 elements"},
    {"MuShort", [](Fixture& f) { f.numbers[top + "vectors/mu"] = {}; }, "mu has 0 elements|1"},
    {"MuNegative", [](Fixture& f) { f.numbers[top + "vectors/mu"] = {-1}; }, "file.hdf5|cone 0|-1"},
    {"MuInteger",
     [](Fixture& f) {
         f.numbers.erase(top + "vectors/mu");
         f.integers[top + "vectors/mu"] = {1};
     },
     "mu must hold floating-point numbers"},
    {"FLong",
     [](Fixture& f) {
         f.numbers[top + "vectors/f"] = {1, 2, 3};
     },
     "M is 2 × 2|3 × 3"},
    {"FEmpty", [](Fixture& f) { f.numbers[top + "vectors/f"] = {}; }, "f is empty"},
    {"WNan",
     [](Fixture& f) {
         f.numbers[top + "vectors/w"] = {1, NAN, 2};
     },
     "b[1] is nan"},
    {"BilateralWithoutB", [](Fixture& f) { f.numbers.erase(top + "vectors/b"); }, "vectors/b is missing"},
    {"HugeM", [](Fixture& f) { f.integers[top + "H/m"] = {2147483646}; }, "H is 2147483646 × 3|2 × 3"},
    {"NegativeM", [](Fixture& f) { f.integers[top + "H/m"] = {-2}; }, "m is -2"},
    {"UnknownStorage", [](Fixture& f) { f.integers[top + "H/nz"] = {-3}; }, "nz is -3"},
    {"ManyTriplets", [](Fixture& f) { f.integers[top + "H/nz"] = {2000000000}; }, "p has 4 elements|2000000000"},
    {"PShort",
     [](Fixture& f) {
         f.integers[top + "H/p"] = {0, 1, 2};
     },
     "p has 3 elements|at least 4"},
    {"PDescends",
     [](Fixture& f) {
         f.integers[top + "H/p"] = {0, 2, 1, 2};
     },
     "H/p|not descend"},
    {"PFromOne",
     [](Fixture& f) {
         f.integers[top + "H/p"] = {1, 2, 2, 2};
     },
     "H/p|begin with 0"},
    {"PBeyondEntries",
     [](Fixture& f) {
         f.integers[top + "H/p"] = {0, 1, 2, 2000000000};
     },
     "i has 2 elements|2000000000"},
    {"IOutside",
     [](Fixture& f) {
         f.integers[top + "H/i"] = {0, 2};
     },
     "row 2, column 1|2 × 3"},
    {"INegative",
     [](Fixture& f) {
         f.integers[top + "H/i"] = {0, -1};
     },
     "row -1"},
    {"XShort", [](Fixture& f) { f.numbers[top + "H/x"] = {3}; }, "x has 1 elements|at least 2"},
    {"XInfinite",
     [](Fixture& f) {
         f.numbers[top + "M/x"] = {1, INFINITY};
     },
     "H(1, 1) is inf"},
    {"VectorsIsNoGroup",
     [](Fixture& f) {
         std::erase_if(f.numbers, [](auto& e) { return e.first.find("/vectors/") != e.first.npos; });
         f.numbers[top + "vectors"] = {1};
     },
     "vectors must be a group"},
};

INSTANTIATE_TEST_SUITE_P(All, FclibRefuses, testing::ValuesIn(lies),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(FclibRefuses, WhatIsNotHdf5) {
    const ScratchFolder scratch;
    std::ofstream(scratch / "text.hdf5") << "text";
    testing::internal::CaptureStderr();
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "text.hdf5"); }), "not an HDF5 file");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(FclibRefuses, TruncationAnywhere) {
    const ScratchFolder scratch;
    global().write(scratch / "whole.hdf5");
    const std::string whole = text_of(scratch / "whole.hdf5");
    testing::internal::CaptureStderr();
    for (std::size_t size = 0; size < whole.size(); size += 97) {
        std::ofstream(scratch / "cut.hdf5", std::ios::binary) << whole.substr(0, size);
        EXPECT_THROW((void)read_problem(scratch / "cut.hdf5"), InputError) << size;
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(FclibRefuses, WhatBreaksHdf5Itself) {
    // Found by a fuzzer: HDF5 1.10 reads beyond its memory here. Other versions may refuse it in words of their own.
    const fs::path file = fs::path(tests::places::source) / "tests/problem/data/breaks-hdf5-1.10.hdf5";
    ASSERT_TRUE(fs::exists(file));
    testing::internal::CaptureStderr();
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(file); }), "breaks-hdf5-1.10.hdf5");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(FclibRefuses, SizesWithoutData) {
    // A dataset of 1e12 elements of which no chunk was ever written takes no room in the file.
    const ScratchFolder scratch;
    Fixture fixture = global();
    fixture.numbers.erase("fclib_global/vectors/w");
    fixture.write(scratch / "p.hdf5");
    const hid_t file = H5Fopen((scratch / "p.hdf5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hsize_t size = 1'000'000'000'000;
    const hsize_t chunk = 1000;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &chunk);
    H5Dclose(H5Dcreate2(file, "/fclib_global/vectors/w", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
    H5Pclose(creation);
    H5Sclose(space);
    H5Fclose(file);
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "p.hdf5"); }),
                    "w announces 1000000000000 elements|0 bytes");
}

TEST(FclibRefuses, Links) {
    const ScratchFolder scratch;
    Fixture fixture = global();
    fixture.numbers.erase("fclib_global/vectors/w");
    fixture.write(scratch / "p.hdf5");
    const hid_t file = H5Fopen((scratch / "p.hdf5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Lcreate_external("/etc/hostname", "/w", file, "/fclib_global/vectors/w", H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(file);
    expect_sentence(sentence_of<InputError>([&] { (void)read_problem(scratch / "p.hdf5"); }), "w is a link");
}

}  // namespace
}  // namespace delassus::tests::fclib_test
#endif
