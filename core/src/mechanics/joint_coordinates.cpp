// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/joint_coordinates.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "delassus/error.hpp"
#include "mechanics/angle.hpp"
#include "mechanics/kinematic_tree.hpp"
#include "mechanics/model.hpp"
#include "mechanics/tree_derivatives.hpp"
#include "mechanics/tree_projection.hpp"

namespace delassus {

using mechanics::Link;
using mechanics::LinkJoint;
using mechanics::LinkMotion;
using mechanics::Matrix3d;
using mechanics::Quaterniond;
using mechanics::Vector3d;

struct JointCoordinates::Implementation {
    explicit Implementation(MultibodySystem& system)
        : bodies(system),
          tree(system),
          derivatives(tree, [this](std::size_t k) { return spins_alone(k); }),
          projection(tree, derivatives, system.n()) {
        const auto n = static_cast<std::size_t>(system.n());
        state.q.assign(static_cast<std::size_t>(system.position_size()), 0.0);
        state.v.assign(n, 0.0);
        force.assign(n, 0.0);
        stiffness.keep_products();
        damping.keep_products();
        for (std::size_t k = 1; k < tree.links().size(); ++k) turns = turns || !spins_alone(k);
        std::vector<bool> in_trees(static_cast<std::size_t>(system.joint_count()), false);
        for (const Link& link : tree.links()) {
            if (link.joint < 0) continue;
            in_trees[static_cast<std::size_t>(link.joint)] = true;
            if (const std::int32_t place = system.angle_position(link.joint); place >= 0)
                angles.push_back(
                    {static_cast<std::size_t>(place), static_cast<std::size_t>(link.position + link.coordinates - 1)});
        }
        angles_of_trees = angles.size();
        for (std::int32_t joint = 0; joint < system.joint_count(); ++joint)
            if (const std::int32_t place = system.angle_position(joint);
                place >= 0 && !in_trees[static_cast<std::size_t>(joint)])
                angles.push_back({static_cast<std::size_t>(place),
                                  static_cast<std::size_t>(tree.position_size()) + angles.size() - angles_of_trees});
    }

    MultibodySystem& bodies;
    mechanics::KinematicTree tree;
    mechanics::TreeDerivatives derivatives;
    mechanics::TreeProjection projection;
    State start;
    std::vector<std::int32_t> held;  // rows that the trees hold
    bool turns = false;              // a link with a joint, whose forces depend on the state
    // Angles over whole turns in q of the bodies, and in q of the trees: coordinates, and at the end of q those of
    // joints that no tree holds.
    struct AngleOfJoint {
        std::size_t of_bodies, own;
    };
    std::vector<AngleOfJoint> angles;
    std::size_t angles_of_trees = 0;  // these come first
    // Work space of the call that runs:
    State state;  // of the bodies
    std::vector<double> force, rates;
    // One for each matrix of the bodies, so that its pattern lasts from call to call.
    MatrixAssembler stiffness, damping, turned_damping, gyroscopic, pull_of_rows, rows, joint_rows;
    UnilateralRows body_rows;
    State then;  // of collect_contact()
    std::vector<double> way_then;
    std::vector<FreeSpin> body_spins;
    /// A body that a free joint holds and that carries none: its gyroscopic torque is that of free_spins().
    [[nodiscard]] bool spins_alone(std::size_t k) const {
        return tree.links()[k].kind == LinkJoint::Free && tree.links()[k].leaf;
    }

    /// own ← body_rows in joint coordinates.
    void project_body_rows(UnilateralRows& own) {
        own.clear();
        std::size_t row = 0;
        for (const auto& block : body_rows.blocks()) {
            for (std::int32_t i = 0; i < block.cone.rows; ++i, ++row) {
                const auto begin = static_cast<std::size_t>(body_rows.row_start()[row]),
                           end = static_cast<std::size_t>(body_rows.row_start()[row + 1]);
                const auto entries = projection.row(body_rows.column().subspan(begin, end - begin),
                                                    body_rows.value().subspan(begin, end - begin));
                for (const auto& [column, value] : entries) own.entry(column, value);
                const auto& of_bodies = body_rows.rows()[row];
                own.end_row(of_bodies.gap, of_bodies.rate, of_bodies.rate_now);
            }
            own.end_block(block.cone, block.key, block.restitution, block.compliance);
        }
        own.contacts() = body_rows.contacts();
    }

