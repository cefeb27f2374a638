// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <set>

#include "mechanics/attachment.hpp"
#include "mechanics/beam.hpp"
#include "mechanics/beam_inertia.hpp"
#include "mechanics/cable.hpp"
#include "mechanics/linkage.hpp"
#include "mechanics/model.hpp"
#include "mechanics/motion_corners.hpp"
#include "mechanics/solid_element.hpp"

namespace delassus {

struct MultibodySystem::Implementation {
    // ---- As built ----
    Vector3 gravity{0.0, 0.0, -9.81};
    std::vector<mechanics::Body> bodies;
    std::vector<mechanics::Node> nodes;
    std::vector<mechanics::Joint> joints;
    std::vector<mechanics::RowSpring> springs;
    std::vector<mechanics::TurnDamper> turn_dampers;
    std::vector<mechanics::JointFriction> frictions;
    bool has_armature = false;          // of a joint
    std::vector<std::int32_t> counted;  // joints whose angles are counted in turns
    std::vector<mechanics::Load> loads;
    std::vector<mechanics::Attachment> attachments;  // to bodies that move
    std::vector<mechanics::LinearTetrahedron> linear_tetrahedra;
    std::vector<mechanics::QuadraticTetrahedron> quadratic_tetrahedra;
    std::vector<mechanics::Brick> bricks;
    std::vector<mechanics::ElementSide> element_sides;  // of all these
    std::vector<mechanics::Cable> cables;
    std::vector<mechanics::Beam> beams;
    std::vector<mechanics::BeamInertia> beam_inertias;  // of those with a consistent mass
    std::vector<mechanics::ReducedSolid> reduced;
    std::vector<mechanics::ModalAttachment> modal_attachments;
    std::vector<mechanics::BoundedMotor> bounded_motors;
    std::vector<mechanics::BoundedActuator> bounded_actuators;
    mechanics::Motions motions;
    mechanics::MotionCorners motion_corners;  // of all motions
    std::uint64_t revision = 0;
    std::vector<Shape> shapes;
    std::vector<std::int32_t> shape_material;  // of shapes, then of node contacts
    struct NodeContact {
        std::int32_t node = 0;
        double radius = 0.0;
        std::int32_t material = 0;
    };
    std::vector<NodeContact> node_contacts;
    std::vector<ContactMaterial> materials;
    std::map<std::pair<std::int32_t, std::int32_t>, ContactMaterial> material_pairs;
    std::set<std::pair<BodyIndex, BodyIndex>> apart;
    double envelope = 0.0;  // 0: chosen by finish()
    std::optional<double> wanted_envelope;
    bool finished = false;

    // ---- Since finish() ----
    std::int32_t n = 0, position_size = 0;
    std::int32_t first_angle = 0;             // in q, of `counted`
    std::vector<ReducedBody> reduced_bodies;  // as `reduced`
    std::vector<mechanics::ModalLoad> modal_loads;
    // Of all joints' rows, then of attachments, those of reduced bodies last: number among those that are kept, −1:
    // left out.
    std::vector<std::int32_t> place_of_row;
    std::vector<std::int32_t> kept_rows;  // ascending
    std::optional<State> assembled;       // since assemble()
    std::optional<Assembly> assembly;
    std::vector<std::int32_t> first_kept_rows;                   // those of assemble()
    std::vector<mechanics::Linkage> redundant;                   // those with rows that are left out
    std::vector<std::int32_t> held_rows;                         // by other means: ascending
    std::optional<std::vector<mechanics::Linkage>> beside_held;  // likewise, where hold_rows() has been called
    std::vector<mechanics::MovingBody> moving;
    std::vector<BodyIndex> prescribed;  // bodies that move as they are told
    bool driven = false;                // MultibodySystem::is_driven()
    std::vector<BodyIndex> uneven;      // of these, those whose turning moves their surface
    bool gyroscopic = false;            // a moving body whose moments differ
    double load_factor = 1.0;           // of weight and loads
    double size = 0.0;                  // the median of the shapes that collide
    struct Extent {
        double largest, half_smallest;  ///< m; infinite of planes and terrains
    };
    std::vector<Extent> extents;     // of shapes
    PartNumbers numbers;             // of a part of another system; empty otherwise
    std::optional<double> recovery;  // likewise, m/s
    bool unilateral_whole = false;   // likewise: the other system has contacts or stops
    std::unique_ptr<CollisionDetector> detector;
    struct MeshTouching;
    std::shared_ptr<MeshTouching> mesh_touching;  // null: no two meshes can meet
    bool leaves_out = true;                       ///< what no contact needs

