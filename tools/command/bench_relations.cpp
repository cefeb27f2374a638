// SPDX-License-Identifier: BSD-3-Clause
#include "bench_relations.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "bench/scratch_folder.hpp"
#include "delassus/error.hpp"
#include "measuring.hpp"
#include "process/child_process.hpp"
#include "process/supervision.hpp"
#include "relations/campaign.hpp"
#include "relations/relations.hpp"
#include "support/nearest_name.hpp"
#include "support/text_file.hpp"

namespace delassus::command {
namespace {

void require_relations(const std::vector<std::string>& names) {
    const auto& all = relations::relation_names;
    for (const auto& name : names)
        if (std::find(all.begin(), all.end(), name) == all.end())
            throw InputError(
                fmt::format("there is no relation {}{}", name,
                            nearest_name_hint(name, std::vector<std::string_view>(all.begin(), all.end()))));
}

void require_sense(const RelationsArguments& arguments) {
    if (arguments.jobs < 1 || arguments.jobs > 1024)
        throw InputError(fmt::format("--jobs is {}; it must be from 1 to 1024", arguments.jobs));
    if (!(arguments.minutes >= 0.0)) throw InputError("--minutes must be a positive number");
    if (!(arguments.shrink_seconds >= 0.0)) throw InputError("--shrink must be a number of seconds, or 0");
}

}  // namespace

const CLI::Option* RelationsArguments::given() const {
    const auto found =
        std::find_if(options.begin(), options.end(), [](const auto* option) { return option->count() > 0; });
    return found == options.end() ? nullptr : *found;
}

bool is_relations(const std::string& suite) {
    return suite == "relations" && !std::filesystem::is_regular_file(suite);
}

std::string about_relations() {
    return fmt::format(
        "relations: Random scenes, and what must hold between runs of them\n"
        "    Turned and moved, in other units, in another order, in two pieces, in other coordinates and more; what "
        "fails "
        "is shrunk to a small scene (--count, --seed, --minutes, --jobs)\n    relations: {}",
        fmt::join(relations::relation_names, ", "));
}

void add_relations_options(CLI::App& run, RelationsArguments& arguments) {
    const auto add = [&](CLI::Option* option) {
        option->group("Options of the suite `relations`");
        arguments.options.push_back(option);
    };
    add(run.add_option("--count", arguments.count, "How many random scenes [100]")->type_name("N"));
    add(run.add_option("--seed", arguments.seed, "Of the scenes: the same seed and counter make the same scene [1]")
            ->type_name("N"));
    add(run.add_option("--first", arguments.first, "Counter of the first scene [0]")->type_name("N"));
    add(run.add_option("--minutes", arguments.minutes, "After which no other scene is begun [no limit]")
            ->type_name("MINUTES"));
    add(run.add_option("--jobs", arguments.jobs, "Scenes that are judged side by side [1]")->type_name("N"));
    add(run.add_option("--shrink", arguments.shrink_seconds,
                       "Seconds to look for the smallest scene of each violation; 0: none [30]")
            ->type_name("SECONDS"));
    add(run.add_option("--scene", arguments.scene, "Judge this scene in place of random ones, and write nothing")
            ->type_name("SCENE"));
}

int run_relations(const RelationsArguments& arguments) {
    require_relations(arguments.only);
    require_sense(arguments);
    const bench::ScratchFolder scratch;
    relations::Campaign campaign;
    campaign.settings.command = own_program();
    campaign.settings.plugin_path = arguments.plugin_path;
    campaign.settings.scratch = scratch.path();
    campaign.settings.cancelled = interrupted;
    campaign.only = arguments.only;
    install_interrupt_handler();
    if (!arguments.scene.empty()) {
        const auto answer = relations::judge_file(campaign.settings, arguments.scene, campaign.only);
        fmt::print("{}", answer.text);
        return answer.violated > 0 || interrupted() ? exit_not_converged : exit_solved;
    }
    campaign.seed = arguments.seed;
    campaign.first = arguments.first;
    campaign.count = arguments.count;
    if (arguments.minutes > 0.0) campaign.seconds = 60.0 * arguments.minutes;
    campaign.jobs = arguments.jobs;
    campaign.shrink_seconds = arguments.shrink_seconds;
    OutputFolder output(arguments.output.empty() ? std::filesystem::path("delassus-bench-relations") : arguments.output,
                        "relations");
    relations::CampaignCounts counts;
    {
        MeasuringProgress progress;
        counts = relations::run_campaign(campaign, output, [&](const relations::CampaignCounts& now) {
            progress.begin(fmt::format("[{}/{}] violated: {}", now.scenes, campaign.count, now.violated));
        });
    }
    fmt::print("{}\n{}\n", read_file(output.path() / "summary.md"),
               (output.path() / "results.jsonl").lexically_normal().string());
    if (counts.interrupted) fmt::print(stderr, "delassus: interrupted after {} scenes\n", counts.scenes);
    return counts.violated > 0 || counts.interrupted ? exit_not_converged : exit_solved;
}

}  // namespace delassus::command