    void place(const State& at) {
        tree.place(at.q.data(), at.v.data());
        write(at.q.data(), state);
        state.t = at.t;
    }

    /// The same with all velocities 0.
    void place_at_rest(const State& at) {
        tree.place(at.q.data(), nullptr);
        write(at.q.data(), state);
        state.t = at.t;
    }

    /// After tree.place() at q.
    void write(const double* q, State& of_bodies) const {
        tree.write(of_bodies);
        for (const auto& angle : angles) of_bodies.q[angle.of_bodies] = q[angle.own];
    }

    /// What the bodies' add_force() has but for weight and gyroscopic torques, which are the recursion's.
    const std::vector<double>& forces_beside_weight() {
        force.assign(force.size(), 0.0);
        bodies.add_force(state, 1.0, force.data());
        const Vector3d gravity(bodies.gravity().data());
        for (std::size_t k = 1; k < tree.links().size(); ++k) {
            const Link& link = tree.links()[k];
            Eigen::Map<Vector3d> push(force.data() + link.body_column), torque(force.data() + link.body_column + 3);
            const Vector3d omega = tree.motion(k).A.transpose() * tree.motion(k).omega;
            push -= link.mass * gravity;
            torque += omega.cross(link.inertia * omega);
        }
        return force;
    }

    /// wanting −= what rotors push bodies with at these accelerations; after place().
    void add_rotors(const double* u_dot, double* wanting) const {
        for (std::size_t k = 1; k < tree.links().size(); ++k) {
            const Link& link = tree.links()[k];
            const LinkMotion& own = tree.motion(k);
            const Vector3d arm = own.A * link.arm;
            for (int j = 0; j < link.freedoms; ++j) {
                const double size = link.armature[j] * u_dot[link.column + j];
                if (size == 0.0) continue;
                const bool about = own.angular.col(j).squaredNorm() > 0.0;
                const Vector3d push = about ? Vector3d(Vector3d::Zero()) : Vector3d(size * own.linear.col(j));
                const Vector3d moment = about ? Vector3d(size * own.angular.col(j)) : Vector3d(arm.cross(push));
                Eigen::Map<Vector3d>(wanting + link.body_column) += push;
                Eigen::Map<Vector3d>(wanting + link.body_column + 3) += own.A.transpose() * moment;
                if (link.parent == 0) continue;
                const Link& base = tree.links()[static_cast<std::size_t>(link.parent)];
                const Matrix3d& A = tree.motion(static_cast<std::size_t>(link.parent)).A;
                Eigen::Map<Vector3d>(wanting + base.body_column) -= push;
                Eigen::Map<Vector3d>(wanting + base.body_column + 3) -= A.transpose() * (moment + own.d.cross(push));
            }
        }
    }

