// SPDX-License-Identifier: BSD-3-Clause
// The table of cones: all that host and solvers know of the kinds comes from here. A new kind is one file in cones/ and
// one row of cone_table, with the next number in delassus_cone_kind (delassus/plugin.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>

#include "delassus/plugin.h"
#ifdef DELASSUS_TEST_CONE
#include "delassus/sdk/cones/ball.hpp"
#endif
#include "delassus/sdk/cones/box.hpp"
#include "delassus/sdk/cones/free.hpp"
#include "delassus/sdk/cones/friction.hpp"
#include "delassus/sdk/cones/nonnegative.hpp"

namespace delassus::sdk {

/// One kind of cone: what there is to know of it, and what it can do. All vectors hold the block's rows.
struct ConeOperations : ConeDescription {
    void (*project)(const delassus_cone&, double* lambda);  ///< Euclidean projection onto Υ, in place
    void (*project_dual)(const delassus_cone&, double* u);  ///< Euclidean projection onto Υ*, in place
    double (*gap)(const delassus_cone&, const double* lambda, const double* u);  ///< 0 at a solution
    /// What λ of one row may be, whatever the others are; null where the rows do not separate.
    Interval (*interval)(const delassus_cone&, std::int32_t row);
    /// What the exact Coulomb law adds to the first row of u; null where no friction law applies.
    double (*de_saxce)(const delassus_cone&, const double* u);
    // Whether there are the two above: under sanitizers g++ 12 takes no comparison of their addresses for a constant.
    bool has_interval, has_de_saxce;

    /// The DELASSUS_CAN_* bit that a solver needs for it.
    [[nodiscard]] constexpr std::uint64_t capability() const { return DELASSUS_CAN_CONE(kind); }
    /// Whether a change of one row leaves the others' sets alone, so that rows may be scaled and stepped one by one.
    [[nodiscard]] constexpr bool is_separable() const { return has_interval; }
    /// Whether a friction law changes what its blocks ask for.
    [[nodiscard]] constexpr bool has_law() const { return has_de_saxce; }
    /// Its parameters, as far as there are any.
    [[nodiscard]] constexpr std::span<const ConeParameter> named_parameters() const {
        return {parameters, static_cast<std::size_t>(parameter_count)};
    }
};

template <class Cone>
constexpr ConeOperations cone_operations() {
    ConeOperations row{
        Cone::description, &Cone::project, &Cone::project_dual, &Cone::gap, nullptr, nullptr, false, false};
    if constexpr (requires { &Cone::interval; }) {
        row.interval = &Cone::interval;
        row.has_interval = true;
    }
    if constexpr (requires { &Cone::de_saxce; }) {
        row.de_saxce = &Cone::de_saxce;
        row.has_de_saxce = true;
    }
    return row;
}

/// Row k serves the kind with number k (delassus_cone_kind).
inline constexpr std::array cone_table = {
    cone_operations<FreeCone>(), cone_operations<NonnegativeCone>(),
    cone_operations<BoxCone>(),  cone_operations<FrictionCone>(),
#ifdef DELASSUS_TEST_CONE
    cone_operations<BallCone>(),
#endif
};

static_assert([] {
    for (std::size_t k = 0; k < cone_table.size(); ++k) {
        const ConeOperations& row = cone_table[k];
        if (row.kind != static_cast<std::int32_t>(k) || k > 15) return false;
        if (!row.is_separable() && row.most_rows > largest_block_rows) return false;
    }
    return true;
}());

inline const ConeOperations& operations_of(const delassus_cone& cone) {
    return cone_table[static_cast<std::size_t>(cone.kind)];
}

/// The DELASSUS_CAN_* bits of the kinds for which the predicate holds.
template <class Predicate>
constexpr std::uint64_t cones_that(Predicate&& holds) {
    std::uint64_t bits = 0;
    for (const ConeOperations& row : cone_table)
        if (holds(row)) bits |= row.capability();
    return bits;
}
/// All kinds: for solvers that know of cones only what the table says, and for masks.
inline constexpr std::uint64_t all_cones = cones_that([](const ConeOperations&) { return true; });
/// The kinds that make a problem more than a linear system.
inline constexpr std::uint64_t cones_not_linear = cones_that([](const ConeOperations& row) { return !row.is_linear; });
/// The kinds to which a friction law applies.
inline constexpr std::uint64_t cones_with_law = cones_that([](const ConeOperations& row) { return row.has_law(); });

/// Projects the block's rows of λ onto Υ; inlined for the two kinds that fill hot loops.
inline void project(const delassus_cone& cone, double* lambda) {
    if (cone.kind == DELASSUS_CONE_FRICTION) {
        FrictionCone::project(cone, lambda);
    } else if (cone.kind == DELASSUS_CONE_NONNEGATIVE) {
        NonnegativeCone::project(cone, lambda);
    } else {
        operations_of(cone).project(cone, lambda);
    }
}

/// What the exact Coulomb law adds to the first row of u; 0 where no friction law applies.
inline double de_saxce(const delassus_cone& cone, const double* u) {
    if (cone.kind == DELASSUS_CONE_FRICTION) return FrictionCone::de_saxce(cone, u);
    const auto term = operations_of(cone).de_saxce;
    return term ? term(cone, u) : 0.0;
}

/// Whether a change of one row leaves the others' sets alone, so that rows may be scaled and stepped one by one.
inline bool is_separable(const delassus_cone& cone) {
    return operations_of(cone).is_separable();
}

/// The cones of a problem, in the order of their rows. They need not lie side by side: a host of a later minor version
/// has longer ones.
class ConeRange {
public:
    class Iterator {
    public:
        using iterator_category = std::forward_iterator_tag;
        using value_type = delassus_cone;
        using difference_type = std::ptrdiff_t;
        using pointer = const delassus_cone*;
        using reference = const delassus_cone&;

