// SPDX-License-Identifier: BSD-3-Clause
// Problems of real mechanics, made from a few parameters: for tests, benchmarks, examples and `delassus generate`.
//
// All are one step of the linearised implicit Euler method in SI units (kg, m, s, rad), with the step h:
//
//     H = M + h R + h² K        a = (M + h R) v + h f        D = C_q or the contact Jacobian        b = C/h or gap/h
//
// where v is the velocity before the step, f the forces (gravity along −z, gyroscopic, elastic), C the joint errors.
// x is the velocity after the step, λ are impulses. Where f does not depend on v, R = 0 and a = M v + h f.
//
// A rigid body has 6 columns: the velocity of its mass centre in the world frame, then its angular velocity in the body
// frame (the axes of which are the principal axes of inertia, so that M is diagonal). Fixed bodies have no columns.
// Equal parameters give equal problems, bit for bit, on machines with the same libm.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

// ---- By name -------------------------------------------------------------------------------------------------------

/// A parameter of a kind of problem.
struct GeneratorParameter {
    std::string_view key;  ///< lower_snake_case, unique in the table
    double default_value = 0.0;
    double minimum = 0.0;  ///< the range is closed
    double maximum = 0.0;
    bool integer = false;   ///< whole numbers only; a flag is a whole number from 0 to 1
    std::string_view unit;  ///< "" where there is none
    std::string_view doc;   ///< one line
};

/// A kind of problem.
struct Generator {
    std::string_view name;
    std::string_view doc;  ///< one line
    std::span<const GeneratorParameter> parameters;
};

/// The table of all kinds, in the order of this header. Lives as long as the library.
[[nodiscard]] DELASSUS_API std::span<const Generator> generators();

/// The problem of that kind; keys that are absent from `values` have their defaults. Throws InputError for an unknown
/// kind or key (with the nearest name), for values out of range, and for parameters that contradict one another.
[[nodiscard]] DELASSUS_API Problem generate(std::string_view kind, const std::map<std::string, double>& values = {});

// ---- By structure: the parameters of each kind -------------------------------------------------------------------
//
// The functions throw InputError if a member is outside the range that generators() gives, or for contradictions.