    [[nodiscard]] auto adder(double factor, MatrixAssembler& H) const {
        return
            [factor, &H](std::int32_t row, std::int32_t column, double value) { H.add(row, column, factor * value); };
    }
};

namespace {

MultibodySystem& with_masses_of_bodies(MultibodySystem& bodies) {
    if (bodies.has_consistent_mass())
        throw Unsupported(
            "joint coordinates take no beams with a consistent mass, which couples bodies; give the beams lumped "
            "masses, "
            "or the scene coordinates: maximal");
    return bodies;
}

}  // namespace

JointCoordinates::JointCoordinates(MultibodySystem& bodies)
    : implementation_(std::make_unique<Implementation>(with_masses_of_bodies(bodies))) {
    auto& self = *implementation_;
    const State start = bodies.initial_state();
    auto& held = self.held;
    for (const Link& link : self.tree.links()) {
        if (link.joint < 0) continue;
        const auto [first, count] = bodies.joint_rows(link.joint);
        const std::int32_t own = 6 - link.freedoms;  // what motors add comes after them
        for (std::int32_t row = first; row < first + std::min(own, count); ++row) held.push_back(row);
    }
    std::sort(held.begin(), held.end());
    bodies.hold_rows(held);
    self.start = coordinates_of(start);
}

JointCoordinates::~JointCoordinates() = default;

// ---- Reading ----

const MultibodySystem& JointCoordinates::bodies() const {
    return implementation_->bodies;
}

std::vector<TreeJoint> JointCoordinates::joints() const {
    const auto& links = implementation_->tree.links();
    std::vector<TreeJoint> joints;
    for (std::size_t k = 1; k < links.size(); ++k) {
        const Link& link = links[k];
        joints.push_back({link.joint, link.body, links[static_cast<std::size_t>(link.parent)].body, link.position,
                          link.coordinates, link.column, link.freedoms});
    }
    return joints;
}

const std::vector<std::int32_t>& JointCoordinates::rows_of_trees() const {
    return implementation_->held;
}
std::int32_t JointCoordinates::body_velocities() const {
    return implementation_->bodies.n();
}

bool JointCoordinates::renew_rows(State& state, std::int64_t step) {
    auto& self = *implementation_;
    State bodies = bodies_of(state);
    if (!self.bodies.renew_rows(bodies, step)) return false;
    State renewed = coordinates_of(bodies);
    const auto keep_turns = [&](std::int32_t place) {
        const auto at = static_cast<std::size_t>(place);
        renewed.q[at] += 2.0 * std::numbers::pi * std::round((state.q[at] - renewed.q[at]) / (2.0 * std::numbers::pi));
    };
    for (const Link& link : self.tree.links()) {
        if (link.kind == LinkJoint::Revolute || link.kind == LinkJoint::Universal) keep_turns(link.position);
        if (link.kind == LinkJoint::Cylindrical || link.kind == LinkJoint::Universal) keep_turns(link.position + 1);
        if (link.kind == LinkJoint::Planar) keep_turns(link.position + 2);
    }
    state = std::move(renewed);
    return true;
}

State JointCoordinates::bodies_of(const State& state) const {
    State result;
    bodies_of(state, result);
    return result;
}

void JointCoordinates::bodies_of(const State& state, State& result) const {
    auto& self = *implementation_;
    result.q.resize(self.state.q.size());
    result.v.resize(self.state.v.size());
    result.t = state.t;
    self.tree.place(state.q.data(), state.v.data());
    self.write(state.q.data(), result);
}

State JointCoordinates::coordinates_of(const State& bodies) const {
    const auto& self = *implementation_;
    State state;
    self.tree.read(bodies, state);
    state.q.resize(static_cast<std::size_t>(position_size()));
    for (std::size_t k = 0; k < self.angles.size(); ++k) {
        const auto [of_bodies, own] = self.angles[k];
        state.q[own] = k < self.angles_of_trees ? mechanics::Angle::nearest(state.q[own], bodies.q[of_bodies])
                                                : bodies.q[of_bodies];
    }
    return state;
}

// ---- Sizes and the group ----

std::int32_t JointCoordinates::n() const {
    return implementation_->tree.n();
}
std::int32_t JointCoordinates::position_size() const {
    const auto& self = *implementation_;
    return self.tree.position_size() + static_cast<std::int32_t>(self.angles.size() - self.angles_of_trees);
}
std::vector<std::int32_t> JointCoordinates::constraint_blocks() const {
    return implementation_->bodies.constraint_blocks();
}
State JointCoordinates::initial_state() const {
    return implementation_->start;
}

namespace {

/// Visits the links: visit(link, number of plain coordinates, whether a quaternion follows them).
template <class Visitor>
void for_each_coordinate(const mechanics::KinematicTree& tree, Visitor&& visit) {
    for (std::size_t k = 1; k < tree.links().size(); ++k) {
        const Link& link = tree.links()[k];
        const bool turns = link.coordinates > link.freedoms;
        visit(link, turns ? link.freedoms - 3 : link.freedoms, turns);
    }
}

Quaterniond quaternion_of(const double* q) {
    return {q[0], q[1], q[2], q[3]};
}

}  // namespace

void JointCoordinates::increment(const double* q, const double* delta, double* result) const {
    for_each_coordinate(implementation_->tree, [&](const Link& link, std::int32_t plain, bool turns) {
        const double *from = q + link.position, *by = delta + link.column;
        double* to = result + link.position;
        const std::array<double, 4> old =
            turns ? std::array<double, 4>{from[plain], from[plain + 1], from[plain + 2], from[plain + 3]}
                  : std::array<double, 4>{};
        for (std::int32_t i = 0; i < plain; ++i) to[i] = from[i] + by[i];
        if (!turns) return;
        const Quaterniond turned =
            mechanics::rotated(quaternion_of(old.data()), Eigen::Map<const Vector3d>(by + plain));
        to[plain] = turned.w();
        to[plain + 1] = turned.x();
        to[plain + 2] = turned.y();
        to[plain + 3] = turned.z();
    });
    auto& self = *implementation_;
    if (self.angles_of_trees == self.angles.size()) return;
    // Angles in loops follow from the bodies: δ is their velocity at the end, as far as whole turns go.
    for (std::size_t k = self.angles_of_trees; k < self.angles.size(); ++k)
        result[self.angles[k].own] = q[self.angles[k].own];
    self.tree.place(result, delta);
    self.write(result, self.state);
    self.bodies.add_turns(self.state.q.data(), self.state.v.data(), self.state.q.data());
    for (std::size_t k = self.angles_of_trees; k < self.angles.size(); ++k)
        result[self.angles[k].own] = self.state.q[self.angles[k].of_bodies];
}

void JointCoordinates::settle_turns(State& state) const {
    auto& self = *implementation_;
    if (self.angles_of_trees == self.angles.size()) return;
    self.place(state);
    self.bodies.settle_turns(self.state);
    for (std::size_t k = self.angles_of_trees; k < self.angles.size(); ++k)
        state.q[self.angles[k].own] = self.state.q[self.angles[k].of_bodies];
}

void JointCoordinates::difference(const double* from, const double* to, double* delta) const {
    for_each_coordinate(implementation_->tree, [&](const Link& link, std::int32_t plain, bool turns) {
        const double *a = from + link.position, *b = to + link.position;
        double* by = delta + link.column;
        for (std::int32_t i = 0; i < plain; ++i) by[i] = b[i] - a[i];
        if (!turns) return;
        Eigen::Map<Vector3d> turn(by + plain);
        turn = mechanics::logarithm(quaternion_of(a + plain).conjugate() * quaternion_of(b + plain));
    });
}

void JointCoordinates::inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const {
    blocks.clear();
    for_each_coordinate(implementation_->tree, [&](const Link& link, std::int32_t plain, bool turns) {
        if (!turns) return;
        DiagonalBlock3& block = blocks.emplace_back();
        block.first = link.column + plain;
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> value(block.value);
        value = mechanics::inverse_tangent_of(Eigen::Map<const Vector3d>(delta + block.first));
    });
}

// ---- Forces ----

void JointCoordinates::add_mass(const State& state, double factor, MatrixAssembler& M) const {
    auto& self = *implementation_;
    self.tree.place(state.q.data());
    self.tree.add_mass(factor, M);
}

void JointCoordinates::multiply_mass(const State& state, double factor, const double* x, double* result) const {
    auto& self = *implementation_;
    self.tree.place(state.q.data());
    self.tree.multiply_mass(factor, x, result);
}

void JointCoordinates::add_force(const State& state, double factor, double* result) const {
    auto& self = *implementation_;
    self.place(state);
    std::fill(self.force.begin(), self.force.end(), 0.0);
    self.bodies.add_force(self.state, 1.0, self.force.data());
    self.tree.project_with_bias(self.force.data(), factor, result);
}

bool JointCoordinates::accelerate(const State& state, double* v_dot) const {
    auto& self = *implementation_;
    self.place(state);
    std::fill(self.force.begin(), self.force.end(), 0.0);
    self.bodies.add_force(self.state, 1.0, self.force.data());
    self.tree.accelerate(self.force.data(), v_dot);
    return true;
}

void JointCoordinates::add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    auto& self = *implementation_;
    self.place(state);
    const std::int32_t n = self.bodies.n();
    const bool forces = self.bodies.has_stiffness(), exact = tangent == Tangent::Exact;
    if (exact) self.derivatives.set_motion(state.v.data(), Vector3d(self.bodies.gravity().data()));
    if (forces) {
        self.stiffness.begin(n, n);
        self.bodies.add_stiffness(self.state, 1.0, tangent, self.stiffness);
        self.projection.add_matrix(self.stiffness, factor, H);
    }
    if (!exact || !self.turns) return;
    if (forces) {
        self.turned_damping.begin(n, n);
        self.bodies.add_damping(self.state, 1.0, tangent, self.turned_damping);
        self.projection.add_matrix_along_velocities(self.turned_damping.finish(), factor, H);
        self.derivatives.geometry(self.forces_beside_weight().data(), self.adder(-factor, H));
    }
    self.derivatives.positions(self.adder(factor, H));
}

