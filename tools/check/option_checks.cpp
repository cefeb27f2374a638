// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "check/checks.hpp"
#include "delassus/error.hpp"

namespace delassus::check {

namespace {

bool is_snake_case(const std::string& key) {
    return !key.empty() && key[0] >= 'a' && key[0] <= 'z' &&
           key.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
}

std::string check_table(const Subject& subject) {
    for (const auto& option : subject.info().options) {
        expect(is_snake_case(option.key), fmt::format("the key \"{}\" is not in lower_snake_case", option.key));
        expect(!option.doc.empty() && option.doc.find('\n') == std::string::npos,
               fmt::format("\"{}\" has no line of documentation", option.key));
        expect(option.type != DELASSUS_OPTION_CHOICE || option.choices.size() > 1,
               fmt::format("\"{}\" offers fewer than two choices", option.key));
    }
    return fmt::format("{} options", subject.info().options.size());
}

std::string check_defaults(const Subject& subject) {
    OptionTexts written;
    for (const auto& option : subject.info().options) written[option.key] = option.default_value;
    const auto known = subject.problems().front();
    Solver by_default = subject.solver(), by_hand = subject.solver(written);
    solve_known(by_default, known);
    solve_known(by_hand, known);
    return fmt::format("solves \"{}\"", known.problem.name);
}

/// Makes a solver with one option set; a refusal must give its reason. Null: refused.
std::unique_ptr<Solver> solver_with(const Subject& subject, const std::string& key, const std::string& value) {
    try {
        return std::make_unique<Solver>(subject.solver({{key, value}}));
    } catch (const InputError& error) {
        expect(std::string_view(error.what()).find("it gave no reason") == std::string_view::npos,
               fmt::format("{}={} is refused without a reason", key, value));
        expect(std::string_view(error.what()).find("exception through the plugin border") == std::string_view::npos,
               fmt::format("{}={}: {}", key, value, error.what()));
        return nullptr;
    }
}

std::string check_ranges(const Subject& subject) {
    int tried = 0, refused = 0;
    const auto attempt = [&](const OptionInfo& option, double value) {
        if (!std::isfinite(value)) return;
        const std::string text = option.type == DELASSUS_OPTION_INTEGER
                                     ? fmt::format("{}", static_cast<std::int64_t>(value))
                                     : fmt::format("{}", value);
        ++tried;
        if (!solver_with(subject, option.key, text)) ++refused;
    };
    for (const auto& option : subject.info().options) {
        if (option.type != DELASSUS_OPTION_INTEGER && option.type != DELASSUS_OPTION_REAL) continue;
        attempt(option, option.minimum);
        attempt(option, option.maximum);
        if (!std::isfinite(option.minimum)) continue;
        bool outside_is_refused = false;
        try {
            static_cast<void>(subject.solver({{option.key, fmt::format("{}", option.minimum - 1.0)}}));
        } catch (const InputError&) {
            outside_is_refused = true;
        }
        expect(outside_is_refused, fmt::format("\"{}\" accepted a value below its range", option.key));
    }
    return fmt::format("{} bounds, {} refused with a sentence", tried, refused);
}

/// A choice may converge worse than the default, or refuse a problem; it may not fail or claim falsely.
std::string check_choices(const Subject& subject) {
    const auto problems = subject.problems();
    int tried = 0;
    const auto attempt = [&](const std::string& key, const std::string& value) {
        ++tried;
        const auto solver = solver_with(subject, key, value);
        if (!solver) return;
        const PreparedProblem problem(problems.back().problem);
        auto settings = settings_of(1e-6);
        settings.max_iterations = 1000;
        settings.time_limit = 1.0;
        if (!solver->refusal(problem, settings).empty()) return;
        Solution solution;
        const auto report = solver->solve(problem, solution, settings);
        expect(report.status != Status::Error && report.status != Status::FalseClaim,
               fmt::format("with {}={}, \"{}\" ended with {}: {}", key, value, problem.problem().name,
                           name_of(report.status), report.message));
    };
    for (const auto& option : subject.info().options) {
        if (option.type == DELASSUS_OPTION_BOOLEAN)
            for (const char* value : {"true", "false"}) attempt(option.key, value);
        if (option.type == DELASSUS_OPTION_CHOICE)
            for (const auto& value : option.choices) attempt(option.key, value);
    }
    return fmt::format("{} values", tried);
}

std::string check_unknown(const Subject& subject) {
    try {
        static_cast<void>(subject.solver({{"no_such_option", "1"}}));
    } catch (const InputError& error) {
        return error.what();
    }
    throw Failure("an option that is not in the table was accepted");
}

}  // namespace

std::vector<Check> option_checks() {
    return {{"options/table", check_table},
            {"options/defaults", check_defaults},
            {"options/ranges", check_ranges},
            {"options/choices", check_choices},
            {"options/unknown", check_unknown}};
}

}  // namespace delassus::check
