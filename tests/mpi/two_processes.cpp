// SPDX-License-Identifier: BSD-3-Clause
// two_processes PLUGIN write|compare FILE: solves a set of linear problems. `write` keeps x of each in FILE; `compare`,
// run on every process of an MPI run, requires the same x to 1e-8. Exit code 1 with a sentence on stderr if not.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "delassus/generate.hpp"
#include "delassus/solver.hpp"

namespace {

using namespace delassus;

std::vector<Problem> problems() {
    ChainParameters chain;
    chain.bodies = 200;
    chain.world_frame = true;
    ChainParameters repeated = chain;
    repeated.repeated = 2;
    repeated.mass_ratio = 1e6;
    GyroscopicParameters tops;
    Problem free_flight;  // m = 0
    free_flight.H = SparseMatrix::from_triplets(3, 3, {{0, 0, 2.0}, {1, 1, 4.0}, {2, 2, 8.0}});
    free_flight.a = {1.0, 2.0, 3.0};
    Problem tiny;  // fewer rows than processes in λ
    tiny.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {1, 1, 3.0}});
    tiny.D = SparseMatrix::from_triplets(1, 2, {{0, 0, 1.0}, {0, 1, -1.0}});
    tiny.a = {4.0, 0.0};
    tiny.b = {0.0};
    tiny.cones = {Cone::free(1)};
    return {generate_chain(chain), generate_chain(repeated), generate_gyroscopic(tops), free_flight, tiny};
}

int fail(const std::string& sentence) {
    std::fprintf(stderr, "%s\n", sentence.c_str());
    return 1;
}

int run(const std::string& plugin, bool write, const std::string& file) {
    const Registry registry;
    Solver solver(registry.load(plugin), {}, &registry);
    std::vector<double> answers;
    SolveSettings settings;
    settings.tolerance = 1e-10;
    settings.time_limit = 60.0;
    for (auto& problem : problems()) {
        const PreparedProblem prepared(std::move(problem));
        Solution solution;
        const auto report = solver.solve(prepared, solution, settings);
        if (report.status != Status::Solved)
            return fail("problem with n = " + std::to_string(solution.x.size()) + ": " +
                        std::string(name_of(report.status)) + ", " + report.message);
        answers.insert(answers.end(), solution.x.begin(), solution.x.end());
    }
    const auto bytes = static_cast<std::streamsize>(answers.size() * sizeof(double));
    if (write) {
        std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(answers.data()), bytes);
        return 0;
    }
    if (!std::getenv("OMPI_COMM_WORLD_SIZE") && !std::getenv("PMI_SIZE"))
        return fail("compare must be started by mpirun");
    std::vector<double> serial(answers.size());
    if (!std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(serial.data()), bytes))
        return fail("the serial answers are missing or of another size");
    double difference = 0.0, size = 0.0;
    for (std::size_t i = 0; i < answers.size(); ++i) {
        difference = std::hypot(difference, answers[i] - serial[i]);
        size = std::hypot(size, serial[i]);
    }
    if (!(difference <= 1e-8 * size))
        return fail("the answers differ by " + std::to_string(difference / size) + " of their size");
    return 0;
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) return fail("usage: two_processes PLUGIN write|compare FILE");
    try {
        return run(arguments[1], std::string(arguments[2]) == "write", arguments[3]);
    } catch (const std::exception& failure) {
        return fail(failure.what());
    }
}
