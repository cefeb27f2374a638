// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/step_solver.hpp"

#include <fmt/format.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "delassus/error.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "dynamics/islands.hpp"

namespace delassus {

namespace {

/// The names in the files preference.txt of the plugin folders, in order; lines with # are comments.
std::vector<std::string> preferences(const Registry& registry) {
    std::vector<std::string> names;
    for (const auto& folder : registry.folders()) {
        std::ifstream file(folder / "preference.txt");
        for (std::string line; std::getline(file, line);)
            if (!line.empty() && line[0] != '#') names.push_back(line);
    }
    return names;
}

/// x = H⁻¹ a for an H that is not definite: LU with partial pivoting. Throws StepSolver's sentence if H is singular.
std::vector<double> solve_by_lu(const PreparedProblem& problem) {
    const sdk::ProblemView view(problem.raw());
    const Eigen::SparseLU<sdk::SparseColumns> factor{sdk::SparseColumns(view.H)};
    if (factor.info() != Eigen::Success) throw InputError("H is singular, and no constraint holds what it leaves free");
    const sdk::Vector x = factor.solve(view.a);
    return {x.begin(), x.end()};
}

}  // namespace

struct StepSolver::Implementation {
    Implementation(const Registry& known, SolverConfig chosen) : registry(known), config(std::move(chosen)) {
        settings = config.settings();
    }

    Solver& named(const std::string& name, std::size_t instance) {
        SolverConfig one = config;
        one.name = name;
        std::vector<Solver> more;
        for (std::size_t k = solvers.contains(name) ? solvers[name].size() : 0; k <= instance; ++k)
            more.push_back(make_solver(registry, one));
        auto& instances = solvers[name];
        std::move(more.begin(), more.end(), std::back_inserter(instances));
        return instances[instance];
    }

    [[nodiscard]] std::string choice(std::uint64_t needs) const {
        if (!config.name.empty()) return config.name;
        const auto capable = registry.capable(needs);
        for (const auto& name : preferences(registry))
            if (std::find(capable.begin(), capable.end(), name) != capable.end()) return name;
        return capable.empty() ? std::string() : capable.front();
    }

    Solver& choose(const PreparedProblem& problem, std::size_t instance) {
        const std::string name = choice(problem.needs());
        if (!name.empty()) return named(name, instance);
        throw Unsupported(
            fmt::format("no installed solver can take the step's problem: {}", problem.describe(problem.needs())));
    }

    bool solve_part(Problem problem, Solution& solution, bool warm_start, std::size_t number);

    /// Parts beyond so many share instances; it bounds the memory.
    static constexpr std::size_t most_instances = 64;

    const Registry& registry;
    SolverConfig config;
    SolveSettings settings;
    std::map<std::string, std::vector<Solver>> solvers;  // instances by the number of the part
    SolverEffort effort;
};

StepSolver::StepSolver(const Registry& registry, SolverConfig config)
    : implementation_(std::make_unique<Implementation>(registry, std::move(config))) {}
StepSolver::~StepSolver() = default;

// The parts of a problem are solved one by one, each kind of part by a solver instance of its own: the k-th part of a
// step is, as long as bodies keep their neighbours, the k-th of the next, and its analysis can be used again.
bool StepSolver::solve(Problem problem, Solution& solution, bool warm_start) {
    auto& self = *implementation_;
    if (self.config.law) problem.law = *self.config.law;
    if (on_problem) on_problem(problem);
    ++self.effort.solves;
    const auto n = static_cast<std::size_t>(problem.n()), m = static_cast<std::size_t>(problem.m());
    warm_start = warm_start && solution.x.size() == n && solution.lambda.size() == m;
    if (m == 0 || problem.E.rows > 0) return self.solve_part(std::move(problem), solution, warm_start, 0);

    const Islands islands(problem);
    if (islands.list().size() == 1 && islands.list()[0].cones.size() == problem.cones.size())
        return self.solve_part(std::move(problem), solution, warm_start, 0);
    if (!warm_start) solution = {std::vector<double>(n, 0.0), std::vector<double>(m, 0.0)};
    const Solution start = solution;
    std::fill(solution.lambda.begin(), solution.lambda.end(), 0.0);  // of rows that belong to no part
    bool solved = true;
    std::size_t number = 0;
    for (const Island& island : islands.list()) {
        Solution part = islands.take(island, start);
        solved = self.solve_part(islands.part(island), part, warm_start, number++) && solved;
        islands.put(island, part, solution);
    }
    return solved;
}

bool StepSolver::Implementation::solve_part(Problem problem, Solution& solution, bool warm_start, std::size_t number) {
    const PreparedProblem prepared(std::move(problem));
    if (prepared.problem().m() == 0) {
        const auto structure = prepared.structure();
        const bool definite = structure == Structure::Diagonal || structure == Structure::Blocks ||
                              structure == Structure::Definite || structure == Structure::Reduced;
        solution.x = definite ? ErrorMeter(prepared).velocity_of({}) : solve_by_lu(prepared);
        solution.lambda.clear();
        return true;
    }
    Solver& solver = choose(prepared, number % most_instances);
    SolveSettings part_settings = settings;
    part_settings.warm_start = warm_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
    const auto report = solver.solve(prepared, solution, part_settings);
    ++effort.plugin_solves;
    effort.iterations += report.iterations;
    effort.seconds += report.seconds_setup + report.seconds_solve;
    effort.worst_natural = std::max(effort.worst_natural, report.error.natural);
    if (report.status == Status::Solved) return true;
    if (effort.unsolved.empty())
        effort.unsolved =
            fmt::format("{} ended with {} at a natural error of {:.1e}{}{}", report.solver, name_of(report.status),
                        report.error.natural, report.message.empty() ? "" : ": ", report.message);
    return false;
}

std::vector<StepSolver::Part> StepSolver::parts(Problem problem) const {
    if (implementation_->config.law) problem.law = *implementation_->config.law;
    const auto part_of = [](const PreparedProblem& prepared) {
        return Part{prepared.problem().n(), prepared.problem().m(), prepared.structure(), prepared.needs()};
    };
    if (problem.m() == 0 || problem.E.rows > 0) return {part_of(PreparedProblem(std::move(problem)))};
    const Islands islands(problem);
    std::vector<Part> result;
    for (const Island& island : islands.list()) result.push_back(part_of(PreparedProblem(islands.part(island))));
    return result;
}
std::string StepSolver::choice(std::uint64_t needs) const {
    return implementation_->choice(needs);
}

const SolverEffort& StepSolver::effort() const {
    return implementation_->effort;
}
void StepSolver::reset_effort() {
    implementation_->effort = {};
}
std::vector<std::string> StepSolver::loaded() const {
    std::vector<std::string> names;
    for (const auto& [name, instances] : implementation_->solvers) names.push_back(name);
    return names;
}

}  // namespace delassus
