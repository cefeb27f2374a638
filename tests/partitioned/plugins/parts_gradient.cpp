// SPDX-License-Identifier: BSD-3-Clause
// A small solver of partitioned problems for tests: accelerated projected gradients, of which every process keeps the
// whole x. It also fails as it is told, on one process.
#include <mpi.h>
#include <Eigen/LU>

#include <Eigen/LU>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <vector>

#include <unistd.h>

#include "delassus/sdk/partitioned_solver.hpp"

namespace {

using namespace delassus::sdk;

constexpr const char* faults[] = {"none", "throw", "kill", "crash", "memory", "wait", "claim"};
constexpr delassus_option options[] = {
    choice_option("fault", "none", faults,
                  "What process 1 does after ten iterations; claim: all claim that there is no solution"),
};

class PartsGradient : public PartitionedSolver {
public:
    explicit PartsGradient(const OptionValues& values) : fault_(values.choice("fault")) {}

    using PartitionedSolver::analyze;
    using PartitionedSolver::factorize;
    using PartitionedSolver::solve;

    void analyze(const LocalProblemView&) override {}
    void factorize(const LocalProblemView& problem) override {
        inverse_.assign(static_cast<std::size_t>(problem.n * 16), 0.0);
        for (std::size_t k = 0; k + 1 < problem.h_block_start.size(); ++k) {
            const auto first = problem.h_block_start[k], size = problem.h_block_start[k + 1] - first;
            Eigen::MatrixXd block = Eigen::MatrixXd::Zero(size, size);
            for (std::int64_t i = 0; i < size; ++i)
                for (std::int64_t j = 0; j < size; ++j)
                    block(i, j) = entry(problem, row(problem, first + i), row(problem, first + j));
            block = block.inverse().eval();
            for (std::int64_t i = 0; i < size; ++i)
                for (std::int64_t j = 0; j < size; ++j)
                    inverse_[static_cast<std::size_t>(row(problem, first + i) * 16 + j)] = block(i, j);
        }
    }