        Iterator() = default;
        Iterator(const char* place, std::ptrdiff_t stride) : place_(place), stride_(stride) {}
        reference operator*() const { return *reinterpret_cast<const delassus_cone*>(place_); }
        pointer operator->() const { return reinterpret_cast<const delassus_cone*>(place_); }
        Iterator& operator++() {
            place_ += stride_;
            return *this;
        }
        Iterator operator++(int) {
            const Iterator before = *this;
            ++*this;
            return before;
        }
        bool operator==(const Iterator& other) const { return place_ == other.place_; }

    private:
        const char* place_ = nullptr;
        std::ptrdiff_t stride_ = 0;
    };

    ConeRange() = default;
    explicit ConeRange(const delassus_problem& problem)
        : first_(reinterpret_cast<const char*>(problem.cones)),
          size_(static_cast<std::size_t>(problem.cone_count)),
          stride_(problem.cone_stride) {}
    explicit ConeRange(const delassus_local_problem& problem)
        : first_(reinterpret_cast<const char*>(problem.cones)),
          size_(static_cast<std::size_t>(problem.cone_count)),
          stride_(problem.cone_stride) {}
    /// Cones side by side, as an array of one's own.
    ConeRange(std::span<const delassus_cone> cones)
        : first_(reinterpret_cast<const char*>(cones.data())), size_(cones.size()), stride_(sizeof(delassus_cone)) {}

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    /// Cones first … last − 1.
    [[nodiscard]] ConeRange part(std::size_t first, std::size_t last) const {
        ConeRange result = *this;
        result.first_ += static_cast<std::ptrdiff_t>(first) * stride_;
        result.size_ = last - first;
        return result;
    }
    [[nodiscard]] const delassus_cone& operator[](std::size_t k) const {
        return *reinterpret_cast<const delassus_cone*>(first_ + static_cast<std::ptrdiff_t>(k) * stride_);
    }
    [[nodiscard]] Iterator begin() const { return {first_, stride_}; }
    [[nodiscard]] Iterator end() const { return {first_ + static_cast<std::ptrdiff_t>(size_) * stride_, stride_}; }

private:
    const char* first_ = nullptr;
    std::size_t size_ = 0;
    std::ptrdiff_t stride_ = sizeof(delassus_cone);
};

}  // namespace delassus::sdk
