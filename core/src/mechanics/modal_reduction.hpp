// SPDX-License-Identifier: BSD-3-Clause
// Reduces an elastic mesh to few modes (Craig and Bampton, AIAA Journal 6, 1968).
//
// The displacements of the mesh are sought in the span of
//
// - the six rigid motions, which become those of the frame (modal_body.hpp);
// - constraint modes: the static displacements under each rigid motion of one interface while the others are held. An
//   interface is a set of nodes that move as a rigid body; with the rigid motions of the whole, those of all interfaces
//   but the first suffice. They make the answer to any static load at interfaces exact;
// - normal modes: the lowest vibrations while all interfaces are held;
// - static responses to given loads, and to the unit forces at interfaces of one node, while the other interfaces are
//   held. Where there are none to hold, the load is balanced by the inertia of the rigid body.
//
// From the span, the part that is M-orthogonal to the rigid motions is taken, and in it the basis that diagonalises
// both M and K: vibrations of the free reduced body. So the sums Σ m Φ and Σ m X × Φ vanish. Elasticity is that of
// small strains: K is the stiffness of the undeformed elements.
#pragma once

#include <string>
#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/modal_body.hpp"

namespace delassus::mechanics {

/// A mesh at rest.
struct ElasticStructure {
    Matrix3Xd places;  ///< of the nodes, m
    VectorXd mass;     ///< of the nodes, kg, > 0
    SparseMatrix K;    ///< over x, y, z of all nodes, N/m, symmetric
};

/// A force on nodes of the mesh, numbered within it.
struct ModalLoadPattern {
    std::vector<NodeShare> shares;
    std::array<bool, 3> along{};  ///< whether it ever has this component
};

/// Nodes that move as a rigid body: its point moves by shape s, and it turns by the small rotation turn s.
struct ModalInterface {
    ModalPoint point;  ///< the mean of the nodes
    Matrix3Xd turn;    ///< 3 × k; no column if the interface is a single node
    [[nodiscard]] bool turns() const { return turn.cols() > 0; }
};

struct ModalModel {
    ModalInertia inertia;
    Vector3d centre = Vector3d::Zero();  ///< the mass centre, in the frame of the structure's places
    Matrix3Xd places;                    ///< of the nodes about it
    MatrixXd shapes;                     ///< three rows for each node, a column for each mode
    std::vector<ModalInterface> interfaces;
    std::vector<ModalPoint> loads;  ///< Σ shares · (place, shape)
};

/// The frame has the axes of the structure's places. interfaces: nodes of each, no node twice; normal: how many normal
/// modes are kept, ≥ 0. Modes are ascending. Throws InputError, with the name of the body, where the mesh falls apart
/// or has too few freedoms for so many modes, where no mode is left, and where the nodes of an interface lie on a line.
[[nodiscard]] ModalModel reduce(const std::string& name, const ElasticStructure& structure,
                                const std::vector<std::vector<std::int32_t>>& interfaces,
                                const std::vector<ModalLoadPattern>& loads, std::int32_t normal);

}  // namespace delassus::mechanics