    Outcome solve(const LocalProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override {
        if (!request.warm_start()) lambda.setZero();
        const Vector s = scaling(problem);
        double largest = power(problem, s);
        Vector a = problem.a;
        apply(problem, a);
        Vector r = multiply(problem, spread(problem, a)) + problem.b, z = lambda.cwiseQuotient(s), y = z, before = z;
        double reference = std::sqrt(sum(problem, r.cwiseProduct(s).squaredNorm()));
        if (!(reference > 0.0)) reference = 1.0;
        double momentum = 1.0;
        Outcome outcome{DELASSUS_ITERATION_LIMIT, 0, NAN, ""};
        for (std::int64_t k = 0;; ++k) {
            outcome.iterations = k;
            const Vector F = velocity(problem, s, z);
            const double natural = std::sqrt(sum(problem, (z - project(problem, z - F)).squaredNorm())) / reference;
            outcome.residual = natural;
            if (k == 10) fail(problem);
            lambda = z.cwiseProduct(s);
            if (const auto answer = request.progress(k, nullptr, lambda.data()); answer != DELASSUS_CONTINUE) {
                outcome.status = status_of(answer);
                break;
            }
            if (k == 10 && fault_ == "claim") {
                outcome.status = DELASSUS_INFEASIBLE;
                break;
            }
            if (natural <= 0.9 * request.tolerance()) {
                outcome.status = DELASSUS_SOLVED;
                break;
            }
            if (k >= request.max_iterations()) break;
            before = z;
            z = project(problem, y - velocity(problem, s, y) / largest);
            const double ascent = sum(problem, (y - z).dot(z - before));
            const double next = ascent > 0.0 ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
            y = ascent > 0.0 ? z : Vector(z + (momentum - 1.0) / next * (z - before));
            momentum = next;
        }
        Vector own = problem.a + gather(problem, lambda);
        apply(problem, own);
        x = own;
        return outcome;
    }

private:
    static MPI_Comm communicator(const LocalProblemView& problem) { return MPI_Comm_f2c(problem.raw->communicator); }
    static bool alone(const LocalProblemView& problem) { return problem.raw->processes == 1; }
    static double sum(const LocalProblemView& problem, double value) {
        if (!alone(problem)) MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, communicator(problem));
        return value;
    }
    static std::int64_t row(const LocalProblemView& problem, std::int64_t place) {
        return problem.h_block_index[static_cast<std::size_t>(place)];
    }
    static double entry(const LocalProblemView& problem, std::int64_t i, std::int64_t j) {
        for (auto k = problem.H.row_start[static_cast<std::size_t>(i)];
             k < problem.H.row_start[static_cast<std::size_t>(i) + 1]; ++k)
            if (problem.H.column[static_cast<std::size_t>(k)] == problem.first_column() + j)
                return problem.H.value[static_cast<std::size_t>(k)];
        return 0.0;
    }
    /// v ← H⁻¹ v, own entries.
    void apply(const LocalProblemView& problem, Vector& v) const {
        const Vector from = v;
        for (std::size_t k = 0; k + 1 < problem.h_block_start.size(); ++k) {
            const auto first = problem.h_block_start[k], size = problem.h_block_start[k + 1] - first;
            for (std::int64_t i = 0; i < size; ++i) {
                double total = 0.0;
                for (std::int64_t j = 0; j < size; ++j)
                    total += inverse_[static_cast<std::size_t>(row(problem, first + i) * 16 + j)] *
                             from[row(problem, first + j)];
                v[row(problem, first + i)] = total;
            }
        }
    }
    /// The whole of a vector of columns of which each process has its own.
    static Vector spread(const LocalProblemView& problem, const Vector& own) {
        Vector all = Vector::Zero(problem.raw->n_all);
        all.segment(problem.first_column(), problem.n) = own;
        if (!alone(problem))
            MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM,
                          communicator(problem));
        return all;
    }
    /// Own entries of Dᵀλ.
    static Vector gather(const LocalProblemView& problem, const Vector& lambda) {
        Vector all = Vector::Zero(problem.raw->n_all);
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (auto k = problem.D.row_start[static_cast<std::size_t>(i)];
                 k < problem.D.row_start[static_cast<std::size_t>(i) + 1]; ++k)
                all[problem.D.column[static_cast<std::size_t>(k)]] +=
                    problem.D.value[static_cast<std::size_t>(k)] * lambda[i];
        if (!alone(problem))
            MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM,
                          communicator(problem));
        return all.segment(problem.first_column(), problem.n);
    }
    static Vector multiply(const LocalProblemView& problem, const Vector& all) {
        Vector u = Vector::Zero(problem.m);
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (auto k = problem.D.row_start[static_cast<std::size_t>(i)];
                 k < problem.D.row_start[static_cast<std::size_t>(i) + 1]; ++k)
                u[i] +=
                    problem.D.value[static_cast<std::size_t>(k)] * all[problem.D.column[static_cast<std::size_t>(k)]];
        return u;
    }
    /// S(D H⁻¹(a + Dᵀ S z) + b), with the De Saxcé term.
    Vector velocity(const LocalProblemView& problem, const Vector& s, const Vector& z) const {
        Vector own = problem.a + gather(problem, s.cwiseProduct(z));
        apply(problem, own);
        Vector u = multiply(problem, spread(problem, own)) + problem.b;
        for (std::int64_t c = 0; problem.coulomb && c < problem.raw->cone_count; ++c)
            u[problem.cone(c).first_row] += de_saxce(problem.cone(c), u.data() + problem.cone(c).first_row);
        return u.cwiseProduct(s);
    }
    static Vector project(const LocalProblemView& problem, Vector z) {
        for (std::int64_t c = 0; c < problem.raw->cone_count; ++c)
            delassus::sdk::project(problem.cone(c), z.data() + problem.cone(c).first_row);
        return z;
    }
    Vector scaling(const LocalProblemView& problem) const {
        Vector s = Vector::Ones(problem.m);
        std::vector<double> whole(static_cast<std::size_t>(problem.raw->n_all * 16), 0.0);
        std::vector<std::int64_t> block(static_cast<std::size_t>(problem.raw->n_all), 0), place = block;
        for (std::size_t k = 0; k + 1 < problem.h_block_start.size(); ++k)
            for (auto p = problem.h_block_start[k]; p < problem.h_block_start[k + 1]; ++p) {
                const auto j = static_cast<std::size_t>(problem.first_column() + row(problem, p));
                block[j] = problem.first_column() + row(problem, problem.h_block_start[k]) + 1;
                place[j] = p - problem.h_block_start[k];
            }
        std::copy(inverse_.begin(), inverse_.end(), whole.begin() + problem.first_column() * 16);
        if (!alone(problem)) {
            MPI_Allreduce(MPI_IN_PLACE, whole.data(), static_cast<int>(whole.size()), MPI_DOUBLE, MPI_SUM,
                          communicator(problem));
            for (auto* numbers : {&block, &place})
                MPI_Allreduce(MPI_IN_PLACE, numbers->data(), static_cast<int>(numbers->size()), MPI_INT64_T, MPI_SUM,
                              communicator(problem));
        }
        for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
            const auto& cone = problem.cone(c);
            double trace = 0.0;
            for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i) {
                const auto begin = problem.D.row_start[static_cast<std::size_t>(i)],
                           end = problem.D.row_start[static_cast<std::size_t>(i) + 1];
                for (auto p = begin; p < end; ++p)
                    for (auto q = begin; q < end; ++q) {
                        const auto j = static_cast<std::size_t>(problem.D.column[static_cast<std::size_t>(p)]);
                        const auto l = static_cast<std::size_t>(problem.D.column[static_cast<std::size_t>(q)]);
                        if (block[j] == block[l])
                            trace += problem.D.value[static_cast<std::size_t>(p)] *
                                     problem.D.value[static_cast<std::size_t>(q)] *
                                     whole[j * 16 + static_cast<std::size_t>(place[l])];
                    }
            }
            for (std::int32_t i = cone.first_row; trace > 0.0 && i < cone.first_row + cone.rows; ++i)
                s[i] = 1.0 / std::sqrt(trace / cone.rows);
        }
        return s;
    }
    /// The largest eigenvalue of S N S, and a little more.
    double power(const LocalProblemView& problem, const Vector& s) const {
        Vector v = Vector::Ones(problem.m);
        double size = 1.0;
        for (int k = 0; k < 60; ++k) {
            const double norm = std::sqrt(sum(problem, v.squaredNorm()));
            if (!(norm > 0.0)) return 1.0;
            v /= norm;
            Vector own = gather(problem, s.cwiseProduct(v));
            apply(problem, own);
            v = multiply(problem, spread(problem, own)).cwiseProduct(s);
            size = std::sqrt(sum(problem, v.squaredNorm()));
        }
        return 1.1 * size;
    }
    void fail(const LocalProblemView& problem) const {
        if (problem.raw->process != 1 || fault_ == "none") return;
        if (fault_ == "throw") throw std::runtime_error("the disk of this node is gone");
        if (fault_ == "memory") throw std::bad_alloc();
        if (fault_ == "crash") std::raise(SIGSEGV);
        if (fault_ == "kill") std::raise(SIGKILL);
        if (fault_ == "wait") {  // to be killed from outside: its number is in $DELASSUS_TEST_AT_WORK
            if (const char* file = std::getenv("DELASSUS_TEST_AT_WORK")) std::ofstream(file) << getpid() << std::endl;
            for (;;) pause();
        }
    }

    std::string fault_;
    std::vector<double> inverse_;  // 16 for each own row
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(PartsGradient,
                       (PluginInfo{.name = "parts_gradient",
                                   .version = "1.0.0",
                                   .description = "Projected gradients in parts, and faults, for tests",
                                   .licence = "BSD-3-Clause",
                                   .capabilities = all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB |
                                                   DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                                                   DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START |
                                                   DELASSUS_CAN_PARTITIONED}),
                       options)
