// SPDX-License-Identifier: BSD-3-Clause
#include "processes.hpp"

#include <string>

namespace delassus::petsc {

void Processes::together(const std::function<void()>& body) const {
    if (size_ == 1) return body();
    std::string sentence;
    std::int64_t failed = 0, numerical = 0;
    try {
        body();
    } catch (const sdk::NumericalFailure& failure) {
        failed = numerical = 1;
        sentence = failure.what();
    } catch (const std::bad_alloc&) {
        failed = 1;
        sentence = "out of memory on process " + std::to_string(rank_);
    } catch (const std::exception& failure) {
        failed = 1;
        sentence = failure.what();
    }
    const std::int64_t speaks = size_ - max(failed != 0 ? std::int64_t{size_ - rank_} : 0);
    if (speaks == size_) return;
    std::int64_t about[2] = {numerical, static_cast<std::int64_t>(sentence.size())};
    MPI_Bcast(about, 2, MPI_INT64_T, static_cast<int>(speaks), communicator_);
    sentence.resize(static_cast<std::size_t>(about[1]));
    MPI_Bcast(sentence.data(), static_cast<int>(about[1]), MPI_CHAR, static_cast<int>(speaks), communicator_);
    if (about[0] != 0) throw sdk::NumericalFailure(sentence);
    throw std::runtime_error(sentence);
}

}  // namespace delassus::petsc
