// SPDX-License-Identifier: BSD-3-Clause
// The linear system of an interior point step, in the bases U of the rows and Z of the reactions (complementarity.hpp):
//
//     Ĥ δx − D̂″ᵀ δz       = f        D̂' = Uᵀ D̂,  D̂″ = Zᵀ D̂,  Ê' = Uᵀ Ê Z
//     D̂' δx + (Ê' + θ) δz = g
//
// factored with static regularisation, θ + δ1 and Ĥ + ρ1, in one of three forms:
//     normal     Ĥ + ρ1 + D̂″ᵀ T D̂' with T = (Ê' + θ + δ1)⁻¹ by groups; where Ê couples no two groups
//     augmented  [Ĥ + ρ1, D̂″ᵀ; D̂', −(Ê' + θ + δ1)]
//     reduced    Ê' + θ + δ1, for n = 0
// and refined with the residual of the system as it stands. The patterns depend on those of H, D and E alone. Under the
// associated law U = Z, and the augmented form is quasi-definite: L Δ Lᵀ exists in every order (Vanderbei 1995). With
// exact Coulomb θ couples the rows of each block, the values are unsymmetric on the same patterns, and L U is found
// without exchanging pivots.
#pragma once

#include <cmath>
#include <string>

#include "complementarity.hpp"
#include "delassus/sdk/sparse_factor.hpp"

namespace delassus::ipm {

enum class Form { Automatic, Normal, Augmented, Reduced };

struct KktSettings {
    Form form = Form::Automatic;
    double regularization = 0.0;  ///< δ, relative to the diagonal of N
    int refinements = 0;          ///< at most so many a solve
};

class KktSystem {
public:
    explicit KktSystem(const KktSettings& settings) : settings_(settings) {}

    /// Chooses the form by the fill of its factor, and analyses it. Reads patterns only.
    void analyze(const sdk::ProblemView& problem);

    /// Takes new values; system must outlive the solves. definite: whether H is.
    void load(const ScaledSystem& system, bool definite);

    /// theta: m, the diagonal, in the bases of cones. Raises the regularisation until the factorisation exists. Throws
    /// sdk::NumericalFailure if it does not for any.
    void factorize(const Complementarity& cones, const sdk::Vector& theta);

    // What Refinement takes. f: n, g: m; rows of g and δz in the bases.
    /// δx and δz from the factor.
    void solve_once(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double, sdk::Vector& dx,
                    sdk::Vector& dz);
    /// What δx and δz leave of the system.
    void find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, const sdk::Vector& dx,
                   const sdk::Vector& dz, sdk::Vector& f_rest, sdk::Vector& g_rest);
    [[nodiscard]] double weighted_norm(const sdk::Vector& f, const sdk::Vector& g) const {
        return std::sqrt(f.squaredNorm() + g.cwiseProduct(weight_).squaredNorm());
    }
    [[nodiscard]] int refinements() const { return settings_.refinements; }

    /// The form in use, its fill and the regularisation, for a message.
    [[nodiscard]] std::string description() const;
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    /// Rows of D in one group: a dense block over the columns that any of them touches.
    struct DBlock {
        std::int32_t columns;
        std::size_t index;  // into column_
        std::size_t value;  // into d_value_, d_rotated_: rows × columns, column by column
        std::size_t place;  // into d_place_
    };
    /// Ê between two groups, row ≥ column.
    struct EBlock {
        std::int32_t row, column;  // groups
        std::size_t value;         // into e_value_: rows × columns, column by column
        std::size_t place;         // into e_place_
    };

    void find_blocks(const sdk::ProblemView& problem);
    [[nodiscard]] sdk::SparseColumns pattern(const sdk::ProblemView& problem, Form form) const;
    void find_places(const sdk::ProblemView& problem);
    void rotate(const Complementarity& cones);
    void rotate_D(const Complementarity& cones, bool by_rows, std::vector<double>& result) const;
    void rotate_E(const Complementarity& cones, bool by_rows, std::vector<double>& result) const;
    void subtract_beside(const sdk::Vector& dz, sdk::Vector& rest) const;
    void find_T(std::size_t group, const sdk::Vector& theta);
    void assemble(const sdk::Vector& theta);
    [[nodiscard]] const double* reactions_D(std::size_t group) const {
        return (unsymmetric_ ? d_reactions_ : d_rotated_).data() + d_blocks_[group].value;
    }
    void add_normal_block(std::size_t group);
    void solve_factored(const sdk::Vector& f, const sdk::Vector& g, sdk::Vector& dx, sdk::Vector& dz);

    KktSettings settings_;
    Form form_ = Form::Automatic;
    Eigen::Index n_ = 0, m_ = 0;
    const ScaledSystem* system_ = nullptr;
    bool definite_ = true;
    double delta_ = 0.0, rho_ = 0.0;

    std::vector<Group> groups_;
    std::vector<std::int32_t> group_of_row_;
    std::vector<DBlock> d_blocks_;  // one a group
    std::vector<std::int32_t> column_;
    std::vector<double> d_value_, d_rotated_;  // D̂, D̂'
    std::vector<double> d_reactions_;          // D̂″ where it is not D̂'
    std::vector<std::size_t> d_slot_;          // of each entry of D, into d_value_
    std::vector<EBlock> e_blocks_;             // every diagonal block, then the others
    std::vector<double> e_value_, e_rotated_;
    std::vector<double> e_mirrored_;      // Zᵀ Ê U where it is not Ê': the transpose of Ê' on the other side
    std::vector<std::ptrdiff_t> e_slot_;  // of each entry of E, into e_value_; −1 above the diagonal blocks
    bool couples_groups_ = false;         // Ê has blocks off the diagonal

    bool unsymmetric_ = false;
    std::vector<Complementarity::Beside> beside_;            // of θ, one a group where unsymmetric
    sdk::SparseColumns matrix_;                              // the lower triangle of the form
    std::vector<double> upper_;                              // beside it where unsymmetric: the mirrored values
    std::vector<std::int32_t> h_place_, d_place_, e_place_;  // into its values
    std::vector<Triple> t_;                                  // rows of T, three a group
    sdk::SparseFactor factor_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
    sdk::Vector stacked_, unrotated_, product_;
    sdk::Vector weight_, theta_;
};

}  // namespace delassus::ipm
