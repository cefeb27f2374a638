// SPDX-License-Identifier: BSD-3-Clause
// M, f, K and R of a multibody system.
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::Matrix3d;
using mechanics::RowMatrix;
using mechanics::RowVector;
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

Vector3d at_time(const std::array<Motion, 3>& motions, double t) {
    Vector3d result = Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
        if (motions[i].value) result[static_cast<Eigen::Index>(i)] = motions[i].value(t);
    return result;
}

}  // namespace

void MultibodySystem::add_mass(const State&, double factor, MatrixAssembler& M) const {
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
}

void MultibodySystem::multiply_mass(const State&, double factor, const double* x, double* result) const {
    const auto& self = *implementation_;
    for (const auto& body : self.moving) {
        const Eigen::Map<const Vector3d> linear(x + body.column), angular(x + body.column + 3);
        Eigen::Map<Vector3d>(result + body.column) += factor * body.mass * linear;
        Eigen::Map<Vector3d>(result + body.column + 3) += factor * (body.inertia * angular);
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0)
            for (int i = 0; i < 3; ++i) result[node.column + i] += factor * node.parameters.mass * x[node.column + i];
}

// Gravity m g; gyroscopic torque −ω̄ × J ω̄ (Newton and Euler in the body frame); springs −(k C + c Ċ) ∇C; loads
// (F, s̄ × Aᵀ F + Aᵀ T).
void MultibodySystem::add_force(const State& state, double factor, double* result) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), state.v.data());
    const Vector3d gravity = self.load_factor * vector(self.gravity);
    for (const auto& body : self.moving) {
        const Vector3d& omega = self.at[body.body].omega;
        Eigen::Map<Vector3d>(result + body.column) += factor * body.mass * gravity;
        Eigen::Map<Vector3d>(result + body.column + 3) -= factor * omega.cross(body.inertia * omega);
    }
    for (const auto& node : self.nodes)
        if (node.column >= 0) Eigen::Map<Vector3d>(result + node.column) += factor * node.parameters.mass * gravity;
    for (const auto& spring : self.springs) {
        const auto columns = spring.row.columns(self.at);
        spring.row.gradient(self.at, state.t, columns, self.gradient);
        double force = spring.stiffness * spring.row.value(self.at, state.t);
        for (int k = 0; k < columns.bodies; ++k)
            for (int i = 0; i < 6; ++i)
                force += spring.damping * self.gradient[6 * k + i] *
                         state.v[static_cast<std::size_t>(columns.column[static_cast<std::size_t>(k)] + i)];
        for (int k = 0; k < columns.bodies; ++k)
            for (int i = 0; i < 6; ++i)
                result[columns.column[static_cast<std::size_t>(k)] + i] -= factor * force * self.gradient[6 * k + i];
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
    for (const auto& load : self.loads) {
        const auto& place = self.at[load.parameters.body];
        if (place.column < 0) continue;
        const Vector3d force = self.load_factor * at_time(load.parameters.force, state.t);
        const Vector3d torque = self.load_factor * (place.A.transpose() * at_time(load.parameters.torque, state.t));
        Eigen::Map<Vector3d>(result + place.column) += factor * force;
        Eigen::Map<Vector3d>(result + place.column + 3) +=
            factor * (load.point.cross(place.A.transpose() * force) + torque);
    }
}

// Springs: f = −(k C + c Ċ) ∇C, so that K = k ∇C ∇Cᵀ + (k C + c Ċ) ∇²C + c ∇C (∂Ċ/∂q)ᵀ with Ċ = ∇C · v and
// (∂Ċ/∂q)_j = Σ_i v_i ∇²C_ij. Loads: −∂(s̄ × Aᵀ F + Aᵀ T)/∂θ = −[s̄]× [Aᵀ F]× − [Aᵀ T]×.
void MultibodySystem::add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), state.v.data());
    for (const auto& spring : self.springs) {
        const auto columns = spring.row.columns(self.at);
        spring.row.gradient(self.at, state.t, columns, self.gradient);
        spring.row.hessian(self.at, state.t, columns, self.hessian);
        RowVector v(6 * columns.bodies);
        for (int k = 0; k < columns.bodies; ++k)
            v.segment<6>(6 * k) = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(
                state.v.data() + columns.column[static_cast<std::size_t>(k)]);
        const double force =
            spring.stiffness * spring.row.value(self.at, state.t) + spring.damping * self.gradient.dot(v);
        const RowVector turning = self.hessian.transpose() * v;
        RowMatrix K = spring.stiffness * self.gradient * self.gradient.transpose() + force * self.hessian;
        K += spring.damping * self.gradient * turning.transpose();
        add_local(columns, K, factor, tangent, H);
    }
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        using Element = std::decay_t<decltype(element)>;
        typename Element::Matrix K;
        element.stiffness(at, K);
        add_element<Element::freedoms>(K, at, factor, tangent, H);
    });
    for (const auto& load : self.loads) {
        const auto& place = self.at[load.parameters.body];
        if (place.column < 0) continue;
        const Vector3d force = place.A.transpose() * at_time(load.parameters.force, state.t);
        const Vector3d torque = place.A.transpose() * at_time(load.parameters.torque, state.t);
        add_matrix(place.column + 3, place.column + 3, -skew(load.point) * skew(force) - skew(torque),
                   factor * self.load_factor, tangent, H);
    }
}

// Springs: R = c ∇C ∇Cᵀ.
void MultibodySystem::add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const {
    const auto& self = *implementation_;
    self.place(state.q.data(), state.v.data());
    for (const auto& spring : self.springs) {
        if (spring.damping == 0.0) continue;
        const auto columns = spring.row.columns(self.at);
        spring.row.gradient(self.at, state.t, columns, self.gradient);
        const RowMatrix R = spring.damping * self.gradient * self.gradient.transpose();
        add_local(columns, R, factor, tangent, H);
    }
    self.for_each_element(state, [&](const auto& element, const auto& at) {
        if (!element.damped()) return;
        using Element = std::decay_t<decltype(element)>;
        typename Element::Matrix R;
        element.damping(at, R);
        add_element<Element::freedoms>(R, at, factor, tangent, H);
    });
}

bool MultibodySystem::has_stiffness() const {
    const auto& self = *implementation_;
    return !self.springs.empty() || !self.loads.empty() || !self.tetrahedra.empty() || !self.cables.empty() ||
           !self.beams.empty();
}

}  // namespace delassus
