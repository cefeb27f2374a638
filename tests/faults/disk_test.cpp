// SPDX-License-Identifier: BSD-3-Clause
// Every writer on a full disk: the old file stays, one sentence comes, nothing is half-written.
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "fault_fixture.hpp"
#include "support/full_disk.hpp"
#include "support/html_page.hpp"
#include "support/places.hpp"
#include "support/scenes.hpp"

namespace delassus::tests {
namespace {

/// One that writes. DISK and INPUT stand for the folders of the same name.
struct Writer {
    const char* name;
    std::vector<std::string> before;  ///< commands that are run while there is room
    std::string command;
    bool needs_hdf5 = false, needs_page = false;
};

void PrintTo(const Writer& writer, std::ostream* out) {
    *out << writer.name;
}

const std::string run_pendulum = "run " + example_scene("pendulum") + " --end 0.1 --every 5 -o ";
const std::string compare_pile = "compare INPUT/pile --solvers apgd --repeats 1 -o DISK/out";

class FullDisk : public testing::TestWithParam<Writer> {
protected:
    void SetUp() override {
        if (GetParam().needs_page && !fs::exists(page_parts() / "echarts.min.js"))
            GTEST_SKIP() << "built without pages";
#ifndef DELASSUS_HAS_HDF5
        if (GetParam().needs_hdf5) GTEST_SKIP() << "built without HDF5";
#endif
        fs::create_directory(input_);
        fs::create_directory(disk_);
        run("generate sphere_pile INPUT/pile --set contacts=60");
        run("generate box_stack INPUT/small --set boxes=1");
        if (GetParam().needs_hdf5) run("convert INPUT/pile INPUT/pile.h5");
        std::ofstream(input_ / "suite.yaml") << "title: T\nproblems: [pile]\nsolvers: [apgd]\ntolerances: [1e-3]\n"
                                                "repeats: 1\nreferences: {time_limit: 1}\n";
    }

    [[nodiscard]] std::vector<std::string> words(const std::string& line) const {
        std::vector<std::string> words = words_of(line);
        for (std::string& word : words)
            for (const auto& [mark, folder] : {std::pair("DISK", &disk_), std::pair("INPUT", &input_)})
                if (word.rfind(mark, 0) == 0) word.replace(0, std::strlen(mark), folder->string());
        return words;
    }
    void run(const std::string& line) const {
        const auto result = run_words(words(line));
        ASSERT_EQ(result.exit_code, 0) << line << "\n" << result.errors;
    }
    void prepare() const {
        for (const auto& line : GetParam().before) run(line);
    }

    /// The command fails with a sentence, and all that was there is there, and no more.
    void expect_refusal(const std::map<std::string, std::string>& old) const {
        const auto result = run_words(words(GetParam().command));
        EXPECT_EQ(result.exit_code, 2) << result.errors;
        expect_sentences(result.errors, GetParam().command);
        EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
        EXPECT_TRUE(result.errors.find("cannot be written") != std::string::npos ||
                    result.errors.find("cannot be created") != std::string::npos)
            << result.errors;
        const auto now = snapshot(disk_);
        EXPECT_EQ(names_of(now), names_of(old));
        EXPECT_TRUE(now == old) << "a file is not what it was";
    }

