// SPDX-License-Identifier: BSD-3-Clause
// Multibody systems: rigid bodies, point nodes, joints, motors, springs, elements, contact. SI units.
//
// A moving body has 7 positions (mass centre, unit quaternion w x y z) and 6 velocities (of the mass centre in the
// world frame, angular velocity in the body frame). A node has 3 and 3. Fixed ones have none. A reduced body has as
// many more as it has modes, after those. Bodies come first, then nodes, then reduced bodies. At the end of q stand
// angles of joints (MultibodySystem::angle_position()).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "delassus/collision.hpp"
#include "delassus/dynamical_system.hpp"
#include "delassus/export.hpp"
#include "delassus/mesh_files.hpp"

namespace delassus {

/// Number of a body, −1 for the world.
using BodyIndex = std::int32_t;
inline constexpr BodyIndex world_body = -1;

/// The inertia tensor about the mass centre in the body frame: xx, yy, zz, xy, xz, yz, kg m².
struct Inertia {
    double xx = 1.0, yy = 1.0, zz = 1.0, xy = 0.0, xz = 0.0, yz = 0.0;

    DELASSUS_API static Inertia sphere(double mass, double radius);
    /// edges: full lengths along x, y, z.
    DELASSUS_API static Inertia box(double mass, const Vector3& edges);
    /// Along z, with half length.
    DELASSUS_API static Inertia cylinder(double mass, double radius, double half_length);
    /// A thin rod along x.
    DELASSUS_API static Inertia rod(double mass, double length);
};

/// How Motion::table goes from value to value.
enum class Interpolation {
    Linear,
    Cubic  ///< the cubic spline; its slopes at the ends are 0, or those of its period
};

/// A prescribed function of time with two derivatives and its integral from zero. An empty one is zero.
struct Motion {
    std::function<double(double)> value, rate, acceleration;
    std::function<double(double)> integral;  ///< needed of the speed of a motor without force limit
    std::vector<double> corners = {};        ///< ascending times where a value or a derivative of these jumps, s
    double period = 0.0;                     ///< after which the corners repeat, s; 0: they do not
    /// Whether nothing but t decides the functions, and whether they are smooth between the corners: those made below
    /// are. Where a motion is not, no step looks ahead of what is shown.
    bool foreseeable = false;
    double oscillation_period = 0.0;  ///< s; 0: the functions do not oscillate
    double ramp_duration = 0.0;       ///< s, from the first corner on; 0: the functions are no ramp
    bool is_constant = false;         ///< the value never changes; of constant() alone
    DELASSUS_API static Motion constant(double value);
    DELASSUS_API static Motion linear(double start, double rate);
    /// offset + amplitude sin(2π frequency t + phase)
    DELASSUS_API static Motion sine(double amplitude, double frequency, double phase = 0.0, double offset = 0.0);
    /// Two or more values at ascending times, and between them. Before and after, the first and the last value are
    /// kept; if periodic, everything repeats, and the last value must be the first. Throws InputError.
    DELASSUS_API static Motion table(const std::vector<double>& times, const std::vector<double>& values,
                                     Interpolation interpolation = Interpolation::Linear, bool periodic = false);
    /// Σ coefficients[k] t^k
    DELASSUS_API static Motion polynomial(const std::vector<double>& coefficients);
    /// From one value to another within `duration` (s, > 0) after `start`: with a continuous rate (smoothness 1) or
    /// second derivative (2).
    DELASSUS_API static Motion ramp(double from, double to, double start, double duration, int smoothness = 2);
};

/// Moves a body along a given way: turned by an angle about an axis through a point, then moved. Beginning at its pose.
struct BodyMotion {
    std::array<Motion, 3> translation;  ///< m, world frame
    Motion angle;                       ///< rad
    Vector3 axis{0.0, 0.0, 1.0};        ///< world frame; need not be a unit vector
    std::optional<Vector3> point;       ///< world frame; none: the body's position
};

/// A rigid body.
struct BodyParameters {
    std::string name;
    double mass = 1.0;  ///< > 0
    Inertia inertia;    ///< positive definite, principal moments with the triangle inequality
    Pose pose;
    Vector3 velocity{};          ///< of the mass centre, world frame
    Vector3 angular_velocity{};  ///< body frame
    bool fixed = false;
    /// Neither mass nor inertia, which do not count then: a piece between two joints. Joint coordinates alone take it
    /// (needs_joint_coordinates()): a joint of a tree must hold it, and what it carries must have mass.
    bool massless = false;
    /// The body is kinematic: it takes part in contacts and joints, and nothing that they do moves it. Mass, inertia
    /// and velocities do not count then. MultibodySystem::body() has the pose at t = 0.
    std::optional<BodyMotion> motion;
};

/// A point mass.
struct NodeParameters {
    std::string name;
    double mass = 0.0;  ///< ≥ 0, in addition to what elements give it; together > 0
    Vector3 position{};
    Vector3 velocity{};
    bool fixed = false;
};

enum class JointKind {
    Spherical,     ///< 3 rows: the points coincide
    Revolute,      ///< 5 rows: rotation about the axis
    Prismatic,     ///< 5 rows: translation along the axis
    Cylindrical,   ///< 4 rows: both along one axis
    Universal,     ///< 4 rows: axis of the first body normal to second_axis of the second
    Fixed,         ///< 6 rows
    Planar,        ///< 3 rows: as PointOnPlane, and the axis stays normal to the plane
    PointOnPlane,  ///< 1 row: the point of the second body stays in the plane through the point, normal to the axis, of
                   ///< the first
    Distance,      ///< 1 row: the points keep their initial distance
    Gear           ///< 1 row: the coordinates of two revolute joints, or of two prismatic ones, keep a ratio
};

/// A coordinate of a joint, 0 where the bodies are given: what acts in it beside reactions (a linear spring and damper,
/// and dry friction that holds it still as long as a force within its bound can; all ≥ 0 but `rest`), and how it
/// starts.
struct JointCoordinate {
    double damping = 0.0;    ///< N s/m along an axis, N m s/rad about one
    double stiffness = 0.0;  ///< N/m or N m/rad
    double rest = 0.0;       ///< the coordinate at which the spring is at rest, m or rad; turns are counted
    double friction = 0.0;   ///< N or N m
    /// The inertia of a rotor behind a gear, which turns with the coordinate and adds ½ armature ċ² to the kinetic
    /// energy: kg or kg m². Joint coordinates alone take it (needs_joint_coordinates()).
    double armature = 0.0;
    /// Where MultibodySystem::assemble() puts it and how fast it moves then: m and m/s, or rad and rad/s, whole turns
    /// counted. Without a value it is as the bodies are given.
    std::optional<double> start = std::nullopt, start_rate = std::nullopt;
};

/// A joint holds from the initial configuration on: its frames are given once, in the world frame at t = 0.
struct JointParameters {
    std::string name;
    JointKind kind = JointKind::Spherical;
    BodyIndex first = world_body, second = world_body;
    Vector3 point{};                                 ///< world frame at t = 0; of the first body for Distance
    Vector3 second_point{};                          ///< of the second body, Distance only
    Vector3 axis{0.0, 0.0, 1.0};                     ///< need not be a unit vector
    Vector3 second_axis{1.0, 0.0, 0.0};              ///< Universal only
    std::int32_t gear_first = -1, gear_second = -1;  ///< indices of two revolute or two prismatic joints; Gear only
    /// Coordinate of the second = ratio · coordinate of the first; of angles a fraction with terms below 1000.
    double gear_ratio = 1.0;
    /// Limits of the coordinate of a revolute (rad, whole turns counted) or prismatic (m) joint; not a number: none.
    double lower, upper;
    JointCoordinate slide;  ///< along the axis; Prismatic and Cylindrical
    JointCoordinate turn;   ///< about the axis; Revolute and Cylindrical; Spherical and Universal: damping alone, of
                            ///< the relative angular velocity; Spherical also armature, against any turning
    DELASSUS_API JointParameters();
};

/// Drives the coordinate of a revolute or prismatic joint.
struct MotorParameters {
    std::string name;
    std::int32_t joint = -1;
    bool speed = false;  ///< motion is the speed; else the position
    Motion motion;
    double force_limit;  ///< N or Nm, speed motors only; infinity: a bilateral constraint
    DELASSUS_API MotorParameters();
};

/// A servo at the coordinate c of a revolute or prismatic joint, with the force or torque
///     kp (position(t) − c) + kd (speed(t) − ċ),
/// cut off at the limit. It is taken at the end of each step, so that any gains are stable.
struct ActuatorParameters {
    std::string name;
    std::int32_t joint = -1;
    Motion position;     ///< m or rad, over whole turns; needed where kp > 0
    Motion speed;        ///< m/s or rad/s; empty: the rate of `position`
    double kp = 0.0;     ///< N/m or N m/rad, ≥ 0
    double kd = 0.0;     ///< N s/m or N m s/rad, ≥ 0; one of the two > 0
    double force_limit;  ///< N or N m, ≥ 0; infinity: none. With a limit it is a box row, for steppers that take those
    DELASSUS_API ActuatorParameters();
};

/// A spring and damper between two points: force k (ℓ − ℓ₀) + c dℓ/dt along the line.
struct SpringParameters {
    std::string name;
    BodyIndex first = world_body, second = world_body;
    Vector3 first_point{}, second_point{};  ///< world frame at t = 0
    double stiffness = 0.0, damping = 0.0;  ///< N/m, N s/m; ≥ 0
    double rest_length;                     ///< m; not a number: the initial distance
    DELASSUS_API SpringParameters();
};

/// A linear spring and damper for all six relative motions of two bodies at a point, in the axes of the first body.
struct BushingParameters {
    std::string name;
    BodyIndex first = world_body, second = world_body;
    Vector3 point{};
    Vector3 stiffness{}, damping{};            ///< along x, y, z: N/m, N s/m
    Vector3 turn_stiffness{}, turn_damping{};  ///< about x, y, z: Nm/rad, Nms/rad
};

/// A node and its part of a force.
struct NodeShare {
    std::int32_t node = -1;
    double share = 1.0;
};

/// Nodes that a body carries: each stays where it is in the body's frame at t = 0. Holds elastic bodies by rigid ones.
/// Of a reduced body the nodes are an interface, which moves with the body as a whole.
struct AttachmentParameters {
    std::string name;
    std::vector<std::int32_t> nodes;
    BodyIndex body = world_body;  ///< of a fixed body, or the world, the nodes become fixed
};

/// A force on a body, or on nodes; a torque on a body. Given in time.
struct LoadParameters {
    std::string name;
    BodyIndex body = world_body;
    std::vector<NodeShare> nodes;  ///< in place of a body; the force is constant in the world frame then
    std::array<Motion, 3> force;   ///< at the point, world frame, N
    std::array<Motion, 3> torque;  ///< world frame, Nm
    Vector3 point{};               ///< world frame at t = 0; moves with the body
    bool follower = false;         ///< force and torque are in the body's frame, and turn with it
};

/// An isotropic elastic material.
struct ElasticMaterial {
    double young = 1e6;         ///< Pa, > 0
    double poisson = 0.3;       ///< in (−1, ½)
    double density = 1000.0;    ///< kg/m³, > 0
    double damping_time = 0.0;  ///< τ of Kelvin–Voigt damping, s: viscosity = τ × elasticity
    double damping_rate = 0.0;  ///< α, 1/s: −α m v at the nodes of solids. With τ, Rayleigh's damping α M + τ K
};

enum class ElementModel {
    Corotational,      ///< linear strain in a frame that turns with the element
    StVenantKirchhoff  ///< Green's strain with Hooke's law; weak under strong compression
};

/// Of the displacements in an element. Elements of order 1 are far too stiff in bending until they are small.
enum class ElementOrder { Linear = 1, Quadratic = 2 };

/// A block of bricks, each of six tetrahedra around a diagonal (Kuhn's division, which fits from brick to brick).
/// Linear tetrahedra of a brick share their mean change of volume.
struct ElasticBlock {
    std::string name;
    Vector3 corner{};                            ///< of the least coordinates, m
    Vector3 edges{1.0, 1.0, 1.0};                ///< m, > 0
    std::array<std::int32_t, 3> cells{1, 1, 1};  ///< bricks along x, y, z
    ElasticMaterial material;
    ElementModel model = ElementModel::Corotational;
    ElementOrder order = ElementOrder::Quadratic;
    std::array<bool, 6> fixed_faces{};  ///< x_min, x_max, y_min, y_max, z_min, z_max: their nodes do not move
    Vector3 velocity{};                 ///< m/s
    /// m; nodes of the surface touch bodies as spheres of this radius, and surfaces of two meshes touch at the sum of
    /// their radii; 0: not at all.
    double contact_radius = 0.0;
    std::int32_t contact_material = -1;
    Vector3 angular_velocity{};  ///< about its mass centre, world frame, rad/s; for nodes that are not fixed
};

/// A box with edges along the axes, m.
struct AlignedBox {
    Vector3 lower{}, upper{};
};

/// An elastic body of the tetrahedra of a mesh.
struct ElasticMeshParameters {
    std::string name;
    TetrahedralMesh mesh;
    Pose pose;  ///< of the mesh's frame
    ElasticMaterial material;
    ElementModel model = ElementModel::Corotational;
    ElementOrder order = ElementOrder::Quadratic;
    std::vector<AlignedBox> fixed_boxes;  ///< world frame at t = 0: the nodes in them do not move
    Vector3 velocity{};                   ///< m/s
    double contact_radius = 0.0;          ///< as in ElasticBlock
    std::int32_t contact_material = -1;
    Vector3 angular_velocity{};  ///< likewise
};

/// An elastic body of few modes (Craig and Bampton) in a frame that moves as a rigid body: for small deformations and
/// any motion. Its interfaces are what add_attachment() holds, and the fixed faces or boxes of the solid. The modes
/// are: six for each interface but the first, `modes` vibrations with all interfaces held, and three for each component
/// of a load on its nodes and each interface of a single node.
struct ReducedBodyParameters {
    std::variant<ElasticBlock, ElasticMeshParameters> solid;
    std::int32_t modes = 10;  ///< ≥ 0
};

/// A reduced body of a finished system. Its velocities are that of the mass centre (world frame), the angular velocity
/// (body frame) and the rates of the k amplitudes s; its positions are the mass centre, a unit quaternion and s. A node
/// at the place X has moved to X + Φ s in the frame, which has the axes of the world at t = 0.
struct ReducedBody {
    std::string name;
    std::int32_t first_node = 0;
    std::int32_t position = 0, column = 0;  ///< first entries in q and v
    double mass = 0.0;                      ///< kg
    std::vector<double> frequencies;        ///< of the free body, Hz, ascending; k
    std::vector<Vector3> places;            ///< X of each node, m
    std::vector<double> shapes;  ///< Φ: x, y, z of each node, mode after mode; Σ m Φ² = mass, so that s is in m
};

/// An elastic cable between two nodes.
struct CableParameters {
    std::string name;
    std::array<std::int32_t, 2> nodes{-1, -1};
    double young = 1e9;         ///< Pa
    double area = 1e-4;         ///< m²
    double density = 1000.0;    ///< kg/m³
    double damping_time = 0.0;  ///< s
    double rest_length;         ///< m; not a number: the initial distance
    bool slack = true;          ///< carries no compression
    DELASSUS_API CableParameters();
};

/// The section of a beam in its axes: x along the beam, y and z principal axes of the section.
struct BeamSection {
    double area, inertia_y, inertia_z;  ///< A; ∫z² dA (bending about y); ∫y² dA (about z): m², m⁴, > 0
    double torsion;                     ///< Saint-Venant's constant J, m⁴, > 0
    double shear_area_y, shear_area_z;  ///< m², > 0; infinite: no shear (Euler and Bernoulli)
    /// width along y, height along z (m); shear areas 5/6 of the area; torsion within 0.5 % (Roark's formula).
    DELASSUS_API static BeamSection rectangle(double width, double height);
    /// Shear areas 9/10 of the area.
    DELASSUS_API static BeamSection circle(double radius);
};

/// A straight elastic beam between two bodies, unstressed at t = 0, for any displacement and for turns of its ends
/// against each other by less than π. It has no mass: its bodies have.
struct BeamParameters {
    std::string name;
    BodyIndex first = world_body, second = world_body;
    Vector3 first_point{}, second_point{};  ///< its ends: world frame at t = 0, kept by the bodies
    Vector3 section_y{};                    ///< near the y axis of the section; (0, 0, 0): any
    BeamSection section = BeamSection::rectangle(0.01, 0.01);
    ElasticMaterial material;  ///< its density is not used
};

/// What the inertia of a beam follows from.
enum class BeamMass {
    Lumped,     ///< each body's share: M is diagonal by bodies; frequencies converge with order 2
    Consistent  ///< the kinetic energy of the displacements in an element: M couples its ends; order 4 in bending
};

/// A straight beam of equal elements with a body at each node, that has its share of the mass and of the section's
/// inertia. Bodies are named name_0, name_1, …; their x axis is along the beam.
struct ElasticBeamParameters {
    std::string name;
    Vector3 from{}, to{1.0, 0.0, 0.0};  ///< m
    std::int32_t elements = 10;         ///< ≥ 1
    Vector3 section_y{};                ///< as in BeamParameters
    BeamSection section = BeamSection::rectangle(0.01, 0.01);
    ElasticMaterial material;
    BeamMass mass = BeamMass::Lumped;
    bool fixed_from = false, fixed_to = false;  ///< whether the body at that end is fixed
    Vector3 velocity{};                         ///< of the end `from`, m/s; the beam moves as a rigid body at the start
    Vector3 angular_velocity{};                 ///< world frame, rad/s
};

/// How surfaces act in contact.
struct ContactMaterial {
    double friction = 0.0;     ///< μ ≥ 0
    double restitution = 0.0;  ///< in [0, 1]
    bool touch = true;         ///< of a pair: whether shapes of these materials touch at all
};

/// Two bodies whose shapes overlap.
struct BodyOverlap {
    BodyIndex a, b;    ///< a < b
    double depth;      ///< of the deepest contact, m, > 0
    double extent;     ///< the largest one of the smaller shape that touches, m
    double thickness;  ///< half of the smallest extent of the thinner one, m; infinite of planes and terrains
};

/// What MultibodySystem::assemble() changed.
struct Assembly {
    // The largest change of a body:
    double displacement = 0.0, rotation = 0.0;      ///< m, rad
    double velocity = 0.0, angular_velocity = 0.0;  ///< m/s, rad/s
    /// The largest change of a position: in sizes of its linkage, or in rad.
    double position_share = 0.0;
    /// The largest change of velocities that were given, not 0, over the largest velocity of the linkage.
    double velocity_share = 0.0;
    /// The same of all velocities: 1 where motors set bodies in motion that were at rest.
    double velocity_share_of_all = 0.0;
};

/// Built by add_…(), which check their input (InputError with one sentence), and completed by finish(). From then on it
/// serves as a DynamicalSystem.
class DELASSUS_API MultibodySystem : public DynamicalSystem {
public:
    MultibodySystem();
    ~MultibodySystem() override;