    // ---- Work space of the call that runs ----
    mutable mechanics::Placements at;
    mechanics::Placements
        at_state;  ///< before place_for_step() gave bodies with a given motion the means over the step
    mutable std::vector<mechanics::ModalPlacement> modal_at;  // of `reduced`
    mutable mechanics::RowVector gradient;
    mutable mechanics::RowMatrix hessian;
    mutable std::vector<double> generalized_force;
    std::vector<Pose> poses;                      // of the detector's bodies; those of fixed ones stay
    std::vector<BodyDisplacement> displacements;  // of the same; fixed ones have none
    /// What was detected last.
    struct Detected {
        std::vector<Pose> poses;
        std::vector<BodyDisplacement> displacements;
        std::vector<ContactPoint> contacts;
    } detected;

    std::vector<std::vector<Pose>> expected;  // of the detector's bodies, as expect_end() had them

    void must_be_finished() const;
    void must_not_be_finished() const;
    void check_body(BodyIndex body, const std::string& name) const;
    void check_node(std::int32_t node, std::string_view what) const;
    /// Throws InputError if there is no such node. what: names the element.
    template <std::size_t Nodes>
    [[nodiscard]] std::array<mechanics::Vector3d, Nodes> positions_of(const std::array<std::int32_t, Nodes>& named,
                                                                      std::string_view what) const;
    template <class Element>
    void share_mass(const Element& element);
    /// shape_of(nodes, positions) is the element's shape.
    template <class Element, class ShapeOf>
    void add_solid(std::vector<Element>& elements, ShapeOf shape_of, std::string_view what,
                   const std::array<std::int32_t, Element::size>& named, const ElasticMaterial& material,
                   ElementModel model);

    /// Placements of all bodies so far at t = 0, without columns.
    [[nodiscard]] mechanics::Placements initial_placements() const;
    /// Placements of a state; v may be null for what needs positions alone.
    void place(const double* q, const double* v, double t) const;
    void place(const State& state) const { place(state.q.data(), state.v.data(), state.t); }

    /// From now on q has the angle of the joint over whole turns. Before copies of the angle are made.
    void count_turns_of(std::int32_t joint);
    /// −k (C − target(t)) − c (Ċ − target˙(t)), C being the coordinate less `rest`; target may be null.
    void add_coordinate_spring(std::int32_t joint, bool turns, double stiffness, double damping, double rest,
                               const Motion* target, bool potential);
    /// What the parameters of a joint say of its coordinates.
    void add_joint_forces(std::int32_t joint);
    /// The kinetic energy of armatures; after place().
    [[nodiscard]] double energy_of_rotors() const;
    /// ċ of a coordinate, its ∂c/∂t among it; after place().
    [[nodiscard]] double rate_of(const mechanics::Row& coordinate) const;
    [[nodiscard]] mechanics::NodePlacement node_at(std::int32_t node, const double* q, const double* v) const;
    [[nodiscard]] mechanics::NodePlacement node_of_reduced(std::int32_t node, const double* q, const double* v) const;
    [[nodiscard]] std::size_t solids_count() const {
        return linear_tetrahedra.size() + quadratic_tetrahedra.size() + bricks.size();
    }
    /// Visits all elements with the placements of their nodes or bodies: visit(element, placements). After place().
    template <class Visitor>
    void for_each_element(const State& state, Visitor&& visit) const {
        const auto each = [&](const auto& elements) {
            for (const auto& element : elements) {
                std::array<mechanics::NodePlacement, std::decay_t<decltype(element)>::size> corners;
                for (std::size_t k = 0; k < corners.size(); ++k)
                    corners[k] = node_at(element.nodes()[k], state.q.data(), state.v.data());
                visit(element, corners);
            }
        };
        each(linear_tetrahedra);
        each(quadratic_tetrahedra);
        each(bricks);
        each(cables);
        for (const auto& beam : beams) visit(beam, mechanics::Beam::Ends{at[beam.bodies()[0]], at[beam.bodies()[1]]});
    }

    [[nodiscard]] bool find_driven() const;
    /// result (n) += factor · the forces of loads at this time; after place().
    void add_loads(double t, double factor, double* result) const;

    /// Visits the elements with a consistent mass: visit(element, placements of its ends). After place().
    template <class Visitor>
    void for_each_inertia(Visitor&& visit) const {
        for (const auto& inertia : beam_inertias)
            visit(inertia, mechanics::BeamInertia::Ends{at[inertia.bodies()[0]], at[inertia.bodies()[1]]});
    }

