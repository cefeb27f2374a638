// SPDX-License-Identifier: BSD-3-Clause
// Problems and solutions in one file, of which each process reads and writes its slice.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numeric>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/problem_files.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"
#include "support/small_problems.hpp"

#ifdef DELASSUS_HAS_HDF5
#include <hdf5.h>

namespace delassus::partitioned_files_test {
namespace {
namespace fs = std::filesystem;
using tests::expect_same;

/// A folder that all processes see.
class Files : public testing::Test {
protected:
    void SetUp() override {
        if (run->rank() == 0) scratch = std::make_unique<tests::ScratchFolder>();
        folder = run->broadcast(run->rank() == 0 ? scratch->path().string() : "");
    }
    void TearDown() override { static_cast<void>(run->all(0)); }

    /// On process 0 alone, while the others wait.
    void alone(const std::function<void()>& work) const {
        static_cast<void>(run->all(0));  // the others have closed what they read
        together(*run, [&] {
            if (run->rank() == 0) work();
        });
    }

    std::string refusal(const fs::path& file) const {
        return tests::sentence_of<InputError>([&] { static_cast<void>(read_partitioned(*run, file)); });
    }

    std::shared_ptr<const Communicator> run = communicator_of_run();
    std::unique_ptr<tests::ScratchFolder> scratch;
    fs::path folder;
};

/// Every kind of cone, E, odd numbers.
std::vector<Problem> examples() {
    std::vector<Problem> problems;
    for (const char* family : {"box_stack", "chain", "elastic_block", "sphere_pile", "motors"})
        problems.push_back(generate(family, {}));
    problems.push_back(tests::point_on_plane(1.0, 1.0, 0.5, 0.5, Law::Coulomb));
    Problem reduced;
    reduced.E = SparseMatrix::from_triplets(3, 3, {{0, 0, 2.0}, {1, 1, 3.0}, {0, 1, 0.25}, {1, 0, 0.25}, {2, 2, 1.0}});
    reduced.D = SparseMatrix::zero(3, 0);
    reduced.b = {-1.0, 0.1, -0.0};
    reduced.cones = {Cone::nonnegative(1), Cone::nonnegative(1), Cone::free(1)};
    reduced.notes = "Υ";
    problems.push_back(reduced);
    return problems;
}

TEST_F(Files, RoundTripInPartsAndWhole) {
    int number = 0;
    for (Problem problem : examples()) {
        const fs::path file = folder / ("problem-" + std::to_string(number++) + ".h5");
        if (problem.E.entries() == 0) problem.E = {};
        if (problem.H.rows == 0) problem.H = SparseMatrix::zero(problem.n(), problem.n());
        FileTraffic written, read;
        write_partitioned(*run, part_of(*run, problem), file, &written);
        EXPECT_TRUE(is_partitioned_file(file));
        const PartitionedProblem part = read_partitioned(*run, file, &read);
        Problem again = gathered(*run, part);
        if (again.E.entries() == 0) again.E = {};
        expect_same(again, problem);
        alone([&] {
            Problem whole = read_problem(file);
            if (whole.E.entries() == 0) whole.E = {};
            expect_same(whole, problem);
            write_problem(problem, folder / "again.h5");
            EXPECT_EQ(tests::text_of(folder / "again.h5").size(), tests::text_of(file).size());
        });
        std::vector<std::int64_t> bytes = {read.bytes_read, written.bytes_written};
        run->sum(bytes);
        EXPECT_GE(bytes[0], bytes[1] - 100);
    }
    alone([&] { EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), number + 1); });
}

