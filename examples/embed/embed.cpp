// SPDX-License-Identifier: BSD-3-Clause
// An example of a program that embeds Delassus: a block on a rough slope, with the solver chosen by a configuration
// string.
//
// A point mass m touches a plane inclined by an angle θ. Contact frame: normal, down the slope, across. In one time
// step h from rest, with f the weight: H = m I, a = h f, D = I, b = 0. The block sticks if tan θ ≤ μ, and else slides
// with the acceleration g (sin θ − μ cos θ) (exact Coulomb law).
#include <cmath>
#include <cstdio>
#include <exception>

#include "delassus/config.hpp"
#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace {

delassus::Problem block_on_slope(double angle, double mu) {
    constexpr double mass = 2.0, gravity = 9.81, step = 0.01;
    delassus::Problem problem;
    problem.name = "block on a slope";
    problem.H = delassus::SparseMatrix::from_triplets(3, 3, {{0, 0, mass}, {1, 1, mass}, {2, 2, mass}});
    problem.D = delassus::SparseMatrix::from_triplets(3, 3, {{0, 0, 1.0}, {1, 1, 1.0}, {2, 2, 1.0}});
    problem.a = {-mass * gravity * step * std::cos(angle), mass * gravity * step * std::sin(angle), 0.0};
    problem.b = {0.0, 0.0, 0.0};
    problem.cones = {delassus::Cone::friction(mu)};
    problem.law = delassus::Law::Coulomb;
    return problem;
}

}  // namespace

int main(int argc, char** argv) {
    const char* yaml = argc > 1 ? argv[1] : "solver: {name: pgs, tolerance: 1e-10}";
    try {
        const delassus::Config config = delassus::parse_config(yaml, "the command line");
        const delassus::Registry registry(config.plugin_path);
        delassus::Solver solver = delassus::make_solver(registry, config.solver);

        const double angle = 0.6, mu = 0.3;
        const delassus::PreparedProblem problem(block_on_slope(angle, mu));
        delassus::Solution solution;
        const delassus::SolveReport report = solver.solve(problem, solution, config.solver.settings());

        const double expected = 0.01 * 9.81 * (std::sin(angle) - mu * std::cos(angle));
        std::printf("%s: %.*s, natural error %.1e\n", report.solver.c_str(),
                    static_cast<int>(delassus::name_of(report.status).size()), delassus::name_of(report.status).data(),
                    report.error.natural);
        std::printf("speed down the slope %.12f m/s, by formula %.12f m/s\n", solution.x[1], expected);
        return report.status == delassus::Status::Solved && std::abs(solution.x[1] - expected) < 1e-8 ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
