// SPDX-License-Identifier: BSD-3-Clause
// Elements of elastic solids: derivatives, patch tests, and closed forms of the theory of beams.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <tuple>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"
#include "mechanics/solid_element.hpp"
#include "support/statics.hpp"

namespace delassus::tests::solid_test {
namespace {

using Eigen::Vector3d;
constexpr ElementModel models[] = {ElementModel::Corotational, ElementModel::StVenantKirchhoff};
constexpr ElementOrder orders[] = {ElementOrder::Linear, ElementOrder::Quadratic};

/// A block whose lattice of corners is moved to where `place` takes it. Elements keep straight edges.
struct Lattice {
    std::array<int, 3> cells{1, 1, 1};
    ElementOrder order = ElementOrder::Quadratic;
    ElasticMaterial material{1.0, 0.3, 1.0, 0.0};
    ElementModel model = ElementModel::Corotational;
    std::function<Vector3d(const Vector3d&)> place = [](const Vector3d& x) { return x; };  // of (0 … 1)³
    std::function<bool(const Vector3d&)> fixed = [](const Vector3d&) { return false; };    // likewise

    /// The places in (0 … 1)³ of the nodes.
    std::vector<Vector3d> build(MultibodySystem& system) const {
        system.set_gravity({0.0, 0.0, 0.0});
        const int parts = order == ElementOrder::Quadratic ? 2 : 1;
        const std::array<int, 3> steps{parts * cells[0], parts * cells[1], parts * cells[2]};
        const auto unit = [&](int i, int j, int k) {
            return Vector3d(double(i) / steps[0], double(j) / steps[1], double(k) / steps[2]);
        };
        const auto number = [&](int i, int j, int k) { return (i * (steps[1] + 1) + j) * (steps[2] + 1) + k; };
        const auto corner = [&](int i, int j, int k) { return i % parts == 0 && j % parts == 0 && k % parts == 0; };
        std::vector<Vector3d> places(static_cast<std::size_t>(number(steps[0], steps[1], steps[2]) + 1));
        std::vector<Vector3d> at(places.size());
        for (int i = 0; i <= steps[0]; ++i)
            for (int j = 0; j <= steps[1]; ++j)
                for (int k = 0; k <= steps[2]; ++k) {
                    const auto n = static_cast<std::size_t>(number(i, j, k));
                    places[n] = unit(i, j, k);
                    if (corner(i, j, k)) at[n] = place(places[n]);
                }
        // A node in the middle of an edge, which goes along the odd directions (Kuhn's diagonals point to + + +).
        for (int i = 0; i <= steps[0]; ++i)
            for (int j = 0; j <= steps[1]; ++j)
                for (int k = 0; k <= steps[2]; ++k)
                    if (!corner(i, j, k))
                        at[static_cast<std::size_t>(number(i, j, k))] =
                            0.5 * (at[static_cast<std::size_t>(number(i - i % 2, j - j % 2, k - k % 2))] +
                                   at[static_cast<std::size_t>(number(i + i % 2, j + j % 2, k + k % 2))]);
        for (std::size_t n = 0; n < at.size(); ++n) {
            NodeParameters node;
            node.position = {at[n].x(), at[n].y(), at[n].z()};
            node.fixed = fixed(places[n]);
            system.add_node(node);
        }
        for (int i = 0; i < steps[0]; i += parts)
            for (int j = 0; j < steps[1]; j += parts)
                for (int k = 0; k < steps[2]; k += parts) {
                    std::array<std::array<int, 3>, 8> corners;
                    for (int c = 0; c < 8; ++c)
                        corners[static_cast<std::size_t>(c)] = {i + parts * (c / 4), j + parts * (c / 2 % 2),
                                                                k + parts * (c % 2)};
                    const auto of = [&](const std::array<int, 3>& p) { return number(p[0], p[1], p[2]); };
                    if (parts == 1) {
                        std::array<std::int32_t, 8> nodes;
                        for (std::size_t c = 0; c < 8; ++c) nodes[c] = of(corners[c]);
                        system.add_brick(nodes, material, model);
                        continue;
                    }
                    for (const auto& path : mechanics::brick_tetrahedra) {
                        std::array<std::int32_t, 10> nodes;
                        for (std::size_t v = 0; v < 4; ++v) nodes[v] = of(corners[path[v]]);
                        for (std::size_t e = 0; e < 6; ++e) {
                            const auto [from, to] = mechanics::tetrahedron_edges[e];
                            const auto &a = corners[path[from]], &b = corners[path[to]];
                            nodes[4 + e] = number((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2);
                        }
                        system.add_quadratic_tetrahedron(nodes, material, model);
                    }
                }
        system.finish();
        return places;
    }
};

/// Moves each node to where `map` takes it.
State mapped(const MultibodySystem& system, const std::function<Vector3d(const Vector3d&)>& map) {
    State state = system.initial_state();
    const State start = state;
    for (std::int32_t n = 0; n < system.node_count(); ++n) {
        const Vector3 x = system.node_position(start, n);
        const auto column = system.node_column(n);
        if (column >= 0) Vector3d::Map(state.q.data() + column) = map(Vector3d(x[0], x[1], x[2]));
    }
    return state;
}

/// Inner nodes are pushed aside, by a tenth of an element.
Vector3d jittered(const Vector3d& x) {
    if ((x.array() < 1e-9).any() || (x.array() > 1.0 - 1e-9).any()) return x;
    return x +
           0.05 * Vector3d(std::sin(7.0 * x.y() + 3.0), std::cos(11.0 * x.z()), std::sin(5.0 * x.x() + 9.0 * x.z()));
}

/// Of the forces on the nodes within a lattice, of which there are some.
double largest_inside(const std::vector<Vector3d>& places, const VectorXd& force) {
    double largest = 0.0;
    int count = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
        if ((places[n].array() < 1e-9).any() || (places[n].array() > 1.0 - 1e-9).any()) continue;
        largest = std::max(largest, force.segment<3>(3 * static_cast<Eigen::Index>(n)).norm());
        ++count;
    }
    EXPECT_GE(count, 1);
    return largest;
}

TEST(SolidElements, HaveTheStiffnessAndDampingTheyClaim) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-0.05, 0.05);
    for (const ElementOrder order : orders)
        for (const ElementModel model : models)
            for (const double damping_time : {0.0, 0.1}) {
                MultibodySystem system;
                Lattice lattice;
                lattice.order = order;
                lattice.model = model;
                lattice.material = {100.0, 0.3, 10.0, damping_time, 3.0 * damping_time};
                lattice.fixed = [](const Vector3d& x) { return x.x() > 0.25; };
                lattice.build(system);
                State state = system.initial_state();
                for (double& q : state.q) q += any(random);
                for (double& v : state.v) v += any(random);
                expect_derivatives(system, state, VectorXd(0), 1e-6);
            }
}

