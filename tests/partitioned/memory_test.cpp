// SPDX-License-Identifier: BSD-3-Clause
// How much stands beside a part while it is moved, prepared and judged: every operator new of the process is counted.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>

#include "delassus/generate_partitioned.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/repartition.hpp"

namespace {
std::atomic<std::int64_t> bytes_alive = 0, bytes_at_most = 0;

void count(std::int64_t bytes) {
    const std::int64_t alive = bytes_alive.fetch_add(bytes, std::memory_order_relaxed) + bytes;
    std::int64_t most = bytes_at_most.load(std::memory_order_relaxed);
    while (alive > most && !bytes_at_most.compare_exchange_weak(most, alive, std::memory_order_relaxed)) {
    }
}
}  // namespace

void* operator new(std::size_t size) {
    void* pointer = std::malloc(size == 0 ? 1 : size);
    if (!pointer) throw std::bad_alloc();
    count(static_cast<std::int64_t>(malloc_usable_size(pointer)));
    return pointer;
}

void operator delete(void* pointer) noexcept {
    if (pointer) count(-static_cast<std::int64_t>(malloc_usable_size(pointer)));
    std::free(pointer);
}

void operator delete(void* pointer, std::size_t) noexcept {
    operator delete(pointer);
}

namespace delassus::partitioned_memory_test {
namespace {

class PartMemory : public testing::Test {
protected:
    std::shared_ptr<const Communicator> run = communicator_of_run();

    /// 320 bytes a contact in D, about 480 in all.
    [[nodiscard]] PartitionedProblem pile() const {
        PileParameters parameters;
        parameters.contacts = 60000;
        return generate_partitioned(*run, parameters);
    }
    static double bytes_of(const PartitionedProblem& part) {
        const auto of = [](const LocalMatrix& matrix) {
            return 8.0 * static_cast<double>(matrix.row_start.size() + 2 * matrix.column.size());
        };
        return of(part.H) + of(part.D) + of(part.E) + 8.0 * static_cast<double>(part.a.size() + part.b.size()) +
               static_cast<double>(part.cones.size() * sizeof(Cone));
    }
    /// What action takes at most beside what is alive before it.
    template <class Action>
    static double taken_by(Action&& action) {
        const std::int64_t before = bytes_alive;
        bytes_at_most = before;
        action();
        return static_cast<double>(bytes_at_most - before);
    }
    /// Pieces on their way, here and there, and what does not grow with the problem.
    static constexpr double small = 4e6;
};

TEST_F(PartMemory, IsCounted) {
    EXPECT_NEAR(taken_by([] { std::vector<double>(100000, 1.0).swap(*std::make_unique<std::vector<double>>()); }), 8e5,
                1e4);
    // The library's own, too.
    PartitionedProblem part;
    EXPECT_GT(taken_by([&] { part = pile(); }), bytes_of(part));
}

// Every array goes alone; the largest is a third of the part. The numbers of before take 8 bytes a row and a column.
TEST_F(PartMemory, MovingTakesLessThanAnotherPart) {
    PartitionedProblem part = pile();
    const double bytes = bytes_of(part);
    std::vector<std::int32_t> target(bodies_of(*run, part).size());
    // Runs of a hundred bodies to one process after another: nearly all move.
    for (std::size_t k = 0; k < target.size(); ++k) target[k] = static_cast<std::int32_t>(k / 100 + 1) % run->size();
    const double taken = taken_by([&] { part = moved(*run, std::move(part), target); });
    EXPECT_LT(taken, 0.7 * std::max(bytes, bytes_of(part)) + small);
    RecordProperty("taken", std::to_string(taken / bytes));
}

// The border needs cones of its own; H has no copy worth mentioning, D none at all.
TEST_F(PartMemory, PreparingAndJudgingCopyNoMatrix) {
    PartitionedProblem part = pile();
    const double bytes = bytes_of(part);
    std::optional<PreparedPart> prepared;
    const double preparing = taken_by([&] { prepared.emplace(run, std::move(part)); });
    EXPECT_LT(preparing, 0.5 * bytes + small);
    const std::vector<double> x(static_cast<std::size_t>(prepared->raw().n), 0.25),
        lambda(static_cast<std::size_t>(prepared->raw().m), 0.5);
    const double judging = taken_by([&] { static_cast<void>(prepared->measure(x, lambda)); });
    EXPECT_LT(judging, 0.4 * bytes + small);
    RecordProperty("preparing", std::to_string(preparing / bytes));
    RecordProperty("judging", std::to_string(judging / bytes));
}

#ifdef DELASSUS_HAS_SCOTCH
TEST_F(PartMemory, PartitioningTakesLessThanAnotherPart) {
    PartitionedProblem part = pile();
    const double bytes = bytes_of(part);
    const double taken = taken_by([&] { part = repartition(*run, std::move(part), Partitioning::Scotch); });
    EXPECT_LT(taken, 0.7 * std::max(bytes, bytes_of(part)) + small);
    RecordProperty("taken", std::to_string(taken / bytes));
}
#endif

}  // namespace
}  // namespace delassus::partitioned_memory_test
