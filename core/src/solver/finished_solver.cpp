// SPDX-License-Identifier: BSD-3-Clause
#include "solver/finished_solver.hpp"

#include <fmt/format.h>

#include "delassus/error.hpp"
#include "solver/solver_implementation.hpp"
#include "solver/stages.hpp"

namespace delassus {

namespace {

/// The table of the two options, in the form of a plugin's own.
const std::vector<OptionInfo>& finish_table() {
    static const std::vector<OptionInfo> table = {
        {"finish", DELASSUS_OPTION_TEXT, "", 0.0, 0.0, {}, "", "Solver that takes over, e.g. ssn"},
        {"finish_at", DELASSUS_OPTION_REAL, "1e-4", 1e-15, 1.0, {}, "", "Natural error at which it takes over"}};
    return table;
}

class FinishedSolver : public Solver::Implementation {
public:
    FinishedSolver(Solver main, Solver finish, double finish_at, OptionTexts chosen)
        : main_(std::move(main)), finish_(std::move(finish)), finish_at_(finish_at), chosen_(std::move(chosen)) {}

    [[nodiscard]] const PluginInfo& info() const override { return main_.info(); }
    [[nodiscard]] const OptionTexts& options() const override { return chosen_; }

    [[nodiscard]] std::string refusal(const Prepared& problem, const SolveSettings& settings) override {
        if (std::string sentence = main_.refusal(problem, settings); !sentence.empty()) return sentence;
        SolveSettings warm = settings;
        warm.warm_start = true;
        return finish_.refusal(problem, warm);
    }

    [[nodiscard]] SetUpCounts counts() const override {
        SetUpCounts sum = counts_of(main_);
        return sum += counts_of(finish_);
    }

    std::optional<Errors> run(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                              SolveReport& report) override {
        StageRunner runner(problem, solution, settings, report);
        const auto done = [&](Solver& solver, const Stage& stage) {
            return runner.run(solver, stage).end == TurnEnd::Done;
        };
        if (!done(main_, {.reason = "the solver that was asked for", .tolerance = finish_at_}) &&
            !done(finish_, {.reason = "its finish"}))
            done(main_, {.reason = "the finish did not reach the tolerance"});
        report.message = runner.sentence();
        return runner.error();
    }

private:
    Solver main_, finish_;
    double finish_at_;
    OptionTexts chosen_;
};

}  // namespace

FinishOptions take_finish(OptionTexts& options) {
    OptionTexts own;
    for (const auto& row : finish_table())
        if (auto found = options.extract(row.key)) own.insert(std::move(found));
    const auto values = resolve_options("the framework", finish_table(), own);
    FinishOptions finish{values[0].text, values[1].real};
    if (finish.solver.empty() && own.contains("finish_at"))
        throw InputError("finish_at says when another solver takes over; finish must name it");
    return finish;
}

Solver make_finished(Solver main, Solver finish, double finish_at, OptionTexts chosen) {
    return Solver(std::make_unique<FinishedSolver>(std::move(main), std::move(finish), finish_at, std::move(chosen)));
}

}  // namespace delassus
