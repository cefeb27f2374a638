// SPDX-License-Identifier: BSD-3-Clause
// Things that change their process: bodies, columns, rows, cones, and what belongs to them (internal).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "delassus/communicator.hpp"

namespace delassus {

/// Who gets which of the own things. On its new process a thing stands after those of processes of smaller rank, and
/// the things of one process keep their order. All operations are collective.
class Route {
public:
    /// target: the process that each own thing goes to.
    Route(const Communicator& run, std::span<const std::int32_t> target);

    /// Where each process's things begin among all, after the move; processes + 1.
    [[nodiscard]] const std::vector<std::int64_t>& start() const { return start_; }
    /// The numbers of the own things after the move, among those of all processes. Not collective.
    [[nodiscard]] std::vector<std::int64_t> numbers() const;

    /// values ← those of the things that come here; on entry one for each own thing.
    template <class Value>
    void move(std::vector<Value>& values) const {
        move_ragged(values, [](std::int64_t thing) { return thing; });
    }
    /// The same where own thing k has the values start[k] … start[k + 1] − 1; on return start is that of the things
    /// that come here. further: another array with as many values for each thing, or null.
    template <class First, class Second>
    void move(std::vector<std::int64_t>& start, std::vector<First>& values, std::vector<Second>* further) const {
        const std::vector<std::int64_t> before = std::move(start);
        together(run_, [&] {
            start.resize(before.size() - 1);
            for (std::size_t k = 0; k < start.size(); ++k) start[k] = before[k + 1] - before[k];
        });
        move(start);
        together(run_, [&] {
            start.insert(start.begin(), 0);
            for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
        });
        move_ragged(values, before, start);
        if (further) move_ragged(*further, before, start);
    }

private:
    /// About so many bytes leave a process at once; the second number counts where there are many processes, of which
    /// most get nothing.
    static constexpr std::size_t bytes_at_once = 1 << 20, bytes_for_one = 1 << 16;

    [[nodiscard]] std::size_t processes() const { return static_cast<std::size_t>(run_.size()); }
    [[nodiscard]] std::size_t rank() const { return static_cast<std::size_t>(run_.rank()); }

    template <class Value, class Start>
    void move_ragged(std::vector<Value>& values, const Start& start) const {
        move_between(values, start, start);
    }
    template <class Value>
    void move_ragged(std::vector<Value>& values, const std::vector<std::int64_t>& before,
                     const std::vector<std::int64_t>& after) const {
        move_between(
            values, [&](std::int64_t thing) { return before[static_cast<std::size_t>(thing)]; },
            [&](std::int64_t thing) { return after[static_cast<std::size_t>(thing)]; });
    }

    // What comes from one process is one run of the result, so that messages are values alone, and in any pieces. The
    // old array stands beside the new one, and one piece beside both.
    template <class Value, class Before, class After>
    requires std::is_trivially_copyable_v<Value>
    void move_between(std::vector<Value>& values, const Before& before, const After& after) const {
        std::vector<Value> result;
        std::vector<std::size_t> place(processes());
        together(run_, [&] {
            result.resize(static_cast<std::size_t>(after(from_.back())));
            for (std::size_t p = 0; p < place.size(); ++p) place[p] = static_cast<std::size_t>(after(from_[p]));
        });
        const std::size_t quota = std::max(bytes_at_once / processes(), bytes_for_one) / sizeof(Value);
        std::vector<std::int64_t> next(to_.begin(), to_.end() - 1);
        std::vector<std::vector<std::byte>> pieces(processes());
        std::int64_t left = 1;
        while (left != 0) {
            together(run_, [&] {
                for (std::size_t q = 0; q < pieces.size(); ++q) {
                    pieces[q].clear();
                    for (std::size_t count = 0; next[q] < to_[q + 1] && (count < quota || q == rank()); ++next[q]) {
                        const auto thing = order_[static_cast<std::size_t>(next[q])];
                        const std::span some(values.data() + before(thing),
                                             static_cast<std::size_t>(before(thing + 1) - before(thing)));
                        count += some.size() + (some.empty() ? 1 : 0);
                        if (q == rank()) {
                            std::copy(some.begin(), some.end(), result.begin() + static_cast<std::ptrdiff_t>(place[q]));
                            place[q] += some.size();
                            continue;
                        }
                        const auto bytes = std::as_bytes(some);
                        pieces[q].insert(pieces[q].end(), bytes.begin(), bytes.end());
                    }
                }
            });
            const auto arrived = run_.exchange(pieces);
            for (std::size_t p = 0; p < arrived.size(); ++p) {
                if (!arrived[p].empty()) std::memcpy(result.data() + place[p], arrived[p].data(), arrived[p].size());
                place[p] += arrived[p].size() / sizeof(Value);
            }
            left = 0;
            for (std::size_t q = 0; q < next.size(); ++q) left += to_[q + 1] - next[q];
            run_.max(std::span(&left, 1));
        }
        values = std::move(result);
    }

    const Communicator& run_;
    std::vector<std::int64_t> order_;      // own things by the process that they go to, then in their order
    std::vector<std::int64_t> to_, from_;  // of each process's among order_, and among those that come; processes + 1
    std::vector<std::int64_t> start_;
    std::vector<std::int64_t> first_new_;  // of own things by the process that they go to: the new number of the first
};

}  // namespace delassus
