// SPDX-License-Identifier: BSD-3-Clause
// Solvers and their results.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "arrays.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "guards.hpp"
#include "problems.hpp"

namespace delassus::python {

/// A solver, the registry that it refers to, and whose turn it is to use it.
struct SharedSolver {
    std::shared_ptr<const Registry> registry;
    std::optional<Solver> solver;
    Turn turn;

    SharedSolver(std::shared_ptr<const Registry> plugins, const std::string& text, const OptionTexts& options)
        : registry(std::move(plugins)) {
        SolverConfig config = parse_solver(text);
        if (config.name.empty()) config.name = "auto";
        for (const auto& [key, value] : options) config.options.insert_or_assign(key, value);
        const py::gil_scoped_release without_gil;
        solver.emplace(make_solver(*registry, config));
    }
};

/// What a solve gave.
struct SolveResult {
    SolveReport report;
    py::array x, lambda, u;
};

/// Has the problem another law as long as this lives.
class LawForNow {
public:
    LawForNow(PreparedProblem& problem, Law law) : problem_(problem), before_(problem.problem().law) { set(law); }
    ~LawForNow() { set(before_); }
    LawForNow(const LawForNow&) = delete;
    LawForNow& operator=(const LawForNow&) = delete;

private:
    void set(Law law) {
        if (problem_.problem().law != law) problem_.set_law(law);
    }
    PreparedProblem& problem_;
    Law before_;
};

/// u = D x + E λ + b; m.
inline std::vector<double> constraint_velocities(const Problem& problem, const Solution& solution) {
    std::vector<double> u = vector_of(problem.b);
    if (problem.n() > 0) problem.D.multiply_add(1.0, solution.x.data(), u.data());
    if (problem.E.entries() > 0) problem.E.multiply_add(1.0, solution.lambda.data(), u.data());
    return u;
}

inline SolveResult solve(SharedSolver& self, SharedProblem& problem, double tolerance,
                         std::optional<std::int64_t> max_iterations, std::optional<double> time_limit,
                         const std::optional<std::string>& law, const std::optional<std::pair<Reals, Reals>>& start,
                         bool curve) {
    Interrupts interrupts;
    SolveSettings settings;
    settings.tolerance = tolerance;
    if (max_iterations) settings.max_iterations = *max_iterations;
    if (time_limit) settings.time_limit = *time_limit;
    settings.record_curve = curve;
    settings.cancelled = [&interrupts] { return interrupts.came(); };
    Solution solution;
    if (start) {
        settings.warm_start = true;
        solution = {vector_of(start->first, "the start's x"), vector_of(start->second, "the start's λ")};
        const auto n = problem.data().n(), m = problem.data().m();
        if (solution.x.size() != static_cast<std::size_t>(n) || solution.lambda.size() != static_cast<std::size_t>(m))
            throw InputError(fmt::format("the start has {} velocities and {} reactions; the problem has n = {}, m = {}",
                                         solution.x.size(), solution.lambda.size(), n, m));
    }
    SolveReport report;
    std::vector<double> u;
    {
        const py::gil_scoped_release without_gil;
        const std::scoped_lock lock(self.turn, problem.turn);
        const LawForNow law_for_now(*problem.prepared, law ? law_of(*law) : problem.data().law);
        const ProblemInUse in_use(*problem.prepared);
        report = self.solver->solve(*problem.prepared, solution, settings);
        u = constraint_velocities(problem.data(), solution);
    }
    interrupts.rethrow();
    return {std::move(report), array_of(std::move(solution.x)), array_of(std::move(solution.lambda)),
            array_of(std::move(u))};
}

inline py::dict errors_of(const SolveResult& result) {
    py::dict errors;
    for (const ErrorMeasure& measure : error_measures)
        errors[py::str(measure.name.data(), measure.name.size())] = result.report.error.*measure.value;
    return errors;
}

inline py::array curve_of(const SolveResult& result) {
    std::vector<double> rows;
    rows.reserve(3 * result.report.curve.size());
    for (const CurveSample& sample : result.report.curve)
        rows.insert(rows.end(), {static_cast<double>(sample.iteration), sample.seconds, sample.natural});
    const auto count = static_cast<py::ssize_t>(result.report.curve.size());
    return array_of(std::move(rows), {count, 3});
}

inline py::list stages_of(const SolveResult& result) {
    py::list stages;
    for (const StageReport& stage : result.report.stages) {
        py::dict row;
        row["solver"] = stage.solver;
        row["options"] = stage.options;
        row["law"] = std::string(name_of(stage.law));
        row["reason"] = stage.reason;
        row["tolerance"] = stage.tolerance;
        row["status"] = std::string(name_of(stage.status));
        row["message"] = stage.message;
        row["iterations"] = stage.iterations;
        row["seconds"] = stage.seconds;
        row["natural"] = stage.natural;
        stages.append(row);
    }
    return stages;
}

/// What a solver that failed left is no answer, so that the error of it says nothing.
inline std::string text_of(const SolveResult& result) {
    const SolveReport& report = result.report;
    const bool failed = report.status == Status::Error || report.status == Status::NumericalFailure;
    const std::string error =
        failed ? "no answer"
        : report.error.balance > std::max(report.error.natural, report.tolerance)
            ? fmt::format("natural error {:.2e}, balance error {:.2e}", report.error.natural, report.error.balance)
            : fmt::format("natural error {:.2e}", report.error.natural);
    return fmt::format("<delassus.Result: {} with {}: {} after {} iterations, {:.3g} s, {}{}{}>",
                       report.problem.empty() ? "problem" : report.problem, report.solver, name_of(report.status),
                       report.iterations, report.seconds_setup + report.seconds_solve, error,
                       report.message.empty() ? "" : ": ", report.message);
}

inline void bind_solvers(py::module_& module) {
    using namespace py::literals;

    const auto from_report = [](auto member) {
        return [member](const SolveResult& result) { return result.report.*member; };
    };
    py::class_<SolveResult>(module, "Result",
                            "What a solve gave. All errors were computed by Delassus from the problem and (x, λ), "
                            "whatever the solver claimed.")
        .def_readonly("x", &SolveResult::x, "Velocities, n.")
        .def_readonly("lam", &SolveResult::lambda, "Reactions λ, m.")
        .def_readonly("lambda_", &SolveResult::lambda, "Reactions λ, m; the same array as lam.")
        .def_readonly("u", &SolveResult::u, "Constraint velocities D x + E λ + b, m.")
        .def_property_readonly(
            "status", [](const SolveResult& result) { return std::string(name_of(result.report.status)); },
            "'solved', 'iteration_limit', 'time_limit', 'stalled', 'infeasible', 'numerical_failure', 'cancelled', "
            "'error' or 'false_claim'.")
        .def_property_readonly(
            "solved", [](const SolveResult& result) { return result.report.status == Status::Solved; },
            "Whether the status is 'solved': the solver says so, and the measured errors agree.")
        .def_property_readonly("errors", &errors_of,
                               "The error measures by name, dimensionless (docs/errors.md); tolerance means 'natural'.")
        .def_property_readonly("iterations", from_report(&SolveReport::iterations), "As the solver counts them.")
        .def_property_readonly(
            "seconds",
            [](const SolveResult& result) { return result.report.seconds_setup + result.report.seconds_solve; },
            "The solver's own time, set-up included and measuring excluded.")
        .def_property_readonly("seconds_setup", from_report(&SolveReport::seconds_setup))
        .def_property_readonly("seconds_solve", from_report(&SolveReport::seconds_solve))
        .def_property_readonly("analyses", from_report(&SolveReport::analyses), "Since the solver was made.")
        .def_property_readonly("factorizations", from_report(&SolveReport::factorizations),
                               "Since the solver was made.")
        .def_property_readonly("claimed_residual", from_report(&SolveReport::claimed_residual),
                               "The solver's own idea of its natural error; NaN if it has none.")
        .def_property_readonly("curve", &curve_of,
                               "Samples × 3: iteration, seconds, natural error; without rows unless curve=True.")
        .def_property_readonly("stages", &stages_of,
                               "With 'auto' and 'finish' the solvers in turn, a dict each with the reason and what "
                               "it reached.")
        .def_property_readonly("message", from_report(&SolveReport::message), "What a person should know; may be ''.")
        .def_property_readonly("problem", from_report(&SolveReport::problem), "The problem's name.")
        .def_property_readonly("solver", from_report(&SolveReport::solver))
        .def_property_readonly("version", from_report(&SolveReport::version))
        .def_property_readonly("options", from_report(&SolveReport::options), "Those that were chosen.")
        .def_property_readonly("law", [](const SolveResult& result) { return std::string(name_of(result.report.law)); })
        .def_property_readonly("tolerance", from_report(&SolveReport::tolerance))
        .def(
            "to_json", [](const SolveResult& result) { return to_json(result.report); },
            "The report as `delassus solve --json` prints it (docs/report.md).")
        .def("__repr__", [](const SolveResult& result) { return text_of(result); });

    py::class_<SharedSolver>(module, "Solver")
        .def(py::init<std::shared_ptr<const Registry>, const std::string&, const OptionTexts&>(), "registry"_a,
             "name"_a, "options"_a)
        .def_property_readonly("name", [](const SharedSolver& self) { return self.solver->info().name; })
        .def_property_readonly("version", [](const SharedSolver& self) { return self.solver->info().version; })
        .def_property_readonly(
            "optimized", [](const SharedSolver& self) { return optimized_of(self.solver->info()); },
            "Whether the compiler optimised the plugin; None where it does not say.")
        .def(
            "refusal",
            [](SharedSolver& self, SharedProblem& problem) {
                const py::gil_scoped_release without_gil;
                const std::scoped_lock lock(self.turn, problem.turn);
                const ProblemInUse in_use(*problem.prepared);
                return self.solver->refusal(*problem.prepared, SolveSettings());
            },
            "problem"_a, "'' if the solver can take the problem; else a sentence that says why not.")
        .def("_solve", &solve);
}

}  // namespace delassus::python
