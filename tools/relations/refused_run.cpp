// SPDX-License-Identifier: BSD-3-Clause
#include "relations/refused_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "process/child_process.hpp"
#include "support/output_folder.hpp"

namespace delassus::relations {
namespace {

namespace fs = std::filesystem;

/// Names in the folder that its mark does not list; the mark itself is one that it need not.
std::string unlisted_name(const fs::path& folder) {
    std::set<std::string> listed = {std::string(folder_mark)};
    std::ifstream mark(folder / folder_mark);
    for (std::string line; std::getline(mark, line);) {
        if (line.ends_with('/')) line.pop_back();
        listed.insert(line);
    }
    for (const auto& entry : fs::directory_iterator(folder))
        if (const auto name = entry.path().filename().string(); !listed.contains(name)) return name;
    return "";
}

}  // namespace

std::string wrong_with_refusal(const Json& scene, const fs::path& command, const fs::path& scratch, double seconds) {
    const fs::path file = scratch / "refused.yaml", folder = scratch / "refused";
    fs::remove_all(folder);
    std::ofstream(file) << scene_yaml(scene);
    ChildSettings child;
    child.program = command;
    child.arguments = {"run", file.string(), "-o", folder.string()};
    child.timeout = seconds;
    const ChildResult result = run_child(child);
    if (result.timed_out) return "";
    if (result.signal != 0) return "the command ends by " + signal_name(result.signal);
    const int code = result.exit_code.value_or(0);
    if (code < 2 || code > 4) return fmt::format("the command ends with exit code {} where it refuses", code);
    if (result.errors.find("delassus: ") == std::string::npos) return "the command refuses without a sentence";
    if (fs::exists(folder))
        if (const auto name = unlisted_name(folder); !name.empty())
            return fmt::format("a refused run leaves a file \"{}\" that is not listed", name);
    return "";
}

}  // namespace delassus::relations
