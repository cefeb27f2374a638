// SPDX-License-Identifier: BSD-3-Clause
// Vibrations and static responses of a large elastic structure through the module delassus_eigenmodes, which the first
// reduced body loads. So Spectra is mapped only into processes that have such bodies.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "delassus/problem.hpp"

namespace delassus::mechanics {

/// Lowest vibrations and static responses of K x + M ẍ = f, M diagonal.
struct Eigenmodes {
    Eigen::VectorXd squares;    ///< ω², rad²/s², ascending
    Eigen::MatrixXd modes;      ///< a column for each: K φ = ω² M φ, φᵀ M φ = 1
    Eigen::MatrixXd responses;  ///< K⁻¹ loads; M-orthogonal to the motions without force
};

/// The `count` lowest modes, count < n, and the responses to loads (n rows). K: n × n, symmetric, positive
/// semidefinite; mass: its n > 0 entries, kg. rigid: the motions on which K does nothing, M-orthonormal columns, or
/// none; loads do no work on them. shift: 1/s², below the smallest other ω²; 0 where there are no such motions. Throws
/// InputError where this build has no Spectra, where K + shift · M is not positive definite, and where the iteration
/// finds fewer modes.
[[nodiscard]] Eigenmodes find_eigenmodes(const SparseMatrix& K, const Eigen::VectorXd& mass,
                                         const Eigen::MatrixXd& rigid, double shift, const Eigen::MatrixXd& loads,
                                         std::int32_t count);

}  // namespace delassus::mechanics

// The module is built together with libdelassus_mechanics, so C++ types may cross here.
extern "C" {
/// delassus_eigenmodes_find of delassus_eigenmodes.so; arguments as of find_eigenmodes().
using DelassusEigenmodesFind = void (*)(const delassus::SparseMatrix& K, const Eigen::VectorXd& mass,
                                        const Eigen::MatrixXd& rigid, double shift, const Eigen::MatrixXd& loads,
                                        std::int32_t count, delassus::mechanics::Eigenmodes& result);
}