TEST_F(Files, NobodyReadsItAll) {
    const fs::path file = folder / "pile.h5";
    write_partitioned(*run, part_of(*run, generate("sphere_pile", {{"contacts", 20000}})), file);
    FileTraffic traffic;
    const PartitionedProblem part = read_partitioned(*run, file, &traffic);
    std::int64_t bytes = 0;
    alone([&] { bytes = static_cast<std::int64_t>(fs::file_size(file)); });
    std::vector<std::int64_t> size = {bytes};
    run->max(size);
    const double share = static_cast<double>(size[0]) / run->size();
    EXPECT_LT(static_cast<double>(traffic.bytes_read), 1.3 * share + 200'000);
    EXPECT_LT(static_cast<double>(part.n() + part.m()),
              1.2 * static_cast<double>(part.n_all() + part.m_all()) / run->size());
    // Cones are with the body of their smallest column.
    for (std::int64_t row = 0; row < part.m(); ++row) {
        const auto column = part.D.column[static_cast<std::size_t>(part.D.row_start[static_cast<std::size_t>(row)])];
        EXPECT_GE(column, part.column_start[static_cast<std::size_t>(run->rank())]);
        EXPECT_LT(column, part.column_start[static_cast<std::size_t>(run->rank()) + 1]);
    }
}

TEST_F(Files, BodiesStayWhole) {
    for (const bool says_bodies : {true, false}) {
        const fs::path file = folder / "bricks.h5";
        PartitionedProblem part = part_of(*run, generate("brick_wall", {}));
        if (!says_bodies) part.body_start.clear();
        write_partitioned(*run, part, file);
        const PartitionedProblem again = read_partitioned(*run, file);
        if (says_bodies) {
            for (const auto start : again.column_start) EXPECT_EQ(start % 6, 0);
            std::vector<std::int64_t> bodies = {static_cast<std::int64_t>(again.body_start.size())};
            run->sum(bodies);
            EXPECT_EQ(6 * bodies[0], again.n_all());
        }
    }
    // Coupled columns say it themselves: hinged rods in the world frame have full blocks of inertia.
    const fs::path file = folder / "chain.h5";
    PartitionedProblem part = part_of(*run, generate("chain", {{"world_frame", 1}}));
    part.body_start.clear();
    write_partitioned(*run, part, file);
    for (const auto start : read_partitioned(*run, file).column_start)
        EXPECT_TRUE(start % 6 == 0 || start % 6 <= 3) << start;
}

TEST_F(Files, ReadByFewerProcessesThanWroteIt) {
    const Problem problem = generate("box_stack", {{"towers", 3}});
    const fs::path file = folder / "stack.h5";
    write_partitioned(*run, part_of(*run, problem), file);
    alone([&] { expect_same(gathered(*single_process(), read_partitioned(*single_process(), file)), problem); });
    // The file of one process is that of many, byte for byte.
    alone([&] { write_partitioned(*single_process(), part_of(*single_process(), problem), folder / "one.h5"); });
    alone([&] { EXPECT_TRUE(tests::text_of(folder / "one.h5") == tests::text_of(file)); });
    expect_same(gathered(*run, read_partitioned(*run, folder / "one.h5")), problem);
}

TEST_F(Files, SolutionsStandInTheOriginalOrder) {
    const fs::path file = folder / "solution.h5";
    PartitionedProblem part = part_of(*run, generate("box_stack", {{"towers", 3}}));
    const auto mirrored = [](std::int64_t first, std::int64_t count, std::int64_t total) {
        std::vector<std::int64_t> numbers(static_cast<std::size_t>(count));
        std::iota(numbers.begin(), numbers.end(), first);
        for (auto& number : numbers) number = total - 1 - number;
        return numbers;
    };
    const auto own = static_cast<std::size_t>(run->rank());
    for (const bool moved : {false, true}) {
        if (moved) {
            part.column_origin = mirrored(part.column_start[own], part.n(), part.n_all());
            part.row_origin = mirrored(part.row_start[own], part.m(), part.m_all());
        }
        std::vector<double> x, lambda;
        for (std::int64_t k = 0; k < part.n(); ++k)
            x.push_back(0.1 * static_cast<double>(moved ? part.column_origin[static_cast<std::size_t>(k)]
                                                        : part.column_start[own] + k));
        for (std::int64_t k = 0; k < part.m(); ++k)
            lambda.push_back(-1.0 / (1.0 + static_cast<double>(moved ? part.row_origin[static_cast<std::size_t>(k)]
                                                                     : part.row_start[own] + k)));
        write_partitioned_solution(*run, file, part, x, lambda, "{\"status\": \"solved\"}");
        const Solution again = read_partitioned_solution(*run, file, part);
        EXPECT_TRUE(tests::same_bits(again.x, x));
        EXPECT_TRUE(tests::same_bits(again.lambda, lambda));
        // Whatever the order of the parts, the file is in the order of the problem.
        PartitionedProblem unmoved = part;
        unmoved.column_origin.clear();
        unmoved.row_origin.clear();
        const Solution plain = read_partitioned_solution(*run, file, unmoved);
        for (std::size_t k = 0; k < plain.x.size(); ++k)
            EXPECT_EQ(plain.x[k], 0.1 * static_cast<double>(part.column_start[own] + static_cast<std::int64_t>(k)));
    }
    const PartitionedProblem other = part_of(*run, generate("box_stack", {{"towers", 2}}));
    tests::expect_sentence(
        tests::sentence_of<InputError>([&] { static_cast<void>(read_partitioned_solution(*run, file, other)); }),
        "solution.h5|/x has|but the problem has");
}

/// Opens the file on process 0 and spoils it.
void spoil(const fs::path& file, const std::function<void(hid_t)>& how) {
    const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    how(id);
    H5Fclose(id);
}

template <class Value>
void overwrite(hid_t file, const char* name, hsize_t place, Value value) {
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set);
    H5Sselect_elements(space, H5S_SELECT_SET, 1, &place);
    const hid_t one = H5Screate(H5S_SCALAR);
    H5Dwrite(set, std::is_integral_v<Value> ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE, one, space, H5P_DEFAULT, &value);
    for (const hid_t id : {one, space}) H5Sclose(id);
    H5Dclose(set);
}

