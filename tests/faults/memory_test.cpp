// SPDX-License-Identifier: BSD-3-Clause
// Allocations that fail, one at a time and all above a size, all along a command: it ends with a sentence and an exit
// code, never by a crash, and leaves nothing half-written.
#include <regex>

#include "fault_fixture.hpp"
#include "support/places.hpp"
#include "support/scenes.hpp"

namespace delassus::tests {
namespace {

struct Command {
    const char* name;
    std::string line;          ///< INPUT and OUT stand for folders, of which the second is empty before
    const char* in = nullptr;  ///< only processes with this first argument fail
    int samples = 24;
};

void PrintTo(const Command& command, std::ostream* out) {
    *out << command.name;
}

class OutOfMemory : public testing::TestWithParam<Command> {
protected:
    void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
        GTEST_SKIP() << "sanitizers have a malloc of their own";
#endif
        fs::create_directory(scratch_ / "in");
        fs::create_directory(scratch_ / "out");
        for (const char* line :
             {"generate box_stack INPUT/boxes --set boxes=3", "convert INPUT/boxes INPUT/boxes.hdf5 --law coulomb"})
            ASSERT_EQ(run_words(words(line)).exit_code, 0) << line;
    }

    [[nodiscard]] std::vector<std::string> words(const std::string& line) const {
        std::vector<std::string> words = words_of(line);
        for (std::string& word : words)
            for (const auto& [mark, folder] : {std::pair("INPUT", "in"), std::pair("OUT", "out")})
                if (word.rfind(mark, 0) == 0) word.replace(0, std::strlen(mark), (scratch_ / folder).string());
        return words;
    }

    /// HDF5 1.10 crashes where a single allocation of its own fails, so those are left alone: it is not called where
    /// memory is short (hdf5::require_memory), which the limits of size show.
    [[nodiscard]] ChildResult run(Environment environment) const {
        environment.emplace_back("DELASSUS_FAIL_NOT_IN", "libhdf5");
        environment.emplace_back("LD_PRELOAD", tests::places::failing_malloc);
        if (GetParam().in != nullptr) environment.emplace_back("DELASSUS_FAIL_IN", GetParam().in);
        return run_words(words(GetParam().line), environment);
    }

    /// What an untroubled run allocates: how often, and how much at most.
    [[nodiscard]] std::pair<long, long> measure() const {
        const auto report = scratch_ / "report";
        fs::remove(report);
        const auto result = run({{"DELASSUS_FAIL_REPORT", report.string()}});
        EXPECT_EQ(result.exit_code, 0) << result.errors;
        std::ifstream stream(report);
        std::pair<long, long> most{0, 0};
        for (long count = 0, size = 0; stream >> count >> size;)
            most = {std::max(most.first, count), std::max(most.second, size)};
        EXPECT_GT(most.first, 100);
        return most;
    }

    void expect_order(const ChildResult& result, const std::string& fault) {
        const std::string told = fault + ", exit code " + std::to_string(result.exit_code.value_or(-1)) + "\n" +
                                 result.output + result.errors;
        EXPECT_FALSE(result.timed_out) << told;
        const int code = result.exit_code.value_or(-1);
        // The C library ends the process itself where it finds no memory for a thread's data or for its destructor.
        const bool by_loader = code == 127 && told.find("thread-local data: ABORT") != std::string::npos;
        const bool by_libc = told.find("Fatal glibc error: failed to register TLS destructor") != std::string::npos;
        EXPECT_TRUE(by_libc || result.signal == 0) << told;
        EXPECT_TRUE(by_loader || by_libc || code == 0 || code == 2 || code == 3 || code == 4) << told;
        EXPECT_EQ(told.find("terminate called"), std::string::npos) << told;
        EXPECT_TRUE(by_libc || told.find("crashed") == std::string::npos) << told;
        if (code != 0) {
            ++failures_;
            // The last is how the dynamic loader says it.
            const bool says =
                std::regex_search(told, std::regex("memory|alloc|shared object descriptor", std::regex::icase));
            EXPECT_TRUE(says) << told;
        }
        const auto now = snapshot(scratch_ / "out");
        for (const auto& [name, content] : now) EXPECT_EQ(name.find("partial"), std::string::npos) << told << name;
        std::error_code ignored;
        for (const auto& entry : fs::directory_iterator(scratch_ / "out")) fs::remove_all(entry.path(), ignored);
    }

    ScratchFolder scratch_;
    int failures_ = 0;
};

TEST_P(OutOfMemory, EndsInOrder) {
    const auto [count, size] = measure();
    const int samples = GetParam().samples;
    for (int k = 0; k < samples; ++k) {
        const long at = 1 + (count - 1) * k / samples + k % 7;
        expect_order(run({{"DELASSUS_FAIL_AT", std::to_string(at)}}), "allocation " + std::to_string(at));
    }
    for (int k = 1; k < samples; ++k) {
        const long most = size * k / samples;
        expect_order(run({{"DELASSUS_FAIL_ABOVE", std::to_string(most)}}), std::to_string(most) + " bytes");
    }
    EXPECT_GT(failures_, samples) << "faults were not noticed";
}

INSTANTIATE_TEST_SUITE_P(
    Of, OutOfMemory,
    testing::Values(Command{"solve", "solve INPUT/boxes --solver pgs --solution OUT/s"},
                    Command{"solve_hdf5", "solve INPUT/boxes.hdf5 --solver pgs"},
                    Command{"solve_auto", "solve INPUT/boxes --json"},
                    Command{"run", "run " + example_scene("box_on_incline") + " --end 0.05 -o OUT/run"},
                    Command{"inspect", "inspect INPUT/boxes --json"},
                    Command{"inspect_hdf5", "inspect INPUT/boxes.hdf5"},
                    Command{"convert", "convert INPUT/boxes OUT/p.hdf5 --law coulomb"},
                    Command{"generate", "generate sphere_pile OUT/p --set contacts=30"},
                    Command{"compare", "compare INPUT/boxes --solvers pgs --repeats 1 -o OUT/c", "compare", 10},
                    Command{"compares_worker", "compare INPUT/boxes --solvers pgs --repeats 1 -o OUT/c", "worker", 10}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace delassus::tests
