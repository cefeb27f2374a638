// SPDX-License-Identifier: BSD-3-Clause
// The processes of a partitioned problem: what they add up, agree on, and fail in together.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "cost_meter.hpp"
#include "delassus/sdk/partitioned_solver.hpp"
#include "library.hpp"

namespace delassus::petsc {

/// All operations but get() and size() are collective, and give the same bits on all processes.
class Processes {
public:
    /// One process: MPI_COMM_SELF.
    Processes() = default;
    /// Those of the problem. Starts nothing: ensure_petsc() comes first.
    explicit Processes(const delassus_local_problem& problem)
        : communicator_(problem.processes > 1 ? MPI_Comm_f2c(problem.communicator) : MPI_COMM_SELF),
          size_(problem.processes),
          rank_(problem.process),
          meter_(std::make_shared<CostMeter>(communicator_, size_)) {}

    [[nodiscard]] MPI_Comm get() const { return communicator_; }
    [[nodiscard]] int size() const { return size_; }
    [[nodiscard]] int rank() const { return rank_; }
    /// What a solve costs this process; copies of this object share it, and so do the objects made with them.
    [[nodiscard]] const std::shared_ptr<CostMeter>& meter() const { return meter_; }

    void sum(std::span<double> values) const { reduce(values, MPI_SUM); }
    [[nodiscard]] double sum(double value) const {
        sum(std::span(&value, 1));
        return value;
    }
    [[nodiscard]] double max(double value) const {
        reduce(std::span(&value, 1), MPI_MAX);
        return value;
    }
    [[nodiscard]] double min(double value) const {
        reduce(std::span(&value, 1), MPI_MIN);
        return value;
    }
    [[nodiscard]] std::int64_t sum(std::int64_t value) const { return reduced(value, MPI_SUM); }
    [[nodiscard]] std::int64_t max(std::int64_t value) const { return reduced(value, MPI_MAX); }
    [[nodiscard]] bool any(bool value) const { return max(std::int64_t{value ? 1 : 0}) != 0; }

    /// Runs body, which must not be collective. If it throws on any process, all throw the sentence of the first one,
    /// as sdk::NumericalFailure if it was one, else as std::runtime_error.
    void together(const std::function<void()>& body) const;

private:
    void reduce(std::span<double> values, MPI_Op operation) const {
        reduce(values.data(), values.size(), sizeof(double), MPI_DOUBLE, operation);
    }
    [[nodiscard]] std::int64_t reduced(std::int64_t value, MPI_Op operation) const {
        reduce(&value, 1, sizeof value, MPI_INT64_T, operation);
        return value;
    }
    void reduce(void* values, std::size_t count, std::size_t bytes, MPI_Datatype type, MPI_Op operation) const {
        if (size_ == 1) return;
        const CostMeter::Together all(*meter_, DELASSUS_PHASE_REDUCTIONS);
        MPI_Allreduce(MPI_IN_PLACE, values, static_cast<int>(count), type, operation, communicator_);
        meter_->add_bytes(count * bytes);
    }

    MPI_Comm communicator_ = MPI_COMM_SELF;
    int size_ = 1, rank_ = 0;
    std::shared_ptr<CostMeter> meter_ = std::make_shared<CostMeter>(MPI_COMM_SELF, 1);
};

}  // namespace delassus::petsc
