// SPDX-License-Identifier: BSD-3-Clause
// Trees of rigid bodies in the coordinates of their joints: kinematics, mass matrix and forward dynamics by recursion
// (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 to 7).
//
// A *link* is a body with the joint that holds it to its parent; a body without such a joint is held by a free one. All
// vectors here are in the axes of the world, and twists and wrenches of a link are taken about its own mass centre:
// (ω, v) and (τ, F). With d = x − x_parent, u the velocities of the link's joint and the columns (a_j, l_j) of its S
//
//     ω = ω_p + Σ a_j u_j,      v = v_p + ω_p × d + Σ l_j u_j
//     ω̇ = ω̇_p + Σ a_j u̇_j + c_ω,      v̇ = v̇_p + ω̇_p × d + Σ l_j u̇_j + c_v
//     and a wrench on the link is (τ + d × F, F) about the mass centre of the parent.
//
// With r̂ the way from the mass centre of the parent to the point of the joint on the link, r̂_c that from the link's own
// mass centre to it, w = Σ a_j u_j the relative angular velocity and s′ the sliding velocity,
//
//     d = r̂ − r̂_c,     c_ω = ω_p × w + β,     c_v = ω_p × (ω_p × r̂ + 2 s′) − c_ω × r̂_c − ω × (ω × r̂_c)
//
// where β = a₁ u₁ × a₂ u₂ of a universal joint, whose second axis turns with the first, and 0 of all others.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

/// What holds a link. Coordinates and velocities of each, in their order:
enum class LinkJoint {
    Free,         ///< mass centre and quaternion in the world; velocities as those of a body of MultibodySystem
    Fixed,        ///< none
    Revolute,     ///< angle
    Prismatic,    ///< slide
    Cylindrical,  ///< slide, angle
    Universal,    ///< angle about the axis of the parent, angle about that of the link
    Spherical,  ///< quaternion of the link in the frame of the parent; angular velocity against it in the link's frame
    Planar      ///< two slides along axes of the parent, angle about their normal
};

struct Link {
    BodyIndex body = world_body;
    std::int32_t parent = 0;  ///< number of the link; 0: the ground
    LinkJoint kind = LinkJoint::Free;
    std::int32_t joint = -1;                      ///< of the system; −1: none
    std::int32_t column = 0, freedoms = 0;        ///< its entries of the velocities
    std::int32_t position = 0, coordinates = 0;   ///< and of the positions
    std::int32_t body_column = 0, body_position;  ///< of the body in states of the MultibodySystem
    bool leaf = true;
    double mass = 0.0;  ///< 0: a massless body
    // Of a massless body: its name, the mass that it carries, and the sum of the moments of inertia of that about the
    // joint where the system was given.
    std::string name;
    double carried_mass = 0.0, carried_inertia = 0.0;
    Matrix3d inertia = Matrix3d::Identity();                                     ///< about the mass centre, body frame
    Eigen::Matrix<double, 6, 1> armature = Eigen::Matrix<double, 6, 1>::Zero();  ///< of its velocities
    // In the frame of the parent, or of the world on the ground: the point of the joint, its axis and two normal ones,
    // and the orientation of the link at coordinates 0.
    Vector3d point = Vector3d::Zero(), axis = Vector3d::UnitZ(), normals[2] = {Vector3d::UnitX(), Vector3d::UnitY()};
    Quaterniond turned = Quaterniond::Identity();
    // In the frame of the link: the point and the axis, and the second axis of a universal joint.
    Vector3d arm = Vector3d::Zero(), own_axis = Vector3d::UnitZ(), second_axis = Vector3d::UnitX();
};

/// Where a link is and how it moves.
struct LinkMotion {
    static constexpr int most = 6;
    Quaterniond Q = Quaterniond::Identity();
    Matrix3d A = Matrix3d::Identity();
    Vector3d x = Vector3d::Zero(), v = Vector3d::Zero(), omega = Vector3d::Zero();
    Vector3d d = Vector3d::Zero();                                   ///< from the mass centre of the parent
    Vector3d turn_bias = Vector3d::Zero(), bias = Vector3d::Zero();  ///< c_ω, c_v
    Eigen::Matrix<double, 3, most> angular, linear;                  ///< the columns of S; the first ones are used
};

/// A wrench about a mass centre, or an acceleration of one: (τ, F), (ω̇, v̇).
struct Spatial {
    Vector3d angular = Vector3d::Zero(), linear = Vector3d::Zero();
};

class KinematicTree {
public:
    /// Chooses the trees: each body, nearest to the ground first, is held by the joint with the most rows among those
    /// that lead to it, by one with an armature or at a massless body before all others. system: built up to its
    /// finish(). Throws Unsupported for nodes of elements.
    explicit KinematicTree(const MultibodySystem& system);