void JointCoordinates::add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    auto& self = *implementation_;
    self.place(state);
    const std::int32_t n = self.bodies.n();
    if (self.bodies.has_stiffness()) {
        self.damping.begin(n, n);
        self.bodies.add_damping(self.state, 1.0, tangent, self.damping);
        self.projection.add_matrix(self.damping, factor, H);
    }
    if (tangent != Tangent::Exact || !self.turns) return;
    self.derivatives.set_motion(state.v.data(), Vector3d(self.bodies.gravity().data()));
    self.derivatives.rates(self.adder(factor, H));
}

// Of what the bodies alone have for stiff, all that it is along the joints: the mass m of a spring there has
// 1/m = ∇C M⁻¹ ∇Cᵀ ≤ that of its bodies without joints.
void JointCoordinates::find_stiff_forces(double rate, std::vector<std::int32_t>& stiff) const {
    auto& self = *implementation_;
    self.bodies.find_stiff_forces(rate, stiff);
    if (stiff.empty()) return;
    self.place_at_rest(initial_state());
    const auto n = static_cast<std::size_t>(self.tree.n());
    std::vector<double> gradient(n), response(n);
    std::erase_if(stiff, [&](std::int32_t number) {
        std::fill(self.force.begin(), self.force.end(), 0.0);
        std::fill(gradient.begin(), gradient.end(), 0.0);
        self.bodies.add_stiff_forces(self.state, {&number, 1}, std::array{-1.0}, 1.0, self.force.data());
        self.tree.project_with_bias(self.force.data(), 1.0, gradient.data());
        self.tree.accelerate(self.force.data(), response.data());
        const double weight = std::inner_product(gradient.begin(), gradient.end(), response.begin(), 0.0);
        const auto [stiffness, damping] = self.bodies.stiff_force_constants(number);
        return !mechanics::is_stiff(stiffness * weight, damping * weight, rate);
    });
}

