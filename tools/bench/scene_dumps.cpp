// SPDX-License-Identifier: BSD-3-Clause
#include "bench/scene_dumps.hpp"

#include <algorithm>

#include "bench/ask.hpp"
#include "bench/key.hpp"
#include "delassus/error.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

/// Runs the scene; what makes the folder complete is its report, which is written last.
void run_scene(const WorkerSettings& worker, const SuiteDump& dump, const fs::path& folder) {
    ChildSettings child;
    child.program = worker.command;
    child.arguments = {"run",
                       dump.scene.file.string(),
                       "-o",
                       folder.string(),
                       "--dump-problems",
                       std::to_string(dump.every),
                       "--every",
                       "1000000"};
    for (const auto& [path, value] : dump.scene.settings) {
        child.arguments.emplace_back("--set");
        child.arguments.push_back(path + "=" + value);
    }
    if (dump.scene.end >= 0.0) {
        child.arguments.emplace_back("--end");
        child.arguments.push_back(digits(dump.scene.end));
    }
    for (const auto& path : worker.plugin_path) {
        child.arguments.emplace_back("--plugin-path");
        child.arguments.push_back(path.string());
    }
    child.timeout = loading_limit;
    child.cancelled = worker.cancelled;
    const ChildResult run = run_child(child);
    if (run.cancelled) throw Error("interrupted while " + dump.scene.file.string() + " was run");
    // 3: a step missed its tolerance, which does not matter to the problems.
    if (run.exit_code != 0 && run.exit_code != 3)
        throw InputError(fmt::format("{}: the scene could not be run: {}", dump.place, last_line(run.errors)));
}

}  // namespace

void add_dumped_problems(const WorkerSettings& worker, OutputFolder& output, Suite& suite) {
    for (const auto& dump : suite.dumps) {
        std::vector<std::string> parts = {read_file(dump.scene.file), std::to_string(dump.every),
                                          digits(dump.scene.end)};
        for (const auto& [key, value] : dump.scene.settings) parts.push_back(key + "=" + value);
        const std::string name = dump.scene.file.stem().string();
        output.add_folder("problems");
        output.keep();
        const fs::path own = output.add(fmt::format("problems/{}-{}", name, key_of(parts).substr(0, 8)));
        if (!fs::exists(own / "report.json")) {
            run_scene(worker, dump, own);
        }
        std::vector<fs::path> found;
        if (fs::is_directory(own / "problems"))
            for (const auto& entry : fs::directory_iterator(own / "problems")) found.push_back(entry.path());
        if (found.empty())
            throw InputError(
                fmt::format("{}: no step of {} has a problem with rows", dump.place, dump.scene.file.string()));
        std::sort(found.begin(), found.end());
        for (const auto& problem : found)
            suite.problems.push_back({problem, fmt::format("{}: {}", name, problem.filename().string()), {}});
    }
    suite.dumps.clear();
}

}  // namespace delassus::bench
