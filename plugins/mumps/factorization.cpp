// SPDX-License-Identifier: BSD-3-Clause
#include "factorization.hpp"

#include <algorithm>
#include <mutex>

#include "delassus/sdk/blas_threads.hpp"
#include "delassus/sdk/saddle_point.hpp"
#include "errors.hpp"

namespace delassus::mumps {

using sdk::NumericalFailure;
using sdk::ProblemView;
using sdk::Vector;

namespace {

// MUMPS keeps the list of its instances in static arrays: one call at a time in a process.
std::recursive_mutex& library() {
    static std::recursive_mutex mutex;
    return mutex;
}

constexpr int unsymmetric_matrix = 0, symmetric_matrix = 2;  // SYM

}  // namespace

Factorization::~Factorization() {
    stop();
}

void Factorization::run(int job) {
    const std::lock_guard lock(library());
    // The analysis foresees the work of a factorisation; a solve is small beside it.
    const sdk::BlasThreads threads(job == 2 ? data_.rinfog[0] : 0.0);
    data_.job = job;
    dmumps_c(&data_);
}

void Factorization::start(bool symmetric) {
    stop();
    data_ = {};
    data_.par = 1;
    data_.sym = symmetric ? symmetric_matrix : unsymmetric_matrix;
    data_.comm_fortran = static_cast<MUMPS_INT>(MPI_Comm_c2f(communicator_.get()));
    run(-1);
    if (result() < 0) throw NumericalFailure(error_sentence(data_.infog[0], data_.infog[1]));
    started_ = true;
    symmetric_ = symmetric;
    const auto icntl = [&](int k) -> MUMPS_INT& { return data_.icntl[k - 1]; };
    icntl(1) = icntl(2) = icntl(3) = -1;  // no output
    icntl(4) = 0;
    icntl(7) = settings_.ordering;
    icntl(8) = 0;  // scaled before, by powers of two
    icntl(10) = settings_.refinement_steps;
    icntl(11) = settings_.error_analysis;
    icntl(13) = 1;  // null pivots are not detected in a root that ScaLAPACK factors
    icntl(14) = settings_.memory_relaxation;
    icntl(18) = distributed() ? 3 : 0;
    icntl(24) = 1;  // detect null pivots
    if (!symmetric) icntl(6) = 0;
    // Not the ordering of a graph compressed by a weighted matching: with many equal entries the matching takes
    // quadratic time (2000 bodies with doubled joints: 2.5 s against 0.14 s), and the scaled pivots are good without
    // it.
    if (symmetric) icntl(12) = 1;
    data_.cntl[0] = settings_.pivot_threshold;
    data_.cntl[2] = -settings_.null_pivot;
    data_.cntl[4] = 0.0;  // the unknown of a null pivot is set to zero
}

void Factorization::stop() {
    if (started_ && sdk::mpi_is_running()) run(-2);
    started_ = false;
}

// This process's share of the entries: all of them if it is alone, else a slice. LDLᵀ takes one triangle.
void Factorization::fill(const ProblemView& problem, const Vector& C, double shift, bool places) {
    std::int64_t total = 0, position = 0;
    const auto wanted = [&](std::int32_t i, std::int32_t j) { return !symmetric_ || i >= j; };
    sdk::visit_saddle_point(problem, C, shift,
                            [&](std::int32_t i, std::int32_t j, double) { total += wanted(i, j) ? 1 : 0; });
    const std::int64_t rank = communicator_.rank(), size = communicator_.size();
    const std::int64_t begin = total * rank / size, end = total * (rank + 1) / size;
    value_.resize(static_cast<std::size_t>(end - begin));
    if (places) {
        row_.resize(value_.size());
        column_.resize(value_.size());
    }
    sdk::visit_saddle_point(problem, C, shift, [&](std::int32_t i, std::int32_t j, double value) {
        if (!wanted(i, j)) return;
        if (position >= begin && position < end) {
            const auto k = static_cast<std::size_t>(position - begin);
            value_[k] = value;
            if (places) {
                row_[k] = i + 1;
                column_[k] = j + 1;
            }
        }
        ++position;
    });
    data_.n = static_cast<MUMPS_INT>(problem.n + problem.m);
    if (distributed()) {
        data_.nnz_loc = end - begin;
        data_.irn_loc = row_.data();
        data_.jcn_loc = column_.data();
        data_.a_loc = value_.data();
    } else {
        data_.nnz = end - begin;
        data_.irn = row_.data();
        data_.jcn = column_.data();
        data_.a = value_.data();
    }
}

void Factorization::analyze(const ProblemView& problem, const Vector& C) {
    start(!problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC));
    fill(problem, C, 0.0, true);
    run(1);
    if (result() < 0) throw NumericalFailure(error_sentence(data_.infog[0], data_.infog[1]));
    ++analyses_;
}

void Factorization::factorize(const ProblemView& problem, const Vector& C, double shift) {
    fill(problem, C, shift, false);
    data_.icntl[24 - 1] = shift == 0.0 ? 1 : 0;
    // With a semidefinite H the shifted matrix is quasi-definite: LDLᵀ exists for every order of elimination
    // (Vanderbei, 1995), and pivoting would only delay the small pivots into ever larger fronts.
    const bool quasi_definite =
        shift > 0.0 && !problem.needs_any(DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC);
    data_.cntl[0] = quasi_definite ? 0.0 : settings_.pivot_threshold;
    constexpr int attempts = 8;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        run(2);
        const int code = result();
        if (code != -8 && code != -9 && code != -17 && code != -20) break;
        data_.icntl[14 - 1] = std::max(2 * data_.icntl[14 - 1], 50);
    }
    if (result() < 0) throw NumericalFailure(error_sentence(data_.infog[0], data_.infog[1]));
    ++factorizations_;
    null_pivots_ = shift == 0.0 ? data_.infog[28 - 1] : 0;
    fresh_ = true;
    error_analysis_ = {};
}

void Factorization::solve(Vector& v, bool transposed) {
    right_hand_side_.assign(v.data(), v.data() + v.size());
    data_.rhs = right_hand_side_.data();
    data_.nrhs = 1;
    data_.lrhs = data_.n;
    data_.icntl[9 - 1] = transposed ? 0 : 1;
    // A right-hand side of zeros has no backward error.
    const bool analysed = fresh_ && settings_.error_analysis > 0 && v.squaredNorm() > 0.0;
    data_.icntl[11 - 1] = analysed ? settings_.error_analysis : 0;
    run(3);
    if (result() < 0) throw NumericalFailure(error_sentence(data_.infog[0], data_.infog[1]));
    if (analysed) {
        fresh_ = false;
        double values[] = {data_.rinfog[6], data_.rinfog[7], data_.rinfog[8], data_.rinfog[9], data_.rinfog[10]};
        communicator_.broadcast(values, 5);
        error_analysis_ = {true, values[0], values[1], 0.0, 0.0, 0.0};
        if (settings_.error_analysis == 1) {
            error_analysis_.forward = values[2];
            error_analysis_.condition_1 = values[3];
            error_analysis_.condition_2 = values[4];
        }
    }
    communicator_.broadcast(right_hand_side_.data(), v.size());
    v = Eigen::Map<const Vector>(right_hand_side_.data(), v.size());
}

}  // namespace delassus::mumps
