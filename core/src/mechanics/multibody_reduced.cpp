// SPDX-License-Identifier: BSD-3-Clause
// Elastic bodies of few modes in a multibody system (modal_body.hpp, modal_reduction.hpp, modal_attachment.hpp).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <type_traits>
#include <utility>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"
#include "support/pivoted_qr.hpp"

namespace delassus {

using mechanics::array;
using mechanics::Matrix3d;
using mechanics::ModalAttachment;
using mechanics::ModalPlacement;
using mechanics::Placement;
using mechanics::Quaterniond;
using mechanics::refuse_unless;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A square matrix over θ and s of a modal body, or its symmetric part.
void add_square(const MatrixXd& matrix, std::int32_t column, double factor, MatrixAssembler& H) {
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> block = matrix;
    const auto size = static_cast<std::int32_t>(block.rows());
    H.add_block(column, column, size, size, block.data(), factor);
}

}  // namespace

// ---- Building ----

void MultibodySystem::Implementation::must_have_columns(std::int32_t node, std::string_view what) const {
    if (const auto reduced_body = nodes[static_cast<std::size_t>(node)].reduced; reduced_body >= 0)
        throw InputError(
            fmt::format("{} names a node of \"{}\", which is reduced to modes: its nodes take no "
                        "element and no cable",
                        what, reduced[static_cast<std::size_t>(reduced_body)].name));
}

std::int32_t MultibodySystem::Implementation::reduced_of(const std::vector<std::int32_t>& named,
                                                         const std::string& who) const {
    const auto of = [&](std::int32_t node) { return nodes[static_cast<std::size_t>(node)].reduced; };
    const std::int32_t first = of(named.front());
    for (const auto node : named)
        refuse_unless(of(node) == first, "the attachment", who,
                      "holds nodes of several bodies, of which one is reduced to modes; attach each by itself");
    return first;
}

std::int32_t MultibodySystem::add_reduced_body(const ReducedBodyParameters& parameters) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    mechanics::ReducedSolid body;
    body.mesh = std::make_unique<MultibodySystem>();
    body.modes = parameters.modes;
    double contact_radius = 0.0;
    std::int32_t contact_material = -1;
    std::visit(
        [&](const auto& given) {
            refuse_unless(parameters.modes >= 0, "the modes of the elastic body", given.name,
                          fmt::format("are {}; their number must not be negative", parameters.modes));
            refuse_unless(mechanics::finite(given.velocity) && mechanics::finite(given.angular_velocity),
                          "the velocity of the elastic body", given.name, "is not finite");
            body.name = given.name;
            body.damping_time = given.material.damping_time;
            body.damping_rate = given.material.damping_rate;
            body.velocity = given.velocity;
            body.angular_velocity = given.angular_velocity;
            mechanics::check_material(given.material);
            contact_radius = given.contact_radius;
            contact_material = given.contact_material;
            auto solid = given;
            solid.contact_radius = 0.0;
            solid.material.damping_time = solid.material.damping_rate = 0.0;
            solid.velocity = solid.angular_velocity = {};
            if constexpr (std::is_same_v<std::decay_t<decltype(given)>, ElasticBlock>) {
                body.mesh->add_elastic_block(solid);
            } else {
                body.mesh->add_elastic_mesh(solid);
            }
        },
        parameters.solid);
    auto& mesh = *body.mesh->implementation_;
    body.first_node = node_count();
    body.nodes = body.mesh->node_count();
    const auto index = static_cast<std::int32_t>(self.reduced.size());
    std::vector<std::int32_t> fixed;
    for (std::int32_t k = 0; k < body.nodes; ++k) {
        auto& node = mesh.nodes[static_cast<std::size_t>(k)];
        if (std::exchange(node.parameters.fixed, false)) fixed.push_back(body.first_node + k);
        mechanics::Node own;
        own.parameters = node.parameters;
        own.reduced = index;
        self.nodes.push_back(own);
    }
    const std::size_t sides_before = self.element_sides.size();
    for (auto side : mesh.element_sides) {
        for (auto& node : side.corners) node += body.first_node;
        for (auto& node : side.middles)
            if (node >= 0) node += body.first_node;
        self.element_sides.push_back(side);
    }
    const auto first = body.first_node;
    const std::string name = body.name;
    self.reduced.push_back(std::move(body));
    if (contact_radius > 0.0) {
        std::set<std::int32_t> touching;
        for (const auto& side : mechanics::outer_sides(std::span(self.element_sides).subspan(sides_before)))
            side.for_each_node([&](std::int32_t node) { touching.insert(node); });
        for (const auto node : touching) add_node_contact(node, contact_radius, contact_material);
    }
    if (!fixed.empty()) self.attach_reduced({name, fixed, world_body}, index);
    return first;
}

