// SPDX-License-Identifier: BSD-3-Clause
// M, f, K and R of a multibody system.
#include <algorithm>
#include <limits>
#include <numeric>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::at_time;
using mechanics::Matrix3d;
using mechanics::Placements;
using mechanics::RowColumns;
using mechanics::RowMatrix;
using mechanics::RowVector;
using mechanics::TurnDamper;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

void add_matrix(std::int32_t row, std::int32_t column, const Matrix3d& matrix, double factor, Tangent tangent,
                MatrixAssembler& H) {
    const RowMajor3 block =
        tangent == Tangent::Exact ? RowMajor3(matrix) : RowMajor3(0.5 * (matrix + matrix.transpose()));
    H.add_block(row, column, 3, 3, block.data(), factor);
}

/// Adds a matrix of blocks over the moving nodes (or bodies) of an element, each with `freedoms` rows.
template <int freedoms, class Matrix, class Nodes>
void add_element(const Matrix& matrix, const Nodes& at, double factor, Tangent tangent, MatrixAssembler& H) {
    for (std::size_t a = 0; a < at.size(); ++a)
        for (std::size_t b = 0; b < at.size(); ++b) {
            if (at[a].column < 0 || at[b].column < 0) continue;
            const auto i = freedoms * static_cast<Eigen::Index>(a), j = freedoms * static_cast<Eigen::Index>(b);
            Eigen::Matrix<double, freedoms, freedoms, Eigen::RowMajor> block =
                matrix.template block<freedoms, freedoms>(i, j);
            if (tangent == Tangent::Symmetric)
                block = (0.5 * (block + matrix.template block<freedoms, freedoms>(j, i).transpose())).eval();
            H.add_block(at[a].column, at[b].column, freedoms, freedoms, block.data(), factor);
        }
}

/// The entries of x (n) at the ends of a beam; 0 of what is fixed.
mechanics::BeamInertia::Forces gathered(const mechanics::BeamInertia::Ends& at, const double* x) {
    mechanics::BeamInertia::Forces result = mechanics::BeamInertia::Forces::Zero();
    for (std::size_t i = 0; i < 2; ++i)
        if (at[i].column >= 0)
            result.segment<6>(6 * static_cast<Eigen::Index>(i)) =
                Eigen::Map<const Eigen::Matrix<double, 6, 1>>(x + at[i].column);
    return result;
}

/// result (n) += factor · forces on the ends.
void scatter(const mechanics::BeamInertia::Forces& forces, const mechanics::BeamInertia::Ends& at, double factor,
             double* result) {
    for (std::size_t i = 0; i < 2; ++i)
        if (at[i].column >= 0)
            Eigen::Map<Eigen::Matrix<double, 6, 1>>(result + at[i].column) +=
                factor * forces.segment<6>(6 * static_cast<Eigen::Index>(i));
}

/// The velocities of the bodies of a row, in the order of its columns.
RowVector velocities_of(const RowColumns& columns, const Placements& at) {
    RowVector v(6 * columns.bodies);
    for (int k = 0; k < columns.bodies; ++k) {
        const auto& place = at[columns.body[static_cast<std::size_t>(k)]];
        v.segment<3>(6 * k) = place.v;
        v.segment<3>(6 * k + 3) = place.omega;
    }
    return v;
}

/// k C + c Ċ of a spring; columns and gradient: its own.
double tension(const mechanics::RowSpring& spring, const RowColumns& columns, const RowVector& gradient,
               const Placements& at, double t) {
    double result =
        spring.stiffness * spring.row.value(at, t) + spring.damping * gradient.dot(velocities_of(columns, at));
    if (spring.row.drive) result -= spring.damping * spring.row.drive->rate(t);
    return result;
}

/// result (n) += factor · gradient, at the moving bodies.
void scatter(const RowColumns& columns, const RowVector& gradient, double factor, double* result) {
    for (int k = 0; k < columns.bodies; ++k)
        if (const auto column = columns.column[static_cast<std::size_t>(k)]; column >= 0)
            Eigen::Map<Eigen::Matrix<double, 6, 1>>(result + column) += factor * gradient.segment<6>(6 * k);
}

