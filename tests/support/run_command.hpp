// SPDX-License-Identifier: BSD-3-Clause
// Runs the `delassus` command as a user would.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <unistd.h>
#include "support/places.hpp"

namespace delassus::tests {

/// A folder of its own for one test, removed at the end.
class ScratchFolder {
public:
    ScratchFolder() {
        static std::atomic<int> count{0};
        path_ = std::filesystem::temp_directory_path() /
                ("delassus-test-" + std::to_string(getpid()) + "-" + std::to_string(count++));
        std::filesystem::create_directories(path_);
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

struct CommandResult {
    int exit_code = -1;  ///< 128 + signal if it was killed
    std::string out, err;
};

/// arguments as typed in a shell after the program's path.
inline CommandResult run_shell(const std::string& line) {
    const ScratchFolder scratch;
    const std::string full = "( " + line + " ) >" + (scratch / "out").string() + " 2>" + (scratch / "err").string();
    const int status = std::system(full.c_str());
    CommandResult result;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = text_of(scratch / "out");
    result.err = text_of(scratch / "err");
    return result;
}

inline CommandResult run_command(const std::string& arguments) {
    return run_shell(std::string(tests::places::command) + " " + arguments);
}

/// What the dynamic loader says of the libraries that it maps while the command runs.
inline std::string loader_log(const std::string& arguments) {
    const ScratchFolder scratch;
    const auto result = run_shell("LD_DEBUG=files LD_DEBUG_OUTPUT=" + (scratch / "log").string() + " " +
                                  tests::places::command + " " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::string log;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) log += text_of(entry.path());
    EXPECT_NE(log.find("libdelassus.so"), std::string::npos) << "the loader's log is empty";
    return log;
}

inline std::string example(const std::string& name) {
    return (std::filesystem::path(tests::places::source) / "examples" / "problems" / name).string();
}

}  // namespace delassus::tests
