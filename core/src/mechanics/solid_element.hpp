// SPDX-License-Identifier: BSD-3-Clause
// Elements of elastic solids: tetrahedra with linear and with quadratic displacements, and bricks of six linear ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
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

/// What an element knows of its shape functions N_a, all of it in the reference configuration.
template <int Nodes, int Points>
struct SolidShape {
    std::array<double, Points> volume{};  ///< that each point stands for, m³
    /// Column a: ∇N_a at the point, 1/m.
    std::array<Eigen::Matrix<double, 3, Nodes>, Points> gradient;
    std::array<double, Nodes> share{};  ///< of the mass that goes to each node; their sum is 1
};

/// Throws InputError if the element has no volume or is inverted (negative det of its edges). nodes: for the message.
[[nodiscard]] SolidShape<4, 1> linear_tetrahedron(const std::array<std::int32_t, 4>& nodes,
                                                  const std::array<Vector3d, 4>& positions);
/// The corners, then the middles of the edges. Throws InputError also if one of these is not in the middle.
[[nodiscard]] SolidShape<10, 4> quadratic_tetrahedron(const std::array<std::int32_t, 10>& nodes,
                                                      const std::array<Vector3d, 10>& positions);
/// The corners as in brick_tetrahedra.
[[nodiscard]] SolidShape<8, 6> brick(const std::array<std::int32_t, 8>& nodes,
                                     const std::array<Vector3d, 8>& positions);

/// An element of an elastic material with Rayleigh damping. Its change of volume counts as the mean over the
/// element (Nagtegaal, Parks and Rice, Comput. Methods Appl. Mech. Engrg. 4, 1974), so that elements of several points
/// do not lock where the material hardly changes its volume.
template <int Nodes, int Points>
class SolidElement {
public:
    SolidElement(const std::array<std::int32_t, Nodes>& nodes, const SolidShape<Nodes, Points>& shape,
                 const ElasticMaterial& material, ElementModel model);

    static constexpr int size = Nodes, freedoms = 3;
    using Placements = std::array<NodePlacement, Nodes>;
    [[nodiscard]] const std::array<std::int32_t, Nodes>& nodes() const { return nodes_; }
    /// What goes to the a-th node, kg.
    [[nodiscard]] double mass(std::size_t a) const { return density_ * volume_ * shape_.share[a]; }
    [[nodiscard]] double energy(const Placements& at) const;

    using Forces = Eigen::Matrix<double, 3 * Nodes, 1>;
    using Matrix = Eigen::Matrix<double, 3 * Nodes, 3 * Nodes, Eigen::RowMajor>;
    void force(const Placements& at, Forces& result) const;
    /// −∂f/∂x and −∂f/∂v.
    void stiffness(const Placements& at, Matrix& result) const;
    void damping(const Placements& at, Matrix& result) const;
    [[nodiscard]] bool damped() const { return damping_ > 0.0 || damping_rate_ > 0.0; }

private:
    struct Point;
    struct Strain;
    [[nodiscard]] Strain strain(const Placements& at) const;

    std::array<std::int32_t, Nodes> nodes_;
    ElementModel model_;
    double lambda_, mu_, density_, damping_, damping_rate_;
    double volume_ = 0.0;
    SolidShape<Nodes, Points> shape_;
};

using LinearTetrahedron = SolidElement<4, 1>;
using QuadraticTetrahedron = SolidElement<10, 4>;
using Brick = SolidElement<8, 6>;

extern template class SolidElement<4, 1>;
extern template class SolidElement<10, 4>;
extern template class SolidElement<8, 6>;

}  // namespace delassus::mechanics
