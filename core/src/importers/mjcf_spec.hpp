// SPDX-License-Identifier: BSD-3-Clause
// What an MJCF model says, with its defaults, frames, includes and attachments resolved. Lengths in m, angles in rad;
// each object in the frame of its body, each body in that of its parent. A value that a class of defaults gives stands
// in the object. What MuJoCo's documentation calls "real(n)" keeps the default of its remaining entries where fewer are
// given.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "importers/xml_tree.hpp"
#include "model_import/model.hpp"

namespace delassus::importers::mjcf {

using model_import::Matrix3d;
using model_import::none;
using model_import::Quaterniond;
using model_import::Vector3d;

using Frame = Eigen::Isometry3d;

/// Of contacts, limits and equalities, where the model says nothing.
inline constexpr std::array<double, 2> usual_solref = {0.02, 1.0};
inline constexpr std::array<double, 5> usual_solimp = {0.9, 0.95, 0.001, 0.5, 2.0};

struct Softness {
    std::array<double, 2> solref = usual_solref;
    std::array<double, 5> solimp = usual_solimp;
    [[nodiscard]] bool is_usual() const { return solref == usual_solref && solimp == usual_solimp; }
};

enum class Switch { Off, On, Auto };

enum class JointType { Free, Ball, Slide, Hinge };

struct Joint {
    std::string name;
    JointType type = JointType::Hinge;
    Vector3d position = Vector3d::Zero(), axis = Vector3d::UnitZ();
    Switch limited = Switch::Auto, force_limited = Switch::Auto, align = Switch::Auto;
    std::array<double, 2> range{}, force_range{};
    double margin = 0.0, reference = 0.0, spring_reference = 0.0, armature = 0.0, friction_loss = 0.0;
    std::array<double, 2> spring_damper{};  ///< time constant (s), damping ratio
    /// The first is linear; the others multiply powers of the coordinate, or of its rate.
    std::array<double, 3> stiffness{}, damping{};
    Softness limit, friction;
    bool gravity_compensated = false;  ///< actuatorgravcomp
    std::string where;
    // resolved
    bool is_limited = false, is_force_limited = false;
    std::int32_t body = -1, coordinate = 0, freedom = 0;  ///< addresses in qpos and qvel
};

inline int freedoms_of(JointType type) {
    return type == JointType::Free ? 6 : type == JointType::Ball ? 3 : 1;
}
inline int coordinates_of(JointType type) {
    return type == JointType::Free ? 7 : type == JointType::Ball ? 4 : 1;
}

enum class GeomType { Plane, HeightField, Sphere, Capsule, Ellipsoid, Cylinder, Box, Mesh };

/// Mass, mass centre, and moments about it.
struct MassProperties {
    double mass = 0.0;
    Vector3d centre = Vector3d::Zero();
    Matrix3d inertia = Matrix3d::Zero();
};

struct Mesh;

struct Geom {
    std::string name;
    GeomType type = GeomType::Sphere;
    Vector3d position = Vector3d::Zero();
    Quaterniond orientation = Quaterniond::Identity();
    Vector3d size = Vector3d::Zero();  ///< MuJoCo's: halves
    std::array<double, 6> from_to = {none};
    int contype = 1, conaffinity = 1, condim = 3, group = 0, priority = 0;
    std::array<double, 3> friction = {1.0, 0.005, 0.0001};
    Softness softness;
    double margin = 0.0, gap = 0.0, mass = none, density = 1000.0, fit_scale = 1.0, adhesion = 0.0;
    std::array<double, 6> surface_velocity{};
    bool shell = false;
    std::string mesh, height_field;
    std::string where;
    // resolved
    std::int32_t body = 0;
    std::shared_ptr<const Mesh> of_mesh;
    MassProperties own;  ///< in the geom's frame
};

enum class MeshInertia { Convex, Exact, Legacy, Shell };

/// Vertices and triangles in the frame in which geoms have them: refpos, refquat and scale are applied.
struct Mesh {
    std::string name;
    std::vector<Vector3d> points;
    std::vector<std::array<std::int32_t, 3>> triangles;
    MeshInertia inertia = MeshInertia::Legacy;
    MassProperties unit;  ///< of density 1 (of a volume, or of a surface for shells)
    std::string trouble;  ///< why it has no mass, or is not there at all; empty: all is well

