// SPDX-License-Identifier: BSD-3-Clause
// Every writer on a full disk: the old file stays, one sentence comes, nothing is half-written.
#include "fault_fixture.hpp"
#include "support/full_disk.hpp"
#include "support/html_page.hpp"
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
const std::string compare_boxes = "compare INPUT/boxes --solvers pgs --repeats 1 -o DISK/out";

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
        run("generate box_stack INPUT/boxes --set boxes=30");
        run("generate box_stack INPUT/small --set boxes=1");
        std::ofstream(input_ / "suite.yaml") << "title: T\nproblems: [boxes]\nsolvers: [pgs]\ntolerances: [1e-3]\n"
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
    for (const off_t left : {0, 4096, 12288}) {  // nothing fits; something does
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
               "convert INPUT/boxes DISK/p.hdf5 --law coulomb",
               true},
        Writer{"new_hdf5", {}, "convert INPUT/boxes DISK/p.hdf5 --law coulomb", true},
        Writer{"convert", {"convert INPUT/small DISK/p --law coulomb"}, "convert INPUT/boxes DISK/p --law coulomb"},
        Writer{"solution",
               {"solve INPUT/small --solver pgs --solution DISK/s"},
               "solve INPUT/boxes --solver pgs --solution DISK/s"},
        Writer{"new_solution", {}, "solve INPUT/boxes --solver pgs --solution DISK/s"},
        Writer{"view", {run_pendulum + "DISK/run", "view DISK/run"}, "view DISK/run", true, true},
        Writer{"compare", {compare_boxes}, compare_boxes + " --tolerance 1e-5"},
        Writer{
            "bench_report", {"bench run INPUT/suite.yaml -o DISK/out --cache INPUT/cache"}, "bench report DISK/out"}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(FullDiskOf, StandardOutputIsNoSuccess) {
    for (const char* command : {"--help", "bench list", "plugins list --json"}) {
        const auto result = run_shell(std::string(DELASSUS_COMMAND) + " " + command + " >/dev/full");
        EXPECT_EQ(result.exit_code, 2) << command;
        EXPECT_NE(result.err.find("standard output cannot be written: No space left on device"), std::string::npos)
            << command << result.err;
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
        if (!rows.empty()) EXPECT_EQ(rows.back(), '\n');
    }
    disk.make_room();
    const auto result = run_words(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_NE(result.output.find("4 of 4"), std::string::npos) << result.output;
}

#ifdef DELASSUS_HAS_HDF5

/// The positions and velocities of a checkpoint, as bits.
std::string state_of(const fs::path& run) {
    const auto json = nlohmann::json::parse(text_of(run / "checkpoint.json"));
    return json["systems"][0]["q"].get<std::string>() + json["systems"][0]["v"].get<std::string>();
}

/// A run that its disk stops can go on from its last checkpoint, and its trajectory is whole.
void expect_run_goes_on(const fs::path& folder, const std::string& scene, const std::function<void()>& stop,
                        const std::function<void()>& allow) {
    ScratchFolder scratch;
    const auto run = [&](const std::string& end, const std::string& where) {
        return run_words(words_of("run " + scene + " --every 1 --end " + end + where));
    };
    ASSERT_EQ(run("0.1", " -o " + folder.string()).exit_code, 0);
    const std::string started = state_of(folder);
    stop();
    const auto stopped = run("8", " --resume " + folder.string());
    allow();
    EXPECT_EQ(stopped.exit_code, 2) << stopped.errors;
    expect_sentences(stopped.errors, "run");
    EXPECT_NE(stopped.errors.find("cannot be written"), std::string::npos) << stopped.errors;
    for (const auto& [name, content] : snapshot(folder)) EXPECT_EQ(name.find("partial"), std::string::npos) << name;
    EXPECT_EQ(state_of(folder), started) << "the run was stopped before its next checkpoint";

    const auto resumed = run("0.5", " --resume " + folder.string());
    ASSERT_EQ(resumed.exit_code, 0) << resumed.errors;
    ASSERT_EQ(run("0.5", " -o " + (scratch / "whole").string()).exit_code, 0);
    EXPECT_EQ(state_of(folder), state_of(scratch / "whole"));
    if (!fs::exists(page_parts() / "echarts.min.js")) return;
    const auto seen = run_words(words_of("view " + folder.string() + " --frames 1000000"));
    const auto whole = run_words(words_of("view " + (scratch / "whole").string() + " --frames 1000000"));
    EXPECT_EQ(seen.exit_code, 0) << seen.errors;
    const auto frames = [](const std::string& text) { return text.substr(text.find(':', text.find(": ") + 1)); };
    EXPECT_EQ(frames(seen.output), frames(whole.output));
}

TEST(FullDiskOf, ARunIsGoneOnWith) {
    const ScratchFolder scratch;
    const fs::path folder = scratch / "disk";
    const SmallDisk disk(folder, 24 << 20);
    if (!disk.refusal().empty()) GTEST_SKIP() << disk.refusal();
    for (const off_t left : {4 << 10, 400 << 10, 4 << 20}) {
        SCOPED_TRACE(left);
        expect_run_goes_on(
            folder / "run", example_scene("pendulum"), [&] { disk.fill(left); }, [&] { disk.make_room(); });
    }
}

TEST(FullDiskOf, ARunWithALimitOfFileSizesIsGoneOnWith) {
    const ScratchFolder scratch;
    std::optional<FileSizeLimit> limit;
    expect_run_goes_on(
        scratch / "run", example_scene("pendulum"), [&] { limit.emplace(2'600'000); }, [&] { limit.reset(); });
}

#endif

}  // namespace
}  // namespace delassus::tests