// Turned by any rotation, moved and spinning: no forces, and kinetic energy alone.
TEST(SolidElements, DoNotFeelRigidMotion) {
    for (const ElementOrder order : orders)
        for (const ElementModel model : models) {
            MultibodySystem system;
            Lattice lattice;
            lattice.order = order;
            lattice.model = model;
            lattice.material = {100.0, 0.3, 10.0, 0.1};
            lattice.build(system);
            const Eigen::AngleAxisd turn(2.1, Vector3d(1.0, -2.0, 0.5).normalized());
            State state =
                mapped(system, [&](const Vector3d& x) { return Vector3d(turn * x + Vector3d(5.0, -3.0, 2.0)); });
            const Vector3d omega(0.3, -1.0, 0.7);
            for (std::int32_t n = 0; n < system.n(); n += 3)
                Vector3d::Map(state.v.data() + n) = omega.cross(Vector3d::Map(state.q.data() + n));
            EXPECT_LE(force_of(system, state).cwiseAbs().maxCoeff(), 1e-11);
            EXPECT_NEAR(system.energy(state), system.kinetic_energy(state), 1e-11);
        }
}

// A uniform deformation, however large, is in balance in a patch of distorted elements, with the energy of its density.
TEST(SolidElements, PassThePatchTest) {
    Eigen::Matrix3d F;
    F << 1.1, 0.2, -0.1, 0.05, 0.9, 0.15, -0.2, 0.1, 1.2;
    for (const ElementOrder order : orders)
        for (const ElementModel model : models) {
            MultibodySystem system;
            Lattice lattice;
            lattice.cells = {2, 2, 2};
            lattice.order = order;
            lattice.model = model;
            lattice.place = jittered;
            lattice.material.poisson = 0.4;
            const auto places = lattice.build(system);
            const State state = mapped(system, [&](const Vector3d& x) { return Vector3d(F * x); });
            const VectorXd force = force_of(system, state);
            EXPECT_GE(force.cwiseAbs().maxCoeff(), 1e-3) << "the boundary is pulled";
            EXPECT_LE(largest_inside(places, force), 1e-14);
            const double lambda = 0.4 / (1.4 * 0.2), mu = 0.5 / 1.4;
            const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F);
            const Vector3d& stretch = svd.singularValues();
            const Vector3d strain = model == ElementModel::Corotational
                                        ? Vector3d(stretch.array() - 1.0)
                                        : Vector3d(0.5 * (stretch.array().square() - 1.0));
            EXPECT_NEAR(system.energy(state), mu * strain.squaredNorm() + 0.5 * lambda * strain.sum() * strain.sum(),
                        1e-14);
        }
}