/// Rods that hang from a fixed point, joined end to end. Free rows: 3 for a joint (m/s), and for a hinge 2 more (rad/s)
/// in a block of their own, so that no block mixes units.
struct ChainParameters {
    std::int32_t bodies = 20;
    double length = 0.2;        ///< of a rod, m
    double mass = 1.0;          ///< of the first rod, kg
    double mass_ratio = 1.0;    ///< mass of the last rod over that of the first, geometric grading between
    bool heavy_end = false;     ///< only the last rod has another mass
    bool revolute = false;      ///< hinges (5 rows) in place of spherical joints (3 rows)
    std::int32_t repeated = 1;  ///< how often each joint is written: redundant, consistent rows
    bool planar = false;        ///< the rods lie in the x–z plane, all hinges along y
    bool closed = false;        ///< the last rod's end is joined to a fixed point too; planar hinges: 3 redundant rows
    double bend = 0.6;          ///< how far the rods zig-zag: tangent of the largest angle to the vertical, about
    bool world_frame = false;   ///< angular velocities in the world frame: full 3 × 3 blocks of inertia in H
    double swing =
        0.0;  ///< rad/s, rotation of the whole chain about the first joint (its pin): consistent if not closed
    double speed = 0.0;  ///< m/s and rad/s, amplitude of random velocities of each body: inconsistent
    double drift = 0.0;  ///< s, for how long each body has moved by its own velocity, breaking the joints: b = C/h
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_chain(const ChainParameters& parameters);

/// A net of point masses (3 columns each) at the crossings of rows × columns strings that cannot stretch, fixed at its
/// four corners. One free row for each string piece.
struct NetParameters {
    std::int32_t rows = 10;
    std::int32_t columns = 10;
    double spacing = 0.1;        ///< between neighbours, in plan, m
    double sag = 0.1;            ///< how far each edge hangs down in its middle, m; 0: flat, 4 redundant rows
    double mass = 0.1;           ///< of a node, kg
    double mass_ratio = 1.0;     ///< mass of the last node over that of the first, geometric grading between
    std::int32_t diagonals = 0;  ///< braces in each cell: 0, 1 or 2; with 2 a large net has redundant rows
    std::int32_t repeated = 1;
    double speed = 0.0;
    double drift =
        0.0;  ///< s, as in ChainParameters; refused with diagonals or a flat net, whose rows would contradict
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_net(const NetParameters& parameters);

/// Spheres in the closest packing (face-centred cubic, square layers) on a fixed floor. The base is the smallest one
/// with at least `contacts` contacts. Time and memory are linear in the number of contacts.
struct SpherePileParameters {
    std::int32_t contacts = 1000;  ///< wanted; counted without jitter
    std::int32_t layers = 8;       ///< of spheres; a pyramid may end sooner
    bool pyramid = true;           ///< each sphere rests on four; otherwise full layers as in a box
    bool walls = false;            ///< four fixed walls that touch the widest layer
    double radius = 0.05;
    double density = 2500.0;
    double jitter = 0.0;    ///< radii are smaller by a random share up to this, so that gaps open
    double envelope = 0.1;  ///< pairs with a gap up to envelope · radius are contacts
    double mu = 0.5;        ///< 0: one nonnegative row a contact instead of three
    double speed = 0.0;     ///< m/s, amplitude of random velocities (over the radius for angular ones)
    bool glue = false;      ///< pass the problem through glued()
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_sphere_pile(const SpherePileParameters& parameters);

/// Spheres in the closest packing in a box with square layers, for runs of several processes: every number comes from
/// the seed and the sphere's place in the lattice (delassus/generate_partitioned.hpp makes it in parts).
struct PileParameters {
    std::uint64_t contacts = 1000;  ///< wanted; counted without jitter
    std::int32_t layers = 10;       ///< of spheres; every other one is one sphere narrower
    bool walls = true;              ///< four fixed walls that touch the wider layers
    double radius = 0.05;
    double density = 2500.0;
    double jitter = 0.0;    ///< radii are smaller by a random share up to this, so that gaps open
    double envelope = 0.1;  ///< neighbours with a gap up to envelope · radius are contacts
    double mu = 0.5;        ///< 0: one nonnegative row a contact instead of three
    double speed = 0.1;     ///< m/s, amplitude of random velocities (over the radius for angular ones)
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_pile(const PileParameters& parameters);

/// Towers of boxes, four contact points on each face: every face has redundant rows (12 with friction, rank 6).
struct BoxStackParameters {
    std::int32_t towers = 1;  ///< independent, turned about the vertical, each by another angle
    std::int32_t boxes = 10;  ///< in a tower
    double width = 0.3;       ///< along x, m
    double depth = 0.2;       ///< along y, m
    double height = 0.1;      ///< along z, m
    double mass = 6.0;        ///< of the lowest box, kg
    double mass_ratio = 1.0;  ///< mass of the top box over that of the lowest, geometric grading between
    bool heavy_top = false;   ///< only the top box has another mass
    double gap = 0.0;         ///< between faces, m
    double mu = 0.5;
    double speed = 0.0;
    bool glue = false;
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_box_stack(const BoxStackParameters& parameters);

/// A wall in running bond: every other course starts and ends with half a brick. Four contacts on each overlap of two
/// bricks, and with head_joints four on each upright face between neighbours.
struct BrickWallParameters {
    std::int32_t courses = 8;
    std::int32_t columns = 6;  ///< whole bricks in the lowest course
    double length = 0.24;      ///< along x, m
    double width = 0.115;      ///< along y, m
    double height = 0.071;     ///< along z, m
    double density = 1800.0;
    bool head_joints = false;
    double mu = 0.6;
    double push = 0.0;   ///< m/s, velocity along y of the brick nearest the middle: a blow
    double speed = 0.0;  ///< m/s, amplitude of random velocities
    bool glue = false;
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_brick_wall(const BrickWallParameters& parameters);

/// A block of trilinear hexahedra of linear elasticity (3 columns a node) on a plane with friction: H is sparse,
/// definite and not block-diagonal. The lowest nodes are the contacts.
struct ElasticBlockParameters {
    std::int32_t elements = 6;  ///< along x and along y
    std::int32_t layers = 4;    ///< along z
    double size = 0.05;         ///< edge of an element, m
    double young = 1e6;         ///< Pa
    double poisson = 0.3;
    double density = 1100.0;
    double damping_mass = 0.0;       ///< α of R = α M + β K, 1/s
    double damping_stiffness = 0.0;  ///< β, s
    double squeeze = 0.0;  ///< initial displacement as a multiple of a column's compression under its own weight
    double gap = 0.0;      ///< under the lowest nodes, m
    double mu = 0.5;
    double slide = 0.5;  ///< m/s, initial velocity along x
    double fall = 0.0;   ///< m/s, initial velocity along −z
    double speed = 0.0;  ///< m/s, amplitude of random velocities
    bool glue = false;
    double gravity = 9.81;
    double step = 0.01;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_elastic_block(const ElasticBlockParameters& parameters);

/// Spinning tops, each standing on the head of the one below by a spherical joint, the lowest on a fixed point. The
/// gyroscopic torque is linearised exactly: H is unsymmetric. Free rows only.
struct GyroscopicParameters {
    std::int32_t bodies = 10;
    double radius = 0.05;   ///< of the disc of a top, m
    double height = 0.1;    ///< from the tip to the head, m
    double mass = 0.5;      ///< kg
    double spin = 300.0;    ///< about a top's own axis, rad/s; neighbours spin in opposite directions
    double nutation = 5.0;  ///< amplitude of random velocities across that axis, rad/s
    double tilt = 0.3;      ///< largest angle to the vertical, about, rad
    double gravity = 9.81;
    double step = 0.001;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_gyroscopic(const GyroscopicParameters& parameters);

/// A walking machine: a trunk on legs of two links. Every kind of cone in one problem: hinges (free), motors with a
/// limited torque (box), knee stops (nonnegative), feet on the floor (friction); compliance E in the hinges and motors.
struct MotorsParameters {
    std::int32_t legs = 6;          ///< on alternating sides
    double trunk_mass = 10.0;       ///< kg
    double link_mass = 1.0;         ///< kg
    double link_length = 0.3;       ///< m
    double torque = 20.0;           ///< limit of a motor, N m
    double motor_stiffness = 50.0;  ///< slope of a motor's line of torque against speed, N m s/rad; 0: infinite
    double motor_speed = 2.0;       ///< wanted speed of the hips; the knees' is half, backwards; rad/s
    double bushing = 1e6;           ///< stiffness of a hinge's bearing, N/m; 0: rigid
    double knee_clearance = 0.01;   ///< angle of each knee from its stop, rad
    double gap = 0.0;               ///< under the feet, m
    double mu = 0.8;
    double speed = 0.0;
    double gravity = 9.81;
    double step = 0.005;
    std::uint64_t seed = 1;
};
[[nodiscard]] DELASSUS_API Problem generate_motors(const MotorsParameters& parameters);

// ---- From another problem ---------------------------------------------------------------------------------------

/// The problem in which every contact sticks: blocks of other cones become free blocks of the same rows, with b = 0
/// there. So linear solvers can be compared on the geometry of a contact problem, with its redundant rows. These are
/// consistent: if b = 0 throughout, x = 0 fulfils D x + b = 0. Throws InputError for a reduced problem (n = 0), whose b
/// holds the loads.
[[nodiscard]] DELASSUS_API Problem glued(const Problem& problem);

}  // namespace delassus