void JointCoordinates::stiff_tensions(const State& state, std::span<const std::int32_t> stiff,
                                      std::vector<double>& tensions) const {
    auto& self = *implementation_;
    self.place(state);
    self.bodies.stiff_tensions(self.state, stiff, tensions);
}

void JointCoordinates::add_stiff_forces(const State& state, std::span<const std::int32_t> stiff,
                                        std::span<const double> tensions, double factor, double* result) const {
    auto& self = *implementation_;
    self.place_at_rest(state);
    std::fill(self.force.begin(), self.force.end(), 0.0);
    self.bodies.add_stiff_forces(self.state, stiff, tensions, 1.0, self.force.data());
    self.tree.project_with_bias(self.force.data(), factor, result);
}

void JointCoordinates::add_stiff_tangent(const State& state, std::span<const std::int32_t> stiff, double of_stiffness,
                                         double of_damping, MatrixAssembler& H) const {
    auto& self = *implementation_;
    self.place(state);
    self.stiffness.begin(self.bodies.n(), self.bodies.n());
    self.bodies.add_stiff_tangent(self.state, stiff, of_stiffness, of_damping, self.stiffness);
    self.projection.add_matrix(self.stiffness, 1.0, H);
}

void JointCoordinates::add_gyroscopic_damping(const State& state, double factor, Tangent tangent,
                                              MatrixAssembler& H) const {
    auto& self = *implementation_;
    self.place(state);
    const std::int32_t n = self.bodies.n();
    self.gyroscopic.begin(n, n);
    self.bodies.add_gyroscopic_damping(self.state, factor, tangent, self.gyroscopic);
    const SparseMatrix& R = self.gyroscopic.finish();
    for (std::int32_t row = 0; row < n; ++row) {
        const std::size_t k = self.projection.link_at(row);
        if (!self.spins_alone(k)) continue;
        const Link& link = self.tree.links()[k];
        for (auto e = R.row_start[static_cast<std::size_t>(row)]; e < R.row_start[static_cast<std::size_t>(row) + 1];
             ++e)
            H.add(link.column + row % 6, link.column + R.column[static_cast<std::size_t>(e)] % 6,
                  R.value[static_cast<std::size_t>(e)]);
    }
}

