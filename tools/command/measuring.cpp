// SPDX-License-Identifier: BSD-3-Clause
#include "measuring.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "delassus/error.hpp"
#include "delassus/plugin_info.hpp"
#include "process/terminal.hpp"
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
    if (shown_) show_line("");
}

void MeasuringProgress::show(const std::string& figures) const {
    if (shown_) show_line(fmt::format("{}  {}", what_, figures));
}

std::string write_report_files(OutputFolder& folder, const std::vector<std::pair<std::string, std::string>>& files,
                               const std::string& page, const std::function<std::string()>& page_text) {
    std::vector<std::pair<std::filesystem::path, std::string>> contents;
    for (const auto& [name, text] : files) contents.emplace_back(folder.add(name), text);
    std::string no_page;
    try {
        std::string text = page_text();
        contents.emplace_back(folder.add(page), std::move(text));
    } catch (const InputError& error) {
        no_page = fmt::format("no {} was written, because a part of the page is missing: {}", page, error.what());
    }
    write_files_atomically(contents);
    folder.keep();
    if (!no_page.empty()) folder.remove(page);
    return no_page;
}

void warn_of_unoptimized(const std::string& plugin) {
    fmt::print(stderr, "delassus: warning: {} was {}\n", plugin, unoptimized_build);
}

void UnoptimizedPlugins::warn() const {
    for (const auto& name : names_) warn_of_unoptimized(name);
}

std::vector<std::string> own_command_line() {
    std::ifstream stream("/proc/self/cmdline", std::ios::binary);
    std::vector<std::string> arguments;
    for (std::string argument; std::getline(stream, argument, '\0');) arguments.push_back(argument);
    return arguments;
}

}  // namespace delassus::command
