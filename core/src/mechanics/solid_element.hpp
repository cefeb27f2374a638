// SPDX-License-Identifier: BSD-3-Clause
// Elements of elastic solids: tetrahedra with linear and with quadratic displacements, and bricks of six linear ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/node_placement.hpp"

namespace delassus::mechanics {

/// The corners at the ends of the edges of a tetrahedron, in the order of the nodes in their middles.
inline constexpr std::array<std::array<std::size_t, 2>, 6> tetrahedron_edges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// The tetrahedra of a brick whose corner at (x, y, z) ∈ {0, 1}³ has the number 4 x + 2 y + z: Kuhn's division. Each is
/// a path from (0, 0, 0) to (1, 1, 1) along the axes.
inline constexpr std::array<std::array<std::size_t, 4>, 6> brick_tetrahedra = {
    {{0, 4, 6, 7}, {0, 2, 3, 7}, {0, 1, 5, 7}, {0, 5, 4, 7}, {0, 3, 1, 7}, {0, 6, 2, 7}}};

/// A side of a tetrahedron, counter-clockwise from outside.
struct ElementSide {
    std::array<std::int32_t, 3> corners{};
    std::array<std::int32_t, 3> middles{-1, -1, -1};  ///< after each corner; −1 with linear displacements
    /// Visits the corners and the middles.
    template <class Visitor>
    void for_each_node(Visitor&& visit) const {
        for (const auto node : corners) visit(node);
        for (const auto node : middles)
            if (node >= 0) visit(node);
    }
};

void append_sides(const std::array<std::int32_t, 4>& nodes, std::vector<ElementSide>& sides);
void append_sides(const std::array<std::int32_t, 10>& nodes, std::vector<ElementSide>& sides);
/// Those that no two elements share.
[[nodiscard]] std::vector<ElementSide> outer_sides(std::span<const ElementSide> sides);

/// A column for each node.
using NodeColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 10>;

/// What an element knows of its shape functions N_a, all of it in the reference configuration.
struct SolidShape {
    struct Point {
        double volume = 0.0;   ///< that it stands for, m³
        NodeColumns gradient;  ///< ∇N_a there, 1/m
    };
    std::vector<Point> points;
    std::vector<double> share;  ///< of the mass that goes to each node; their sum is 1
    double own_bulk = 0.0;  ///< λ/μ up to which each point's change of volume is its own; beyond, all have the mean
};

/// Throws InputError if the element has no volume or is inverted (negative det of its edges). nodes: for the message.
[[nodiscard]] SolidShape linear_tetrahedron(const std::array<std::int32_t, 4>& nodes,
                                            const std::array<Vector3d, 4>& positions);
/// The corners, then the middles of the edges. Throws InputError also if one of these is not in the middle.
[[nodiscard]] SolidShape quadratic_tetrahedron(const std::array<std::int32_t, 10>& nodes,
                                               const std::array<Vector3d, 10>& positions);
/// The corners as in brick_tetrahedra.
[[nodiscard]] SolidShape brick(const std::array<std::int32_t, 8>& nodes, const std::array<Vector3d, 8>& positions);

/// An elastic material with Rayleigh damping between nodes. What λ is beyond SolidShape::own_bulk counts for the mean
/// change of volume over the element (Nagtegaal, Parks and Rice, Comput. Methods Appl. Mech. Engrg. 4, 1974), so that
/// elements of several points do not lock where the material hardly changes its volume.
class ElasticSolid {
public:
    ElasticSolid(SolidShape shape, const ElasticMaterial& material, ElementModel model);

    /// What goes to the a-th node, kg.
    [[nodiscard]] double mass(std::size_t a) const { return density_ * volume_ * shape_.share[a]; }
    [[nodiscard]] bool damped() const { return damping_ > 0.0 || damping_rate_ > 0.0; }

    /// x, v: positions and velocities of the nodes. Results have three entries for each node, matrices are by rows.
    [[nodiscard]] double energy(const NodeColumns& x) const;
    /// Whether the material is turned inside out somewhere: det F ≤ 0 at a point.
    [[nodiscard]] bool inverted(const NodeColumns& x) const;
    void force(const NodeColumns& x, const NodeColumns& v, double* result) const;
    /// −∂f/∂x and −∂f/∂v.
    void stiffness(const NodeColumns& x, const NodeColumns& v, double* result) const;
    void damping(const NodeColumns& x, double* result) const;

private:
    struct Point;
    struct Strain;
    [[nodiscard]] Strain strain(const NodeColumns& x, const NodeColumns& v) const;

    ElementModel model_;
    double lambda_, mu_, density_, damping_, damping_rate_;
    double own_;  // the share of λ that counts for each point's own change of volume
    double volume_ = 0.0;
    SolidShape shape_;
};

/// An elastic solid between certain nodes.
template <int Nodes>
class SolidElement {
public:
    SolidElement(const std::array<std::int32_t, Nodes>& nodes, SolidShape shape, const ElasticMaterial& material,
                 ElementModel model)
        : nodes_(nodes), solid_(std::move(shape), material, model) {}

    static constexpr int size = Nodes, freedoms = 3;
    using Placements = std::array<NodePlacement, Nodes>;
    using Forces = Eigen::Matrix<double, 3 * Nodes, 1>;
    using Matrix = Eigen::Matrix<double, 3 * Nodes, 3 * Nodes, Eigen::RowMajor>;
    [[nodiscard]] const std::array<std::int32_t, Nodes>& nodes() const { return nodes_; }
    [[nodiscard]] double mass(std::size_t a) const { return solid_.mass(a); }
    [[nodiscard]] bool damped() const { return solid_.damped(); }
    [[nodiscard]] double energy(const Placements& at) const { return solid_.energy(columns(at, &NodePlacement::x)); }
    [[nodiscard]] bool inverted(const Placements& at) const { return solid_.inverted(columns(at, &NodePlacement::x)); }
    void force(const Placements& at, Forces& result) const {
        solid_.force(columns(at, &NodePlacement::x), columns(at, &NodePlacement::v), result.data());
    }
    void stiffness(const Placements& at, Matrix& result) const {
        solid_.stiffness(columns(at, &NodePlacement::x), columns(at, &NodePlacement::v), result.data());
    }
    void damping(const Placements& at, Matrix& result) const {
        solid_.damping(columns(at, &NodePlacement::x), result.data());
    }

private:
    static NodeColumns columns(const Placements& at, Vector3d NodePlacement::*what) {
        NodeColumns result(3, Nodes);
        for (std::size_t a = 0; a < Nodes; ++a) result.col(static_cast<Eigen::Index>(a)) = at[a].*what;
        return result;
    }

    std::array<std::int32_t, Nodes> nodes_;
    ElasticSolid solid_;
};

using LinearTetrahedron = SolidElement<4>;
using QuadraticTetrahedron = SolidElement<10>;
using Brick = SolidElement<8>;

}  // namespace delassus::mechanics
