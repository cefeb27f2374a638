// SPDX-License-Identifier: BSD-3-Clause
// A multibody system in the coordinates of its joints.
//
// Joints that make trees disappear: their coordinates and velocities are the unknowns. What is left, joints that close
// loops, gears, distances and motors without a limit, stays as rows, through the Jacobian J of the trees: with the
// velocities of the bodies v = J(q) u,
//
//     M = Jᵀ M̄ J,   f = Jᵀ (f̄ − M̄ J̇ u),   C_q = C̄_q J,   D_A = D̄_A J
//
// where what has a bar belongs to the bodies. SI units. docs/mechanics.md has the formulas.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/export.hpp"
#include "delassus/multibody.hpp"

namespace delassus {

/// What became of a joint.
struct TreeJoint {
    std::int32_t joint = -1;        ///< number in the MultibodySystem; −1: a body that no joint of a tree holds
    BodyIndex body = world_body;    ///< which it carries
    BodyIndex parent = world_body;  ///< the body that carries it; the world also for fixed bodies
    std::int32_t position = 0, coordinates = 0;  ///< its entries of q
    std::int32_t column = 0, freedoms = 0;       ///< and of v
};

/// The coordinates of a joint are 0 where the scene places its bodies; of
///     revolute     the angle, which counts turns; of prismatic the slide; of cylindrical slide and angle
///     universal    the angle about the first axis, then that about the second
///     spherical    a unit quaternion w x y z and an angular velocity, of the body carried, in its own frame, against
///                  the body that carries it
///     planar       two slides along axes fixed in the body that carries it, then the angle
///     none         as of a body in MultibodySystem: mass centre and quaternion
/// At the end of q stand those of MultibodySystem::angle_position() whose joints no tree holds.
class DELASSUS_API JointCoordinates : public DynamicalSystem {
public:
    /// bodies: after assemble(); it outlives this. From now on it keeps only rows that the trees do not hold, so that
    /// assemble() or keep_rows() must not be called on it. Throws Unsupported where the system has nodes.
    explicit JointCoordinates(MultibodySystem& bodies);
    ~JointCoordinates() override;

    [[nodiscard]] const MultibodySystem& bodies() const;
    /// By links: parents before their children.
    [[nodiscard]] std::vector<TreeJoint> joints() const;
    /// Rows of joints that the trees hold, and the unknowns of the bodies: what is saved is the first and
    /// body_velocities() − n().
    [[nodiscard]] std::int32_t rows_saved() const { return static_cast<std::int32_t>(rows_of_trees().size()); }
    /// Their numbers among all rows, ascending.
    [[nodiscard]] const std::vector<std::int32_t>& rows_of_trees() const;
    [[nodiscard]] std::int32_t body_velocities() const;
    /// MultibodySystem::renew_rows() for rows of loops: state ← moved to where the new ones hold.
    bool renew_rows(State& state, std::int64_t step);

    /// λ of rows_of_trees(), in their order, N and Nm: what the joints of trees carry at a state, where f acts on the
    /// bodies beside it (forces and torques as MultibodySystem::add_force() has them, with those of other rows).
    [[nodiscard]] std::vector<double> tree_reactions(const State& state, const std::vector<double>& f) const;

    /// The state of the bodies.
    [[nodiscard]] State bodies_of(const State& state) const;
    /// The same where memory serves again.
    void bodies_of(const State& state, State& bodies) const;
    /// The inverse, for bodies that are placed and move as the trees allow. Angles are those that the system counts
    /// (MultibodySystem::angle_position()), others in (−π, π].
    [[nodiscard]] State coordinates_of(const State& bodies) const;
    /// MultibodySystem::settle_turns() for the angles at the end of q.
    void settle_turns(State& state) const;

    // ---- DynamicalSystem ----
    [[nodiscard]] std::int32_t n() const override;
    [[nodiscard]] std::int32_t position_size() const override;
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override;
    [[nodiscard]] State initial_state() const override;
    void increment(const double* q, const double* delta, double* result) const override;
    void difference(const double* from, const double* to, double* delta) const override;
    void inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const override;
    void add_mass(const State& state, double factor, MatrixAssembler& M) const override;
    void multiply_mass(const State& state, double factor, const double* x, double* result) const override;
    void add_force(const State& state, double factor, double* result) const override;
    bool accelerate(const State& state, double* v_dot) const override;
    /// Exact: all of K. Symmetric: only what springs, loads and dampers have, without what the trees turn, so that H
    /// stays definite; Newton's method and linearised ones are consistent with either.
    void add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    void add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    void add_gyroscopic_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    /// Of bodies that a free joint holds.
    [[nodiscard]] std::vector<std::int32_t> vectors() const override;
    /// Trees, which count as bodies here.
    [[nodiscard]] std::vector<std::int32_t> bodies_of_columns() const override;
    /// Of bodies that nothing but a free joint holds and that carry none.
    void free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const override;
    void add_inertial_stiffness(const State& state, const double* acceleration, double factor, Tangent tangent,
                                MatrixAssembler& H) const override;
    [[nodiscard]] bool has_stiffness() const override;
    void find_stiff_forces(double rate, std::vector<std::int32_t>& stiff) const override;
    void stiff_tensions(const State& state, std::span<const std::int32_t> stiff,
                        std::vector<double>& tensions) const override;
    void add_stiff_forces(const State& state, std::span<const std::int32_t> stiff, std::span<const double> tensions,
                          double factor, double* result) const override;
    void add_stiff_tangent(const State& state, std::span<const std::int32_t> stiff, double of_stiffness,
                           double of_damping, MatrixAssembler& H) const override;
    void constraint(const State& state, double* C) const override;
    void add_constraint_jacobian(const State& state, std::int32_t first_row, MatrixAssembler& D) const override;
    void constraint_rate(const State& state, double* C_t) const override;
    void constraint_curvature(const State& state, double* c) const override;
    void add_constraint_stiffness(const State& state, const double* lambda, double factor, Tangent tangent,
                                  MatrixAssembler& H) const override;
    [[nodiscard]] bool has_unilateral() const override;
    [[nodiscard]] double next_jump(double t) const override;
    [[nodiscard]] double longest_step(double t) const override;
    [[nodiscard]] bool depends_on_time() const override;
    void collect_unilateral(const State& state, double h, UnilateralRows& rows) override;
    bool collect_contact(const SmoothMotion& motion, double time, const ContactPoint& contact,
                         UnilateralRows& rows) override;
    [[nodiscard]] std::optional<Vector3> prescribed_velocity(const ContactPoint& contact, double begin,
                                                             double t) const override;
    [[nodiscard]] double recovery_speed() const override;
    [[nodiscard]] double free_fall() const override;
    [[nodiscard]] double gap_resolution() const override;
    [[nodiscard]] double energy(const State& state) const override;
    [[nodiscard]] double supplied_power(const State& state) const override;
    [[nodiscard]] bool is_driven() const override;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