/// act(spring, its columns) for the springs of these numbers, with its gradient in self.gradient; after place().
template <class Implementation, class Act>
void for_each_spring(const Implementation& self, std::span<const std::int32_t> numbers, const Act& act) {
    for (const std::int32_t number : numbers) {
        const auto& spring = self.springs[static_cast<std::size_t>(number)];
        const RowColumns columns = spring.row.columns(self.at, true);
        spring.row.gradient(self.at, columns, self.gradient);
        act(spring, columns);
    }
}

// In the frames of the bodies the torques are −c (ω̄_s − P ω̄_f) on the second and −c (ω̄_f − Pᵀ ω̄_s) on the first, with
// P = A_sᵀ A_f. Along increments δ(P ω̄_f) = [P ω̄_f]× θ_s − P [ω̄_f]× θ_f, and the same with the bodies exchanged.
/// H += factor c · blocks on a body's own turning and on the other's: own(P, ω̄_other) and other(P, ω̄_other).
template <class Own, class Other>
void add_damper(const TurnDamper& damper, const Placements& at, double factor, Tangent tangent, MatrixAssembler& H,
                Own&& own, Other&& other) {
    RowColumns columns;
    for (const BodyIndex body : {damper.first, damper.second})
        if (at[body].column >= 0) columns.add(body, at[body].column);
    RowMatrix matrix = RowMatrix::Zero(6 * columns.bodies, 6 * columns.bodies);
    for (const auto& [here, there] :
         {std::pair{&at[damper.second], &at[damper.first]}, {&at[damper.first], &at[damper.second]}}) {
        const int row = columns.place(here->column), column = columns.place(there->column);
        const Matrix3d P = here->A.transpose() * there->A;
        if (row >= 0) matrix.block<3, 3>(row + 3, row + 3) += damper.damping * own(P, there->omega);
        if (row >= 0 && column >= 0) matrix.block<3, 3>(row + 3, column + 3) += damper.damping * other(P, there->omega);
    }
    add_local(columns, matrix, factor, tangent, H);
}

// A force F̄ and a torque T̄ in the frame of the body: f = (A F̄, s̄ × F̄ + T̄), so that −∂f/∂θ = (A [F̄]×, 0). The
// symmetric tangent takes nothing of it: half of it with its transpose would be indefinite, and in a linearised step
// the transpose is a torque that does not exist, by which a force through the mass centre would change the spin.
void add_follower(const mechanics::Load& load, const mechanics::Placement& place, double t, double factor,
                  Tangent tangent, MatrixAssembler& H) {
    if (tangent == Tangent::Symmetric) return;
    const RowMajor3 K = place.A * skew(at_time(load.parameters.force, t));
    H.add_block(place.column, place.column + 3, 3, 3, K.data(), factor);
}

}  // namespace

