// SPDX-License-Identifier: BSD-3-Clause
// The own rows of the convex problem behind the associated law, scaled as in sdk/scaled_problem.hpp:
//
//     minimise ½ λ̂ᵀ N̂ λ̂ + r̂ᵀ λ̂ over Υ̂,   λ = P λ̂,   N̂ = Ŵ Ŵᵀ + Ê,   Ŵ = P D L⁻ᵀ,   H = L Lᵀ,   Ê = P E P.
//
// With H diagonal or of blocks, a row of Ŵ reaches the bodies of that row alone. A product with N̂ is Ŵᵀ λ̂ by the own
// rows, a sum over processes at bodies that several touch, and Ŵ times that. What crosses is six numbers for each body
// at a border, to its owner and back.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "delassus/sdk/block_rows.hpp"
#include "petsc/bodies.hpp"

namespace delassus::petsc {

/// Collective operations are marked; a method that works by parts and adds up by sum() takes the same decisions on all
/// processes. Vectors hold the own rows.
class ScaledPart {
public:
    /// About a thousand own rows that follow one another, in one slice of Ŵ.
    struct Part {
        std::int32_t first = 0, rows = 0;
        std::size_t first_block = 0, blocks = 0, first_interval = 0, intervals = 0;
        std::size_t slice = 0, first_group = 0, groups = 0;  // the groups count within their slice

        template <class Any>
        [[nodiscard]] auto of(Any& vector) const {
            return vector.segment(first, rows);
        }
    };

    /// Collective.
    void analyze(const Processes& processes, const sdk::LocalProblemView& problem);
    /// Makes Ŵ, slice by slice, and keeps nothing else of the matrices. Collective. Throws sdk::NumericalFailure.
    void factorize(const sdk::LocalProblemView& problem);
    /// Takes a, b, the cones' parameters and bounds. Collective.
    void load(const sdk::LocalProblemView& problem);

    [[nodiscard]] const Processes& processes() const { return bodies_.processes(); }
    [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

    /// before(part) for all parts, a product of N̂ with λ̂, made by before, and after(part), which calls finish_product.
    /// The sums over all processes of the First numbers of before and the Second of after, by one reduction.
    /// Collective.
    template <std::size_t First, std::size_t Second, class Before, class After>
    [[nodiscard]] std::array<double, First + Second> sums_about_product(const sdk::Vector& lambda, const Before& before,
                                                                        const After& after) const {
        std::array<double, First + Second> total = {};
        const auto projecting = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
        for (const Part& part : parts_) {
            const std::array<double, First> sums = before(part);
            for (std::size_t k = 0; k < First; ++k) total[k] += sums[k];
        }
        begin_product(lambda);
        for (const Part& part : parts_) {
            const std::array<double, Second> sums = after(part);
            for (std::size_t k = 0; k < Second; ++k) total[First + k] += sums[k];
        }
        processes().sum(total);
        return total;
    }

    /// result ← N̂ λ̂ of the part's rows, with the λ̂ of sums_about_product.
    void finish_product(const Part& part, sdk::Vector& result) const;
    /// result ← N̂ λ̂ + r̂ = û. Collective.
    void gradient(const sdk::Vector& lambda, sdk::Vector& result) const;

    /// λ̂ ← its projection onto Υ̂.
    void project(const Part& part, sdk::Vector& lambda) const;
    void project(sdk::Vector& lambda) const {
        for (const Part& part : parts_) project(part, lambda);
    }

    /// The part's share of the square of the natural error, which natural_from takes summed up.
    [[nodiscard]] double natural_square(const Part& part, const sdk::Vector& lambda, const sdk::Vector& velocity) const;
    [[nodiscard]] double natural_from(double sum) const { return std::sqrt(sum) / reference_; }
    /// Collective.
    [[nodiscard]] double natural(const sdk::Vector& lambda, const sdk::Vector& velocity) const;

    /// The natural error as the host will measure it, from λ in the problem's units: x = H⁻¹(a + Dᵀλ) and u anew.
    /// Collective.
    [[nodiscard]] double measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda) const;
    /// x = H⁻¹(a + Dᵀλ) of own bodies. Collective.
    void velocity(const sdk::LocalProblemView& problem, const sdk::Vector& lambda, sdk::MutableVectorView x) const;

    [[nodiscard]] const sdk::Vector& scaling() const { return p_; }  ///< the diagonal of P
    /// Sent by all processes together in one product with N̂.
    [[nodiscard]] std::int64_t bytes_a_product() const { return 2 * bodies_.columns().bytes() + rows_.bytes(); }

private:
    /// A friction block's data in hot loops; rows: 0 where the block is of another kind, which rest_ has.
    struct Contact {
        double mu;
        std::int32_t first, rows;
    };
    struct Block {
        delassus_cone cone;
        double unit;  ///< λ = unit · λ̂ where Υ is no cone; 1 for a cone
    };
    struct Interval {
        std::int32_t first, rows;
    };
    /// Own rows, of whole cones, that are whitened and stored together. Their groups count rows from first.
    struct Slice {
        std::int32_t first = 0, rows = 0;
        std::vector<sdk::RowGroup> groups;
        sdk::BlockRows inertia, compliance;  // Ŵ, Ê
    };

    static constexpr std::int32_t longest_interval = 512, part_rows = 1024, least_slice = 1 << 16;

    void begin_product(const sdk::Vector& lambda) const;
    void cut_slices(const sdk::LocalProblemView& problem);
    void whiten(const sdk::LocalProblemView& problem, Slice& slice, std::int64_t first_cone, std::int64_t last_cone);
    void scale_rest();
    void fill_compliance(const sdk::LocalProblemView& problem);
    void divide();
    [[nodiscard]] sdk::Vector local_velocity(const sdk::LocalProblemView& problem, const sdk::Vector* lambda) const;
    void project_block(std::size_t block, double* lambda) const;

    Bodies bodies_;
    Exchange rows_;  // of E
    bool has_compliance_ = false;
    std::vector<Slice> slices_;
    std::vector<std::int64_t> first_cone_;  // of each slice, and the end
    std::vector<Part> parts_;
    std::vector<Contact> contacts_;
    std::vector<Block> rest_;  // by number of contact where rows is 0, else unused; empty if all are friction
    std::vector<Interval> intervals_;
    std::vector<double> trace_;  // mean diagonal of N in a cone, by cones; until scale_rest()
    sdk::Vector r_;              // r̂
    sdk::Vector p_, ratio_;      // ratio: s of the row's block over p of the row
    sdk::Vector lower_, upper_;  // of the rows of intervals; empty if there are none
    double reference_ = 1.0;
    mutable sdk::Vector work_, padded_;  // local columns, and local rows of E; both with the padding of BlockRows
};

}  // namespace delassus::petsc
