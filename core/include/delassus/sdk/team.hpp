// SPDX-License-Identifier: BSD-3-Clause
// Threads of the host that share a piece of work. A solver finds them by sdk::Solver::team(); nothing here starts one.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <utility>

#include "delassus/plugin.h"

namespace delassus::sdk {

/// Threads that run one task together; the calling thread is a member. A view: the threads are the host's.
class Team {
public:
    /// The calling thread alone.
    Team() = default;
    /// raw may be null: the calling thread alone. *raw must outlive the team.
    explicit Team(const delassus_team* raw) : raw_(raw && raw->size > 1 ? raw : nullptr) {}

    [[nodiscard]] int size() const { return raw_ ? raw_->size : 1; }
    /// For the border; null: the calling thread alone.
    [[nodiscard]] const delassus_team* raw() const { return raw_; }
    /// The team where the work is worth waking it, else the calling thread alone.
    [[nodiscard]] Team if_worth(bool work) const { return work ? *this : Team(); }

    /// body(index) by every member at once, index 0 by the caller; returns when all are done. body must not throw, and
    /// must not call run() of the same team.
    template <class Body>
    void run(const Body& body) const {
        if (!raw_) return body(0);
        raw_->run(
            raw_->context, [](void* data, std::int32_t member) { (*static_cast<const Body*>(data))(member); },
            const_cast<void*>(static_cast<const void*>(std::addressof(body))));
    }

    /// Called by every member inside run(): no member goes on before all have come.
    void barrier() const {
        if (raw_) raw_->barrier(raw_->context);
    }

    /// The part of 0 … count − 1 that falls to a member: [first, second).
    [[nodiscard]] std::pair<std::size_t, std::size_t> share(std::size_t count, int index) const {
        const auto members = static_cast<std::size_t>(size()), member = static_cast<std::size_t>(index);
        return {count * member / members, count * (member + 1) / members};
    }

    /// Vectors are cut into parts of this many entries, so that sums of the parts' sums have the same bits for any
    /// team.
    static constexpr std::ptrdiff_t part_entries = 1024;
    [[nodiscard]] static std::ptrdiff_t parts_of(std::ptrdiff_t entries) {
        return (entries + part_entries - 1) / part_entries;
    }
    /// body(part, first, size) for all parts of so many entries, by all members. body must not throw.
    template <class Body>
    void for_parts(std::ptrdiff_t entries, const Body& body) const {
        run([&](int member) {
            const auto [begin, end] = share(static_cast<std::size_t>(parts_of(entries)), member);
            for (auto part = static_cast<std::ptrdiff_t>(begin); part < static_cast<std::ptrdiff_t>(end); ++part) {
                const std::ptrdiff_t first = part * part_entries;
                body(part, first, std::min(part_entries, entries - first));
            }
        });
    }

    /// body(k) for 0 ≤ k < count, one after another by the members as they are free. body may throw: the exception of
    /// the least k is thrown again when all are done, and those after it may be left out.
    template <class Body>
    void for_each(std::size_t count, const Body& body) const {
        for_each_by_member(count, [&](std::size_t k, int) { body(k); });
    }
    /// The same with body(k, index) for the member that does it.
    template <class Body>
    void for_each_by_member(std::size_t count, const Body& body) const {
        if (!raw_ || count < 2) {
            for (std::size_t k = 0; k < count; ++k) body(k, 0);
            return;
        }
        std::atomic<std::size_t> next = 0, failed = count;
        std::exception_ptr failure;
        std::atomic_flag lock;
        run([&](int member) {
            for (std::size_t k; (k = next.fetch_add(1, std::memory_order_relaxed)) < failed.load();) {
                try {
                    body(k, member);
                } catch (...) {
                    while (lock.test_and_set()) lock.wait(true);
                    if (k < failed.load()) {
                        failed.store(k);
                        failure = std::current_exception();
                    }
                    lock.clear();
                    lock.notify_one();
                }
            }
        });
        if (failure) std::rethrow_exception(failure);
    }

private:
    const delassus_team* raw_ = nullptr;
};

}  // namespace delassus::sdk
