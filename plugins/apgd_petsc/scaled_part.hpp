// SPDX-License-Identifier: BSD-3-Clause
// The own rows of the convex problem behind the associated law, scaled as in sdk/scaled_rows.hpp:
//
//     minimise ½ λ̂ᵀ N̂ λ̂ + r̂ᵀ λ̂ over Υ̂,   λ = P λ̂,   N̂ = Ŵ Ŵᵀ + Ê,   Ŵ = P D L⁻ᵀ,   H = L Lᵀ,   Ê = P E P.
//
// With H diagonal or of blocks, a row of Ŵ reaches the bodies of that row alone. A product with N̂ is Ŵᵀ λ̂ by the own
// rows, a sum over processes at bodies that several touch, and Ŵ times that. What crosses is six numbers for each body
// at a border, to its owner and back.
#pragma once

#include <array>
#include <vector>

#include "delassus/sdk/scaled_rows.hpp"
#include "petsc/bodies.hpp"

namespace delassus::petsc {

/// What sdk::ScaledProblem is in one process. Collective operations are marked; a method that works by parts and adds
/// up by sums_about_product takes the same decisions on all processes. Vectors hold the own rows. Teams are of one
/// thread.
class ScaledPart : public sdk::ScaledRows {
public:
    using View = sdk::LocalProblemView;

    /// Collective.
    void analyze(const Processes& processes, const sdk::LocalProblemView& problem);
    /// Makes Ŵ, slice by slice, and keeps nothing else of the matrices. Collective. Throws sdk::NumericalFailure.
    void factorize(const sdk::LocalProblemView& problem);
    /// Takes a, b, the cones' parameters and bounds. Collective.
    void load(const sdk::LocalProblemView& problem);

    [[nodiscard]] const Processes& processes() const { return bodies_.processes(); }

    /// before(part) for all parts, a product of N̂ with λ̂, made by before, and after(part), which calls finish_product.
    /// The sums over all processes of the First numbers of before and the Second of after, by one reduction.
    /// Collective.
    template <std::size_t First, std::size_t Second, class Before, class After>
    [[nodiscard]] std::array<double, First + Second> sums_about_product(const sdk::Team& team,
                                                                        const sdk::Vector& lambda, const Before& before,
                                                                        const After& after) const {
        const auto projecting = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
        auto total = sums_about<First, Second>(
            team, before, [&] { begin_product(lambda); }, after);
        processes().sum(total);
        return total;
    }

    /// result ← N̂ λ̂ of the part's rows, with the λ̂ of sums_about_product.
    void finish_product(const Part& part, sdk::Vector& result) const;
    /// result ← N̂ λ̂ + r̂ = û. Collective.
    void gradient(const sdk::Vector& lambda, sdk::Vector& result) const;

    /// The natural error of λ̂ with û. Collective.
    [[nodiscard]] double natural(const sdk::Vector& lambda, const sdk::Vector& velocity) const;

    /// The natural error as the host will measure it, from λ in the problem's units: x = H⁻¹(a + Dᵀλ), left in velocity
    /// at all local columns, and u anew. Collective.
    [[nodiscard]] double measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                                  sdk::Vector& velocity) const;
    /// x = H⁻¹(a + Dᵀλ) of own bodies. Collective.
    [[nodiscard]] sdk::Vector velocity(const sdk::LocalProblemView& problem,
                                       const Eigen::Ref<const sdk::Vector>& lambda) const;

    [[nodiscard]] bool everywhere(bool holds) const { return !processes().any(!holds); }  ///< Collective.
    void next_iteration() const { processes().meter()->clock().next_iteration(); }
    void end_iterations() const { processes().meter()->clock().end_iterations(); }
    /// Sent by all processes together in one product with N̂.
    [[nodiscard]] std::int64_t bytes_a_product() const { return 2 * bodies_.columns().bytes() + rows_.bytes(); }

private:
    /// Own rows, of whole cones, that are whitened and stored together. Their groups count rows from first.
    struct Slice {
        std::int32_t first = 0, rows = 0;
        std::vector<sdk::RowGroup> groups;
        sdk::BlockRows inertia, compliance;  // Ŵ, Ê
    };

    static constexpr std::int32_t least_slice = 1 << 16;

    void begin_product(const sdk::Vector& lambda) const;
    void cut_slices(const sdk::LocalProblemView& problem);
    void whiten(const sdk::LocalProblemView& problem, std::size_t slice, sdk::Vector& diagonal);
    void fill_compliance(const sdk::LocalProblemView& problem);
    [[nodiscard]] sdk::Vector local_velocity(const sdk::LocalProblemView& problem,
                                             const Eigen::Ref<const sdk::Vector>& lambda) const;

    Bodies bodies_;
    Exchange rows_;  // of E
    bool has_compliance_ = false;
    std::vector<Slice> slices_;
    std::vector<std::size_t> first_cone_;  // of each slice, and the end
    sdk::Vector r_;                        // r̂
    mutable sdk::Vector work_, padded_;    // local columns, and local rows of E; both with the padding of BlockRows
};

}  // namespace delassus::petsc