std::vector<std::int32_t> JointCoordinates::vectors() const {
    std::vector<std::int32_t> columns;
    for (const Link& link : implementation_->tree.links())
        if (link.freedoms == 6) columns.insert(columns.end(), {link.column, link.column + 3});
    std::sort(columns.begin(), columns.end());
    return columns;
}

std::vector<std::int32_t> JointCoordinates::bodies_of_columns() const {
    const std::vector<Link>& links = implementation_->tree.links();
    std::vector<std::int32_t> tree(links.size(), 0), numbers(static_cast<std::size_t>(n()), 0);
    std::int32_t trees = 0;
    for (std::size_t k = 1; k < links.size(); ++k) {
        const Link& link = links[k];
        tree[k] = link.parent == 0 ? trees++ : tree[static_cast<std::size_t>(link.parent)];
        std::fill_n(numbers.begin() + link.column, link.freedoms, tree[k]);
    }
    return numbers;
}

void JointCoordinates::free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const {
    auto& self = *implementation_;
    spins.clear();
    self.place(state);
    self.bodies.free_spins(self.state, h, self.body_spins);
    for (FreeSpin spin : self.body_spins) {
        const std::size_t k = self.projection.link_at(spin.column);
        if (!self.spins_alone(k)) continue;
        spin.column = self.tree.links()[k].column + 3;
        spins.push_back(spin);
    }
}

void JointCoordinates::add_inertial_stiffness(const State& state, const double* acceleration, double factor,
                                              Tangent tangent, MatrixAssembler& H) const {
    auto& self = *implementation_;
    if (!self.turns || tangent != Tangent::Exact) return;
    self.tree.place(state.q.data());
    self.derivatives.set_acceleration(acceleration);
    self.derivatives.positions(self.adder(factor, H));
}

bool JointCoordinates::has_stiffness() const {
    return implementation_->turns || implementation_->bodies.has_stiffness();
}

// ---- Rows ----

void JointCoordinates::constraint(const State& state, double* C) const {
    auto& self = *implementation_;
    self.place(state);
    self.bodies.constraint(self.state, C);
}