void MultibodySystem::add_mass(const State& state, double factor, MatrixAssembler& M) const {
    const auto& self = *implementation_;
    for (const auto& body : self.moving) {
        for (int i = 0; i < 3; ++i) M.add(body.column + i, body.column + i, factor * body.mass);
        const Matrix3d& J = body.inertia;
        if (body.diagonal) {
            for (int i = 0; i < 3; ++i) M.add(body.column + 3 + i, body.column + 3 + i, factor * J(i, i));
        } else {
            M.add_block(body.column + 3, body.column + 3, 3, 3, RowMajor3(J).data(), factor);
        }
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            for (int i = 0; i < 3; ++i) M.add(node.column + i, node.column + i, factor * node.parameters.mass);
    self.add_modal_mass(state, factor, M);
    if (self.beam_inertias.empty()) return;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_inertia([&](const auto& inertia, const auto& at) {
        mechanics::BeamInertia::Matrix matrix;
        inertia.mass(at, matrix);
        add_element<6>(matrix, at, factor, Tangent::Exact, M);
    });
}

void MultibodySystem::add_metric(double factor, MatrixAssembler& M) const {
    const auto& self = *implementation_;
    add_mass(initial_state(), factor, M);
    for (const auto& body : self.moving) {
        const auto& stands_in = self.bodies[static_cast<std::size_t>(body.body)];
        if (!stands_in.parameters.massless) continue;
        for (int i = 0; i < 3; ++i) {
            M.add(body.column + i, body.column + i, factor * stands_in.metric_mass);
            M.add(body.column + 3 + i, body.column + 3 + i, factor * stands_in.metric_inertia(i, i));
        }
    }
}

void MultibodySystem::multiply_mass(const State& state, double factor, const double* x, double* result) const {
    const auto& self = *implementation_;
    for (const auto& body : self.moving) {
        const Eigen::Map<const Vector3d> linear(x + body.column), angular(x + body.column + 3);
        Eigen::Map<Vector3d>(result + body.column) += factor * body.mass * linear;
        Eigen::Map<Vector3d>(result + body.column + 3) += factor * (body.inertia * angular);
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            for (int i = 0; i < 3; ++i) result[node.column + i] += factor * node.parameters.mass * x[node.column + i];
    self.multiply_modal_mass(state, factor, x, result);
    if (self.beam_inertias.empty()) return;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_inertia([&](const auto& inertia, const auto& at) {
        mechanics::BeamInertia::Forces product;
        inertia.multiply_mass(at, gathered(at, x), product);
        scatter(product, at, factor, result);
    });
}

// What is not definite: the symmetric tangent takes its symmetric part where that leaves M definite.
void MultibodySystem::add_inertial_stiffness(const State& state, const double* acceleration, double factor,
                                             Tangent tangent, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.add_modal_inertial_stiffness(state, acceleration, factor, tangent, H);
    if (self.beam_inertias.empty()) return;
    self.place(state.q.data(), nullptr, state.t);
    self.for_each_inertia([&](const auto& inertia, const auto& at) {
        mechanics::BeamInertia::Matrix matrix;
        inertia.inertial_stiffness(at, gathered(at, acceleration), matrix);
        if (tangent == Tangent::Symmetric && !inertia.leaves_definite(at, matrix, factor)) return;
        add_element<6>(matrix, at, factor, tangent, H);
    });
}

void MultibodySystem::Implementation::add_loads(double t, double factor, double* result) const {
    for (const auto& load : loads) {
        const Vector3d force = load_factor * at_time(load.parameters.force, t);
        for (const auto& [node, share] : load.parameters.nodes)
            if (const auto column = nodes[static_cast<std::size_t>(node)].column; column >= 0)
                Eigen::Map<Vector3d>(result + column) += factor * share * force;
        if (!load.parameters.nodes.empty()) continue;
        const auto& place = at[load.parameters.body];
        if (place.column < 0) continue;
        const Vector3d torque = load_factor * at_time(load.parameters.torque, t);
        if (load.parameters.follower) {
            Eigen::Map<Vector3d>(result + place.column) += factor * (place.A * force);
            Eigen::Map<Vector3d>(result + place.column + 3) += factor * (load.point.cross(force) + torque);
            continue;
        }
        Eigen::Map<Vector3d>(result + place.column) += factor * force;
        Eigen::Map<Vector3d>(result + place.column + 3) +=
            factor * (load.point.cross(place.A.transpose() * force) + place.A.transpose() * torque);
    }
}

// Gravity m g; gyroscopic torque −ω̄ × J ω̄ (Newton and Euler in the body frame); springs −(k C + c Ċ) ∇C; loads
// (F, s̄ × Aᵀ F + Aᵀ T).
void MultibodySystem::add_force(const State& state, double factor, double* result) const {
    const auto& self = *implementation_;
    self.place(state);
    const Vector3d gravity = self.load_factor * vector(self.gravity);
    for (const auto& body : self.moving) {
        const Vector3d& omega = self.at[body.body].omega;
        Eigen::Map<Vector3d>(result + body.column) += factor * body.mass * gravity;
        Eigen::Map<Vector3d>(result + body.column + 3) -= factor * omega.cross(body.inertia * omega);
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0) Eigen::Map<Vector3d>(result + node.column) += factor * node.parameters.mass * gravity;
    for (const auto& spring : self.springs) {
        const auto columns = spring.row.columns(self.at, true);
        spring.row.gradient(self.at, columns, self.gradient);
        scatter(columns, self.gradient, -factor * tension(spring, columns, self.gradient, self.at, state.t), result);
    }
    for (const auto& damper : self.turn_dampers) {
        const auto &first = self.at[damper.first], &second = self.at[damper.second];
        const Vector3d torque = -damper.damping * (second.A * second.omega - first.A * first.omega);
        for (const auto& [place, sign] : {std::pair{&first, -1.0}, {&second, 1.0}})
            if (place->column >= 0)
                Eigen::Map<Vector3d>(result + place->column + 3) += factor * sign * (place->A.transpose() * torque);
    }
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        using Element = std::decay_t<decltype(element)>;
        constexpr int freedoms = Element::freedoms;
        typename Element::Forces forces;
        element.force(at, forces);
        for (std::size_t a = 0; a < at.size(); ++a)
            if (at[a].column >= 0)
                Eigen::Map<Eigen::Matrix<double, freedoms, 1>>(result + at[a].column) +=
                    factor * forces.template segment<freedoms>(freedoms * static_cast<Eigen::Index>(a));
    });
    self.for_each_inertia([&](const auto& inertia, const auto& at) {
        mechanics::BeamInertia::Forces forces;
        inertia.force(at, gravity, forces);
        scatter(forces, at, factor, result);
    });
    self.add_loads(state.t, factor, result);
    self.add_modal_force(state, factor, result);
}

