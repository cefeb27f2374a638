// SPDX-License-Identifier: BSD-3-Clause
// delassus view: a page that plays the motion of a run.
#include <fmt/format.h>

#include "command.hpp"
#include "delassus/error.hpp"
#include "output/view_page.hpp"
#include "support/atomic_file.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

namespace {

namespace fs = std::filesystem;

struct ViewArguments {
    fs::path folder, output;
    RecordingLimits limits;
};

int view(const ViewArguments& arguments) {
    if (arguments.limits.frames < 2) throw InputError("--frames must be at least 2: the start and the end");
    const char* own_name = "scene.html";
    const fs::path file = arguments.output.empty() ? arguments.folder / own_name : arguments.output;
    require_replaceable(file, "page");
    const RecordedRun run = read_run(arguments.folder, arguments.limits);
    const std::string page = view_page(run);
    if (arguments.output.empty()) add_to_folder_mark(arguments.folder, own_name);
    write_file_atomically(file, page);
    fmt::print("{}: {:.1f} MB\n", file.lexically_normal().string(), static_cast<double>(page.size()) / 1e6);
    for (const auto& system : run.systems) {
        fmt::print("  {}: {} of {} frames, to t = {:.6g} s", system.name, system.t.size(), system.frames,
                   system.t.back());
        fmt::print("{}\n", static_cast<std::int64_t>(system.t.size()) < system.frames ? "; --frames N shows more" : "");
    }
    if (run.status != "finished") fmt::print("  the run is {}; the page shows what is there\n", run.status);
    return exit_solved;
}

}  // namespace

void add_view(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<ViewArguments>();
    auto* command = program.add_subcommand(
        "view", "Write a page for a browser, in a single file, that plays the motion of a run in 3D beside its plots");
    command->add_option("folder", arguments->folder, "Folder that `delassus run -o` wrote")
        ->required()
        ->type_name("DIR");
    command->add_option("-o,--output", arguments->output, "The page [DIR/scene.html]")->type_name("FILE");
    command
        ->add_option("--frames", arguments->limits.frames,
                     "Largest number of frames of each system, evenly chosen in time [600]")
        ->type_name("N");
    command->callback([arguments, &action] { action.run = [arguments] { return view(*arguments); }; });
}

}  // namespace delassus::command