TEST_F(Files, BadOnesAreRefusedByAll) {
    const Problem problem = generate("motors", {});
    const fs::path good = folder / "good.h5", bad = folder / "bad.h5";
    write_partitioned(*run, part_of(*run, problem), good);
    const auto without = [](const char* name) { return [=](hid_t file) { H5Ldelete(file, name, H5P_DEFAULT); }; };
    const std::int64_t far = 1'000'000'000'000;
    const std::vector<std::pair<std::function<void(hid_t)>, std::string>> cases = {
        {without("a"), "bad.h5|/a is missing"},
        {without("cones/mu"), "/cones/mu is missing|friction"},
        {without("cones/lo"), "/cones/lo and /cones/hi are missing"},
        {without("D/value"), "/D/value is missing"},
        {[](hid_t file) { H5Adelete(file, "law"); }, "the attribute law must be \"associated\" or \"coulomb\""},
        {[](hid_t file) { H5Adelete(file, "version"); }, "the attribute version must be the integer 1, but is missing"},
        {[](hid_t file) { H5Adelete(file, "format"); }, "the attribute format must be \"delassus-problem\""},
        {[](hid_t file) { overwrite(file, "D/row_start", 0, std::int64_t{3}); }, "/D/row_start must ascend from 0"},
        {[&](hid_t file) { overwrite(file, "D/row_start", 5, far); }, "/D/row_start does not ascend"},
        {[&](hid_t file) { overwrite(file, "D/row_start", 5, -far); }, "/D/row_start"},
        {[&](hid_t file) { overwrite(file, "D/column", 5, far); }, "its D has the column 1000000000000"},
        {[&](hid_t file) { overwrite(file, "cones/row_start", 2, far); }, "/cones/row_start"},
        {[](hid_t file) { overwrite(file, "cones/kind", 2, std::int64_t{77}); }, "/cones/kind has 77 for cone 2"},
        {[](hid_t file) { overwrite(file, "H/value", 2, std::nan("")); }, "its H holds a value that is not finite"},
        {[](hid_t file) { overwrite(file, "b", 2, HUGE_VAL); }, "its b holds a value that is not finite"},
        {[&](hid_t file) { overwrite(file, "body_start", 1, far); }, "bad.h5"},
    };
    for (const auto& [how, words] : cases) {
        SCOPED_TRACE(words);
        alone([&, &change = how] {
            fs::copy_file(good, bad, fs::copy_options::overwrite_existing);
            spoil(bad, change);
        });
        std::string sentence = refusal(bad);
        if (sentence.back() != '.') sentence += '.';
        tests::expect_sentence(sentence, words);
    }
    alone([&] { std::ofstream(bad) << "no HDF5 at all"; });
    tests::expect_sentence(refusal(bad), "bad.h5 is not an HDF5 file");
    EXPECT_FALSE(is_partitioned_file(bad));
    tests::expect_sentence(refusal(folder / "none.h5"), "none.h5: there is no such file");
    // Cut off and scrambled: a sentence, never a crash.
    for (const double kept : {0.1, 0.5, 0.9, 0.999}) {
        alone([&] {
            std::string bytes = tests::text_of(good);
            bytes.resize(static_cast<std::size_t>(kept * static_cast<double>(bytes.size())));
            std::ofstream(bad, std::ios::binary) << bytes;
        });
        EXPECT_NE(refusal(bad).find("bad.h5"), std::string::npos);
    }
    const std::string nowhere = tests::sentence_of<InputError>(
        [&] { write_partitioned(*run, part_of(*run, problem), folder / "no" / "folder.h5"); });
    tests::expect_sentence(nowhere, "cannot be written|there is no folder");
}