    /// The ground first; parents before their children.
    [[nodiscard]] const std::vector<Link>& links() const { return links_; }
    [[nodiscard]] std::int32_t n() const { return n_; }
    [[nodiscard]] std::int32_t position_size() const { return position_size_; }
    /// The link of a body; 0 where it does not move.
    [[nodiscard]] std::int32_t link_of(BodyIndex body) const { return link_of_[static_cast<std::size_t>(body)]; }

    /// Coordinates of bodies that are placed as the joints allow; angles in (−π, π].
    void read(const State& bodies, State& state) const;

    // ---- At the state of the last place() ----

    /// v may be null: the tree then stands still. What is placed so already stays.
    void place(const double* q, const double* v);
    /// Where velocities do not matter.
    void place(const double* q);
    [[nodiscard]] const LinkMotion& motion(std::size_t link) const { return motions_[link]; }
    /// q and v of the bodies.
    void write(State& bodies) const;
    /// J̇ u, the accelerations of the bodies at u̇ = 0.
    void bias(double* bodies);

    /// result += factor · Jᵀ (f − M̄ J̇ u), f being forces and torques on the bodies (torques in their frames) and M̄ the
    /// masses of the bodies.
    void project_with_bias(const double* f, double factor, double* result);
    /// M += factor · (Jᵀ M̄ J + armatures): by composite bodies, with entries for pairs of which one is on the way of
    /// the other to the ground.
    void add_mass(double factor, MatrixAssembler& M);
    /// result += factor · (Jᵀ M̄ J + armatures) x.
    void multiply_mass(double factor, const double* x, double* result);
    /// u̇ ← (Jᵀ M̄ J + armatures)⁻¹ Jᵀ (f − M̄ J̇ u), by articulated bodies: O(n). Throws StepFailure where a massless body
    /// carries nothing that resists its joint, as where two of three axes have become parallel.
    void accelerate(const double* f, double* u_dot);

private:
    void choose_joints(const MultibodySystem& system);
    /// What massless bodies carry; throws InputError where nothing holds one, or it carries no mass. Likewise for an
    /// armature of a joint that no tree holds.
    void look_at_massless(const MultibodySystem& system);
    void require_resistance(std::size_t link, double least) const;
    void add_link(const MultibodySystem& system, BodyIndex body, std::int32_t parent, std::int32_t joint);
    /// The acceleration of the parent as the link takes part in it: (ω̇_p, v̇_p + ω̇_p × d).
    [[nodiscard]] Spatial carried(std::size_t link) const;
    /// acceleration_ ← J̇ u, in the axes of the world.
    void find_bias();
    /// The wrench that gives the link its acceleration_.
    [[nodiscard]] Spatial inertial(std::size_t link) const;
    /// result += factor · Σ S · wrench, which is handed on to the parents.
    void gather(double factor, double* result);
    /// The inertia of a link about its mass centre in the axes of the world.
    [[nodiscard]] Matrix3d inertia(std::size_t link) const;

    std::vector<double> placed_q_, placed_v_;  ///< of the last place()

    /// An articulated inertia: torque and force of the angular and the linear acceleration.
    struct Articulated {
        Matrix3d turning, mixed, moving;  ///< (τ, F) = (turning ω̇ + mixed v̇, mixedᵀ ω̇ + moving v̇)
        Spatial bias;                     ///< what the wrench is at no acceleration
        Eigen::Matrix<double, 6, LinkMotion::most> U;
        Eigen::Matrix<double, LinkMotion::most, LinkMotion::most> inverse;  ///< (Sᵀ U)⁻¹
        Eigen::Matrix<double, LinkMotion::most, 1> force;                   ///< −Sᵀ bias
    };
    template <int freedoms>
    void eliminate(std::size_t link);
    template <int freedoms>
    void resolve(std::size_t link, double* u_dot);

    std::vector<Link> links_;
    std::vector<std::int32_t> link_of_;
    std::int32_t n_ = 0, position_size_ = 0;
    std::vector<LinkMotion> motions_;
    // Work space of the call that runs:
    std::vector<Spatial> wrench_, acceleration_;
    std::vector<Articulated> articulated_;
    struct Composite {
        double mass;
        Vector3d moment;   ///< mass times the way to the mass centre
        Matrix3d inertia;  ///< about the link's own mass centre
    };
    std::vector<Composite> composite_;
};

/// Whether a joint has a `start` or a `start_rate`.
[[nodiscard]] bool has_start(const JointParameters& joint);

/// The given state with the joints of trees at this share of their `start`, and all rates as they are in `drawn` or as
/// `start_rate` says; itself where no joint has any. Throws InputError for systems with nodes.
[[nodiscard]] State with_joint_starts(const MultibodySystem& system, const State& drawn, const State& given,
                                      double share);

}  // namespace delassus::mechanics