void JointCoordinates::add_constraint_jacobian(const State& state, std::int32_t first_row, MatrixAssembler& D) const {
    auto& self = *implementation_;
    self.place(state);
    self.rows.begin(m(), self.bodies.n());
    self.bodies.add_constraint_jacobian(self.state, 0, self.rows);
    const SparseMatrix& J = self.rows.finish();
    for (std::int32_t row = 0; row < J.rows; ++row) {
        const auto begin = static_cast<std::size_t>(J.row_start[static_cast<std::size_t>(row)]),
                   end = static_cast<std::size_t>(J.row_start[static_cast<std::size_t>(row) + 1]);
        const auto entries = self.projection.row(std::span(J.column).subspan(begin, end - begin),
                                                 std::span(J.value).subspan(begin, end - begin));
        for (const auto& [column, value] : entries) D.add(first_row + row, column, value);
    }
}

void JointCoordinates::constraint_rate(const State& state, double* C_t) const {
    auto& self = *implementation_;
    self.place(state);
    self.bodies.constraint_rate(self.state, C_t);
}

// C̈ at u̇ = 0: of the bodies at v̇ = J̇ u.
void JointCoordinates::constraint_curvature(const State& state, double* c) const {
    auto& self = *implementation_;
    self.place(state);
    self.bodies.constraint_curvature(self.state, c);
    self.rates.assign(self.force.size(), 0.0);
    self.tree.bias(self.rates.data());
    self.rows.begin(m(), self.bodies.n());
    self.bodies.add_constraint_jacobian(self.state, 0, self.rows);
    self.rows.finish().multiply_add(1.0, self.rates.data(), c);
}

void JointCoordinates::add_constraint_stiffness(const State& state, const double* lambda, double factor,
                                                Tangent tangent, MatrixAssembler& H) const {
    auto& self = *implementation_;
    if (m() == 0 || tangent != Tangent::Exact) return;
    self.place(state);
    const std::int32_t n = self.bodies.n();
    self.pull_of_rows.begin(n, n);
    self.bodies.add_constraint_stiffness(self.state, lambda, 1.0, tangent, self.pull_of_rows);
    self.derivatives.set_motion(state.v.data(), Vector3d::Zero());
    self.projection.add_matrix(self.pull_of_rows, factor, H);
    self.rows.begin(m(), n);
    self.bodies.add_constraint_jacobian(self.state, 0, self.rows);
    self.force.assign(self.force.size(), 0.0);
    self.rows.finish().transpose_multiply_add(1.0, lambda, self.force.data());
    self.derivatives.geometry(self.force.data(), self.adder(factor, H));
}

bool JointCoordinates::has_unilateral() const {
    return implementation_->bodies.has_unilateral();
}

double JointCoordinates::next_jump(double t) const {
    return implementation_->bodies.next_jump(t);
}
double JointCoordinates::longest_step(double t) const {
    return implementation_->bodies.longest_step(t);
}
bool JointCoordinates::depends_on_time() const {
    return implementation_->bodies.depends_on_time();
}

void JointCoordinates::collect_unilateral(const State& state, double h, UnilateralRows& rows) {
    auto& self = *implementation_;
    self.place(state);
    self.bodies.collect_unilateral(self.state, h, self.body_rows);
    self.project_body_rows(rows);
}

bool JointCoordinates::collect_contact(const SmoothMotion& motion, double time, const ContactPoint& contact,
                                       UnilateralRows& rows) {
    auto& self = *implementation_;
    self.then = motion.begin;
    self.way_then.resize(motion.begin.v.size());
    for (std::size_t i = 0; i < self.way_then.size(); ++i) self.way_then[i] = motion.way(i, time);
    increment(motion.begin.q.data(), self.way_then.data(), self.then.q.data());
    self.then.t += time;
    self.place(self.then);
    const SmoothMotion still{self.state, self.state.v.data(), {}, motion.h};
    if (!self.bodies.collect_contact(still, 0.0, contact, self.body_rows)) return false;
    self.project_body_rows(rows);
    return true;
}

std::optional<Vector3> JointCoordinates::prescribed_velocity(const ContactPoint& contact, double begin,
                                                             double t) const {
    return implementation_->bodies.prescribed_velocity(contact, begin, t);
}

