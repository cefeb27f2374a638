// SPDX-License-Identifier: BSD-3-Clause
// delassus.1, in the macros of man(7).
#include <array>
#include <cstdlib>
#include <ctime>
#include <sstream>

#include "command_table.hpp"
#include "delassus/version.hpp"

namespace delassus::command {

namespace {

std::string roff(const std::string& text) {
    return replaced(text, {{'\\', "\\e"}, {'-', "\\-"}, {'\'', "\\(aq"}, {'\n', " "}});
}

/// A paragraph in lines of at most 78 bytes where words allow it.
std::string roff_lines(const std::string& text) {
    std::istringstream words(text);
    std::string result, line;
    const auto end_line = [&] {
        if (line.starts_with('.')) result += "\\&";
        result += line + '\n';
        line.clear();
    };
    for (std::string word; words >> word;) {
        if (!line.empty() && line.size() + word.size() + 1 > 78) end_line();
        line += (line.empty() ? "" : " ") + word;
    }
    end_line();
    return result;
}

/// The day of the build, or of SOURCE_DATE_EPOCH, as packages want it.
std::string day_of_the_page() {
    const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
    const std::time_t now = epoch == nullptr ? std::time(nullptr) : std::strtoll(epoch, nullptr, 10);
    std::tm parts{};
    gmtime_r(&now, &parts);
    std::array<char, 16> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts);
    return text.data();
}

void put_arguments(Output& out, const CLI::App& app) {
    for (const CLI::Option* one : positionals(app))
        put(out, ".TP\n\\fI{}\\fR\n{}", roff(one->get_name(true)), roff_lines(roff(one->get_description())));
    for (const CLI::Option* one : options(app)) {
        std::vector<std::string> names;
        for (const auto& flag : flags(*one)) names.push_back("\\fB" + roff(flag) + "\\fR");
        const std::string value = takes_a_value(*one) ? " \\fI" + roff(one->get_type_name()) + "\\fR" : "";
        put(out, ".TP\n{}{}\n{}", joined(names, ", "), value, roff_lines(roff(one->get_description())));
    }
}

void put_manual_command(Output& out, const CommandPath& path) {
    std::string usage = path.app->get_options({}).empty() ? "" : " [\\fIoptions\\fR]";
    for (const CLI::Option* one : positionals(*path.app)) {
        const std::string name = "\\fI" + roff(one->get_name(true)) + "\\fR";
        usage += " " + (one->get_required() ? name : "[" + name + "]") + (may_be_repeated(*one) ? "..." : "");
    }
    if (!subcommands(*path.app).empty()) usage += " \\fIcommand\\fR";
    put(out, ".SS delassus {}\n\\fBdelassus {}\\fR{}\n.PP\n{}", roff(joined(path.words)), roff(joined(path.words)),
        usage, roff_lines(roff(path.app->get_description()) + "."));
    put_arguments(out, *path.app);
}

/// Lines that a newcomer can type in a clone or after an installation.
constexpr std::pair<const char*, const char*> manual_examples[] = {
    {"delassus plugins list", "The solvers that are installed."},
    {"delassus solve examples/problems/sphere_pile --solver apgd --tolerance 1e-6",
     "Solves a pile of spheres with a solver by name."},
    {"delassus compare examples/problems/sphere_pile --solvers 'apgd,pgs(omega=1.2)'",
     "Compares two solvers, with error against time on a page for a browser."},
    {"delassus run examples/scenes/double_wishbone.yaml -o wishbone", "Simulates a mechanism."},
    {"delassus view wishbone", "Makes a page that plays it in 3D."},
};

}  // namespace

void write_manual_page(Output& out, const CLI::App& program) {
    put(out, ".TH DELASSUS 1 \"{}\" \"delassus {}\" \"User commands\"\n", day_of_the_page(), DELASSUS_VERSION);
    put(out, ".SH NAME\ndelassus \\- solve, compare and simulate constrained mechanical systems\n");
    put(out, ".SH SYNOPSIS\n\\fBdelassus\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n");
    const std::string description = program.get_description();
    const auto codes = description.find("Exit codes: ");
    put(out, ".SH DESCRIPTION\n{}", roff_lines(roff(description.substr(0, codes))));
    put(out, ".SH OPTIONS\n");
    put_arguments(out, program);
    put(out, ".SH COMMANDS\n");
    for (const auto& path : command_paths(program))
        if (!path.words.empty()) put_manual_command(out, path);
    if (codes != std::string::npos) put(out, ".SH EXIT STATUS\n{}", roff_lines(roff(description.substr(codes + 12))));
    put(out,
        ".SH ENVIRONMENT\n.TP\n\\fBDELASSUS_PLUGIN_PATH\\fR\nFolders to search for plugins, separated by colons.\n");
    put(out, ".SH EXAMPLES\n");
    for (const auto& [line, purpose] : manual_examples) put(out, ".TP\n\\fB{}\\fR\n{}\n", roff(line), roff(purpose));
}

}  // namespace delassus::command