void MultibodySystem::Implementation::attach_reduced(const AttachmentParameters& parameters, std::int32_t index) {
    const auto& body = reduced[static_cast<std::size_t>(index)];
    ModalAttachment one;
    one.reduced = index;
    one.body = parameters.body;
    one.name = parameters.name;
    for (const auto node : parameters.nodes) one.nodes.push_back(node - body.first_node);
    std::sort(one.nodes.begin(), one.nodes.end());
    one.nodes.erase(std::unique(one.nodes.begin(), one.nodes.end()), one.nodes.end());
    for (const auto& other : modal_attachments)
        refuse_unless(
            other.reduced != index || std::find_first_of(one.nodes.begin(), one.nodes.end(), other.nodes.begin(),
                                                         other.nodes.end()) == one.nodes.end(),
            "the attachment", parameters.name, "holds a node that is fixed or attached already");
    modal_attachments.push_back(std::move(one));
}

void MultibodySystem::Implementation::reduce_bodies() {
    const auto placements = initial_placements();
    modal_at.resize(reduced.size());
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        auto& body = reduced[k];
        body.mesh->finish();
        const auto& mesh = *body.mesh->implementation_;
        mechanics::ElasticStructure structure;
        structure.places.resize(3, body.nodes);
        structure.mass.resize(body.nodes);
        for (std::int32_t i = 0; i < body.nodes; ++i) {
            const auto& node = mesh.nodes[static_cast<std::size_t>(i)].parameters;
            structure.places.col(i) = vector(node.position);
            structure.mass[i] = node.mass;
        }
        MatrixAssembler assembler;
        assembler.begin(mesh.n, mesh.n);
        body.mesh->add_stiffness(body.mesh->initial_state(), 1.0, Tangent::Exact, assembler);
        structure.K = assembler.finish();
        std::vector<ModalAttachment*> held;
        std::vector<std::vector<std::int32_t>> interfaces;
        for (auto& one : modal_attachments)
            if (one.reduced == static_cast<std::int32_t>(k)) {
                held.push_back(&one);
                interfaces.push_back(one.nodes);
            }
        std::vector<mechanics::ModalLoadPattern> patterns;
        const std::size_t first_load = modal_loads.size();
        for (std::size_t i = 0; i < loads.size(); ++i) {
            mechanics::ModalLoadPattern pattern;
            mechanics::ModalLoad load{i, static_cast<std::int32_t>(k), 0.0, {}};
            for (const auto& [node, share] : loads[i].parameters.nodes) {
                if (nodes[static_cast<std::size_t>(node)].reduced != load.reduced) continue;
                pattern.shares.push_back({node - body.first_node, share});
                load.weight += share;
            }
            if (pattern.shares.empty()) continue;
            for (std::size_t along = 0; along < 3; ++along)
                pattern.along[along] = static_cast<bool>(loads[i].parameters.force[along].value);
            patterns.push_back(std::move(pattern));
            modal_loads.push_back(std::move(load));
        }
        body.model = mechanics::reduce(body.name, structure, interfaces, patterns, body.modes);
        body.mesh.reset();
        auto& model = body.model;
        model.inertia.damping_time = body.damping_time;
        model.inertia.damping_rate = body.damping_rate;
        for (std::size_t i = 0; i < held.size(); ++i) {
            held[i]->interface = model.interfaces[i];
            const Placement& place = placements[held[i]->body];
            held[i]->axes = place.A.transpose();
            held[i]->arm = place.A.transpose() * (model.centre + held[i]->interface.point.place - place.x);
        }
        for (std::size_t i = 0; i < patterns.size(); ++i) modal_loads[first_load + i].point = model.loads[i];
        const auto count = static_cast<std::int32_t>(model.inertia.modes());
        body.position = position_size;
        body.column = n;
        position_size += 7 + count;
        n += 6 + count;
        modal_at[k].column = body.column;
        modal_at[k].s = modal_at[k].s_dot = VectorXd::Zero(count);
        ReducedBody shown{body.name, body.first_node, body.position, body.column, model.inertia.mass, {}, {}, {}};
        for (const double square : model.inertia.squares)
            shown.frequencies.push_back(std::sqrt(square) / (2.0 * std::numbers::pi));
        for (std::int32_t i = 0; i < body.nodes; ++i) shown.places.push_back(array(model.places.col(i)));
        shown.shapes.assign(model.shapes.data(), model.shapes.data() + model.shapes.size());
        reduced_bodies.push_back(std::move(shown));
    }
}

