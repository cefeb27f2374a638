// SPDX-License-Identifier: BSD-3-Clause
// The module delassus_mpi: the processes that a launcher has started, through MPI.
#include <algorithm>
#include <cstdlib>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/sdk/mpi.hpp"
#include "support/mpi_module.hpp"

namespace delassus {

namespace {

class MpiRun : public Communicator {
public:
    [[nodiscard]] int rank() const override { return communicator_.rank(); }
    [[nodiscard]] int size() const override { return communicator_.size(); }
    [[nodiscard]] std::int32_t handle() const override { return MPI_Comm_c2f(communicator_.get()); }

    void sum(std::span<double> values) const override { reduce(values, MPI_DOUBLE, MPI_SUM); }
    void sum(std::span<std::int64_t> values) const override { reduce(values, MPI_INT64_T, MPI_SUM); }
    void max(std::span<double> values) const override { reduce(values, MPI_DOUBLE, MPI_MAX); }
    void max(std::span<std::int64_t> values) const override { reduce(values, MPI_INT64_T, MPI_MAX); }

    [[nodiscard]] std::vector<std::int64_t> all(std::int64_t value) const override {
        std::vector<std::int64_t> values(static_cast<std::size_t>(size()));
        MPI_Allgather(&value, 1, MPI_INT64_T, values.data(), 1, MPI_INT64_T, communicator_.get());
        bytes_ += static_cast<std::int64_t>(sizeof value) * (size() - 1);
        return values;
    }

    [[nodiscard]] std::vector<std::vector<std::byte>> exchange(
        const std::vector<std::vector<std::byte>>& to) const override {
        const auto processes = static_cast<std::size_t>(size());
        std::vector<std::int64_t> sizes(processes), incoming(processes);
        for (std::size_t p = 0; p < processes; ++p) sizes[p] = static_cast<std::int64_t>(to[p].size());
        MPI_Alltoall(sizes.data(), 1, MPI_INT64_T, incoming.data(), 1, MPI_INT64_T, communicator_.get());
        std::vector<std::vector<std::byte>> from(processes);
        std::vector<MPI_Request> requests;
        for (std::size_t p = 0; p < processes; ++p) {
            if (p == static_cast<std::size_t>(rank())) {
                from[p] = to[p];
                continue;
            }
            from[p].resize(static_cast<std::size_t>(incoming[p]));
            in_portions(from[p].size(), [&](std::size_t first, int count) {
                MPI_Irecv(from[p].data() + first, count, MPI_BYTE, static_cast<int>(p), 0, communicator_.get(),
                          &requests.emplace_back());
            });
        }
        for (std::size_t p = 0; p < processes; ++p) {
            if (p == static_cast<std::size_t>(rank())) continue;
            in_portions(to[p].size(), [&](std::size_t first, int count) {
                MPI_Isend(to[p].data() + first, count, MPI_BYTE, static_cast<int>(p), 0, communicator_.get(),
                          &requests.emplace_back());
            });
            bytes_ += static_cast<std::int64_t>(sizeof(std::int64_t) + to[p].size());
        }
        MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
        return from;
    }

    [[nodiscard]] std::string broadcast(const std::string& text, int from) const override {
        auto length = static_cast<std::int64_t>(text.size());
        MPI_Bcast(&length, 1, MPI_INT64_T, from, communicator_.get());
        std::string result = rank() == from ? text : std::string(static_cast<std::size_t>(length), ' ');
        in_portions(result.size(), [&](std::size_t first, int count) {
            MPI_Bcast(result.data() + first, count, MPI_BYTE, from, communicator_.get());
        });
        if (rank() == from) bytes_ += length * (size() - 1);
        return result;
    }

    [[nodiscard]] std::int64_t bytes_sent() const override { return bytes_; }

    [[noreturn]] void abort(int exit_code) const override {
        MPI_Abort(communicator_.get(), exit_code);
        std::_Exit(exit_code);
    }

private:
    /// Messages of MPI count with 32 bits.
    template <class Send>
    static void in_portions(std::size_t bytes, Send&& send) {
        constexpr std::size_t portion = std::size_t{1} << 30;
        for (std::size_t first = 0; first < bytes; first += portion)
            send(first, static_cast<int>(std::min(portion, bytes - first)));
    }

    template <class Value>
    void reduce(std::span<Value> values, MPI_Datatype type, MPI_Op operation) const {
        constexpr std::size_t portion = std::size_t{1} << 27;
        for (std::size_t first = 0; first < values.size(); first += portion)
            MPI_Allreduce(MPI_IN_PLACE, values.data() + first,
                          static_cast<int>(std::min(portion, values.size() - first)), type, operation,
                          communicator_.get());
        bytes_ += static_cast<std::int64_t>(values.size_bytes());
    }

    sdk::MpiCommunicator communicator_;
    mutable std::int64_t bytes_ = 0;
};

}  // namespace
}  // namespace delassus

extern "C" DELASSUS_API void delassus_mpi_make(std::shared_ptr<const delassus::Communicator>& communicator) {
    communicator = std::make_shared<delassus::MpiRun>();
}