    void set_gravity(const Vector3& gravity);  ///< m/s²; (0, 0, −9.81) unless set
    BodyIndex add_body(const BodyParameters& body);
    /// Returns the node's number, which counts apart from bodies.
    std::int32_t add_node(const NodeParameters& node);
    std::int32_t add_joint(const JointParameters& joint);
    void add_motor(const MotorParameters& motor);
    void add_actuator(const ActuatorParameters& actuator);
    void add_spring(const SpringParameters& spring);
    void add_bushing(const BushingParameters& bushing);
    void add_load(const LoadParameters& load);
    /// Three rows for each node of a body that moves, after those of all joints. At the start the nodes move with the
    /// body. Nodes do not touch the body that carries them. Of a reduced body six rows hold all nodes together, or
    /// three a single node, also where the other body is fixed. Throws InputError if a node is fixed or attached
    /// already.
    void add_attachment(const AttachmentParameters& attachment);
    /// A tetrahedron with linear displacements between four nodes, its mass shared among them. Throws InputError if it
    /// is inverted.
    void add_tetrahedron(const std::array<std::int32_t, 4>& nodes, const ElasticMaterial& material,
                         ElementModel model = ElementModel::Corotational);
    /// One with quadratic displacements: its corners, then the nodes in the middles of the edges between the corners
    /// 0 and 1, 0 and 2, 0 and 3, 1 and 2, 1 and 3, 2 and 3. Of the mass 1/36 goes to a corner and 4/27 to a middle.
    void add_quadratic_tetrahedron(const std::array<std::int32_t, 10>& nodes, const ElasticMaterial& material,
                                   ElementModel model = ElementModel::Corotational);
    /// Six linear tetrahedra that share their mean change of volume. The corner at (x, y, z), each 0 or 1, has the
    /// place 4 x + 2 y + z.
    void add_brick(const std::array<std::int32_t, 8>& nodes, const ElasticMaterial& material,
                   ElementModel model = ElementModel::Corotational);
    /// Returns the number of its first node, at the corner. Nodes are numbered with z fastest and x slowest; with
    /// quadratic elements there are two along each edge of a brick.
    std::int32_t add_elastic_block(const ElasticBlock& block);
    /// Returns the number of its first node; nodes are numbered as the vertices of the mesh. Those in the middles of
    /// edges follow.
    std::int32_t add_elastic_mesh(const ElasticMeshParameters& body);
    /// Returns the number of its first node; nodes are those of the mesh. They can be attached and loaded, and touch
    /// shapes of bodies. They have no columns of their own, and take no element and no cable. finish() finds the modes,
    /// and throws InputError where there are none to find.
    std::int32_t add_reduced_body(const ReducedBodyParameters& body);
    void add_cable(const CableParameters& cable);
    void add_beam(const BeamParameters& beam);
    /// Returns the number of its first body, at `from`; the others follow.
    BodyIndex add_elastic_beam(const ElasticBeamParameters& beam);
    /// Whether a beam has a consistent mass: M is not diagonal by bodies then.
    [[nodiscard]] bool has_consistent_mass() const;
    /// What only joint coordinates take, as the beginning of a sentence: a massless body or an armature; empty:
    /// nothing.
    [[nodiscard]] std::string needs_joint_coordinates() const;
    /// M += factor · a mass matrix in which massless bodies have the mass of what they carry: for estimates and for
    /// searches in which the mass is a metric and no more.
    void add_metric(double factor, MatrixAssembler& M) const;
    /// shape.body names the body; material indexes what add_material() returned.
    void add_shape(const Shape& shape, std::int32_t material);
    /// A node touches shapes of bodies as a small sphere. radius: m, > 0. The outer sides of tetrahedra whose nodes all
    /// touch are surfaces that touch those of other meshes, where the distance is the sum of the radii; elements that
    /// share nodes are one mesh, and a mesh does not touch itself. Nodes touch no nodes.
    void add_node_contact(std::int32_t node, double radius, std::int32_t material);
    std::int32_t add_material(const ContactMaterial& material);
    /// Contacts of these two materials, or none. Unless set: the geometric mean of μ, the larger restitution. Nodes
    /// have their contacts in any case.
    void set_material_pair(std::int32_t first, std::int32_t second, const ContactMaterial& material);
    /// m; how near shapes must be for a contact to be made. Unless set: a twentieth of the median shape's size.
    void set_envelope(double envelope);
    /// These two bodies never touch. Joined bodies never touch in any case.
    void keep_apart(BodyIndex first, BodyIndex second);
    /// Gives contacts without friction three rows, a cone with μ = 0, and loads the collision library even if nothing
    /// can touch: the reference for what leaving these out saves. Call it before finish().
    void leave_nothing_out();
    /// Numbers what moves; call it once, after the last add_…().
    void finish();

