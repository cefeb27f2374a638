// SPDX-License-Identifier: BSD-3-Clause
// Entries of a distributed vector that other processes own, by PetscSF.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <petscsf.h>

#include "processes.hpp"

namespace delassus::petsc {

using StarForestHandle = Handle<PetscSF, &PetscSFDestroy>;

/// A process's own numbers first … end − 1 of all, and the foreign ones that it uses. In its local numbering all of
/// them stand in the order of their numbers: the foreign ones below, its own, the foreign ones above. Rows of a matrix
/// with ascending columns therefore keep their order. A local vector has size() entries.
class Exchange {
public:
    Exchange() = default;
    /// start: processes + 1. foreign: ascending, without repetition. Collective. Throws if a process has more entries
    /// than PETSc can count.
    Exchange(const Processes& processes, std::span<const std::int64_t> start, std::vector<std::int64_t> foreign);

    [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(foreign_.size()) + own_; }
    [[nodiscard]] Eigen::Index first_own() const { return below_; }  ///< local number of the first own entry
    [[nodiscard]] Eigen::Index own() const { return own_; }
    [[nodiscard]] std::span<const std::int64_t> foreign() const { return foreign_; }

    /// The local number of an own or foreign one.
    [[nodiscard]] std::int32_t local(std::int64_t number) const {
        const auto offset = static_cast<std::uint64_t>(number - first_);
        return offset < static_cast<std::uint64_t>(own_) ? static_cast<std::int32_t>(offset) + below_
                                                         : local_of_foreign(number);
    }
    [[nodiscard]] std::int64_t number(Eigen::Index local) const {
        if (local < below_) return foreign_[static_cast<std::size_t>(local)];
        if (local < below_ + own_) return first_ + local - below_;
        return foreign_[static_cast<std::size_t>(local - own_)];
    }

    /// Foreign entries of a local vector ← their owners' values; width numbers an entry, one entry after another.
    /// Collective.
    void bring(double* values, int width = 1) const { bring(values, MPI_DOUBLE, width, sizeof(double)); }
    void bring(std::int64_t* values, int width = 1) const { bring(values, MPI_INT64_T, width, sizeof(std::int64_t)); }
    /// Own entries += what others have at them. Foreign entries stay. Collective.
    void collect(double* values, int width = 1) const;

    /// Bytes that all processes together send in one bring(), or one collect(), of width 1.
    [[nodiscard]] std::int64_t bytes() const { return 8 * foreign_of_all_; }

private:
    void bring(void* values, MPI_Datatype type, int width, std::size_t bytes) const;
    [[nodiscard]] std::int32_t local_of_foreign(std::int64_t number) const;

    std::int64_t first_ = 0, own_ = 0, foreign_of_all_ = 0;
    std::int32_t below_ = 0;
    std::vector<std::int64_t> foreign_;
    StarForestHandle forest_;
    std::shared_ptr<CostMeter> meter_;
};

/// The columns of a matrix's own rows that lie outside first … end − 1; ascending, without repetition.
[[nodiscard]] std::vector<std::int64_t> foreign_columns(const sdk::LocalMatrixView& matrix, std::int64_t first,
                                                        std::int64_t end);

}  // namespace delassus::petsc
