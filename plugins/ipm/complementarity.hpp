// SPDX-License-Identifier: BSD-3-Clause
// The cones' side of the interior point method: the iterates ẑ, ŝ in the interior, their scaling, targets and steps,
// for both friction laws.
//
// Rows of intervals keep p = ẑ − lower > 0 with w_l > 0 and q = upper − ẑ > 0 with w_u > 0 (those that exist) and
// ŝ = w_l − w_u; on the central path p w_l = q w_u = τ. Eliminating δw_l, δw_u from the linearised products leaves
// δs = t − θ δz with θ = w_l/p + w_u/q.
//
// Friction blocks hold z and s in the interior of the second-order cone Q; on the central path z ∘ s = τ e. The
// Nesterov–Todd matrix W (symmetric, W Q = Q) has W z = W⁻¹ s =: ℓ; linearising (W z) ∘ (W⁻¹ s) gives δs = W q − W²δz
// with q = ℓ \ (what is left of the products). With z̄ = z/√det z, s̄ = s/√det s, J = diag(1, −1, −1) and
//     γ = √((1 + z̄ᵀs̄)/2),  w̄ = (s̄ + J z̄)/(2γ),  η = (det s/det z)^(1/4)
// W² = η²(2 w̄ w̄ᵀ − J) (Andersen, Roos and Terlaky 2003; Vandenberghe 2010, section 5.1). With ω = w̄₀ + ‖w̄₁‖ and the
// direction ŵ of w̄₁ its eigenvectors are c = (1, ±ŵ)/√2 with √θ = η ω^(±1), and (0, t) with √θ = η, t ⊥ ŵ. All work
// is done in this basis, because θ spans 1/τ to τ at a sliding contact: a diagonal keeps each value to full accuracy
// where a 3×3 matrix would lose the small ones.
//
// At a sliding contact det z = (z₀ − ‖z₁‖)(z₀ + ‖z₁‖) falls below the rounding of z itself. det z, det s and zᵀs are
// therefore carried along: after a step they follow from the scaled points W z and W⁻¹ s, which are well centred.
//
// Exact Coulomb has no norm here (docs/solvers/ipm.md): z ∘ s = τ e holds for s = (s₀, û_t) with a free s₀, the normal
// velocity is v = û₀, and z₀ v = τ. So û = (v, s_t) changes by
//     δû₀ = q₀ − (v/z₀) δz₀,    δû_t = (W q − W²δz)_t.
// With the direction ŵ of W, the equations take the basis e₀, ŵ, t of û. The reactions take δz₀, ε = δz₀ + δz_ŵ and
// δz_t for unknowns, because at a sliding contact δz_ŵ = −δz₀ but for a small rest, and ε keeps its digits. There
//     θ = [v/z₀, 0, 0;  −η²/ω², η²(ω² + 1/ω²)/2, 0;  0, 0, η²].
// Where this path ends another leads past the end (coulomb_path.cpp): û = s − σ e₀ with the shift σ = (1 − φ)ς +
// φ‖s_t‖, for a given ς and share φ. φ = 1 is De Saxcé's form of the law; φ = 0 the associated law with another b. With
// φ s_t/‖s_t‖ = c ŵ + d t the first row of θ is then η²((1 + c)/ω², (1 − c)(ω² + 1/ω²)/2 − 1/ω², −d).
#pragma once

#include <array>
#include <vector>

#include "scaled_system.hpp"

namespace delassus::ipm {

using Triple = std::array<double, 3>;

/// Vectors of a friction block's components: of its eigenbasis, or those by which it takes rows or reactions.
using Basis = std::array<Triple, 3>;

/// Which equation stands for the normal velocities: ŝ itself (associated law), z₀ v = τ, or û₀ = s₀ − σ.
enum class Path { Associated, Product, Shift };

class Complementarity {
public:
    /// Beside θ's diagonal in one friction block: [1][0], [0][1], [0][2].
    struct Beside {
        double below = 0.0, right = 0.0, far = 0.0;
    };

    /// θ of a row that is held where it is.
    static constexpr double held = 1e40;

    /// Takes the cones' parameters in scaled units; z_scale: λ = z_scale ∘ ẑ, m.
    void load(const sdk::ProblemView& problem, const sdk::Vector& z_scale);

    /// Starts from ẑ, with ŝ as wanted, both moved into the interior, at least as far from its boundary as the margins.
    void start(const sdk::Vector& z, const sdk::Vector& s, double z_margin, double s_margin);

    [[nodiscard]] const sdk::Vector& z() const { return z_; }  ///< m
    [[nodiscard]] const sdk::Vector& u() const { return u_; }  ///< m: ŝ, or with exact Coulomb û; zero in held rows
    [[nodiscard]] bool is_held(Eigen::Index row) const { return held_[static_cast<std::size_t>(row)] != 0; }

    /// τ = (the sum of all products)/(their number); 0 if there are none.
    [[nodiscard]] double mean_product() const { return degree_ > 0.0 ? products(0.0) / degree_ : 0.0; }
    /// The same after a step of the given length along the direction.
    [[nodiscard]] double mean_product(double step) const { return degree_ > 0.0 ? products(step) / degree_ : 0.0; }

