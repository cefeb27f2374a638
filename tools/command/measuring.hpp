// SPDX-License-Identifier: BSD-3-Clause
// What `delassus compare` and `delassus bench` have in common: a line of progress, a page, the command line.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "delassus/solver.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

/// The one line on a terminal that says where a measurement is; nothing where there is no terminal.
class MeasuringProgress {
public:
    MeasuringProgress();
    ~MeasuringProgress() { clear(); }
    MeasuringProgress(const MeasuringProgress&) = delete;
    MeasuringProgress& operator=(const MeasuringProgress&) = delete;

    void begin(const std::string& what);
    void sample(const CurveSample& sample);
    void clear() const;

private:
    void show(const std::string& figures) const;
    bool shown_;
    std::string what_;
    std::chrono::steady_clock::time_point next_;
};

/// Writes all files of a report, by their names in the folder, and the page that page_text makes, or none of them. If a
/// part of the page is missing, it removes an older page, which would mislead, and returns the sentence that says why
/// there is none.
[[nodiscard]] std::string write_report_files(OutputFolder& folder,
                                             const std::vector<std::pair<std::string, std::string>>& files,
                                             const std::string& page, const std::function<std::string()>& page_text);

/// The command line of this process, as it was given.
[[nodiscard]] std::vector<std::string> own_command_line();

/// Warns on standard error that the plugin was built without optimisation.
void warn_of_unoptimized(const std::string& plugin);

/// Collects plugins that were built without optimisation, and warns of each once.
class UnoptimizedPlugins {
public:
    [[nodiscard]] std::function<void(const std::string&)> listener() {
        return [this](const std::string& plugin) { names_.insert(plugin); };
    }
    void warn() const;

private:
    std::set<std::string> names_;
};

}  // namespace delassus::command