    struct Hull {
        std::vector<Vector3d> points;  ///< empty: without volume
        std::vector<std::array<std::int32_t, 3>> triangles;
        std::string trouble;  ///< why there is none
    };
    /// The convex hull, found when first asked for: most meshes are only seen.
    [[nodiscard]] const Hull& hull() const;

private:
    mutable std::optional<Hull> hull_;
};

struct MeshDefaults {
    Vector3d scale = Vector3d::Ones();
    MeshInertia inertia = MeshInertia::Legacy;
};

struct HeightField {
    std::string name;
    int rows = 0, columns = 0;
    std::array<double, 4> size{};  ///< halves along x and y, height over the lowest, depth of the base
    std::vector<double> heights;   ///< from 0 to 1; the row of the least y first
    std::string trouble;
};

struct Site {
    std::string name;
    Vector3d position = Vector3d::Zero();
    Quaterniond orientation = Quaterniond::Identity();
    std::array<double, 6> from_to = {none};
    std::int32_t body = 0;
};

struct Body {
    std::string name;
    std::int32_t parent = -1;
    Vector3d position = Vector3d::Zero();
    Quaterniond orientation = Quaterniond::Identity();
    bool placed = false;  ///< whether the model says where it is
    bool mocap = false;
    double gravity_compensation = 0.0;
    bool has_inertial = false;
    MassProperties own;                    ///< in the body's frame
    std::optional<Quaterniond> principal;  ///< the axes in which its moments are given
    std::vector<Joint> joints;
    std::vector<Geom> geoms;
    std::vector<Site> sites;
    std::string where;
    bool global = false;  ///< all of it is in the world's frame until it is finished (compiler coordinate="global")
    std::size_t compiler = 0;
    std::int32_t weld = 0;  ///< the body that it is one with: itself if it has joints, 0 for the world
    bool has_children = false;
};

enum class Transmission { None, Joint, JointInParent, SliderCrank, Tendon, Site, Body };
enum class Law { None, Fixed, Affine, Other };

struct Actuator {
    std::string name, target;
    Transmission transmission = Transmission::None;
    std::array<double, 6> gear = {1.0};
    Switch control_limited = Switch::Auto, force_limited = Switch::Auto, state_limited = Switch::Auto;
    std::array<double, 2> control_range{}, force_range{}, state_range{};
    double inherit_range = 0.0, armature = 0.0, damping = 0.0, delay = 0.0;
    std::string dynamics = "none", gain = "fixed", bias = "none";
    std::array<double, 10> gain_parameters = {1.0}, bias_parameters{};
    int group = 0;
    std::string where;
    // resolved
    std::int32_t joint = -1;
    bool is_control_limited = false, is_force_limited = false;
};

enum class EqualityType { Connect, Weld, Joint, Other };

struct Equality {
    std::string name, kind, first, second;
    EqualityType type = EqualityType::Other;
    bool active = true, by_sites = false, has_pose = false;
    Softness softness;
    std::array<double, 11> data{};
    std::string where;
    std::int32_t first_id = -1, second_id = -1;  ///< bodies, sites or joints; of a body that is not named: 0
};

struct Pair {
    std::string name, first, second;
    int condim = 3;
    std::array<double, 5> friction = {1.0, 1.0, 0.005, 0.0001, 0.0001};
    bool has_friction = false, has_condim = false;
    Softness softness;
    double margin = 0.0, gap = 0.0;
    std::string where;
    std::int32_t first_id = -1, second_id = -1;
};

struct Exclude {
    std::string first, second, where;
    std::int32_t first_id = -1, second_id = -1;
};

struct Tendon {
    std::string name;
    Switch limited = Switch::Auto;
    std::array<double, 2> range{};
    std::array<double, 3> stiffness{}, damping{};
    double friction_loss = 0.0, armature = 0.0;
};

struct Key {
    std::string name, where;
    std::vector<double> qpos, qvel, ctrl, mpos, mquat;
};

/// What a class of defaults gives.
struct Defaults {
    Geom geom;
    Joint joint;
    Site site;
    MeshDefaults mesh;
    Actuator actuator;
    Equality equality;
    Pair pair;
    Tendon tendon;
};

struct Compiler {
    bool degree = true, auto_limits = true, balance_inertia = false, global = false, strip_path = false,
         fit_aabb = false, discard_visual = false, align_free = false, exact_mesh_inertia = false;
    double bound_mass = 0.0, bound_inertia = 0.0, total_mass = -1.0;
    Switch inertia_from_geom = Switch::Auto;
    std::array<int, 2> inertia_groups = {0, 5};
    std::string euler_sequence = "xyz", mesh_folder, texture_folder;
};

struct Option {
    Vector3d gravity{0.0, 0.0, -9.81}, wind = Vector3d::Zero();
    double step = 0.002, density = 0.0, viscosity = 0.0;
    std::string collision = "all";
    bool contact = true, constraint = true, equality = true, friction_loss = true, limit = true, spring = true,
         damper = true, gravity_on = true, clamp_control = true, filter_parent = true, actuation = true;
    std::vector<int> disabled_groups;
};

struct Spec {
    std::string title;
    std::vector<Compiler> compilers;  ///< the model's, then those of models that it attaches
    Option option;
    std::vector<Body> bodies;  ///< the world first, parents before children
    std::vector<std::shared_ptr<const Mesh>> meshes;
    std::vector<HeightField> height_fields;
    std::vector<Actuator> actuators;
    std::vector<Equality> equalities;
    std::vector<Pair> pairs;
    std::vector<Exclude> excludes;
    std::vector<Tendon> tendons;
    std::vector<Key> keys;
    std::map<std::string, std::vector<std::string>> seen;  ///< looks, sensors and the like, by kinds
    int coordinates = 0, freedoms = 0, mocaps = 0;
};

/// The rotation that an element's quat, axisangle, xyaxes, zaxis or euler describes; nothing where it has none of them.
/// Throws InputError where it has two of them, or one without a direction.
[[nodiscard]] std::optional<Quaterniond> orientation_of(const XmlElement& element, const Compiler& compiler);
/// Turns the z axis to a direction by the least angle, as MuJoCo does: about x where they are opposite.
[[nodiscard]] Quaterniond z_towards(const Vector3d& direction);

// mjcf_values.cpp: attributes of one element over what defaults say.
void read_switch(const XmlElement& element, const char* attribute, Switch& value);
void read_joint(const XmlElement& element, const Compiler& compiler, Joint& joint);
void read_geom(const XmlElement& element, const Compiler& compiler, Geom& geom);
void read_site(const XmlElement& element, const Compiler& compiler, Site& site);
void read_inertial(const XmlElement& element, const Compiler& compiler, Body& body);
void read_tendon(const XmlElement& element, Tendon& tendon);
void read_equality(const XmlElement& element, Equality& equality);
void read_pair(const XmlElement& element, Pair& pair);
void read_compiler(const XmlElement& element, Compiler& compiler);
void read_option(const XmlElement& element, Option& option);

// mjcf_actuators.cpp
/// Whether elements of this name are actuators.
[[nodiscard]] bool is_actuator(const std::string& name);
void read_actuator(const XmlElement& element, Actuator& actuator);
/// Finds the joints of actuators, their ranges, and the damping that a ratio stands for. Needs finish().
void finish_actuators(Spec& spec, model_import::Model& model);

// mjcf_mesh.cpp
/// A mesh in a file, or in the element. Never throws for what a file has: the mesh then has its trouble.
[[nodiscard]] Mesh read_mesh(const XmlElement& element, const MeshDefaults& defaults,
                             const std::filesystem::path& file);
[[nodiscard]] HeightField read_height_field(const XmlElement& element, const std::filesystem::path& file);

// mjcf_inertia.cpp
/// A geom with its place and size: by fromto, or as a primitive that fits its mesh.
void complete(Geom& geom, const XmlElement& element, const Compiler& compiler);
/// Masses of bodies, and what the compiler's settings do to them; bodies that are welded; limits; addresses of joints.
void finish(Spec& spec, model_import::Model& model);
/// Whether a range limits something. One whose ends are not in their order does not, with a loss.
[[nodiscard]] bool limits(Switch given, const char* attribute, const std::array<double, 2>& range,
                          const Compiler& compiler, const std::string& what, model_import::Model& model);
/// By another frame: of parent ← of child.
[[nodiscard]] MassProperties moved(const MassProperties& of, const Frame& frame);
/// The mass and mass centre of all, and their moments about it.
[[nodiscard]] MassProperties sum_of(const std::vector<MassProperties>& parts);

inline Frame frame_of(const Vector3d& position, const Quaterniond& orientation) {
    Frame frame = Frame::Identity();
    frame.linear() = orientation.toRotationMatrix();
    frame.translation() = position;
    return frame;
}

/// Reads a file with all that it includes and attaches. What scenes do not have goes to the model's losses.
[[nodiscard]] Spec read_spec(const std::filesystem::path& file, model_import::Model& model);

}  // namespace delassus::importers::mjcf
