// SPDX-License-Identifier: BSD-3-Clause
// What readers of models fill and the writer of scenes takes: everything in the world frame, where the coordinates of
// all joints are 0. SI units, rad.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "delassus/model_import.hpp"
#include "delassus/multibody.hpp"

namespace delassus::model_import {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

inline constexpr double none = std::numeric_limits<double>::quiet_NaN();

enum class Form {
    Sphere,      ///< size = (radius, -, -)
    Box,         ///< size = full edges
    Capsule,     ///< size = (radius, length of the straight part, -), along z
    Cylinder,    ///< size = (radius, length, -), along z
    Plane,       ///< the half space z ≤ 0
    Hull,        ///< of points
    MeshFile,    ///< a closed surface in a file that is there
    HeightField  ///< heights over size = (along x, along y, -), rows as on a map
};

struct ModelShape {
    std::string name;  ///< for reports and names of files
    Form form = Form::Sphere;
    Vector3d size = Vector3d::Zero();
    Vector3d position = Vector3d::Zero();
    Quaterniond orientation = Quaterniond::Identity();
    std::vector<Vector3d> points;                        ///< of a hull, in the shape's frame
    std::vector<std::array<std::int32_t, 3>> triangles;  ///< of points; empty: the hull is found when the scene is read
    std::filesystem::path file;
    double scale = 1.0;  ///< of what the file has
    std::int32_t rows = 0, columns = 0;
    std::vector<double> heights;
    std::int32_t material = -1;  ///< −1: without friction
};

struct ModelBody {
    std::string name;
    double mass = 0.0;                     ///< 0 and not fixed: massless
    Matrix3d inertia = Matrix3d::Zero();   ///< about the mass centre, in the axes of the body
    Vector3d position = Vector3d::Zero();  ///< of the mass centre; of a massless body any point
    Quaterniond orientation = Quaterniond::Identity();
    Vector3d velocity = Vector3d::Zero();          ///< of the mass centre
    Vector3d angular_velocity = Vector3d::Zero();  ///< in the axes of the body
    bool fixed = false;
    std::vector<ModelShape> shapes;
};

struct ModelJoint {
    JointParameters parameters;  ///< first and second are numbers of bodies
    bool closes_loop = false;    ///< bodies that it fixes to each other stay two
};

/// A number that a program sets while the scene runs, in place of the model's control u: offset + scale · u.
struct ModelInput {
    std::string name;
    double scale = 1.0, offset = 0.0, start = 0.0;
    std::optional<std::array<double, 2>> range;
};

/// kp (position − c) + kd (speed − ċ) at the coordinate of a joint.
struct ModelActuator {
    std::string name;
    std::int32_t joint = -1;
    std::optional<double> position, speed;
    double kp = 0.0, kd = 0.0, limit = std::numeric_limits<double>::infinity();
    std::optional<ModelInput> input;  ///< in place of the constant position, or of the speed where kp = 0
};

/// A force or torque along the coordinate of a revolute or prismatic joint.
struct ModelDrive {
    std::string name;
    std::int32_t joint = -1;
    double force = 0.0;
    std::optional<ModelInput> input;  ///< in place of the constant force
};

/// Holds the coordinate of a joint.
struct ModelLock {
    std::string name;
    std::int32_t joint = -1;
    double position = 0.0;
};

struct ModelMaterial {
    std::string name;
    double friction = 0.0, restitution = 0.0;
};

struct ModelMaterialPair {
    std::int32_t first = 0, second = 0;
    double friction = 0.0, restitution = 0.0;
    bool touch = true;  ///< false: shapes of these materials pass through each other
};

struct Model {
    std::string title;
    Vector3d gravity{0.0, 0.0, -9.81};
    double step = 0.001;
    std::vector<ModelBody> bodies;  ///< parents before their children
    std::vector<ModelJoint> joints;
    std::vector<ModelActuator> actuators;
    std::vector<ModelDrive> drives;
    std::vector<ModelLock> locks;
    std::vector<ModelMaterial> materials;
    std::vector<ModelMaterialPair> material_pairs;
    std::vector<std::array<std::int32_t, 2>> apart;  ///< bodies that never touch
    std::vector<NotCarriedOver> lost, without_effect;
    std::vector<std::filesystem::path> package_paths;  ///< ImportSettings