// Displacements that are quadratic and in balance: bending without Poisson's effect, and twisting. Quadratic elements
// of any shape have them exactly. The amplitude keeps products of displacements below rounding.
TEST(SolidElements, QuadraticOnesBendAndTwistExactly) {
    const double small = 1e-7;
    const auto bending = [&](const Vector3d& x) {
        return Vector3d(x + small * Vector3d(x.x() * x.z(), 0.0, -0.5 * x.x() * x.x()));
    };
    const auto twisting = [&](const Vector3d& x) {
        return Vector3d(x + small * Vector3d(0.0, -x.x() * x.z(), x.x() * x.y()));
    };
    for (const bool twists : {false, true})
        for (const ElementModel model : models) {
            MultibodySystem system;
            Lattice lattice;
            lattice.cells = {2, 2, 2};
            lattice.model = model;
            lattice.place = jittered;
            lattice.material.poisson = twists ? 0.3 : 0.0;
            const auto places = lattice.build(system);
            const State state = twists ? mapped(system, twisting) : mapped(system, bending);
            const VectorXd force = force_of(system, state);
            EXPECT_LE(largest_inside(places, force), 1e-6 * force.cwiseAbs().maxCoeff());
            // ½ E ∫ z², ½ μ ∫ (y² + z²) over the unit cube.
            const double expected = twists ? 0.5 * (0.5 / 1.3) * (2.0 / 3.0) : 0.5 / 3.0;
            EXPECT_NEAR(system.energy(state) / (small * small), expected, 1e-6 * expected);
        }
}

/// A traction of resultant `force` on the sides of elements beyond x.
VectorXd traction(const MultibodySystem& system, double x, const Vector3d& force) {
    constexpr double any = std::numeric_limits<double>::infinity();
    VectorXd load = VectorXd::Zero(system.n());
    for (const auto& [node, share] :
         system.spread_over_sides(0, system.node_count(), {{x, -any, -any}, {any, any, any}}))
        load.segment<3>(system.node_column(node)) = share * force;
    return load;
}

/// A cantilever along x of `length`, with a square section of edge 1; the load acts on its end as a uniform traction.
struct Cantilever {
    double length = 10.0, poisson = 0.0;
    std::array<int, 3> cells{10, 1, 1};
    ElementOrder order = ElementOrder::Quadratic;
    ElementModel model = ElementModel::Corotational;