// What an element does to all bodies at its ends is what its potential loses and its damper takes. So what it does to
// those that are free to move, beside that, is what it takes from the others: of a spring T times the part of Ċ that is
// prescribed. The potential of an actuator is not counted, so that all it does is supplied.
double MultibodySystem::supplied_power(const State& state) const {
    const auto& self = *implementation_;
    const auto moves_as_prescribed = [&](BodyIndex body) {
        return body != world_body && self.bodies[static_cast<std::size_t>(body)].prescribed;
    };
    for (const auto& inertia : self.beam_inertias)
        if (std::ranges::any_of(inertia.bodies(), moves_as_prescribed)) return std::numeric_limits<double>::quiet_NaN();
    if (self.has_armature && !self.prescribed.empty()) return std::numeric_limits<double>::quiet_NaN();
    self.place(state);
    std::vector<double>& force = self.generalized_force;
    force.assign(state.v.size(), 0.0);
    self.add_loads(state.t, 1.0, force.data());
    double power = 0.0;
    for (const auto& spring : self.springs) {
        if (spring.potential && !spring.row.drive && self.prescribed.empty()) continue;
        const auto columns = spring.row.columns(self.at, true);
        spring.row.gradient(self.at, columns, self.gradient);
        const double T = tension(spring, columns, self.gradient, self.at, state.t);
        if (!spring.potential) {
            scatter(columns, self.gradient, -T, force.data());
            continue;
        }
        if (spring.row.drive) power -= T * spring.row.drive->rate(state.t);
        const RowVector v = velocities_of(columns, self.at);
        for (int k = 0; k < columns.bodies; ++k)
            if (columns.column[static_cast<std::size_t>(k)] < 0)
                power += T * self.gradient.segment<6>(6 * k).dot(v.segment<6>(6 * k));
    }
    if (!self.prescribed.empty()) {
        for (const auto& damper : self.turn_dampers) {
            const auto &first = self.at[damper.first], &second = self.at[damper.second];
            const Vector3d slip = second.A * second.omega - first.A * first.omega;
            if (first.column < 0) power -= damper.damping * slip.dot(first.A * first.omega);
            if (second.column < 0) power += damper.damping * slip.dot(second.A * second.omega);
        }
        for (const auto& beam : self.beams) {
            const mechanics::Beam::Ends ends{self.at[beam.bodies()[0]], self.at[beam.bodies()[1]]};
            mechanics::Beam::Forces forces;
            beam.force(ends, forces);
            for (std::size_t k = 0; k < ends.size(); ++k) {
                if (ends[k].column >= 0) continue;
                const auto place = 6 * static_cast<Eigen::Index>(k);
                power -= forces.segment<3>(place).dot(ends[k].v) + forces.segment<3>(place + 3).dot(ends[k].omega);
            }
        }
    }
    return std::inner_product(force.begin(), force.end(), state.v.begin(), power);
}

