// SPDX-License-Identifier: BSD-3-Clause
// Problems of a few unknowns whose solutions can be written down.
#pragma once

#include <cmath>

#include "delassus/problem.hpp"

namespace delassus::tests {

inline SparseMatrix diagonal_matrix(const std::vector<double>& values) {
    const auto n = static_cast<std::int32_t>(values.size());
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < n; ++i) triplets.push_back({i, i, values[static_cast<std::size_t>(i)]});
    return SparseMatrix::from_triplets(n, n, std::move(triplets));
}

inline SparseMatrix identity(std::int32_t n) {
    return diagonal_matrix(std::vector<double>(static_cast<std::size_t>(n), 1.0));
}

/// A point of mass m pressed onto a plane by the impulse (-press) and pushed along it by push. The contact sticks if
/// push ≤ μ press; else it slides with (push − μ press)/m under the exact Coulomb law.
inline Problem point_on_plane(double mass, double press, double push, double mu, Law law) {
    Problem problem;
    problem.name = "point on plane";
    problem.H = diagonal_matrix({mass, mass, mass});
    problem.D = identity(3);
    problem.a = {-press, push, 0.0};
    problem.b = {0.0, 0.0, 0.0};
    problem.cones = {Cone::friction(mu)};
    problem.law = law;
    return problem;
}

/// A point of mass 2 in the plane, pressed by 6 and pushed by 5: H = 2 I, D = I; without friction λ = (6, 0).
inline Problem point_on_line(double mu, Law law) {
    Problem problem;
    problem.H = diagonal_matrix({2.0, 2.0});
    problem.D = identity(2);
    problem.a = {-6.0, 5.0};
    problem.b = {0.0, 0.0};
    problem.cones = {Cone::friction(mu, 2)};
    problem.law = law;
    return problem;
}

/// Two equal masses on a line, tied to each other by one free row: they share the momentum.
inline Problem tied_masses() {
    Problem problem;
    problem.name = "tied masses";
    problem.H = diagonal_matrix({1.0, 3.0});
    problem.D = SparseMatrix::from_triplets(1, 2, {{0, 0, 1.0}, {0, 1, -1.0}});
    problem.a = {4.0, 0.0};
    problem.b = {0.0};
    problem.cones = {Cone::free(1)};
    return problem;
}

}  // namespace delassus::tests