const std::vector<ReducedBody>& MultibodySystem::reduced_bodies() const {
    return implementation_->reduced_bodies;
}

// ---- States ----

void MultibodySystem::Implementation::append_modal_start(State& state) const {
    for (const auto& body : reduced) {
        const auto count = static_cast<std::size_t>(body.model.inertia.modes());
        const Vector3d& centre = body.model.centre;
        state.q.insert(state.q.end(), {centre.x(), centre.y(), centre.z(), 1.0, 0.0, 0.0, 0.0});
        state.q.insert(state.q.end(), count, 0.0);
        state.v.insert(state.v.end(), body.velocity.begin(), body.velocity.end());
        state.v.insert(state.v.end(), body.angular_velocity.begin(), body.angular_velocity.end());
        state.v.insert(state.v.end(), count, 0.0);
    }
}

void MultibodySystem::Implementation::place_modal(const double* q, const double* v) const {
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        auto& place = modal_at[k];
        const auto& body = reduced[k];
        const auto count = place.s.size();
        const double* from = q + body.position;
        place.x = Eigen::Map<const Vector3d>(from);
        place.A = Quaterniond(from[3], from[4], from[5], from[6]).toRotationMatrix();
        place.s = Eigen::Map<const VectorXd>(from + 7, count);
        if (!v) continue;
        place.v = Eigen::Map<const Vector3d>(v + body.column);
        place.omega = Eigen::Map<const Vector3d>(v + body.column + 3);
        place.s_dot = Eigen::Map<const VectorXd>(v + body.column + 6, count);
    }
}

mechanics::NodePlacement MultibodySystem::Implementation::node_of_reduced(std::int32_t index, const double* q,
                                                                          const double* v) const {
    const auto& body = reduced[static_cast<std::size_t>(nodes[static_cast<std::size_t>(index)].reduced)];
    const auto& model = body.model;
    const Eigen::Index local = index - body.first_node, count = model.inertia.modes();
    const auto shape = model.shapes.middleRows(3 * local, 3);
    const double* from = q + body.position;
    const Matrix3d A = Quaterniond(from[3], from[4], from[5], from[6]).toRotationMatrix();
    const Vector3d u = model.places.col(local) + shape * Eigen::Map<const VectorXd>(from + 7, count);
    const double* rates = v + body.column;
    const Vector3d turning = Eigen::Map<const Vector3d>(rates + 3).cross(u);
    return {Eigen::Map<const Vector3d>(from) + A * u,
            Eigen::Map<const Vector3d>(rates) + A * (turning + shape * Eigen::Map<const VectorXd>(rates + 6, count)),
            -1};
}

