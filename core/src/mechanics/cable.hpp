// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "delassus/multibody.hpp"
#include "mechanics/node_placement.hpp"

namespace delassus::mechanics {

/// A bar between two nodes that carries tension, and compression unless it is slack under it:
/// energy ½ E A L ε² with ε = (ℓ − L)/L, damping E A τ ε̇.
class Cable {
public:
    Cable(const std::array<std::int32_t, 2>& nodes, const std::array<Vector3d, 2>& positions,
          const CableParameters& parameters);

    static constexpr int size = 2, freedoms = 3;
    [[nodiscard]] const std::array<std::int32_t, 2>& nodes() const { return nodes_; }
    /// What goes to each node, kg.
    [[nodiscard]] double mass(std::size_t) const { return 0.5 * mass_; }
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
