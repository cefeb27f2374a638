// SPDX-License-Identifier: BSD-3-Clause
#include "exchange.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace delassus::petsc {

namespace {

/// width numbers as one unit of PetscSF.
class Unit {
public:
    Unit(MPI_Datatype type, int width) : type_(type), made_(width > 1) {
        if (!made_) return;
        MPI_Type_contiguous(width, type, &type_);
        MPI_Type_commit(&type_);
    }
    ~Unit() {
        if (made_) MPI_Type_free(&type_);
    }
    Unit(const Unit&) = delete;
    Unit& operator=(const Unit&) = delete;
    [[nodiscard]] MPI_Datatype get() const { return type_; }

private:
    MPI_Datatype type_;
    bool made_;
};

void sort_out(std::vector<std::int64_t>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

Exchange::Exchange(const Processes& processes, std::span<const std::int64_t> start, std::vector<std::int64_t> foreign)
    : foreign_(std::move(foreign)), meter_(processes.meter()) {
    const auto process = static_cast<std::size_t>(processes.rank());
    first_ = start[process];
    own_ = start[process + 1] - first_;
    below_ = static_cast<std::int32_t>(std::lower_bound(foreign_.begin(), foreign_.end(), first_) - foreign_.begin());
    processes.together([&] {
        if (own_ + static_cast<std::int64_t>(foreign_.size()) >= std::numeric_limits<PetscInt>::max())
            throw std::runtime_error(
                "one process has more unknowns than this PETSc can count (2^31): use more processes");
    });
    foreign_of_all_ = processes.sum(static_cast<std::int64_t>(foreign_.size()));
    if (foreign_of_all_ == 0) return;
    std::vector<PetscInt> leaves(foreign_.size());
    std::vector<PetscSFNode> roots(foreign_.size());
    for (std::size_t k = 0; k < foreign_.size(); ++k) {
        const auto owner = std::upper_bound(start.begin(), start.end(), foreign_[k]) - start.begin() - 1;
        leaves[k] = static_cast<PetscInt>(static_cast<std::int64_t>(k) < below_ ? static_cast<std::int64_t>(k)
                                                                                : static_cast<std::int64_t>(k) + own_);
        roots[k].rank = static_cast<PetscInt>(owner);
        roots[k].index = static_cast<PetscInt>(foreign_[k] - start[static_cast<std::size_t>(owner)]);
    }
    check(PetscSFCreate(processes.get(), forest_.make()));
    check(PetscSFSetGraph(forest_.get(), static_cast<PetscInt>(own_), static_cast<PetscInt>(leaves.size()),
                          leaves.data(), PETSC_COPY_VALUES, roots.data(), PETSC_COPY_VALUES));
    check(PetscSFSetUp(forest_.get()));
}

std::int32_t Exchange::local_of_foreign(std::int64_t number) const {
    const auto place = std::lower_bound(foreign_.begin(), foreign_.end(), number) - foreign_.begin();
    return static_cast<std::int32_t>(place < below_ ? place : place + own_);
}

void Exchange::bring(void* values, MPI_Datatype type, int width, std::size_t bytes) const {
    if (foreign_of_all_ == 0) return;
    const CostMeter::Together all(*meter_, DELASSUS_PHASE_EXCHANGE);
    const Unit unit(type, width);
    const void* own =
        static_cast<const char*>(values) + static_cast<std::size_t>(below_) * bytes * static_cast<std::size_t>(width);
    check(PetscSFBcastBegin(forest_.get(), unit.get(), own, values, MPI_REPLACE));
    check(PetscSFBcastEnd(forest_.get(), unit.get(), own, values, MPI_REPLACE));
}

void Exchange::collect(double* values, int width) const {
    if (foreign_of_all_ == 0) return;
    const CostMeter::Together all(*meter_, DELASSUS_PHASE_EXCHANGE);
    const Unit unit(MPI_DOUBLE, width);
    double* own = values + static_cast<std::ptrdiff_t>(below_) * width;
    check(PetscSFReduceBegin(forest_.get(), unit.get(), values, own, MPI_SUM));
    check(PetscSFReduceEnd(forest_.get(), unit.get(), values, own, MPI_SUM));
}

std::vector<std::int64_t> foreign_columns(const sdk::LocalMatrixView& matrix, std::int64_t first, std::int64_t end) {
    std::vector<std::int64_t> foreign;
    std::size_t sorted = 0;  // how many there were after the latest sort_out
    for (const std::int64_t column : matrix.column) {
        if (column >= first && column < end) continue;
        foreign.push_back(column);
        if (foreign.size() < 2 * sorted + 1000000) continue;
        sort_out(foreign);
        sorted = foreign.size();
    }
    sort_out(foreign);
    return foreign;
}

}  // namespace delassus::petsc