// A body is first moved rigidly to where its attachments hold, or nearest to it; then it is deformed.
void MultibodySystem::Implementation::carry_reduced(State& state) const {
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        const auto& body = reduced[k];
        const auto count = body.model.inertia.modes();
        std::vector<const ModalAttachment*> held;
        std::int32_t rows = 0;
        for (const auto& one : modal_attachments)
            if (one.reduced == static_cast<std::int32_t>(k)) {
                held.push_back(&one);
                rows += one.rows();
            }
        if (rows == 0) continue;
        constexpr double singular = 1e-10;
        const double reach = body.model.places.colwise().norm().maxCoeff();
        const auto gather = [&](auto&& of) {
            MatrixXd all;
            Eigen::Index row = 0;
            for (const auto* one : held) {
                const MatrixXd part = of(*one, modal_at[k], at[one->body]);
                if (row == 0) all.resize(rows, part.cols());
                all.middleRows(row, part.rows()) = part;
                row += part.rows();
            }
            return all;
        };
        const auto jacobian = [&] {
            return MatrixXd(
                gather([&](const ModalAttachment& one, const ModalPlacement& own, const Placement& of_body) {
                    return MatrixXd(one.jacobian(own, of_body).leftCols(6 + count));
                }));
        };
        /// The change of (c, ϑ, s) that takes a residual away.
        const auto change = [&](const MatrixXd& D, const VectorXd& residual) {
            VectorXd delta(6 + count);
            delta.head<6>() = least_solution(D.leftCols<6>(), -residual, singular);
            delta.tail(count) =
                least_solution(D.rightCols(count), -residual - D.leftCols<6>() * delta.head<6>(), singular);
            return delta;
        };
        constexpr int most_iterations = 20;
        for (int i = 0; i < most_iterations; ++i) {
            place(state);
            const VectorXd C = gather([](const ModalAttachment& one, const ModalPlacement& own,
                                         const Placement& of_body) { return MatrixXd(one.value(own, of_body)); });
            if (largest_entry(C) <= 1e-13 * (reach + modal_at[k].x.norm())) break;
            const VectorXd delta = change(jacobian(), C);
            double* q = state.q.data() + body.position;
            const Quaterniond turned = mechanics::rotated({q[3], q[4], q[5], q[6]}, delta.segment<3>(3));
            Eigen::Map<Vector3d>{q} += delta.head<3>();
            q[3] = turned.w();
            q[4] = turned.x();
            q[5] = turned.y();
            q[6] = turned.z();
            Eigen::Map<VectorXd>(q + 7, count) += delta.tail(count);
        }
        place(state);
        const MatrixXd D = jacobian();
        Eigen::Map<VectorXd> v(state.v.data() + body.column, 6 + count);
        double speed = v.norm();
        const VectorXd rate =
            gather([&](const ModalAttachment& one, const ModalPlacement& own, const Placement& of_body) {
                VectorXd result = one.rate(own, of_body);
                if (of_body.column < 0) return MatrixXd(result);
                const Eigen::Map<const Eigen::Matrix<double, 6, 1>> of(state.v.data() + of_body.column);
                speed = std::max(speed, of.norm());
                result += one.jacobian(own, of_body).rightCols(6) * of;
                return MatrixXd(result);
            });
        const VectorXd residual = D * v + rate;
        if (largest_entry(residual) > 1e-14 * (1.0 + reach) * speed) v += change(D, residual);
    }
}

// ---- M, f, K, R ----

void MultibodySystem::Implementation::add_modal_mass(const State& state, double factor, MatrixAssembler& M) const {
    place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        const auto column = reduced[k].column;
        const double mass = reduced[k].model.inertia.mass;
        const MatrixXd own = modal_dynamics(k).mass();
        for (int i = 0; i < 3; ++i) M.add(column + i, column + i, factor * mass);
        for (Eigen::Index i = 0; i < own.rows(); ++i)
            for (Eigen::Index j = 0; j < own.cols(); ++j)
                if (i < 3 || j < 3 || i == j)
                    M.add(column + 3 + static_cast<std::int32_t>(i), column + 3 + static_cast<std::int32_t>(j),
                          factor * own(i, j));
    }
}

void MultibodySystem::Implementation::multiply_modal_mass(const State& state, double factor, const double* x,
                                                          double* result) const {
    place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < reduced.size(); ++k)
        modal_dynamics(k).multiply_mass(factor, x + reduced[k].column, result + reduced[k].column);
}