// Springs: f = −(k C + c Ċ) ∇C, so that K = k ∇C ∇Cᵀ + (k C + c Ċ) ∇²C + c ∇C (∂Ċ/∂q)ᵀ with Ċ = ∇C · v and
// (∂Ċ/∂q)_j = Σ_i v_i ∇²C_ij. The force of an actuator may be large beside light links, and ∇²C is indefinite: the
// symmetric tangent of a joint's coordinate takes k ∇C ∇Cᵀ alone. Loads: −∂(s̄ × Aᵀ F + Aᵀ T)/∂θ = −[s̄]× [Aᵀ F]× − [Aᵀ
// T]×.
void MultibodySystem::add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state);
    for (const auto& spring : self.springs) {
        const auto columns = spring.row.columns(self.at, true);
        spring.row.gradient(self.at, columns, self.gradient);
        add_row_product(columns, self.gradient, factor * spring.stiffness, H);
        if (spring.definite && tangent == Tangent::Symmetric) continue;
        spring.row.hessian(self.at, columns, self.hessian);
        const RowVector turning = self.hessian.transpose() * velocities_of(columns, self.at);
        RowMatrix K = tension(spring, columns, self.gradient, self.at, state.t) * self.hessian;
        K += spring.damping * self.gradient * turning.transpose();
        add_local(columns, K, factor, tangent, H);
    }
    for (const auto& damper : self.turn_dampers) {
        if (tangent == Tangent::Symmetric) break;  // as of coordinates
        add_damper(
            damper, self.at, factor, tangent, H,
            [](const Matrix3d& P, const Vector3d& omega) -> Matrix3d { return -skew(P * omega); },
            [](const Matrix3d& P, const Vector3d& omega) -> Matrix3d { return P * skew(omega); });
    }
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        using Element = std::decay_t<decltype(element)>;
        typename Element::Matrix K;
        element.stiffness(at, K);
        add_element<Element::freedoms>(K, at, factor, tangent, H);
    });
    self.for_each_inertia([&](const auto& inertia, auto at) {
        mechanics::BeamInertia::Matrix K;
        inertia.stiffness(at, self.load_factor * vector(self.gravity), K);
        if (tangent == Tangent::Symmetric && !inertia.leaves_definite(at, K, factor)) {
            for (auto& end : at) end.v = end.omega = Vector3d::Zero();
            inertia.stiffness(at, self.load_factor * vector(self.gravity), K);
        }
        add_element<6>(K, at, factor, tangent, H);
    });
    for (const auto& load : self.loads) {
        if (!load.parameters.nodes.empty()) continue;
        const auto& place = self.at[load.parameters.body];
        if (place.column < 0) continue;
        if (load.parameters.follower) {
            add_follower(load, place, state.t, factor * self.load_factor, tangent, H);
            continue;
        }
        const Vector3d force = place.A.transpose() * at_time(load.parameters.force, state.t);
        const Vector3d torque = place.A.transpose() * at_time(load.parameters.torque, state.t);
        add_matrix(place.column + 3, place.column + 3, -skew(load.point) * skew(force) - skew(torque),
                   factor * self.load_factor, tangent, H);
    }
    self.add_modal_stiffness(state, factor, tangent, H);
}

