// SPDX-License-Identifier: BSD-3-Clause
// `processes` in a suite: runs in parts under mpirun, what is derived from them, and limits that hold for all of them.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <map>
#include <sstream>
#include <thread>

#include "bench/analysis.hpp"
#include "bench/results_file.hpp"
#include "bench_fixture.hpp"
#include "delassus/registry.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::processes_test {
namespace {

using bench::Json;

class ProcessesSuite : public BenchTest {
protected:
    void SetUp() override {
        BenchTest::SetUp();
        if (geteuid() == 0) {  // Open MPI asks for this
            setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
            setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
        }
    }
    /// Why runs on several processes cannot be tested here; empty if they can.
    [[nodiscard]] static std::string missing() {
        if (std::system("mpirun --version > /dev/null 2>&1") != 0) return "there is no mpirun";
        const Registry registry;
        for (const auto& plugin : registry.plugins())
            if (plugin.name == "apgd_petsc") return {};
        return "apgd_petsc was not built";
    }
    [[nodiscard]] std::string refusal(const std::string& text) const {
        const auto run = run_suite(suite(text));
        EXPECT_EQ(run.exit_code, 2) << text;
        EXPECT_FALSE(fs::exists(folder / "out" / "results.jsonl")) << text;
        return run.errors;
    }
};

constexpr const char* piles =
    "problems:\n  - {generate: pile, set: {contacts: [600, 1200, 2400]}}\n"
    "solvers: [apgd_petsc, pgs]\nprocesses: [2, 1]\ntolerances: [1e-3]\nrepeats: 1\nreferences: none\n";

TEST_F(ProcessesSuite, RunsPilesOnOneAndTwoProcesses) {
    if (const auto reason = missing(); !reason.empty()) GTEST_SKIP() << reason;
    const auto run = run_suite(suite(piles));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_NE(content_of(folder / "out" / "summary.md")
                  .find("Left out: pgs runs in one process only, as it does not take problems in parts"),
              std::string::npos);
    const auto set = bench::read_results(folder / "out");
    ASSERT_EQ(set.solves.size(), 9U);
    EXPECT_EQ(set.missing, 0U);
    std::map<std::string, int> runs;
    for (const Json& row : set.solves) {
        ++runs[row.at("label")];
        EXPECT_EQ(row.at("cause"), "") << row;
        const int processes = row.at("processes");
        if (row.at("solver") == "pgs") {
            EXPECT_TRUE(row.at("parts").is_null());
            continue;
        }
        EXPECT_EQ(row.at("method"), "apgd_petsc");
        const Json& parts = row.at("parts");
        ASSERT_EQ(parts.at("by_process").size(), static_cast<std::size_t>(processes));
        std::int64_t rows = 0;
        for (const Json& one : parts.at("by_process")) {
            rows += one.at("m").get<std::int64_t>();
            const Json& seconds = one.at("seconds");
            double sum = 0.0;
            for (const char* phase :
                 {"products", "projections", "linear_systems", "exchange", "reductions", "waiting"}) {
                EXPECT_GE(seconds.at(phase), 0.0) << phase;
                sum += seconds.at(phase).get<double>();
            }
            EXPECT_GT(sum, 0.0);
            EXPECT_LE(sum, (1.0 + 1e-5) * seconds.at("solve").get<double>() + 1e-6);  // rounding, also of floats
        }
        for (const Json& problem : set.problems)
            if (problem.at("problem") == row.at("problem")) {
                EXPECT_EQ(rows, problem.at("m"));
                EXPECT_EQ(problem.at("m"), 3 * problem.at("size").get<std::int64_t>());
            }
        if (processes == 1) {
            EXPECT_EQ(parts.at("bytes_an_iteration"), 0.0);
            EXPECT_EQ(parts.at("ghosts"), 0);
        } else {
            EXPECT_GT(parts.at("bytes_an_iteration"), 1e3);  // some tens of bodies at the border, 48 bytes each way
            EXPECT_LT(parts.at("bytes_an_iteration"), 1e6);
            EXPECT_GT(parts.at("ghosts"), 0);
        }
        EXPECT_GE(parts.at("imbalance"), 1.0);
        EXPECT_LT(parts.at("imbalance"), 1.3);
    }
    EXPECT_EQ(runs.at("apgd_petsc"), 3);
    EXPECT_EQ(runs.at("apgd_petsc, 2 processes"), 3);
    EXPECT_EQ(runs.at("pgs"), 3);

    const Json processes = bench::analyse(set).at("processes");
    EXPECT_EQ(processes.at("strong").size(), 3U);
    EXPECT_EQ(processes.at("weak").size(), 2U);  // 600 and 1200 contacts a process
    ASSERT_EQ(processes.at("traffic").size(), 1U);
    EXPECT_EQ(processes.at("traffic").at(0).at("points").size(), 3U);
    const std::string summary = content_of(folder / "out" / "summary.md"),
                      csv = content_of(folder / "out" / "results.csv");
    for (const char* title :
         {"### Strong scaling", "### Weak scaling", "### Growth of what is sent", "### What the time"})
        EXPECT_NE(summary.find(title), std::string::npos) << title;
    EXPECT_NE(csv.find(",method,processes,bytes_an_iteration,ghosts,imbalance,products_s,"), std::string::npos);
    EXPECT_NE(csv.find(",apgd_petsc,2,"), std::string::npos);

    const auto again = run_suite(suite(piles));
    EXPECT_EQ(again.exit_code, 0);
    EXPECT_NE(again.errors.find("9 runs were done before"), std::string::npos) << again.errors;
}

TEST_F(ProcessesSuite, TakesFilesAndFolders) {
    if (const auto reason = missing(); !reason.empty()) GTEST_SKIP() << reason;
    ChildSettings convert;
    convert.program = tests::places::command;
    convert.arguments = {"generate", "pile", (folder / "pile.h5").string(), "--set", "contacts=200"};
    convert.timeout = 60.0;
    if (run_child(convert).exit_code != 0) GTEST_SKIP() << "no HDF5 in this build";
    const auto run =
        run_suite(suite("problems: [pile.h5, 'pile:contacts=200', friction]\nsolvers: [apgd_petsc]\nlaws: associated\n"
                        "processes: [1, 2]\ntolerances: [1e-3]\nrepeats: 1\n"));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = bench::read_results(folder / "out");
    ASSERT_EQ(set.solves.size(), 6U);
    for (const Json& row : set.solves) EXPECT_EQ(row.at("cause"), "") << row;
    EXPECT_EQ(set.solves.at(0).at("iterations"), set.solves.at(2).at("iterations"));  // the same pile
}

TEST_F(ProcessesSuite, RefusesBeforeAnythingRuns) {
    const std::string rest = "problems: [stops]\nsolvers: [pgs]\nprocesses: ";
    EXPECT_NE(refusal(rest + "0\n").find("\"processes\" must lie between 1 and 4096"), std::string::npos);
    EXPECT_NE(refusal(rest + "[1, two]\n").find("processes"), std::string::npos);
    EXPECT_NE(refusal(rest + "[2, 1, 2]\n").find("listed twice"), std::string::npos);
    EXPECT_NE(refusal(rest + "[]\n").find("a whole number or a list"), std::string::npos);
    const std::string path = std::getenv("PATH");
    setenv("PATH", "/nonexistent", 1);
    const std::string sentence = refusal(rest + "[1, 2]\n");
    setenv("PATH", path.c_str(), 1);
    EXPECT_NE(sentence.find("there is no mpirun in PATH"), std::string::npos) << sentence;
}

#ifdef DELASSUS_HAS_MPI
// Process 1 waits for ever. All of the run is killed soon after its time, though mpirun puts its processes elsewhere.
TEST_F(ProcessesSuite, ATimeOutEndsAllProcesses) {
    if (const auto reason = missing(); !reason.empty()) GTEST_SKIP() << reason;
    const auto file = suite(
        "problems:\n  - {generate: box_stack}\nsolvers: ['parts_gradient(fault=wait)']\nprocesses: [2]\n"
        "tolerances: [1e-9]\ntime_limit: 4\nrepeats: 1\nreferences: none\n");
    const auto run =
        bench({"run", file.string(), "-o", (folder / "out").string(), "--plugin-path", tests::places::parts_plugins});
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto set = bench::read_results(folder / "out");
    ASSERT_EQ(set.solves.size(), 1U);
    EXPECT_EQ(set.solves.front().at("cause"), "time_limit") << set.solves.front();
    std::istringstream stream(content_of(at_work()));
    pid_t waiting = 0;
    ASSERT_TRUE(stream >> waiting) << "it never waited";
    for (int tries = 0; kill(waiting, 0) == 0 && tries < 50; ++tries)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_NE(kill(waiting, 0), 0) << "process " << waiting << " is still there";
}
#endif

/// A row of a run in parts. The solve is all of the time.
Json row_of(const std::string& problem, int processes, double seconds, std::int64_t iterations, double bytes) {
    Json by_process = Json::array();
    for (int p = 0; p < processes; ++p)
        by_process.push_back(
            {{"seconds",
              {{"setup", 0.0}, {"solve", seconds}, {"products", 0.5 * seconds}, {"projections", 0.25 * seconds}}}});
    return {{"problem", problem},
            {"law", "associated"},
            {"tolerance", 1e-3},
            {"cause", ""},
            {"method", "any"},
            {"label", "any"},
            {"processes", processes},
            {"iterations", iterations},
            {"seconds", {{"setup", 0.0}, {"solve", seconds}}},
            {"peak_memory", 1 << 20},
            {"parts", {{"bytes_an_iteration", bytes}, {"ghosts", 1}, {"imbalance", 1.0}, {"by_process", by_process}}}};
}

TEST(AnalyseProcesses, FindsStrongAndWeakScalingAndTheExponent) {
    bench::ResultSet set;
    set.session = {{"machine", {{"cores", 2}}}};
    for (const auto& [name, size] : {std::pair("a", 1000), std::pair("b", 2010), std::pair("c", 4000)})
        set.problems.push_back({{"problem", name}, {"name", name}, {"size", size}, {"family", "piles"}});
    set.solves = {row_of("a", 1, 1.0, 10, 0.0),    row_of("b", 1, 2.2, 20, 0.0),   row_of("a", 2, 0.625, 10, 100.0),
                  row_of("b", 2, 1.25, 20, 160.0), row_of("c", 2, 2.5, 25, 251.5), row_of("c", 4, 1.5, 25, 300.0)};
    set.solves.push_back(row_of("c", 1, 9.0, 25, 0.0));
    set.solves.back()["cause"] = "time_limit";  // counts nowhere
    const Json found = bench::analyse_processes(set);

    ASSERT_EQ(found.at("strong").size(), 3U);
    const Json& second = found.at("strong").at(0).at("points").at(1);
    EXPECT_EQ(second.at("processes"), 2);
    EXPECT_DOUBLE_EQ(second.at("efficiency").get<double>(), 1.0 / (2.0 * 0.625));
    EXPECT_DOUBLE_EQ(second.at("phases").at("products").get<double>(), 0.3125);
    EXPECT_DOUBLE_EQ(second.at("phases").at("other").get<double>(), 0.15625);
    // Without a run on one process the one on the fewest is what efficiency refers to: T₂ · 2 / (4 T₄).
    EXPECT_DOUBLE_EQ(found.at("strong").at(2).at("points").at(1).at("efficiency").get<double>(), 2.5 / (2.0 * 1.5));

    // Loads of 1000 (a on 1, b on 2, c on 4); of 2010 on one and 2000 on two; of 500 there is one run.
    ASSERT_EQ(found.at("weak").size(), 2U);
    const Json& thousand = found.at("weak").at(0).at("points");
    ASSERT_EQ(thousand.size(), 3U);
    EXPECT_EQ(thousand.at(2).at("problem"), "c");
    EXPECT_DOUBLE_EQ(thousand.at(1).at("efficiency").get<double>(), 1.0 / 1.25);
    EXPECT_DOUBLE_EQ(thousand.at(1).at("efficiency_of_an_iteration").get<double>(), 0.1 / (1.25 / 20.0));

    ASSERT_EQ(found.at("traffic").size(), 1U);  // c alone on four processes is no series
    const Json& fit = found.at("traffic").at(0).at("fit");
    EXPECT_NEAR(fit.at("exponent").get<double>(), std::log(251.5 / 100.0) / std::log(4.0), 1e-2);
    EXPECT_GT(fit.at("standard_error").get<double>(), 0.0);
    EXPECT_EQ(found.at("beyond_cores"), 4);
}

}  // namespace
}  // namespace delassus::bench_test::processes_test
