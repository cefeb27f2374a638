// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of the forces of a tree of links along the increments of its coordinates.
//
// Here twists are V = (ω, v_o) and wrenches (τ_o, F) about the origin, so that those of all links may be added, and
//
//     V × S = (ω × a, ω × l + v × a),      V ×* (τ, F) = (ω × τ + v × F, ω × F)
//
// A joint of several velocities is a chain of *groups*: one slide or one turn each, and the three turns of a sphere
// together, whose axes are fixed in the link. A column S_j turns and moves all that comes after it and, of a sphere,
// its own group: j ≼ i. There an increment along S_j turns S_i by S_j × S_i and the wrench of a link by S_j ×*. V and A
// before the group of j do not turn with them: seen from what follows, the base moves by
//
//     δV = V × S_j,    δA = A × S_j
//
// against it (Carpentier and Mansard, Analytical derivatives of rigid body dynamics algorithms, 2018, have this for
// joints of one group). The recursive force is τ_i = S_iᵀ Σ φ_k over the links k that S_i moves, with
// φ = I A + V ×* I V, A being the acceleration at u̇ = 0 and that of the ground −g. With I, B and F = Σ φ summed up over
// the links that the later one of i and j moves,
//
//     ∂τ_i/∂q_j = S_iᵀ (I (δA − δV × V) + B δV)  [ + S_iᵀ (S_j ×* F) unless j ≼ i ]
//     ∂τ_i/∂u_j = S_iᵀ (I ((V + V′) × S_j) + B S_j)
//     B δV = δV ×* I V + V ×* I δV − I (V × δV)        of each link
//
// where V and V′ stand before and after the group of j.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mechanics/kinematic_tree.hpp"

namespace delassus::mechanics {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// At the state of the tree's last place(). Entries come as add(row, column, value), of pairs of columns of which one
/// is on the way of the other to the ground.
class TreeDerivatives {
public:
    using Add = std::function<void(std::int32_t, std::int32_t, double)>;

    /// skips: links whose own forces are not counted, by number; they carry none.
    explicit TreeDerivatives(const KinematicTree& tree, std::function<bool(std::size_t)> skips);

    /// Of τ with gravity and the velocities u: ∂τ/∂q and ∂τ/∂u.
    void set_motion(const double* u, const Vector3d& gravity);
    /// Of τ = M(q) a.
    void set_acceleration(const double* a);
    void positions(const Add& add) const;
    void rates(const Add& add) const;

    /// ∂(Jᵀ f)/∂q for fixed f: forces in the axes of the world and torques in those of the bodies. After set_motion()
    /// or set_acceleration().
    void geometry(const double* f, const Add& add) const;
    /// ∂(J u)/∂q, the columns of a link's body that column j makes: (v in the world, ω in the body's frame). After
    /// set_motion(); j on the way of the link to the ground.
    [[nodiscard]] Vector6 turned_velocity(std::size_t link, std::int32_t j) const;

private:
    struct Column {
        std::int32_t link = 0, group = 0;
        Vector6 S, before, after, acceleration;  ///< V and A before the group, V after it
    };
    void find_columns(const double* u, const double* a, const Vector3d& ground);
    void sum_up();
    /// Visits pairs of columns of which the second is on the way of the first to the ground, or of the same link.
    template <class Visitor>
    void for_pairs(Visitor&& visit) const;
    [[nodiscard]] bool moves_with(const Column& j, const Column& i) const {
        return j.link != i.link || j.group <= i.group;
    }

    const KinematicTree* tree_;
    std::function<bool(std::size_t)> skips_;
    std::vector<Column> columns_;
    std::vector<Vector6> speed_, acceleration_, force_;  // of links
    std::vector<Matrix6> inertia_, coupling_;            // I and B
};

}  // namespace delassus::mechanics