void MultibodySystem::Implementation::add_modal_force(const State& state, double factor, double* result) const {
    const Vector3d weight = load_factor * vector(gravity);
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        double* own = result + reduced[k].column;
        Eigen::Map<Vector3d>{own} += factor * reduced[k].model.inertia.mass * weight;
        modal_dynamics(k).add_force(factor, own);
    }
    // A force F at the point c + A (X + Ψ s) with F̂ = Aᵀ F: (F, u × F̂, Ψᵀ F̂).
    for (const auto& load : modal_loads) {
        const auto& place = modal_at[static_cast<std::size_t>(load.reduced)];
        const Vector3d F = load_factor * mechanics::at_time(loads[load.load].parameters.force, state.t);
        const Vector3d turned = place.A.transpose() * F;
        double* own = result + place.column;
        Eigen::Map<Vector3d>{own} += factor * load.weight * F;
        Eigen::Map<Vector3d>(own + 3) += factor * load.point.at(place.s).cross(turned);
        Eigen::Map<VectorXd>(own + 6, place.s.size()) += factor * (load.point.shape.transpose() * turned);
    }
}

// The symmetric tangents of the body itself are m Ω² and its damping: what spin adds to them is not definite. Of a load
// δ(u × F̂) = [u]× [F̂]× ϑ − [F̂]× Ψ δs and δ(Ψᵀ F̂) = Ψᵀ [F̂]× ϑ.
void MultibodySystem::Implementation::add_modal_stiffness(const State& state, double factor, Tangent tangent,
                                                          MatrixAssembler& H) const {
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        const auto& inertia = reduced[k].model.inertia;
        const auto column = reduced[k].column;
        if (tangent == Tangent::Exact) {
            add_square(modal_dynamics(k).stiffness(), column + 3, factor, H);
            continue;
        }
        for (Eigen::Index a = 0; a < inertia.modes(); ++a) {
            const auto at_mode = column + 6 + static_cast<std::int32_t>(a);
            H.add(at_mode, at_mode, factor * inertia.mass * inertia.squares[a]);
        }
    }
    for (const auto& load : modal_loads) {
        const auto& place = modal_at[static_cast<std::size_t>(load.reduced)];
        const auto count = place.s.size();
        const Vector3d turned = place.A.transpose() * mechanics::at_time(loads[load.load].parameters.force, state.t);
        MatrixXd K = MatrixXd::Zero(3 + count, 3 + count);
        Matrix3d turning = -skew(load.point.at(place.s)) * skew(turned);
        if (tangent == Tangent::Symmetric) turning = (0.5 * (turning + turning.transpose())).eval();
        K.topLeftCorner<3, 3>() = turning;
        K.topRightCorner(3, count) = skew(turned) * load.point.shape;
        K.bottomLeftCorner(count, 3) = K.topRightCorner(3, count).transpose();
        add_square(K, place.column + 3, factor * load_factor, H);
    }
}

void MultibodySystem::Implementation::add_modal_damping(double factor, Tangent tangent, MatrixAssembler& H) const {
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        const auto& inertia = reduced[k].model.inertia;
        const auto column = reduced[k].column;
        if (inertia.damping_rate > 0.0)
            for (int i = 0; i < 3; ++i) H.add(column + i, column + i, factor * inertia.damping_rate * inertia.mass);
        if (tangent == Tangent::Exact) {
            add_square(modal_dynamics(k).damping(), column + 3, factor, H);
            continue;
        }
        if (inertia.damping_rate > 0.0)
            add_square(modal_dynamics(k).mass(), column + 3, factor * inertia.damping_rate, H);
        if (inertia.damping_time == 0.0) continue;
        for (Eigen::Index a = 0; a < inertia.modes(); ++a) {
            const auto at_mode = column + 6 + static_cast<std::int32_t>(a);
            H.add(at_mode, at_mode, factor * inertia.damping_time * inertia.mass * inertia.squares[a]);
        }
    }
}

void MultibodySystem::Implementation::add_modal_inertial_stiffness(const State& state, const double* acceleration,
                                                                   double factor, Tangent tangent,
                                                                   MatrixAssembler& H) const {
    if (tangent == Tangent::Symmetric) return;  // it is not definite
    place_modal(state.q.data(), state.v.data());
    for (std::size_t k = 0; k < reduced.size(); ++k) {
        const double* own = acceleration + reduced[k].column;
        const VectorXd amplitudes = Eigen::Map<const VectorXd>(own + 6, reduced[k].model.inertia.modes());
        add_square(modal_dynamics(k).inertial_stiffness(Eigen::Map<const Vector3d>(own + 3), amplitudes),
                   reduced[k].column + 3, factor, H);
    }
}

}  // namespace delassus