    [[nodiscard]] const Vector3& gravity() const;  ///< m/s²

    /// Multiplies weight and loads from now on; 1 unless set. For load stepping; after finish().
    void set_load_factor(double factor);
    /// Replaces initial_state(); after assemble().
    void set_start(const State& state);
    /// Grows whenever the gravity, the load factor or the kept rows are set: what was found before may not hold.
    [[nodiscard]] std::uint64_t revision() const;

    // ---- When what is prescribed is not smooth ----
    /// The first time after t, s, at which a motion of a motor, actuator, load or body has a corner; infinity if there
    /// is none.
    [[nodiscard]] double next_corner(double t) const;
    [[nodiscard]] double next_jump(double t) const override;
    /// A quarter of the shortest period of a motion that oscillates; and 1 rad of a body whose shapes are not round
    /// about the axis about which it turns by its motion.
    [[nodiscard]] double longest_step(double t) const override;
    /// Whether a motion of a motor, actuator, load or body is not Motion::is_constant. A motor of constant speed does
    /// not count: as long as it turns its joint, states differ.
    [[nodiscard]] bool depends_on_time() const override;
    /// Whether all these motions are Motion::foreseeable.
    [[nodiscard]] bool foreseeable() const;

    // ---- Reading states ----
    [[nodiscard]] std::int32_t body_count() const;
    [[nodiscard]] std::int32_t node_count() const;
    [[nodiscard]] Vector3 node_position(const State& state, std::int32_t node) const;
    [[nodiscard]] Vector3 node_velocity(const State& state, std::int32_t node) const;  ///< m/s
    [[nodiscard]] const std::vector<ReducedBody>& reduced_bodies() const;              ///< since finish()
    /// Triangles of nodes that bound the tetrahedra, counter-clockwise from outside.
    [[nodiscard]] std::vector<std::array<std::int32_t, 3>> element_surface() const;
    /// What a force of one unit, spread evenly over the outer sides of elements whose corners lie in the box at t = 0,
    /// gives to each node: the integrals of the shape functions. Sides between nodes first … first + count − 1 only.
    /// Throws InputError if there are none.
    [[nodiscard]] std::vector<NodeShare> spread_over_sides(std::int32_t first, std::int32_t count,
                                                           const AlignedBox& box) const;
    /// Those of the nodes first … first + count − 1 that lie in the box at t = 0, ascending.
    [[nodiscard]] std::vector<std::int32_t> nodes_in(std::int32_t first, std::int32_t count,
                                                     const AlignedBox& box) const;
    /// Replaces the velocity at t = 0 of those of these nodes that are not fixed (m/s); before finish(). Throws
    /// InputError if all of them are fixed.
    void set_initial_velocity(const std::vector<std::int32_t>& nodes, const Vector3& velocity);
    /// Nodes that no tetrahedron holds, ascending.
    [[nodiscard]] std::vector<std::int32_t> loose_nodes() const;
    /// The two nodes of each cable.
    [[nodiscard]] std::vector<std::array<std::int32_t, 2>> cables() const;
    /// First entry of a node in v, −1 if it is fixed; of a body likewise.
    [[nodiscard]] std::int32_t node_column(std::int32_t node) const;
    [[nodiscard]] std::int32_t body_column(BodyIndex index) const;
    [[nodiscard]] const BodyParameters& body(BodyIndex index) const;
    [[nodiscard]] std::int32_t joint_count() const;
    [[nodiscard]] const JointParameters& joint(std::int32_t index) const;
    /// The coordinate of a revolute or cylindrical joint (its angle, rad; whole turns counted where something acts on
    /// it, else in (−π, π]) or of a prismatic one (m), 0 where the bodies are given, and its rate. After finish().
    /// Throws InputError of other kinds.
    [[nodiscard]] std::array<double, 2> joint_coordinate(const State& state, std::int32_t joint) const;
    [[nodiscard]] BodyIndex find_body(const std::string& name) const;  ///< world_body if there is none
    [[nodiscard]] Pose pose(const State& state, BodyIndex index) const;
    /// Velocity of the mass centre (world frame) and angular velocity (body frame).
    [[nodiscard]] std::array<Vector3, 2> velocities(const State& state, BodyIndex index) const;
    /// Of bodies; the spheres of nodes are not among them.
    [[nodiscard]] const std::vector<Shape>& shapes() const;
    /// What set_envelope() was given, m.
    [[nodiscard]] std::optional<double> given_envelope() const;
    /// m, since finish(): how near shapes must be for a contact at most, and their median size; 0 where none can touch.
    [[nodiscard]] double envelope() const;
    [[nodiscard]] double size_of_shapes() const;
    /// m: the largest extent of a body's shapes, of planes and terrains apart; 0 if it has no others.
    [[nodiscard]] double extent_of_shapes(BodyIndex body) const;
    /// Bodies that overlap at a state, by pairs, ascending; h (s): of the step that begins there. Not those of nodes.
    /// team: threads that may share the work.
    void collect_overlaps(const State& state, double h, const sdk::Team& team, std::vector<BodyOverlap>& overlaps);
    /// That of a contact alone; of depth 0 where its gap is open, or it is one of nodes.
    [[nodiscard]] BodyOverlap overlap_of(const ContactPoint& contact) const;
    /// From now on collect_unilateral() also has the contacts of shapes that would meet on straight ways to where
    /// bodies and nodes are at `end`: a step that led there had no rows for what its own reactions made bodies meet.
    void expect_end(const State& end);
    /// No longer.
    void expect_nothing();
    /// Whether shapes or nodes could meet, so that contacts are looked for; after finish().
    [[nodiscard]] bool detects_contacts() const;
    /// Whether some of them bounce: materials that touch have restitution.
    [[nodiscard]] bool restitutes() const;
    /// Rows of joint `index` within all_constraints() and all_multipliers(): first row and count.
    [[nodiscard]] std::array<std::int32_t, 2> joint_rows(std::int32_t index) const;