TEST_F(Files, OtherToolsMayWriteThem) {
    // As h5py does: 32-bit numbers, compressed chunks, texts of variable length, no H where it is not needed, no
    // bodies.
    const fs::path file = folder / "other.h5";
    alone([&] {
        const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        const auto text = [&](const char* name, const char* value) {
            const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
            H5Tset_size(type, H5T_VARIABLE);
            const hid_t attribute = H5Acreate2(id, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
            H5Awrite(attribute, type, &value);
            H5Aclose(attribute);
            H5Sclose(space);
            H5Tclose(type);
        };
        text("format", "delassus-problem");
        text("law", "coulomb");
        const hid_t scalar = H5Screate(H5S_SCALAR);
        const hid_t version = H5Acreate2(id, "version", H5T_NATIVE_INT32, scalar, H5P_DEFAULT, H5P_DEFAULT);
        const int one = 1;
        H5Awrite(version, H5T_NATIVE_INT32, &one);
        H5Aclose(version);
        H5Sclose(scalar);
        const auto put = [&](const char* name, hid_t type, hsize_t count, const void* values) {
            const hid_t links = H5Pcreate(H5P_LINK_CREATE), creation = H5Pcreate(H5P_DATASET_CREATE);
            H5Pset_create_intermediate_group(links, 1);
            H5Pset_chunk(creation, 1, &count);
            H5Pset_deflate(creation, 6);
            const hid_t space = H5Screate_simple(1, &count, nullptr);
            const hid_t set = H5Dcreate2(id, name, type, space, links, creation, H5P_DEFAULT);
            H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
            H5Dclose(set);
            H5Sclose(space);
            H5Pclose(creation);
            H5Pclose(links);
        };
        const std::vector<int> h_start = {0, 1, 2, 3}, h_column = {0, 1, 2}, d_start = {0, 1, 2, 3},
                               d_column = {2, 0, 1}, cone_start = {0, 3}, kind = {3};
        const std::vector<double> h_value = {2, 2, 2}, d_value = {1, 1, 1}, a = {1, 0, -1}, b = {0, 0, 0}, mu = {0.5};
        put("H/row_start", H5T_NATIVE_INT, 4, h_start.data());
        put("H/column", H5T_NATIVE_INT, 3, h_column.data());
        put("H/value", H5T_NATIVE_DOUBLE, 3, h_value.data());
        put("D/row_start", H5T_NATIVE_INT, 4, d_start.data());
        put("D/column", H5T_NATIVE_INT, 3, d_column.data());
        put("D/value", H5T_NATIVE_DOUBLE, 3, d_value.data());
        put("a", H5T_NATIVE_DOUBLE, 3, a.data());
        put("b", H5T_NATIVE_DOUBLE, 3, b.data());
        put("cones/row_start", H5T_NATIVE_INT, 2, cone_start.data());
        put("cones/kind", H5T_NATIVE_INT, 1, kind.data());
        put("cones/mu", H5T_NATIVE_DOUBLE, 1, mu.data());
        H5Fclose(id);
    });
    const Problem problem = gathered(*run, read_partitioned(*run, file));
    EXPECT_EQ(problem.law, Law::Coulomb);
    EXPECT_EQ(problem.a, (std::vector<double>{1, 0, -1}));
    EXPECT_EQ(problem.D.column, (std::vector<std::int32_t>{2, 0, 1}));
    ASSERT_EQ(problem.cones.size(), 1u);
    EXPECT_EQ(problem.cones[0].parameters[0], 0.5);
}

TEST_F(Files, AreInspectedWithoutD) {
    const auto inspected = [&](const Problem& problem) {
        write_partitioned(*run, part_of(*run, problem), folder / "some.h5");
        return inspect_partitioned(*run, folder / "some.h5");
    };
    const auto stack = inspected(generate("box_stack", {}));
    EXPECT_EQ(stack.structure, Structure::Diagonal);
    EXPECT_EQ(stack.n, 60);
    EXPECT_EQ(stack.body_count, 10);
    EXPECT_EQ(stack.cones.at("friction").blocks, 40);
    EXPECT_EQ(stack.cones.at("friction").rows, 120);
    const auto chain = inspected(generate("chain", {{"world_frame", 1}}));
    EXPECT_EQ(chain.structure, Structure::Blocks);
    EXPECT_EQ(chain.largest_block, 3);
    EXPECT_EQ(inspected(generate("elastic_block", {})).structure, Structure::Definite);
    EXPECT_EQ(inspected(generate("gyroscopic", {})).structure, Structure::Unsymmetric);
    const auto motors = inspected(generate("motors", {}));
    EXPECT_EQ(motors.cones.size(), 4u);
    EXPECT_GT(motors.E_entries, 0);
}

}  // namespace
}  // namespace delassus::partitioned_files_test
#endif