    MultibodySystem system;
    std::vector<Vector3d> places;
    void build() {
        Lattice lattice;
        lattice.cells = cells;
        lattice.order = order;
        lattice.model = model;
        lattice.material.poisson = poisson;
        lattice.place = [this](const Vector3d& x) { return Vector3d(length * x.x(), x.y() - 0.5, x.z() - 0.5); };
        lattice.fixed = [](const Vector3d& x) { return x.x() == 0.0; };
        places = lattice.build(system);
    }
    [[nodiscard]] VectorXd load(const Vector3d& force) const { return traction(system, 0.999 * length, force); }
    /// Of the end's middle.
    [[nodiscard]] Vector3d displacement(const State& state) const {
        Vector3d result = Vector3d::Zero();
        int count = 0;
        for (std::size_t n = 0; n < places.size(); ++n)
            if (places[n].x() == 1.0) {
                const Vector3 x = system.node_position(state, static_cast<std::int32_t>(n));
                result += Vector3d(x[0] - length, x[1] - (places[n].y() - 0.5), x[2] - (places[n].z() - 0.5));
                ++count;
            }
        return result / count;
    }
};

// Timoshenko, κ = 10 (1 + ν)/(12 + 11 ν): P L³/(3 E I) + P L/(κ G A).
TEST(SolidElements, ACantileverOfOneOrTwoCellsBendsAsABeam) {
    for (const double poisson : {0.0, 0.3, 0.45, 0.499})
        for (int deep : {1, 2})
            for (const ElementOrder order : orders) {
                Cantilever beam;
                beam.poisson = poisson;
                beam.cells = {20, deep, deep};
                beam.order = order;
                beam.build();
                const double force = 1e-7, inertia = 1.0 / 12.0, shear = 0.5 / (1.0 + poisson);
                const double kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
                const double expected =
                    force * std::pow(beam.length, 3) / (3.0 * inertia) + force * beam.length / (kappa * shear);
                const State state =
                    equilibrium_under(beam.system, beam.system.initial_state(), beam.load({0.0, 0.0, -force}));
                const double share = -beam.displacement(state).z() / expected;
                RecordProperty("nu_" + std::to_string(poisson) + "_order_" + std::to_string(int(order)) + "_" +
                                   std::to_string(deep),
                               std::to_string(share));
                if (order == ElementOrder::Linear) {
                    EXPECT_LT(share, 0.98) << "linear elements are too stiff: docs say so";
                    continue;
                }
                EXPECT_GE(share, poisson < 0.46 ? 0.98 : 0.95) << poisson << ", " << deep;
                EXPECT_LE(share, deep == 1 && poisson > 0.4 ? 1.05 : 1.02) << poisson << ", " << deep;
            }
}

// Mattiasson 1981: P L²/(E I) = 1, w/L = 0.30172, u/L = 0.05643; 10: 0.81061, 0.55500. Slender, so that shear and
// stretching do not count.
TEST(SolidElements, ACantileverTurnsFarAsTheElastica) {
    for (const auto& [factor, down, back] : {std::tuple(1.0, 0.30172, 0.05643), std::tuple(10.0, 0.81061, 0.55500)}) {
        Cantilever beam;
        beam.length = 40.0;
        beam.cells = {40, 1, 1};
        beam.build();
        const double force = factor / 12.0 / (beam.length * beam.length);
        const State state = equilibrium_under(beam.system, beam.system.initial_state(), beam.load({0.0, 0.0, -force}),
                                              factor > 5.0 ? 8 : 2);
        const Vector3d end = beam.displacement(state) / beam.length;
        RecordProperty("factor_" + std::to_string(int(factor)),
                       std::to_string(-end.z()) + " " + std::to_string(-end.x()));
        EXPECT_NEAR(-end.z(), down, 0.01 * down) << factor;
        EXPECT_NEAR(-end.x(), back, 0.01 * back) << factor;
    }
}