    // ---- Assembly, and rows that others imply ----
    /// Makes the start consistent, after finish(): puts joints to their `start` and `start_rate`, which moves all that
    /// the joint carries, seen from the ground or from the first body of a free mechanism; leaves out rows of joints
    /// that others imply in every configuration (docs/mechanics.md), moves joined bodies by the least change (in the
    /// metric of the mass) to where C(q, 0) = 0, and changes velocities by the least to where C_q v + C_t = 0. A start
    /// that is consistent up to rounding keeps its bits. initial_state() then is the result, and C, its derivatives,
    /// constraint_blocks() and λ speak of the rows that are kept. Later calls keep the first rows again and change
    /// nothing else. Throws InputError, and names a joint, if there is no such position or velocity, or if a joint with
    /// a start closes a loop: then others decide where it is.
    const Assembly& assemble();
    /// Rows of all joints and motors, kept or not, and after them of attachments.
    [[nodiscard]] std::int32_t constraint_rows() const;
    /// Their numbers, ascending; all until assemble().
    [[nodiscard]] const std::vector<std::int32_t>& kept_rows() const;
    /// Keeps these rows; ascending. Timesteppers made before do not know.
    void keep_rows(const std::vector<std::int32_t>& rows);
    /// After assemble(), which undoes it: these rows hold by other means from now on, as by coordinates of joints.
    /// Keeps of all others enough that the rest holds wherever these and they do, and no more. held: rows of trees of
    /// joints, ascending.
    void hold_rows(const std::vector<std::int32_t>& held);
    /// Chooses anew which rows to keep, if those that are kept nearly depend on each other at this state and others do
    /// not, or if rows that were left out no longer hold; moves the state to where the new ones hold. Returns whether
    /// it did: then timesteppers must be made anew. Throws StepFailure where rows that are left out no longer hold and
    /// no others are better. step: steps taken so far; linkages of m rows are looked at every 10 (1 + m²/2000) steps,
    /// and where left-out rows have drifted.
    bool renew_rows(State& state, std::int64_t step);
    /// C of all rows, kept or not; constraint_rows().
    void all_constraints(const State& state, double* C) const;
    /// D += C_q of all rows of joints, kept or not, but those of gears; constraint_rows() × n().
    void add_joint_jacobian(const State& state, MatrixAssembler& D) const;
    // ---- Whole turns of joints: two orientations do not tell them ----
    /// Where q has the angle of a revolute or cylindrical joint, rad, whole turns counted, 0 where the bodies are
    /// given; without what bodies whose motion is prescribed have turned it by. −1: nothing acts on that angle.
    [[nodiscard]] std::int32_t angle_position(std::int32_t joint) const;
    /// The angles of `result` ← those of q, δ (n()) further, at the bodies of `result`. increment() does it.
    void add_turns(const double* q, const double* delta, double* result) const;
    /// Sets the angles in q to those of the bodies, each to the value nearest to what it was. Increments know no time,
    /// so that at a body whose motion is prescribed they leave what a method's steps miss.
    void settle_turns(State& state) const;