// ---- Reactions ----
//
// The joint of a link carries what the link and all beyond it need besides the forces that act on them. With
// w = M̄ v̇ − f̄ on each body, v̇ = J u̇ + J̇ u, and C_k the rows of the joint in the columns of its link k and of the
// parent p (Newton and Euler's recursion from the leaves to the ground: Featherstone, section 5.3)
//
//     C_{k,k}ᵀ λ_k = w_k,      w_p ← w_p − C_{k,p}ᵀ λ_k
//
// The rows of a joint are independent, and what w_k has along its freedoms is zero by the equations of motion. The
// rotor of an armature a pushes its link by −a u̇ along the axis, and the parent by the opposite: a force on the line
// through the joint's point, or a torque.
std::vector<double> JointCoordinates::tree_reactions(const State& state, const std::vector<double>& f) const {
    using Eigen::Matrix;
    auto& self = *implementation_;
    const auto bodies = self.bodies.n();
    State moving = state;
    self.place(state);
    self.tree.accelerate(f.data(), moving.v.data());
    std::vector<double> bias(f.size(), 0.0), wanting(f.size(), 0.0);
    self.tree.bias(bias.data());
    State accelerated;
    bodies_of(moving, accelerated);
    for (std::size_t i = 0; i < f.size(); ++i) accelerated.v[i] += bias[i];
    self.place(state);
    self.bodies.multiply_mass(self.state, 1.0, accelerated.v.data(), wanting.data());
    for (std::size_t i = 0; i < f.size(); ++i) wanting[i] -= f[i];
    self.add_rotors(moving.v.data(), wanting.data());

    self.joint_rows.begin(self.bodies.constraint_rows(), bodies);
    self.bodies.add_joint_jacobian(self.state, self.joint_rows);
    const SparseMatrix& C = self.joint_rows.finish();
    std::vector<double> carried(self.held.size(), 0.0);
    const auto& links = self.tree.links();
    for (std::size_t k = links.size(); k-- > 1;) {
        const mechanics::Link& link = links[k];
        if (link.joint < 0 || link.freedoms == 6) continue;
        const std::int32_t first = self.bodies.joint_rows(link.joint)[0], count = 6 - link.freedoms;
        const std::int32_t parent = links[static_cast<std::size_t>(link.parent)].body_column;
        Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> own(6, count), other(6, count);
        own.setZero();
        other.setZero();
        for (std::int32_t i = 0; i < count; ++i) {
            const auto row = static_cast<std::size_t>(first + i);
            for (auto at = C.row_start[row]; at < C.row_start[row + 1]; ++at) {
                const auto entry = static_cast<std::size_t>(at);
                if (const auto j = C.column[entry] - link.body_column; j >= 0 && j < 6) {
                    own(j, i) = C.value[entry];
                } else if (link.parent > 0) {
                    other(C.column[entry] - parent, i) = C.value[entry];
                }
            }
        }
        const Eigen::Map<const Matrix<double, 6, 1>> needed(wanting.data() + link.body_column);
        const Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> lambda = own.colPivHouseholderQr().solve(needed);
        const auto place = std::lower_bound(self.held.begin(), self.held.end(), first) - self.held.begin();
        for (std::int32_t i = 0; i < count; ++i) carried[static_cast<std::size_t>(place + i)] = lambda[i];
        if (link.parent > 0) Eigen::Map<Matrix<double, 6, 1>>(wanting.data() + parent) -= other * lambda;
    }
    return carried;
}

double JointCoordinates::recovery_speed() const {
    return implementation_->bodies.recovery_speed();
}
double JointCoordinates::free_fall() const {
    return implementation_->bodies.free_fall();
}
double JointCoordinates::gap_resolution() const {
    return implementation_->bodies.gap_resolution();
}
double JointCoordinates::energy(const State& state) const {
    auto& self = *implementation_;
    self.place(state);
    return self.bodies.energy(self.state);
}
bool JointCoordinates::is_driven() const {
    return implementation_->bodies.is_driven();
}
double JointCoordinates::supplied_power(const State& state) const {
    auto& self = *implementation_;
    self.place(state);
    return self.bodies.supplied_power(self.state);
}

}  // namespace delassus
