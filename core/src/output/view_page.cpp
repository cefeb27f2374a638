// SPDX-License-Identifier: BSD-3-Clause
#include "output/view_page.hpp"

#include <fmt/format.h>

#include "delassus/error.hpp"
#include "output/view_json.hpp"
#include "support/html_page.hpp"
#include "support/json.hpp"
#include "support/sentence.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace fs = std::filesystem;

RecordedRun read_run(const fs::path& folder, const RecordingLimits& limits) {
    const fs::path file = folder / "trajectory.h5", report = folder / "report.json";
    std::error_code error;
    if (!fs::is_directory(folder, error))
        throw InputError(
            fmt::format("{} is not a folder; give the one that `delassus run SCENE -o DIR` wrote", folder.string()));
    if (!fs::exists(file, error))
        throw InputError(
            fmt::format("{} holds no trajectory.h5; `delassus run SCENE -o DIR` writes one", folder.string()));
    RecordedRun run;
    run.status = "unfinished";
    if (fs::exists(report, error)) {
        try {
            const auto json = parse_json(read_file(report));
            run.title = json.at("title").get<std::string>();
            run.status = json.at("status").get<std::string>();
            run.message = json.at("message").get<std::string>();
        } catch (const nlohmann::json::exception& damage) {
            throw InputError(fmt::format("{} is not the report of a run: {}", report.string(), sentence_of(damage)));
        }
    }
    run.systems = read_trajectory(file, limits);
    for (const auto& system : run.systems)
        if (system.t.empty())
            throw InputError(fmt::format("{}: system \"{}\" has no frame yet", file.string(), system.name));
    if (run.systems.empty()) throw InputError(fmt::format("{} holds no system", file.string()));
    return run;
}

std::string view_page(const RecordedRun& run) {
    const fs::path parts = page_parts();
    std::error_code error;
    for (const auto& [part, library] : {std::pair("three.min.js", "three.js"), std::pair("echarts.min.js", "ECharts")})
        if (!fs::exists(parts / part, error))
            throw InputError(
                fmt::format("no page can be made: npm did not bring {} when Delassus was built ({} is "
                            "missing); install npm and build again",
                            library, (parts / part).string()));
    return html_page(parts, "view.html", view_json(run));
}

}  // namespace delassus
