// SPDX-License-Identifier: BSD-3-Clause
// What the tests of the comparison share: a folder of their own, two tiny problems, and the command.
#pragma once

#include <gtest/gtest.h>

#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measurement.hpp"
#include "delassus/problem_files.hpp"
#include "process/child_process.hpp"
#include "support/places.hpp"

namespace delassus::bench_test {

namespace fs = std::filesystem;

inline std::string content_of(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

class BenchTest : public ::testing::Test {
protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "delassus-bench-test-XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
        // E λ + b = u, λ ≥ 0 ⊥ u ≥ 0 with E = diag(2, 4, 1), b = (−2, 1, −3): λ = (1, 0, 3).
        Problem stops;
        stops.name = "stops";
        stops.E = SparseMatrix::from_triplets(3, 3, {{0, 0, 2.0}, {1, 1, 4.0}, {2, 2, 1.0}});
        stops.b = {-2.0, 1.0, -3.0};
        stops.cones = {Cone::nonnegative(3)};
        write_problem(stops, folder / "stops");
        Problem friction = stops;
        friction.name = "friction";
        friction.cones = {Cone::friction(0.5)};
        write_problem(friction, folder / "friction");
        setenv("DELASSUS_TEST_AT_WORK", at_work().c_str(), 1);
    }
    void TearDown() override {
        unsetenv("DELASSUS_TEST_AT_WORK");
        std::error_code ignored;
        fs::remove_all(folder, ignored);
    }

    /// The file that appears when the misbehaving solver is some iterations into its slow or hanging behaviour.
    [[nodiscard]] fs::path at_work() const { return folder / "at_work"; }

    [[nodiscard]] bench::WorkerSettings worker() const {
        return {tests::places::command, {tests::places::plugins}, 0, {}};
    }

    [[nodiscard]] bench::Measurement measure(const std::string& behaviour, double time_limit = 20.0,
                                             const std::string& problem = "stops") const {
        bench::MeasureRequest request;
        request.problem = folder / problem;
        request.solver.name = "misbehaving";
        request.solver.options = {{"behaviour", behaviour}};
        request.settings.time_limit = time_limit;
        return bench::measure(worker(), request);
    }

    /// Runs `delassus compare` on arguments, with the test's plugins and output folder.
    [[nodiscard]] ChildResult compare(std::vector<std::string> arguments) const {
        ChildSettings child;
        child.program = tests::places::command;
        child.arguments = {"compare", "--plugin-path", tests::places::plugins, "-o", (folder / "out").string()};
        child.arguments.insert(child.arguments.end(), arguments.begin(), arguments.end());
        child.timeout = 120.0;
        return run_child(child);
    }

    /// Writes the text as a suite, and returns its file.
    [[nodiscard]] fs::path suite(const std::string& text) const {
        std::ofstream(folder / "suite.yaml") << text;
        return folder / "suite.yaml";
    }

    /// Runs `delassus bench` on arguments, with references in the test's own folder.
    [[nodiscard]] ChildResult bench(std::vector<std::string> arguments) const {
        ChildSettings child;
        child.program = tests::places::command;
        child.arguments = {"bench"};
        child.arguments.insert(child.arguments.end(), arguments.begin(), arguments.end());
        child.environment = {{"XDG_CACHE_HOME", (folder / "cache").string()}};
        child.timeout = 120.0;
        return run_child(child);
    }
    [[nodiscard]] ChildResult run_suite(const fs::path& file, const std::string& output = "out") const {
        return bench({"run", file.string(), "-o", (folder / output).string(), "--plugin-path", tests::places::plugins});
    }

    fs::path folder;
};

}  // namespace delassus::bench_test
