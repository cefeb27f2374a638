// SPDX-License-Identifier: BSD-3-Clause
// One instance of MUMPS: the factors of C K C, spread over the processes of a communicator.
#pragma once

#include <dmumps_c.h>

#include <cstdint>
#include <vector>

#include "delassus/sdk/mpi.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::mumps {

struct Settings {
    int ordering = 7;               ///< ICNTL(7)
    int memory_relaxation = 30;     ///< ICNTL(14), per cent
    int refinement_steps = 2;       ///< ICNTL(10), of MUMPS itself
    int error_analysis = 2;         ///< ICNTL(11): 0 none, 1 with condition numbers, 2 backward errors
    double pivot_threshold = 0.01;  ///< CNTL(1)
    double null_pivot = 1e-14;      ///< −CNTL(3): pivot columns of C K C below it count as zero
};

/// MUMPS' error analysis of the first solution after a factorisation (ICNTL(11)).
struct ErrorAnalysis {
    bool known = false;
    double backward_1 = 0.0, backward_2 = 0.0;    ///< RINFOG(7), RINFOG(8)
    double condition_1 = 0.0, condition_2 = 0.0;  ///< RINFOG(10), RINFOG(11); 0 unless asked for
    double forward = 0.0;                         ///< RINFOG(9): bound of the error of the solution; 0 unless asked for
};

/// All functions are collective. Throws NumericalFailure with a sentence where MUMPS fails.
class Factorization {
public:
    explicit Factorization(const Settings& settings) : settings_(settings) {}
    ~Factorization();
    Factorization(const Factorization&) = delete;
    Factorization& operator=(const Factorization&) = delete;

    /// JOB = 1. C: the scaling, n + m. Chooses LDLᵀ, or LU for an unsymmetric H. Size n + m must not be 0.
    void analyze(const sdk::ProblemView& problem, const sdk::Vector& C);

    /// JOB = 2, of the matrix with the shift on its diagonal (see visit_saddle_point). If MUMPS asks for more memory,
    /// it gets it.
    void factorize(const sdk::ProblemView& problem, const sdk::Vector& C, double shift);

    /// JOB = 3: v ← (C K C)⁻¹ v, on every process. transposed: the inverse of the transpose.
    void solve(sdk::Vector& v, bool transposed = false);

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }
    [[nodiscard]] int null_pivots() const { return null_pivots_; }  ///< INFOG(28)
    [[nodiscard]] const ErrorAnalysis& error_analysis() const { return error_analysis_; }
    [[nodiscard]] const sdk::MpiCommunicator& communicator() const { return communicator_; }

private:
    void start(bool symmetric);
    void stop();
    void fill(const sdk::ProblemView& problem, const sdk::Vector& C, double shift, bool places);
    void run(int job);
    [[nodiscard]] int result() const { return data_.infog[0]; }
    [[nodiscard]] bool distributed() const { return communicator_.size() > 1; }

    Settings settings_;
    sdk::MpiCommunicator communicator_;
    DMUMPS_STRUC_C data_{};
    bool started_ = false, symmetric_ = true;
    std::vector<MUMPS_INT> row_, column_;
    std::vector<double> value_;
    std::vector<double> right_hand_side_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
    int null_pivots_ = 0;
    bool fresh_ = false;
    ErrorAnalysis error_analysis_;
};

}  // namespace delassus::mumps
