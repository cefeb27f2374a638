// SPDX-License-Identifier: BSD-3-Clause
// Elements between nodes: tetrahedra with linear displacements, and cables.
#pragma once

#include <array>
#include <cstdint>

#include "delassus/multibody.hpp"
#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

/// Where a node is and how it moves; column −1 if it is fixed.
struct NodePlacement {
    Vector3d x = Vector3d::Zero(), v = Vector3d::Zero();
    std::int32_t column = -1;
};

/// A tetrahedron of an elastic material with Kelvin–Voigt damping.
class Tetrahedron {
public:
    /// Throws InputError if the element has no volume or is inverted (negative det of its edges).
    Tetrahedron(const std::array<std::int32_t, 4>& nodes, const std::array<Vector3d, 4>& positions,
                const ElasticMaterial& material, ElementModel model);

    static constexpr int size = 4, freedoms = 3;
    [[nodiscard]] const std::array<std::int32_t, 4>& nodes() const { return nodes_; }
    /// A quarter of it goes to each node.
    [[nodiscard]] double mass() const { return density_ * volume_; }
    [[nodiscard]] double energy(const std::array<NodePlacement, 4>& at) const;

    using Forces = Eigen::Matrix<double, 12, 1>;
    using Matrix = Eigen::Matrix<double, 12, 12, Eigen::RowMajor>;
    void force(const std::array<NodePlacement, 4>& at, Forces& result) const;
    /// −∂f/∂x and −∂f/∂v.
    void stiffness(const std::array<NodePlacement, 4>& at, Matrix& result) const;
    void damping(const std::array<NodePlacement, 4>& at, Matrix& result) const;
    [[nodiscard]] bool damped() const { return damping_ > 0.0; }

private:
    struct Deformation;
    [[nodiscard]] Deformation deformation(const std::array<NodePlacement, 4>& at) const;

    std::array<std::int32_t, 4> nodes_;
    ElementModel model_;
    double lambda_, mu_, density_, damping_;
    double volume_;
    std::array<Vector3d, 4> gradient_;  // of the shape functions, in the reference configuration
};

/// A bar between two nodes that carries tension, and compression unless it is slack under it:
/// energy ½ E A L ε² with ε = (ℓ − L)/L, damping E A τ ε̇.
class Cable {
public:
    Cable(const std::array<std::int32_t, 2>& nodes, const std::array<Vector3d, 2>& positions,
          const CableParameters& parameters);

    static constexpr int size = 2, freedoms = 3;
    [[nodiscard]] const std::array<std::int32_t, 2>& nodes() const { return nodes_; }
    [[nodiscard]] double mass() const { return mass_; }
    [[nodiscard]] double energy(const std::array<NodePlacement, 2>& at) const;

    using Forces = Eigen::Matrix<double, 6, 1>;
    using Matrix = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
    void force(const std::array<NodePlacement, 2>& at, Forces& result) const;
    void stiffness(const std::array<NodePlacement, 2>& at, Matrix& result) const;
    void damping(const std::array<NodePlacement, 2>& at, Matrix& result) const;
    [[nodiscard]] bool damped() const { return damping_ > 0.0; }

private:
    /// Length, its rate, the unit vector along the cable, and the tension at that state.
    struct Stretch {
        double length = 0.0, rate = 0.0, tension = 0.0;
        bool slack = false;
        Vector3d along = Vector3d::Zero(), relative_velocity = Vector3d::Zero();
    };
    [[nodiscard]] Stretch stretch(const std::array<NodePlacement, 2>& at) const;

    std::array<std::int32_t, 2> nodes_;
    double length_, stiffness_, damping_, mass_;  // stiffness E A / L, damping E A τ / L
    bool slack_;
};

}  // namespace delassus::mechanics
