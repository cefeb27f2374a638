// SPDX-License-Identifier: BSD-3-Clause
// What the tests of plugins share: where the fixtures are, folders that vanish, and the command as a child process.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "check/known_problems.hpp"
#include "support/places.hpp"

namespace delassus::test {

/// The shared library of tests/check/plugins/<name>.
inline std::filesystem::path fixture(const std::string& name) {
    return std::filesystem::path(tests::places::plugins) / (name + ".so");
}

/// A new folder, removed with all its content at the end.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "delassus-test-XXXXXX").string();
        if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make a temporary folder");
        path_ = pattern;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline check::KnownProblem known_problem(const std::string& name) {
    for (auto& known : check::known_problems())
        if (known.problem.name == name) return known;
    throw std::logic_error("no known problem " + name);
}

inline std::string content_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

struct CommandResult {
    int exit_code = -1;  ///< −1 if it died of a signal
    std::string out, err;
    double seconds = 0.0;
};

/// Runs `delassus ARGUMENTS…` with more environment variables, in a working directory if one is given.
inline CommandResult run_command(const std::vector<std::string>& arguments,
                                 const std::map<std::string, std::string>& environment = {},
                                 const std::filesystem::path& working_directory = {}) {
    const TemporaryFolder folder;
    const auto quoted = [](const std::string& text) { return std::string(1, '\'').append(text).append(1, '\''); };
    std::string line;
    if (!working_directory.empty()) line.append("cd ").append(quoted(working_directory.string())).append(" && ");
    for (const auto& [key, value] : environment) line.append(key).append("=").append(quoted(value)).append(" ");
    line += quoted(tests::places::command);
    for (const auto& argument : arguments) line.append(" ").append(quoted(argument));
    line.append(" >").append(quoted((folder.path() / "out").string()));
    line.append(" 2>").append(quoted((folder.path() / "err").string()));
    const auto begin = std::chrono::steady_clock::now();
    const int status = std::system(line.c_str());
    CommandResult result;
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (WIFEXITED(status) && WEXITSTATUS(status) < 128) result.exit_code = WEXITSTATUS(status);
    result.out = content_of(folder.path() / "out");
    result.err = content_of(folder.path() / "err");
    return result;
}

}  // namespace delassus::test