    /// λ of all rows from that of those that are kept: 0 in the others.
    [[nodiscard]] std::vector<double> all_multipliers(const std::vector<double>& kept) const;
    /// Names of the joints with rows that others imply and that are left out, ascending by joint.
    [[nodiscard]] std::vector<std::string> joints_with_rows_left_out() const;

    /// The spheres of nodes have the numbers from shapes().size() on, in the order of add_node_contact(); after them
    /// come the surfaces of meshes, in the order of their first nodes.
    /// The bodies of a contact's first and its second shape, or body_count() + number of a node: of a surface its first
    /// node. world_body for the world.
    [[nodiscard]] std::array<std::int32_t, 2> contact_bodies(const ContactPoint& contact) const;
    [[nodiscard]] double kinetic_energy(const State& state) const;
    /// How many elastic solids are turned inside out somewhere, which no material can be.
    [[nodiscard]] std::int64_t inverted_solids(const State& state) const;
    /// Linear momentum (kg m/s), and angular momentum about the origin (kg m²/s), world frame.
    [[nodiscard]] std::array<Vector3, 2> momentum(const State& state) const;

    // ---- Some bodies of another system ----
    /// Numbers in the other system, ascending, of what this one has in the same order.
    struct PartNumbers {
        std::vector<std::int32_t> shapes, joints;
        std::vector<std::int32_t> motors, actuators;  ///< those with a force limit, counted among such
        std::vector<BodyIndex> touched;               ///< of this system: others may touch them that are not in it
    };
    /// After finish(), of a system of some bodies of `whole`: takes the scales of the whole for its own (the envelope,
    /// the resolution of gaps, the speed of recovery), and gives its unilateral blocks the keys that they have there.
    void be_part_of(const MultibodySystem& whole, PartNumbers numbers);
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
    void add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    void add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    void add_gyroscopic_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const override;
    [[nodiscard]] std::vector<std::int32_t> vectors() const override;
    /// Bodies, reduced ones among them, and nodes, numbered as their columns follow one another.
    [[nodiscard]] std::vector<std::int32_t> bodies_of_columns() const override;
    void free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const override;
    void add_inertial_stiffness(const State& state, const double* acceleration, double factor, Tangent tangent,
                                MatrixAssembler& H) const override;
    [[nodiscard]] bool has_stiffness() const override;
    /// Among `springs` and the six of each `bushing`, as if no joint held their bodies.
    void find_stiff_forces(double rate, std::vector<std::int32_t>& stiff) const override;
    /// k and c of one of these, N/m and N s/m, or Nm/rad and Nms/rad.
    [[nodiscard]] std::array<double, 2> stiff_force_constants(std::int32_t number) const;
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
    void add_definite_constraint_stiffness(const State& state, const double* lambda, double factor,
                                           MatrixAssembler& H) const override;
    [[nodiscard]] bool has_unilateral() const override;
    void collect_unilateral(const State& state, double h, UnilateralRows& rows) override;
    bool collect_contact(const SmoothMotion& motion, double time, const ContactPoint& contact,
                         UnilateralRows& rows) override;
    [[nodiscard]] std::optional<Vector3> prescribed_velocity(const ContactPoint& contact, double begin,
                                                             double t) const override;
    /// A hundredth of √(g s), the speed that a fall through s gives but for a factor, s being the median size of the
    /// shapes; without gravity, of the fastest speed at the start; where nothing moves, of s a second.
    [[nodiscard]] double recovery_speed() const override;
    [[nodiscard]] double free_fall() const override;
    /// 1e-9 of the median size of the shapes.
    [[nodiscard]] double gap_resolution() const override;
    [[nodiscard]] double energy(const State& state) const override;
    [[nodiscard]] double supplied_power(const State& state) const override;
    [[nodiscard]] bool is_driven() const override;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
