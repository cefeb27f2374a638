// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/route.hpp"

#include <numeric>

#include "partitioned/bytes.hpp"

namespace delassus {

namespace {

/// Entry q goes to process q; entry p of the result came from it.
std::vector<std::int64_t> exchange_one(const Communicator& run, const std::vector<std::int64_t>& to) {
    std::vector<Bytes> messages(to.size());
    for (std::size_t q = 0; q < to.size(); ++q) put(messages[q], std::span(&to[q], 1));
    std::vector<std::int64_t> from;
    for (const Bytes& bytes : run.exchange(messages)) ByteReader(bytes).append(from);
    return from;
}

}  // namespace

Route::Route(const Communicator& run, std::span<const std::int32_t> target) : run_(run) {
    std::vector<std::int64_t> counts(processes(), 0);
    together(run_, [&] {
        for (const auto q : target) ++counts[static_cast<std::size_t>(q)];
        to_.assign(processes() + 1, 0);
        std::partial_sum(counts.begin(), counts.end(), to_.begin() + 1);
        order_.resize(target.size());
        std::vector<std::int64_t> next(to_.begin(), to_.end() - 1);
        for (std::size_t k = 0; k < target.size(); ++k)
            order_[static_cast<std::size_t>(next[static_cast<std::size_t>(target[k])]++)] =
                static_cast<std::int64_t>(k);
    });
    const auto coming = exchange_one(run_, counts);
    from_.assign(processes() + 1, 0);
    std::partial_sum(coming.begin(), coming.end(), from_.begin() + 1);
    start_.assign(1, 0);
    for (const auto count : run_.all(from_.back())) start_.push_back(start_.back() + count);
    std::vector<std::int64_t> first(from_.begin(), from_.end() - 1);
    for (auto& number : first) number += start_[rank()];
    first_new_ = exchange_one(run_, first);
}

std::vector<std::int64_t> Route::numbers() const {
    std::vector<std::int64_t> numbers(order_.size());
    for (std::size_t q = 0; q < processes(); ++q)
        for (auto k = to_[q]; k < to_[q + 1]; ++k)
            numbers[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])] = first_new_[q] + k - to_[q];
    return numbers;
}

}  // namespace delassus