// Euler, lowered by shear (Engesser): P = P_E/(1 + P_E/(κ G A)), P_E = π² E I/(4 L²). K is singular there.
TEST(SolidElements, AColumnBucklesAtEulersLoad) {
    Cantilever beam;
    beam.length = 20.0;
    beam.cells = {20, 1, 1};
    beam.build();
    const double euler = std::numbers::pi * std::numbers::pi / (48.0 * beam.length * beam.length);
    const double expected = euler / (1.0 + euler / (5.0 / 6.0 * 0.5));
    const auto is_stable = [&](double load) {
        const State state = equilibrium_under(beam.system, beam.system.initial_state(), beam.load({-load, 0.0, 0.0}));
        const Eigen::SimplicialLDLT<Sparse> factor(stiffness_of(beam.system, state));
        return (factor.vectorD().array() > 0.0).all();
    };
    double low = 0.5 * expected, high = 1.5 * expected;
    EXPECT_TRUE(is_stable(low));
    EXPECT_FALSE(is_stable(high));
    for (int k = 0; k < 7; ++k) {
        const double middle = 0.5 * (low + high);
        (is_stable(middle) ? low : high) = middle;
    }
    RecordProperty("share", std::to_string(0.5 * (low + high) / expected));
    EXPECT_NEAR(0.5 * (low + high) / expected, 1.0, 0.01);
}

// Cook's membrane: a trapezium from (0, 0) – (0, 44) to (48, 44) – (48, 60), of thickness 1, clamped at x = 0, with a
// unit of shear on its end. Plane stress, E = 1, ν = 1/3: the middle of the end goes up by 23.96 (Simo and Rifai 1990
// and others). The body is solid here and its clamp holds the thickness too.
TEST(SolidElements, CooksMembraneGoesUpAsPublished) {
    MultibodySystem system;
    Lattice lattice;
    lattice.cells = {12, 12, 1};
    lattice.material.poisson = 1.0 / 3.0;
    lattice.place = [](const Vector3d& x) {
        const double low = 44.0 * x.x(), high = 44.0 + 16.0 * x.x();
        return Vector3d(48.0 * x.x(), low + (high - low) * x.y(), x.z());
    };
    lattice.fixed = [](const Vector3d& x) { return x.x() == 0.0; };
    const auto places = lattice.build(system);
    const double force = 1e-6;
    const VectorXd load = traction(system, 47.9, {0.0, force, 0.0});
    EXPECT_NEAR(load.sum(), force, 1e-15);
    const State state = equilibrium_under(system, system.initial_state(), load);
    double up = 0.0;
    int count = 0;
    for (std::size_t n = 0; n < places.size(); ++n)
        if (places[n].x() == 1.0 && places[n].y() == 0.5) {
            up += system.node_position(state, static_cast<std::int32_t>(n))[1] - 52.0;
            ++count;
        }
    RecordProperty("up", std::to_string(up / count / force));
    EXPECT_NEAR(up / count / force, 23.96, 0.01 * 23.96);
}

TEST(SolidElements, RefuseWhatIsNoTetrahedron) {
    MultibodySystem system;
    const std::vector<Vector3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const auto add = [&](const Vector3& at) {
        NodeParameters node;
        node.position = at;
        return system.add_node(node);
    };
    std::array<std::int32_t, 10> nodes;
    for (std::size_t k = 0; k < 4; ++k) nodes[k] = add(corners[k]);
    for (std::size_t e = 0; e < 6; ++e) {
        Vector3 middle;
        for (std::size_t i = 0; i < 3; ++i)
            middle[i] = 0.5 * (corners[mechanics::tetrahedron_edges[e][0]][i] +
                               corners[mechanics::tetrahedron_edges[e][1]][i]) +
                        (e == 5 && i == 0 ? 0.1 : 0.0);
        nodes[4 + e] = add(middle);
    }
    const auto refusal = [&] {
        try {
            system.add_quadratic_tetrahedron(nodes, ElasticMaterial{});
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("taken");
    };
    EXPECT_EQ(refusal(), "the node 9 is not in the middle between the nodes 2 and 3");
    std::swap(nodes[0], nodes[1]);
    EXPECT_NE(refusal().find("has the volume -0.167 m³"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace delassus::tests::solid_test
