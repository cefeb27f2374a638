// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/halo.hpp"

#include <algorithm>

#include "partitioned/bytes.hpp"

namespace delassus {

Halo::Halo(const Communicator& communicator, const std::vector<std::int64_t>& start, std::vector<std::int64_t> wanted)
    : start_(start), ghost_(std::move(wanted)) {
    const auto rank = static_cast<std::size_t>(communicator.rank()), processes = start.size() - 1;
    first_ = start[rank];
    own_ = start[rank + 1] - first_;
    std::erase_if(ghost_, [&](std::int64_t number) { return is_own(number); });
    std::sort(ghost_.begin(), ghost_.end());
    ghost_.erase(std::unique(ghost_.begin(), ghost_.end()), ghost_.end());
    ghost_.shrink_to_fit();
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p <= processes; ++p)
        ghost_start_.push_back(
            static_cast<std::size_t>(std::lower_bound(ghost_.begin(), ghost_.end(), start[p]) - ghost_.begin()));
    for (std::size_t p = 0; p < processes; ++p)
        put(to[p],
            std::span<const std::int64_t>(ghost_).subspan(ghost_start_[p], ghost_start_[p + 1] - ghost_start_[p]));
    const auto from = communicator.exchange(to);
    for (const Bytes& bytes : from) {
        auto& places = needed_by_.emplace_back(ByteReader(bytes).next<std::int64_t>());
        for (auto& place : places) place -= first_;
    }
}

std::size_t Halo::owner(std::int64_t number) const {
    return static_cast<std::size_t>(std::upper_bound(start_.begin(), start_.end(), number) - start_.begin()) - 1;
}

std::size_t Halo::place_of_ghost(std::int64_t number) const {
    return static_cast<std::size_t>(own_) +
           static_cast<std::size_t>(std::lower_bound(ghost_.begin(), ghost_.end(), number) - ghost_.begin());
}

void Halo::fetch(const Communicator& communicator, std::vector<double>& local) const {
    local.resize(size());
    std::vector<Bytes> to(needed_by_.size());
    std::vector<double> values;
    for (std::size_t p = 0; p < to.size(); ++p) {
        values.clear();
        for (const auto place : needed_by_[p]) values.push_back(local[static_cast<std::size_t>(place)]);
        put(to[p], values);
    }
    const auto from = communicator.exchange(to);
    for (std::size_t p = 0; p < from.size(); ++p) {
        const auto got = ByteReader(from[p]).next<double>();
        std::copy(got.begin(), got.end(), local.begin() + own_ + static_cast<std::ptrdiff_t>(ghost_start_[p]));
    }
}

void Halo::add(const Communicator& communicator, std::vector<double>& local) const {
    std::vector<Bytes> to(needed_by_.size());
    for (std::size_t p = 0; p < to.size(); ++p)
        put(to[p], std::span<const double>(local).subspan(static_cast<std::size_t>(own_) + ghost_start_[p],
                                                          ghost_start_[p + 1] - ghost_start_[p]));
    const auto from = communicator.exchange(to);
    for (std::size_t p = 0; p < from.size(); ++p) {
        const auto got = ByteReader(from[p]).next<double>();
        for (std::size_t k = 0; k < got.size(); ++k) local[static_cast<std::size_t>(needed_by_[p][k])] += got[k];
    }
}

// Sorted now and then, so that columns that many rows share are kept a few times only.
std::vector<std::int64_t> foreign_numbers(const Communicator& communicator, const std::vector<std::int64_t>& start,
                                          std::initializer_list<const LocalMatrix*> matrices) {
    const auto rank = static_cast<std::size_t>(communicator.rank());
    std::vector<std::int64_t> numbers;
    std::size_t sorted = 0;
    const auto sort_out = [&] {
        std::sort(numbers.begin(), numbers.end());
        numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
        sorted = numbers.size();
    };
    for (const LocalMatrix* matrix : matrices)
        for (const auto column : matrix->column) {
            if (column >= start[rank] && column < start[rank + 1]) continue;
            numbers.push_back(column);
            if (numbers.size() >= 2 * sorted + 4096) sort_out();
        }
    sort_out();
    return numbers;
}

}  // namespace delassus