    /// The smallest product after such a step, or now (0): of a block, the smallest eigenvalue of (W z) ∘ (W⁻¹ s).
    [[nodiscard]] double smallest_product(double step) const;

    /// Finds W; leaves θ (m) by rows of the blocks' bases, its diagonal.
    void scale(sdk::Vector& theta);
    /// The rest of θ; zero in groups without friction and under the associated law.
    [[nodiscard]] Beside beside(std::size_t group) const {
        return block_of_group_[group] < 0 ? Beside{} : blocks_[static_cast<std::size_t>(block_of_group_[group])].beside;
    }
    [[nodiscard]] Path path() const { return path_; }

    /// Exact Coulomb only. Goes over to û₀ = s₀ − σ with ς = ‖s_t‖ of now, s₀ = v + ς; φ = 1.
    void take_shift_path();
    /// Goes over to z₀ v = τ with v = û₀.
    void take_product_path();
    /// φ, in (0, 1].
    void set_share(double share);
    /// ς ← σ.
    void advance_shift();
    /// ‖‖s_t‖ − σ‖₂.
    [[nodiscard]] double shift_lag() const;
    /// The largest ‖ℓ ∘ ℓ − τ e‖/τ, after scale().
    [[nodiscard]] double distance_from_centre(double tau) const;
    [[nodiscard]] double degree() const { return degree_; }

    /// The rows v of the equations (m) in the blocks' bases: v ← Uᵀ v.
    void rows_to_basis(sdk::Vector& v) const;
    /// Reactions (m) from what stands for them in the linear system: v ← Z v. Z = U under the associated law.
    void reactions_from_basis(sdk::Vector& v) const;
    /// Uᵀ and Zᵀ of a group that is a friction block with μ > 0, otherwise null (the identity).
    [[nodiscard]] const Basis* row_basis(std::size_t group) const {
        return block_of_group_[group] < 0 ? nullptr
                                          : &blocks_[static_cast<std::size_t>(block_of_group_[group])].rows_in;
    }
    [[nodiscard]] const Basis* reaction_basis(std::size_t group) const {
        return block_of_group_[group] < 0 ? nullptr
                                          : &blocks_[static_cast<std::size_t>(block_of_group_[group])].reactions_in;
    }

    /// t of δû = t − θ δz in the blocks' bases (m), aiming at products of zero (Mehrotra's predictor).
    void target_zero(sdk::Vector& t);
    /// Aiming at products of tau; with second_order, which takes the direction set last, Mehrotra's corrector.
    void target(double tau, bool second_order, sdk::Vector& t);

    /// Gondzio's correction of the target t set last: the products that a step of this length along the direction would
    /// lead to, and that lie outside low … high, are to end at these bounds instead.
    void correct(double step, double low, double high, sdk::Vector& t);
    /// The target before correct(); set_direction() with the direction before has to follow.
    void undo_correction();

    /// Takes δz in the blocks' bases, m; δs follows from the target set last.
    void set_direction(const sdk::Vector& dz);
    /// The largest step that keeps z and s in their cones; infinite if all do.
    [[nodiscard]] double longest_step() const;
    void advance(double step);

    /// z ← its nearest point in the recession cone of the set of ẑ: the directions in which ẑ may grow for ever.
    void project_to_recession(sdk::Vector& z) const;
    /// How far s is from the dual of that cone.
    [[nodiscard]] double distance_to_recession_dual(const sdk::Vector& s) const;

private:
    struct Interval {
        std::int32_t row;
        bool has_lower, has_upper;
        double lower, upper;
        double p, wl, q, wu;
        double tl, tu;  // targets of δw_l, δw_u
        double old_tl, old_tu;
        double dz, dwl, dwu;  // direction
    };
    struct Block {
        std::int32_t first, rows;
        double det_z, det_s, product;
        double eta;
        Triple root_theta;
        Basis eigen;                  // of W
        Basis rows_in, reactions_in;  // of the linear system
        Triple ell, q, old_q;         // W z = W⁻¹ s; target, and before the latest correction
        Triple dz, ds;                // W δz, W⁻¹ δs
        double v, tv, dv, dz0;        // exact Coulomb: û₀, its target and change; δz₀
        double shift, c, d;           // ς, and φ s_t/‖s_t‖ seen from ŵ and t
        Beside beside;
    };

    void scale_block(Block& block);
    void renew_products(Block& block) const;
    void renew_velocity();
    void count_products();
    [[nodiscard]] double shift_of(const Block& block) const;
    void find_theta(Block& block, Triple& diagonal) const;
    void store_target(Block& block, sdk::Vector& t) const;
    [[nodiscard]] double normal_product(const Block& block, double step) const {
        return (z_[block.first] + step * block.dz0) * (block.v + step * block.dv);
    }
    [[nodiscard]] double products(double step) const;

    std::vector<std::int32_t> block_of_group_;
    std::vector<Interval> intervals_;
    std::vector<Block> blocks_;
    std::vector<char> held_;
    std::vector<std::int32_t> free_;  // rows without a bound
    Path path_ = Path::Associated;
    double share_ = 1.0;  // φ
    sdk::Vector z_, s_, u_, held_value_;
    sdk::Vector direction_;  // δz in the rows' own basis
    double degree_ = 0.0;
};

}  // namespace delassus::ipm