    ScratchFolder scratch_;
    fs::path input_ = scratch_ / "input", disk_ = scratch_ / "disk";
};

TEST_P(FullDisk, LeavesWhatWasThere) {
    const SmallDisk disk(disk_, 8 << 20);
    if (!disk.refusal().empty()) GTEST_SKIP() << disk.refusal();
    ASSERT_NO_FATAL_FAILURE(prepare());
    for (const off_t left : {0, 4096, 8192}) {  // nothing fits; something does
        SCOPED_TRACE(left);
        disk.fill(left);
        auto old = snapshot(disk_);
        ASSERT_NO_FATAL_FAILURE(expect_refusal(old));
    }
    disk.make_room();
    run(GetParam().command);
}

TEST_P(FullDisk, SoDoesALimitOfFileSizes) {
    ASSERT_NO_FATAL_FAILURE(prepare());
    const auto old = snapshot(disk_);
    {
        const FileSizeLimit limit(2000);
        expect_refusal(old);
    }
    run(GetParam().command);
}

INSTANTIATE_TEST_SUITE_P(
    Of, FullDisk,
    testing::Values(
        Writer{"generate", {"generate box_stack DISK/p --set boxes=2"}, "generate box_stack DISK/p --set boxes=30"},
        Writer{"generate_hdf5",
               {"convert INPUT/small DISK/p.hdf5 --law coulomb"},
               "convert INPUT/pile DISK/p.hdf5 --law coulomb",
               true},
        Writer{"new_hdf5", {}, "convert INPUT/pile DISK/p.hdf5 --law coulomb", true},
        Writer{"one_file", {"convert INPUT/small DISK/p.h5"}, "convert INPUT/pile DISK/p.h5", true},
        Writer{"new_one_file", {}, "convert INPUT/pile DISK/p.h5", true},
        Writer{"pile_in_one_file", {}, "generate pile DISK/p.h5 --set contacts=2000", true},
        Writer{"solution_in_one_file", {}, "solve INPUT/pile.h5 --solver apgd --solution DISK/s.h5", true},
        Writer{"new_run", {}, run_pendulum + "DISK/run", true}, Writer{"new_comparison", {}, compare_pile},
        Writer{"equilibrium", {}, "equilibrium " + example_scene("lees_frame") + " -o DISK/e"},
        Writer{"convert", {"convert INPUT/small DISK/p --law coulomb"}, "convert INPUT/pile DISK/p --law coulomb"},
        Writer{"solution",
               {"solve INPUT/small --solver apgd --solution DISK/s"},
               "solve INPUT/pile --solver apgd --solution DISK/s"},
        Writer{"new_solution", {}, "solve INPUT/pile --solver apgd --solution DISK/s"},
        Writer{"view", {run_pendulum + "DISK/run", "view DISK/run"}, "view DISK/run", true, true},
        Writer{"compare", {compare_pile}, compare_pile + " --tolerance 1e-5"},
        Writer{
            "bench_report", {"bench run INPUT/suite.yaml -o DISK/out --cache INPUT/cache"}, "bench report DISK/out"}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(FullDiskOf, StandardOutputIsNoSuccess) {
    for (const char* command : {"--help", "bench list", "plugins list --json"}) {
        const auto result = run_shell(std::string(tests::places::command) + " " + command + " >/dev/full");
        EXPECT_EQ(result.exit_code, 2) << command;
        EXPECT_NE(result.err.find("No space left on device"), std::string::npos) << command << result.err;
    }
}

TEST(FullDiskOf, BenchmarkGoesOnLater) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "disk";
    const SmallDisk disk(folder, 8 << 20);
    if (!disk.refusal().empty()) GTEST_SKIP() << disk.refusal();
    ASSERT_EQ(run_command("generate box_stack " + (scratch / "boxes").string()).exit_code, 0);
    std::ofstream(scratch / "suite.yaml") << "title: T\nproblems: [boxes]\nsolvers: [pgs, apgd]\n"
                                             "tolerances: [1e-3, 1e-6]\nrepeats: 1\nreferences: {time_limit: 1}\n";
    const auto words = words_of("bench run " + (scratch / "suite.yaml").string() + " -o " + (folder / "out").string() +
                                " --cache " + (scratch / "cache").string());
    for (const off_t left : {0, 4096, 8192}) {
        disk.fill(left);
        const auto result = run_words(words);
        EXPECT_EQ(result.exit_code, 2) << result.errors;
        EXPECT_NE(result.errors.find("cannot be"), std::string::npos) << result.errors;
        const std::string rows = text_of(folder / "out" / "results.jsonl");
        EXPECT_TRUE(rows.empty() || rows.back() == '\n');
    }
    disk.make_room();
    const auto result = run_words(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const std::string rows = text_of(folder / "out" / "results.jsonl");
    int solves = 0;
    for (auto at = rows.find("\"kind\":\"solve\""); at != std::string::npos;
         at = rows.find("\"kind\":\"solve\"", at + 1))
        ++solves;
    EXPECT_EQ(solves, 4);
}

#ifdef DELASSUS_HAS_HDF5

/// The positions and velocities of a checkpoint, as bits.
std::string state_of(const fs::path& run) {
    const auto json = nlohmann::json::parse(text_of(run / "checkpoint.json"));
    return json["systems"][0]["q"].get<std::string>() + json["systems"][0]["v"].get<std::string>();
}

/// A run that its disk stops can go on from its last checkpoint, and its trajectory is whole.
class StoppedRun : public testing::Test {
protected:
    [[nodiscard]] static ChildResult run(const std::string& end, const std::string& where) {
        return run_words(words_of("run " + example_scene("pendulum") + " --end " + end + where));
    }
    [[nodiscard]] static std::string frames_of(const fs::path& folder) {
        const auto view = run_words(words_of("view " + folder.string()));
        EXPECT_EQ(view.exit_code, 0) << view.errors;
        return view.output.substr(view.output.find("main: "));
    }

    void SetUp() override { ASSERT_EQ(run("1.5", " -o " + whole_.string()).exit_code, 0); }

    void expect_it_goes_on(const fs::path& folder, const std::function<void()>& stop,
                           const std::function<void()>& allow) const {
        ASSERT_EQ(run("0.1", " -o " + folder.string()).exit_code, 0);
        stop();
        const auto stopped = run("30", " --resume " + folder.string());
        allow();
        EXPECT_EQ(stopped.exit_code, 2) << stopped.errors;
        expect_sentences(stopped.errors, "run");
        EXPECT_NE(stopped.errors.find("cannot be written"), std::string::npos) << stopped.errors;
        for (const auto& [name, content] : snapshot(folder)) EXPECT_EQ(name.find("partial"), std::string::npos) << name;

        const auto resumed = run("1.5", " --resume " + folder.string());
        ASSERT_EQ(resumed.exit_code, 0) << resumed.errors;
        EXPECT_EQ(state_of(folder), state_of(whole_));
        if (!fs::exists(page_parts() / "echarts.min.js")) return;
        EXPECT_EQ(frames_of(folder), frames_of(whole_));
    }

    ScratchFolder scratch_;
    fs::path whole_ = scratch_ / "whole";
};

TEST_F(StoppedRun, ByAFullDiskGoesOn) {
    const fs::path folder = scratch_ / "disk";
    const SmallDisk disk(folder, 24 << 20);
    if (!disk.refusal().empty()) GTEST_SKIP() << disk.refusal();
    for (const off_t left : {4 << 10, 400 << 10, 4 << 20}) {
        SCOPED_TRACE(left);
        expect_it_goes_on(
            folder / "run", [&] { disk.fill(left); }, [&] { disk.make_room(); });
    }
}

TEST_F(StoppedRun, ANewOneIsRefused) {
    const fs::path folder = scratch_ / "disk";
    const SmallDisk disk(folder, 8 << 20);
    if (!disk.refusal().empty()) GTEST_SKIP() << disk.refusal();
    for (const off_t left : {0, 8 << 10, 64 << 10, 300 << 10, 1 << 20, 2 << 20}) {
        SCOPED_TRACE(left);
        disk.fill(left);
        const auto result = run("30", " -o " + (folder / "run").string());
        EXPECT_EQ(result.exit_code, 2) << result.errors;
        expect_sentences(result.errors, "run");
        EXPECT_NE(result.errors.find("No space left on device"), std::string::npos) << result.errors;
        fs::remove_all(folder / "run");
    }
}

TEST_F(StoppedRun, ByALimitOfFileSizesGoesOn) {
    std::optional<FileSizeLimit> limit;
    const auto stop = [&] { limit.emplace(fs::file_size(scratch_ / "run/trajectory.h5") + 100'000); };
    expect_it_goes_on(scratch_ / "run", stop, [&] {
        limit.reset();
        const auto report = nlohmann::json::parse(text_of(scratch_ / "run" / "report.json"));
        EXPECT_EQ(report.at("status"), "failed");
        EXPECT_NE(report.at("message").get<std::string>().find("cannot be written"), std::string::npos);
    });
}

#endif

}  // namespace
}  // namespace delassus::tests