    /// Among the rows that are kept, −1 if it is left out.
    [[nodiscard]] std::int32_t place_of(const mechanics::Joint& joint, std::size_t i) const {
        return place_of_row[static_cast<std::size_t>(joint.first_row) + i];
    }
    /// D ← with the gradient of a row of a joint in its row `to`; at the placement of now.
    void add_gradient(const mechanics::Row& row, std::int32_t to, MatrixAssembler& D, double factor = 1.0) const;
    /// Visits the kept rows of all joints but gears: visit(row of C, Row).
    template <class Visitor>
    void for_each_row(Visitor&& visit) const {
        for (const auto& joint : joints)
            for (std::size_t i = 0; i < joint.rows.size(); ++i)
                if (const auto place = place_of(joint, i); place >= 0) visit(place, joint.rows[i]);
    }
    template <class Visitor>
    void for_each_gear(Visitor&& visit) const {
        for (const auto& joint : joints)
            if (const auto place = joint.gear ? place_of(joint, 0) : -1; place >= 0) visit(place, *joint.gear);
    }
    /// The rows of a linkage that are kept, or those that are left out, numbered within it.
    [[nodiscard]] std::vector<std::size_t> rows_of(const mechanics::Linkage& linkage, bool kept) const;
    /// Keeps these rows of a linkage, and all others as they are.
    void keep_of(const mechanics::Linkage& linkage, const std::vector<std::size_t>& rows);
    void number_rows();
    /// state ← with the kept rows of a linkage assembled, if they do not hold; done ← with what that changed since
    /// `given`. at_start: joints are where they start, and as fast. Throws InputError.
    void assemble(const mechanics::Linkage& linkage, const State& given, State& state, Assembly& done,
                  bool at_start) const;
    /// done ← with what differs between two states of a linkage.
    static void note_changes(const mechanics::Linkage& linkage, const State& given, const State& state, Assembly& done);
    void choose_turns_of_motors(State& state) const;

    /// Visits the attachments: visit(first row of C, Attachment, placement of its body).
    template <class Visitor>
    void for_each_attachment(Visitor&& visit) const {
        for (const auto& one : attachments)
            visit(place_of_row[static_cast<std::size_t>(one.first_row)], one, at[one.body]);
    }
    /// Puts attached nodes to where their bodies are, and gives them the velocity of that place; reduced bodies
    /// likewise, rigidly as far as that goes.
    void carry_nodes(State& state) const;

    /// Adds ω × r to the velocities of the nodes from `first` on that are not fixed, r being from their mass centre.
    void spin_nodes(std::int32_t first, const Vector3& angular_velocity);

    // ---- Reduced bodies (multibody_reduced.cpp) ----

    /// Whether `nodes` are of one reduced body: its number, or −1. Throws InputError if only some are.
    [[nodiscard]] std::int32_t reduced_of(const std::vector<std::int32_t>& nodes, const std::string& who) const;
    /// Throws InputError if the node is one of a reduced body.
    void must_have_columns(std::int32_t node, std::string_view what) const;
    void attach_reduced(const AttachmentParameters& parameters, std::int32_t index);
    /// Finds the modes, and numbers what they add.
    void reduce_bodies();
    void append_modal_start(State& state) const;
    void carry_reduced(State& state) const;
    void place_modal(const double* q, const double* v) const;
    [[nodiscard]] mechanics::ModalDynamics modal_dynamics(std::size_t index) const {
        return {reduced[index].model.inertia, modal_at[index]};
    }
    void add_modal_mass(const State& state, double factor, MatrixAssembler& M) const;
    void multiply_modal_mass(const State& state, double factor, const double* x, double* result) const;
    /// After place(), as all that follow.
    void add_modal_force(const State& state, double factor, double* result) const;
    void add_modal_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const;
    void add_modal_damping(double factor, Tangent tangent, MatrixAssembler& H) const;
    void add_modal_inertial_stiffness(const State& state, const double* acceleration, double factor, Tangent tangent,
                                      MatrixAssembler& H) const;
    /// Visits the attachments of reduced bodies: visit(first row of C, attachment, placement, placement of its body).
    template <class Visitor>
    void for_each_modal_attachment(Visitor&& visit) const {
        for (const auto& one : modal_attachments)
            visit(place_of_row[static_cast<std::size_t>(one.first_row)], one,
                  modal_at[static_cast<std::size_t>(one.reduced)], at[one.body]);
    }
    /// Calls visit(first column within the attachment's matrices, first column in v, count) for what moves.
    template <class Visitor>
    static void for_each_part(const mechanics::ModalPlacement& own, const mechanics::Placement& body, Visitor&& visit) {
        const auto count = static_cast<std::int32_t>(6 + own.s.size());
        visit(0, own.column, count);
        if (body.column >= 0) visit(count, body.column, 6);
    }

