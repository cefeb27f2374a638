// SPDX-License-Identifier: BSD-3-Clause
#include "cost_meter.hpp"

#include <algorithm>

namespace delassus::petsc {

namespace {

constexpr std::int64_t stride_of_few = 32;

/// What PETSc itself, not the libraries behind it, has sent to other processes so far.
double bytes_of_messages() {
#if defined(PETSC_USE_LOG)
    return petsc_send_len + petsc_isend_len;
#else
    return 0.0;
#endif
}

}  // namespace

void CostMeter::begin(std::int64_t rows, std::int64_t few) {
    clock_.reset(rows < few * processes_ ? stride_of_few : 1);
    seconds_.clear();
    calls_.clear();
    reduced_ = 0;
    bytes_before_ = bytes_of_messages();
}

sdk::Cost CostMeter::end() {
    clock_.end_iterations();
    compare();
    sdk::Cost cost;
    cost.seconds = clock_.seconds();
    for (double& seconds : cost.seconds) seconds = std::max(seconds, 0.0);  // −0 and rounding
    cost.bytes_sent = reduced_ + static_cast<std::int64_t>(bytes_of_messages() - bytes_before_);
    return cost;
}

void CostMeter::note(delassus_phase phase, float seconds) {
    if (processes_ == 1) return;
    seconds_.push_back(seconds);
    calls_.push_back({phase, clock_.is_in_iteration()});
    if (seconds_.size() == batch) compare();
}

void CostMeter::compare() {
    if (processes_ == 1) return;
    least_.resize(seconds_.size());
    MPI_Allreduce(seconds_.data(), least_.data(), static_cast<int>(seconds_.size()), MPI_FLOAT, MPI_MIN, communicator_);
    for (std::size_t k = 0; k < calls_.size(); ++k)
        clock_.move(calls_[k].phase, DELASSUS_PHASE_WAITING, static_cast<double>(seconds_[k] - least_[k]),
                    calls_[k].in_iteration);
    seconds_.clear();
    calls_.clear();
}

}  // namespace delassus::petsc
