// SPDX-License-Identifier: BSD-3-Clause
#include "measuring.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "delassus/error.hpp"
#include "support/atomic_file.hpp"

namespace delassus::command {

MeasuringProgress::MeasuringProgress() : shown_(isatty(STDERR_FILENO) != 0) {}

void MeasuringProgress::begin(const std::string& what) {
    what_ = what;
    show("");
}

void MeasuringProgress::sample(const CurveSample& sample) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(100);
    show(fmt::format("iteration {}  {:.1f} s  natural {:.2e}", sample.iteration, sample.seconds, sample.natural));
}

void MeasuringProgress::clear() const {
    if (shown_) fmt::print(stderr, "\r\033[K");
}

void MeasuringProgress::show(const std::string& figures) const {
    if (shown_) fmt::print(stderr, "\r\033[K{}  {}", what_, figures);
}

std::string write_page(const std::filesystem::path& file, const std::function<std::string()>& text) {
    std::string page;
    try {
        page = text();
    } catch (const InputError& error) {
        std::error_code ignored;
        std::filesystem::remove(file, ignored);
        return fmt::format("no {} was written, because a part of the page is missing: {}", file.filename().string(),
                           error.what());
    }
    write_file_atomically(file, page);
    return {};
}

std::vector<std::string> own_command_line() {
    std::ifstream stream("/proc/self/cmdline", std::ios::binary);
    std::vector<std::string> arguments;
    for (std::string argument; std::getline(stream, argument, '\0');) arguments.push_back(argument);
    return arguments;
}

}  // namespace delassus::command