    void lose(std::string what, std::string why) { lost.push_back({std::move(what), std::move(why)}); }
};

/// Adds a body and a joint without mass before each of several joints that one body of the model has: the last of them
/// leads to the body. joints: from the parent to the body; their first and second are set here. parent: −1 for the
/// world. Pieces lie at the points of their joints and move as `moving` says.
DELASSUS_API void add_chain(Model& model, std::int32_t parent, std::int32_t body, std::vector<ModelJoint> joints,
                            const std::vector<std::pair<Vector3d, Vector3d>>& moving);

/// Makes one body of each set of bodies that fixed joints hold together, drops such joints, and makes bodies fixed that
/// the world holds. Then drops bodies without mass that carry none, with a loss. Throws InputError for a body without
/// mass that nothing holds.
DELASSUS_API void merge_fixed(Model& model);

/// Leaves out shapes without a size, with a loss for each. repair_inertias(): those that no body has become the nearest
/// that one has, zero that of a ball of water; with a loss for each. After merge_fixed().
DELASSUS_API void drop_flat_shapes(Model& model);
DELASSUS_API void repair_inertias(Model& model);

/// ImportSettings::fixed_base (before merge_fixed()), ground and height, apart. Throw InputError.
DELASSUS_API void hold_base(Model& model);
DELASSUS_API void add_ground(Model& model, double height);
DELASSUS_API void part_bodies(Model& model, const std::vector<std::array<std::string, 2>>& pairs);

/// The scene's text, and the files that it needs. path: of the scene.
DELASSUS_API void write_scene(const Model& model, const std::filesystem::path& model_file,
                              const std::filesystem::path& scene, const ImportSettings& settings,
                              ImportedScene& result);

/// A name that none of the taken ones is; notes it. wanted may be empty.
class DELASSUS_API Names {
public:
    std::string take(const std::string& wanted, const std::string& otherwise);

private:
    std::vector<std::string> taken_;
};

inline Vector3 array(const Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}

/// p/q with both below 1000 that is nearest to the ratio.
DELASSUS_API std::array<double, 2> nearest_fraction(double ratio);

/// Points of a sphere of radius one, spread evenly: the corners of an icosahedron whose triangles are each divided into
/// four, twice.
DELASSUS_API std::vector<Vector3d> sphere_points();

/// The file, or the folder, of a path or an address (file://, package://, model://) in a model: relative to the model's
/// folder, or in a folder of that name above it, beside those, or on the search paths of ROS and Gazebo
/// (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH, GAZEBO_MODEL_PATH, GZ_SIM_RESOURCE_PATH, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH),
/// or in the folders given. An address with three slashes is a path, or else lies below one of these. Empty: none is
/// there.
DELASSUS_API std::filesystem::path find_file(const std::string& address, const std::filesystem::path& model,
                                             const std::vector<std::filesystem::path>& folders = {});

/// Shapes of a mesh in a file, at the place of `at`: its closed parts, or the hull of an open one. what: names it in
/// losses. Without a file, or with one that cannot be read, a loss.
DELASSUS_API void add_mesh(Model& model, const ModelShape& at, const std::string& address, const Vector3d& scale,
                           const std::filesystem::path& model_file, const std::string& what,
                           std::vector<ModelShape>& shapes);

/// An ellipsoid as the hull of points in its surface, with a loss; as a sphere where all radii are equal.
DELASSUS_API ModelShape ellipsoid(Model& model, ModelShape at, const Vector3d& radii, const std::string& what);

/// No two of these bodies touch: as links of one robot in Gazebo do not, unless told to.
DELASSUS_API void keep_all_apart(Model& model, const std::vector<std::int32_t>& bodies);

/// Readers, each in a module of its own: fills the model. Throws InputError.
using ReadModel = void(const std::filesystem::path& file, const ImportSettings& settings, Model& model);

}  // namespace delassus::model_import