    /// The body of a shape or of a node contact, or the node: bodies first, nodes after them, −1 for the world.
    [[nodiscard]] std::int32_t owner_of(std::int32_t shape) const;
    /// A point of a body or node that may move.
    struct PointOfOwner {
        std::int32_t column;           ///< −1 if fixed
        const mechanics::Matrix3d* A;  ///< null for a node
        mechanics::Vector3d arm;       ///< from the mass centre, world frame
        mechanics::Vector3d center;    ///< what its velocity moves along a straight line: the mass centre, or the node
        const mechanics::ReducedSolid* reduced =
            nullptr;            ///< of a node of a reduced body, from whose centre the arm is
        Eigen::Index node = 0;  ///< its number in the mesh

        /// The entries of sign · direction · ṗ.
        void put(const mechanics::Vector3d& direction, double sign, UnilateralRows& rows) const;
    };
    [[nodiscard]] bool is_round_about_its_axis(BodyIndex prescribed_body) const;
    [[nodiscard]] PointOfOwner point_of(std::int32_t owner, const mechanics::Vector3d& point) const;
    /// The point of the axis, or the centre, below a point of a round surface with this normal; nothing for others.
    [[nodiscard]] std::optional<mechanics::Vector3d> axis_below(std::int32_t shape, const mechanics::Vector3d& point,
                                                                const mechanics::Vector3d& outward) const;
    /// Of a point of an owner's surface, its mean over a step of length h (s) as what has this center meets it; 0 where
    /// the owner's motion is not prescribed. since: UnilateralRows::since(). place_for_step() has been called.
    [[nodiscard]] mechanics::Vector3d prescribed_velocity(std::int32_t owner, const mechanics::Vector3d& point,
                                                          const mechanics::Vector3d& center, double since,
                                                          double h) const;
    /// The same at the state itself.
    [[nodiscard]] mechanics::Vector3d prescribed_velocity_now(std::int32_t owner,
                                                              const mechanics::Vector3d& point) const;
    /// Of the pair where it was given, else from both: the geometric mean of friction, the larger restitution.
    [[nodiscard]] ContactMaterial material_between(std::int32_t first, std::int32_t second) const;
    [[nodiscard]] Pose pose_of(std::size_t body, const State& state) const;
    /// The poses of all that collides, for the detector.
    /// place(), and bodies with a given motion as they move in a step of length h (s). Where there are such, `at_state`
    /// has their velocities at the state.
    void place_for_step(const State& state, double h);
    void place_shapes(const State& state);
    /// displacements ← of a step of length h (s).
    void predict_displacements(double h, const State& state);
    /// contacts ← also those on the ways to what is expected, of pairs of shapes that have none.
    void add_expected(std::vector<ContactPoint>& contacts, const sdk::Team& team) const;
    /// The contacts of `poses` and `displacements`, valid until the next call: `detected`, where that is of the same.
    const std::vector<ContactPoint>& detect(const sdk::Team& team);
    [[nodiscard]] std::vector<std::int32_t> solids() const;
    void make_detector();
    void make_mesh_contacts();
    /// The first node of a surface that touches other meshes.
    [[nodiscard]] std::int32_t first_node_of_surface(std::size_t surface) const;
    /// kind: 0, 1, … as MeshContact::Kind.
    [[nodiscard]] static std::uint64_t mesh_contact_key(int kind, const std::array<std::uint64_t, 3>& feature);
    void find_bodies_alone(const MultibodySystem& system);
    /// metric_mass and metric_inertia of all bodies.
    void make_metric();

    void collect_limits(double h, UnilateralRows& rows) const;
    void collect_frictions(UnilateralRows& rows) const;
    void collect_motors(double t, UnilateralRows& rows) const;
    void collect_actuators(double t, double h, UnilateralRows& rows) const;
    void collect_contacts(double h, UnilateralRows& rows);
    /// Appends the contacts between meshes, and their rows.
    void collect_mesh_contacts(const State& state, double h, UnilateralRows& rows);
};

}  // namespace delassus