// Springs: R = c ∇C ∇Cᵀ.
void MultibodySystem::add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state);
    for (const auto& spring : self.springs) {
        if (spring.damping == 0.0) continue;
        const auto columns = spring.row.columns(self.at);
        spring.row.gradient(self.at, columns, self.gradient);
        add_row_product(columns, self.gradient, factor * spring.damping, H);
    }
    for (const auto& damper : self.turn_dampers)
        add_damper(
            damper, self.at, factor, tangent, H,
            [](const Matrix3d&, const Vector3d&) -> Matrix3d { return Matrix3d::Identity(); },
            [](const Matrix3d& relative, const Vector3d&) -> Matrix3d { return -relative; });
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        if (!element.damped()) return;
        using Element = std::decay_t<decltype(element)>;
        typename Element::Matrix R;
        element.damping(at, R);
        add_element<Element::freedoms>(R, at, factor, tangent, H);
    });
    self.add_modal_damping(factor, tangent, H);
    self.for_each_inertia([&](const auto& inertia, const auto& at) {
        mechanics::BeamInertia::Matrix R;
        inertia.damping(at, R);
        if (tangent == Tangent::Symmetric && !inertia.leaves_definite(at, R, factor)) return;
        add_element<6>(R, at, factor, tangent, H);
    });
}

bool MultibodySystem::has_stiffness() const {
    const auto& self = *implementation_;
    return !self.springs.empty() || !self.turn_dampers.empty() || !self.loads.empty() || !self.element_sides.empty() ||
           !self.cables.empty() || !self.beams.empty();
}

// ---- Stiff springs ----
//
// A spring by itself moves the bodies at its ends, which weigh m with 1/m = ∇C M⁻¹ ∇Cᵀ along it, at the rate ω =
// √(k/m), and its damper brakes them at the rate c/m. Joints and other springs that hold these bodies are not seen.

void MultibodySystem::find_stiff_forces(double rate, std::vector<std::int32_t>& stiff) const {
    const auto& self = *implementation_;
    stiff.clear();
    if (self.springs.empty()) return;
    self.place(initial_state());
    std::vector<std::int32_t> all(self.springs.size());
    std::iota(all.begin(), all.end(), 0);
    std::int32_t number = 0;
    for_each_spring(self, all, [&](const auto& spring, const RowColumns& columns) {
        double weight = 0.0;  // 1/m
        for (int k = 0; k < columns.bodies; ++k) {
            if (columns.column[static_cast<std::size_t>(k)] < 0) continue;
            const auto& body = self.bodies[static_cast<std::size_t>(columns.body[static_cast<std::size_t>(k)])];
            const Vector3d push = self.gradient.segment<3>(6 * k), turn = self.gradient.segment<3>(6 * k + 3);
            if (!push.isZero(0.0)) weight += push.squaredNorm() / body.metric_mass;
            if (!turn.isZero(0.0)) weight += turn.dot(body.metric_inertia.ldlt().solve(turn));
        }
        if (mechanics::is_stiff(spring.stiffness * weight, spring.damping * weight, rate)) stiff.push_back(number);
        ++number;
    });
}

std::array<double, 2> MultibodySystem::stiff_force_constants(std::int32_t number) const {
    const auto& spring = implementation_->springs[static_cast<std::size_t>(number)];
    return {spring.stiffness, spring.damping};
}

void MultibodySystem::stiff_tensions(const State& state, std::span<const std::int32_t> stiff,
                                     std::vector<double>& tensions) const {
    const auto& self = *implementation_;
    self.place(state);
    tensions.clear();
    for_each_spring(self, stiff, [&](const auto& spring, const RowColumns& columns) {
        tensions.push_back(tension(spring, columns, self.gradient, self.at, state.t));
    });
}

void MultibodySystem::add_stiff_forces(const State& state, std::span<const std::int32_t> stiff,
                                       std::span<const double> tensions, double factor, double* result) const {
    const auto& self = *implementation_;
    self.place(state);
    auto next = tensions.begin();
    for_each_spring(self, stiff, [&](const auto&, const RowColumns& columns) {
        scatter(columns, self.gradient, -factor * *next++, result);
    });
}

void MultibodySystem::add_stiff_tangent(const State& state, std::span<const std::int32_t> stiff, double of_stiffness,
                                        double of_damping, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state);
    for_each_spring(self, stiff, [&](const auto& spring, const RowColumns& columns) {
        add_row_product(columns, self.gradient, of_stiffness * spring.stiffness + of_damping * spring.damping, H);
    });
}

}  // namespace delassus
