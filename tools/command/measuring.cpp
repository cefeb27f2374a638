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

std::string write_report_files(std::vector<std::pair<std::filesystem::path, std::string>> files,
                               const std::filesystem::path& page, const std::function<std::string()>& page_text) {
    std::string no_page;
    try {
        files.emplace_back(page, page_text());
    } catch (const InputError& error) {
        no_page = fmt::format("no {} was written, because a part of the page is missing: {}", page.filename().string(),
                              error.what());
    }
    write_files_atomically(files);
    std::error_code ignored;
    if (!no_page.empty()) std::filesystem::remove(page, ignored);
    return no_page;
}

std::vector<std::string> own_command_line() {
    std::ifstream stream("/proc/self/cmdline", std::ios::binary);
    std::vector<std::string> arguments;
    for (std::string argument; std::getline(stream, argument, '\0');) arguments.push_back(argument);
    return arguments;
}

}  // namespace delassus::command
