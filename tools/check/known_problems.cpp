// SPDX-License-Identifier: BSD-3-Clause
#include "check/known_problems.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "problem/cone_kinds.hpp"

namespace delassus::check {

namespace {

using Numbers = std::vector<double>;

/// A matrix from its rows one after another; zeros are not stored.
SparseMatrix matrix(std::int32_t rows, std::int32_t columns, const Numbers& entries) {
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < rows; ++i)
        for (std::int32_t j = 0; j < columns; ++j)
            if (const double value = entries[static_cast<std::size_t>(i * columns + j)]; value != 0.0)
                triplets.push_back({i, j, value});
    return SparseMatrix::from_triplets(rows, columns, std::move(triplets));
}

SparseMatrix diagonal(const Numbers& entries) {
    const auto size = static_cast<std::int32_t>(entries.size());
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < size; ++i) triplets.push_back({i, i, entries[static_cast<std::size_t>(i)]});
    return SparseMatrix::from_triplets(size, size, std::move(triplets));
}

SparseMatrix identity(std::int32_t size) {
    return diagonal(Numbers(static_cast<std::size_t>(size), 1.0));
}

/// A tridiagonal matrix: with 20 rows one block too large to count as an inertia, so H counts as sparse.
SparseMatrix chain(double below, const Numbers& middle, double above) {
    const auto size = static_cast<std::int32_t>(middle.size());
    std::vector<Triplet> triplets;
    for (std::int32_t i = 0; i < size; ++i) {
        if (i > 0) triplets.push_back({i, i - 1, below});
        triplets.push_back({i, i, middle[static_cast<std::size_t>(i)]});
        if (i + 1 < size) triplets.push_back({i, i + 1, above});
    }
    return SparseMatrix::from_triplets(size, size, std::move(triplets));
}

SparseMatrix definite_chain() {
    return chain(-1.0, Numbers(20, 2.5), -1.0);
}

/// −2, 0, 2, −1, 1, −2, …
Numbers some_velocities(std::int32_t size) {
    Numbers x;
    for (std::int32_t i = 0; i < size; ++i) x.push_back((i * 2) % 5 - 2);
    return x;
}

KnownProblem known(std::string name, SparseMatrix H, SparseMatrix D, SparseMatrix E, std::vector<Cone> cones,
                   Numbers lambda, Numbers u, Law law = Law::Associated) {
    KnownProblem result;
    Problem& problem = result.problem;
    problem.name = std::move(name);
    problem.a.assign(static_cast<std::size_t>(H.rows), 0.0);
    problem.b.assign(static_cast<std::size_t>(D.rows), 0.0);
    problem.H = std::move(H);
    problem.D = std::move(D);
    problem.E = std::move(E);
    problem.cones = std::move(cones);
    problem.law = law;
    result.solution = {some_velocities(problem.n()), std::move(lambda)};
    result.u = std::move(u);
    result.set_right_hand_side();
    return result;
}

/// n = 0: N λ + r = u.
KnownProblem reduced(std::string name, SparseMatrix N, std::vector<Cone> cones, Numbers lambda, Numbers u,
                     Law law = Law::Associated) {
    const auto m = N.rows;
    return known(std::move(name), {}, SparseMatrix::zero(m, 0), std::move(N), std::move(cones), std::move(lambda),
                 std::move(u), law);
}

SparseMatrix small_blocks() {
    return matrix(4, 4, {4, 1, 0, 0, 1, 3, 0, 0, 0, 0, 2, -1, 0, 0, -1, 2});
}

/// Three rows on the 20 freedoms of a chain; independent.
SparseMatrix chain_constraints() {
    return SparseMatrix::from_triplets(3, 20, {{0, 0, 1}, {0, 1, -1}, {1, 5, 1}, {1, 10, 2}, {2, 19, 1}});
}

void add_unconstrained(std::vector<KnownProblem>& list) {
    const auto alone = [&](std::string name, SparseMatrix H) {
        const auto n = H.rows;
        list.push_back(known(std::move(name), std::move(H), SparseMatrix::zero(0, n), {}, {}, {}, {}));
    };
    alone("unconstrained_diagonal", diagonal({2, 1, 4}));
    alone("unconstrained_blocks", small_blocks());
    alone("unconstrained_definite", definite_chain());
}

void add_free(std::vector<KnownProblem>& list) {
    const auto linear = [&](std::string name, SparseMatrix H, SparseMatrix D, SparseMatrix E, Numbers lambda) {
        const auto m = D.rows;
        list.push_back(known(std::move(name), std::move(H), std::move(D), std::move(E), {Cone::free(m)},
                             std::move(lambda), Numbers(static_cast<std::size_t>(m), 0.0)));
    };
    linear("free_diagonal", diagonal({2, 1, 4}), matrix(2, 3, {1, 1, 0, 0, 1, -1}), {}, {3, -1});
    linear("free_blocks", small_blocks(), matrix(2, 4, {1, 0, 1, 0, 0, 1, 0, -1}), {}, {1, 2});
    linear("free_definite", definite_chain(), chain_constraints(), {}, {1, -2, 4});

    // A chain of springs that floats: H has the rigid translation as its null space, which the first row holds.
    Numbers springs(20, 2.0);
    springs.front() = springs.back() = 1.0;
    linear("free_semidefinite", chain(-1, springs, -1),
           SparseMatrix::from_triplets(2, 20, {{0, 0, 1}, {1, 7, 1}, {1, 12, -1}}), {}, {2, 1});

    // A massless freedom of a diagonal H, held by a row.
    linear("free_semidefinite_diagonal", diagonal({1, 0, 2}), matrix(2, 3, {0, 1, 0, 1, 1, 1}), {}, {2, -3});

    Numbers buckled(20, 2.5);
    buckled[3] = -4.0;
    buckled[11] = -1.5;
    linear("free_indefinite", chain(-1, buckled, -1), chain_constraints(), {}, {1, -2, 4});
    linear("free_unsymmetric", chain(-1, Numbers(20, 3.0), -0.5), chain_constraints(), {}, {1, -2, 4});
    linear("free_compliance", diagonal({2, 1, 4}), matrix(2, 3, {1, 1, 0, 0, 1, -1}), diagonal({0.5, 0.25}), {3, -1});
    list.push_back(
        reduced("free_reduced", matrix(3, 3, {4, 1, 0, 1, 3, -1, 0, -1, 2}), {Cone::free(3)}, {1, -2, 3}, {0, 0, 0}));

    // The third row repeats the first: only λ₁ + λ₃ is determined.
    linear("free_redundant", diagonal({2, 1, 4}), matrix(3, 3, {1, 1, 0, 0, 1, -1, 1, 1, 0}), {}, {3, -1, 1});
    list.back().lambda_is_unique = false;
}

void add_nonnegative(std::vector<KnownProblem>& list) {
    const Numbers lambda{2, 0, 1}, u{0, 3, 0};
    const std::vector<Cone> cones{Cone::nonnegative(2), Cone::nonnegative(1)};
    list.push_back(known("nonnegative_diagonal", diagonal({2, 1, 4}), matrix(3, 3, {1, 0, 0, 1, 1, 0, 0, 1, -1}), {},
                         cones, lambda, u));
    list.push_back(known("nonnegative_blocks", small_blocks(), matrix(3, 4, {1, 0, 0, 1, 0, 1, 0, 0, 0, 1, -1, 0}), {},
                         cones, lambda, u));
    list.push_back(known("nonnegative_definite", definite_chain(), chain_constraints(), {}, cones, lambda, u));
    list.push_back(reduced("nonnegative_reduced", matrix(3, 3, {4, 1, 0, 1, 3, -1, 0, -1, 2}), cones, lambda, u));
    list.push_back(
        known("nonnegative_compliance", diagonal({2, 1, 4}), identity(3), diagonal({0.5, 1, 2}), cones, lambda, u));

    // A table on four legs: the load of each is not determined.
    list.push_back(known("nonnegative_redundant", diagonal({2, 1, 1}),
                         matrix(4, 3, {1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1}), {}, {Cone::nonnegative(4)},
                         {2, 1, 1, 2}, {0, 0, 0, 0}));
    list.back().lambda_is_unique = false;
}

void add_box(std::vector<KnownProblem>& list) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    // At the upper bound, at the lower one beside an open one, without bounds, inside, and with no room at all.
    const std::vector<Cone> cones{Cone::box({-1, 0, -infinity}, {1, infinity, infinity}), Cone::box({-2, 1}, {2, 1})};
    const Numbers lambda{1, 0, 5, 0.5, 1}, u{-2, 3, 0, 0, -0.5};
    list.push_back(known("box_diagonal", diagonal({1, 2, 1, 3, 1}), identity(5), {}, cones, lambda, u));
    list.push_back(
        known("box_definite", definite_chain(),
              SparseMatrix::from_triplets(5, 20, {{0, 0, 1}, {1, 3, 1}, {1, 4, -1}, {2, 8, 1}, {3, 11, 2}, {4, 19, 1}}),
              {}, cones, lambda, u));
    list.push_back(known("box_compliance", diagonal({1, 2, 1, 3, 1}), identity(5), diagonal({1, 0.5, 2, 1, 0.25}),
                         cones, lambda, u));
    list.push_back(reduced("box_reduced", chain(-1, Numbers(5, 3.0), -1), cones, lambda, u));
}

/// One contact that sticks, one that slides, one that opens. The sliding one has λ_t of length μ λ_n and u_t against
/// it; u_n is 0 by the exact law and μ‖u_t‖ by the associated one.
struct ThreeContacts {
    std::vector<Cone> cones;
    Numbers lambda, u;
};

ThreeContacts three_contacts(Law law, std::int32_t rows) {
    const double slip = law == Law::Coulomb ? 0.0 : 0.5;
    if (rows == 3)
        return {{Cone::friction(0.5), Cone::friction(0.5), Cone::friction(0.25)},
                {3, 0.5, -0.25, 10, 3, 4, 0, 0, 0},
                {0, 0, 0, slip, -0.6, -0.8, 1, 0.125, -0.25}};
    return {{Cone::friction(0.5, 2), Cone::friction(0.5, 2), Cone::friction(0.25, 2)},
            {3, -0.5, 10, 5, 0, 0},
            {0, 0, slip, -1, 1, 0.125}};
}

void add_friction_of(std::vector<KnownProblem>& list, Law law) {
    const std::string suffix = law == Law::Coulomb ? "_coulomb" : "_associated";
    for (const std::int32_t rows : {3, 2}) {
        const auto contacts = three_contacts(law, rows);
        const std::string dimension = rows == 3 ? "" : "_planar";
        const std::int32_t m = 3 * rows;
        Numbers masses;
        for (const double mass : {2.0, 1.0, 4.0}) masses.insert(masses.end(), static_cast<std::size_t>(rows), mass);
        list.push_back(known("friction" + dimension + "_diagonal" + suffix, diagonal(masses), identity(m), {},
                             contacts.cones, contacts.lambda, contacts.u, law));
        list.push_back(reduced("friction" + dimension + "_reduced" + suffix, diagonal(masses), contacts.cones,
                               contacts.lambda, contacts.u, law));
    }
    // Without friction the tangents are free to move and carry nothing.
    list.push_back(known("friction_of_zero" + suffix, diagonal({2, 2, 2}), identity(3), {}, {Cone::friction(0.0)},
                         {4, 0, 0}, {0, 1, -2}, law));
}

void add_friction(std::vector<KnownProblem>& list) {
    add_friction_of(list, Law::Associated);
    add_friction_of(list, Law::Coulomb);
    const auto contacts = three_contacts(Law::Associated, 3);

    const SparseMatrix inertia = matrix(3, 3, {3, 1, 0, 1, 4, 1, 0, 1, 2});
    std::vector<Triplet> blocks, between;
    for (std::int32_t body = 0; body < 3; ++body)
        for (std::int32_t i = 0; i < 3; ++i) {
            for (std::int32_t k = inertia.row_start[static_cast<std::size_t>(i)];
                 k < inertia.row_start[static_cast<std::size_t>(i) + 1]; ++k)
                blocks.push_back({3 * body + i, 3 * body + inertia.column[static_cast<std::size_t>(k)],
                                  inertia.value[static_cast<std::size_t>(k)]});
            between.push_back({3 * body + i, 3 * body + i, 1.0});
            if (body > 0) between.push_back({3 * body + i, 3 * body + i - 3, -1.0});
        }
    const auto D = SparseMatrix::from_triplets(9, 9, between);
    list.push_back(known("friction_blocks", SparseMatrix::from_triplets(9, 9, blocks), D, {}, contacts.cones,
                         contacts.lambda, contacts.u));
    list.push_back(known("friction_compliance", SparseMatrix::from_triplets(9, 9, blocks), D,
                         diagonal(Numbers(9, 0.25)), contacts.cones, contacts.lambda, contacts.u));
    std::vector<Triplet> on_chain;
    for (std::int32_t i = 0; i < 9; ++i) on_chain.push_back({i, 2 * i, 1.0});
    list.push_back(known("friction_definite", definite_chain(), SparseMatrix::from_triplets(9, 20, on_chain), {},
                         contacts.cones, contacts.lambda, contacts.u));

    // A box on four corners (±1, ±1, −½): forces and moments of 12 rows on six freedoms.
    std::vector<Triplet> corners;
    std::int32_t row = 0;
    for (const double px : {-1.0, 1.0})
        for (const double py : {-1.0, 1.0}) {
            constexpr double pz = -0.5;
            for (const Triplet& entry : {Triplet{0, 2, 1.0},
                                         {0, 3, py},
                                         {0, 4, -px},
                                         {1, 0, 1.0},
                                         {1, 4, pz},
                                         {1, 5, -py},
                                         {2, 1, 1.0},
                                         {2, 3, -pz},
                                         {2, 5, px}})
                corners.push_back({row + entry.row, entry.column, entry.value});
            row += 3;
        }
    Numbers loads;
    for (const double load : {2.0, 1.0, 1.0, 2.0}) loads.insert(loads.end(), {load, 0.25 * load, -0.125 * load});
    list.push_back(known(
        "friction_redundant", diagonal({2, 2, 2, 1, 1, 1}), SparseMatrix::from_triplets(12, 6, corners), {},
        {Cone::friction(0.5), Cone::friction(0.5), Cone::friction(0.5), Cone::friction(0.5)}, loads, Numbers(12, 0.0)));
    list.back().lambda_is_unique = false;
}

void add_mixed(std::vector<KnownProblem>& list) {
    std::vector<Triplet> rows;
    for (std::int32_t i = 0; i < 8; ++i) {
        rows.push_back({i, 2 * i, 1.0});
        rows.push_back({i, 2 * i + 1, i % 2 == 0 ? 0.5 : -0.5});
    }
    list.push_back(known("mixed_definite", definite_chain(), SparseMatrix::from_triplets(8, 20, rows), {},
                         {Cone::free(2), Cone::friction(0.5), Cone::nonnegative(2), Cone::box({-1}, {1})},
                         {3, -1, 10, 3, 4, 2, 0, -1}, {0, 0, 0.5, -0.6, -0.8, 0, 1, 2}));
}

/// A usual block of the kind, with its example parameters.
Cone example_of(const sdk::ConeOperations& kind) {
    const std::int32_t rows = kind.usual_rows;
    Cone cone{static_cast<ConeKind>(kind.kind), rows, {}, {}, {}};
    for (std::size_t k = 0; k < kind.named_parameters().size(); ++k) cone.parameters[k] = kind.parameters[k].example;
    if (kind.has_bounds) {
        cone.lo.assign(static_cast<std::size_t>(rows), -1.0);
        cone.hi.assign(static_cast<std::size_t>(rows), 2.0);
    }
    return cone;
}

/// Adds λ = P(z) and u = λ − z, which fulfil −u ∈ N_Υ(λ) for any z.
void add_pair(const sdk::ConeOperations& kind, const Cone& cone, const Numbers& z, Numbers& lambda, Numbers& u) {
    Numbers projected = z;
    kind.project(raw_cone(cone), projected.data());
    for (std::size_t i = 0; i < z.size(); ++i) u.push_back(projected[i] - z[i]);
    lambda.insert(lambda.end(), projected.begin(), projected.end());
}

/// Three blocks of each kind in the table, by pairs that its own projection makes. z is small, large, and large with a
/// negative first row.
void add_projected(std::vector<KnownProblem>& list) {
    for (const sdk::ConeOperations& kind : sdk::cone_table) {
        const std::int32_t rows = kind.usual_rows, m = 3 * rows;
        const Cone cone = example_of(kind);
        Numbers lambda, u;
        for (const double size : {0.5, 4.0, -4.0}) {
            Numbers z(static_cast<std::size_t>(rows), size);
            for (std::size_t i = 1; i < z.size(); ++i)
                z[i] = (i % 2 == 0 ? -0.5 : 0.75) * size * (size == 0.5 ? 0.25 : 1.0);
            add_pair(kind, cone, z, lambda, u);
        }
        const std::vector<Cone> cones(3, cone);
        const std::string name = "projected_" + std::string(kind.name);
        Numbers masses;
        std::vector<Triplet> between;
        for (std::int32_t i = 0; i < m; ++i) {
            const std::int32_t body = i / rows;
            masses.push_back(1.0 + body);
            between.push_back({i, i, 1.0});
            if (i >= rows) between.push_back({i, i - rows, -0.5});
        }
        list.push_back(known(name + "_diagonal", diagonal(masses), SparseMatrix::from_triplets(m, m, between), {},
                             cones, lambda, u));
        list.push_back(reduced(name + "_reduced", diagonal(masses), cones, lambda, u));
    }
}

/// Where a projection divides by a length that may be zero. The blocks of a kind do not know of one another, so that
/// already the first iterate of a solver that starts from zero projects: a point on the axis of the polar cone (a
/// contact that opens straight up), one beside the axis, the apex itself, and one on the axis of the cone. In all but
/// the last λ = 0 where Υ is a cone; u = 0 in the last, so that both laws have the same answer.
void add_apex(std::vector<KnownProblem>& list) {
    for (const sdk::ConeOperations& kind : sdk::cone_table) {
        const std::int32_t rows = kind.usual_rows;
        const Cone cone = example_of(kind);
        Numbers lambda, u, masses;
        const std::pair<double, double> points[] = {{-1.0, 0.0}, {-2.0, 0.5}, {0.0, 0.0}, {1.0, 0.0}};
        for (const auto& [along, across] : points) {
            Numbers z(static_cast<std::size_t>(rows), 0.0);
            z[0] = along;
            if (rows > 1) z[1] = across;
            add_pair(kind, cone, z, lambda, u);
            masses.insert(masses.end(), static_cast<std::size_t>(rows), 2.0);
        }
        const std::vector<Cone> cones(std::size(points), cone);
        const auto m = static_cast<std::int32_t>(masses.size());
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            if (law == Law::Coulomb && !kind.has_law()) continue;
            const std::string name = "apex_" + std::string(kind.name) + (law == Law::Coulomb ? "_coulomb" : "");
            list.push_back(known(name + "_diagonal", diagonal(masses), identity(m), {}, cones, lambda, u, law));
            list.push_back(reduced(name + "_reduced", diagonal(masses), cones, lambda, u, law));
        }
    }
}

/// Body i stands on body i − 1, and the first on the ground: N = D Dᵀ is tridiagonal by blocks, of condition about
/// bodies².
KnownProblem tower(const std::string& name, const Cone& cone, double sideways, Law law, bool is_reduced) {
    constexpr std::int32_t bodies = 100;
    const std::int32_t rows = cone.rows, m = bodies * rows;
    std::vector<Triplet> D, N;
    Numbers lambda;
    for (std::int32_t body = 0; body < bodies; ++body) {
        for (std::int32_t i = 0; i < rows; ++i) {
            const std::int32_t row = body * rows + i;
            D.push_back({row, row, 1.0});
            N.push_back({row, row, body == 0 ? 1.0 : 2.0});
            lambda.push_back((bodies - body) * (i == 0 ? 1.0 : sideways));
            if (body == 0) continue;
            D.push_back({row, row - rows, -1.0});
            N.push_back({row, row - rows, -1.0});
            N.push_back({row - rows, row, -1.0});
        }
    }
    const std::vector<Cone> cones(bodies, cone);
    const Numbers u(static_cast<std::size_t>(m), 0.0);
    if (is_reduced)
        return reduced("tower_" + name + "_reduced", SparseMatrix::from_triplets(m, m, N), cones, lambda, u, law);
    return known("tower_" + name, identity(m), SparseMatrix::from_triplets(m, m, D), {}, cones, lambda, u, law);
}

}  // namespace

void KnownProblem::set_right_hand_side() {
    std::fill(problem.a.begin(), problem.a.end(), 0.0);
    problem.b = u;
    if (problem.n() > 0) {
        problem.H.multiply_add(1.0, solution.x.data(), problem.a.data());
        problem.D.transpose_multiply_add(-1.0, solution.lambda.data(), problem.a.data());
        problem.D.multiply_add(-1.0, solution.x.data(), problem.b.data());
    }
    if (problem.E.rows > 0) problem.E.multiply_add(-1.0, solution.lambda.data(), problem.b.data());
}

KnownProblem KnownProblem::with_right_hand_side(int k) const {
    KnownProblem other = *this;
    for (std::size_t i = 0; i < other.solution.x.size(); ++i)
        other.solution.x[i] += std::sin(static_cast<double>(i) + k);
    const bool are_cones = std::none_of(problem.cones.begin(), problem.cones.end(),
                                        [](const Cone& cone) { return !operations_of(cone).is_cone; });
    if (are_cones) {
        for (double& value : other.solution.lambda) value *= 1.0 + 0.125 * k;
        for (double& value : other.u) value *= 1.0 + 0.125 * k;
    }
    other.set_right_hand_side();
    return other;
}

KnownProblem KnownProblem::with_values(double factor) const {
    KnownProblem other = *this;
    for (double& value : other.problem.H.value) value *= factor;
    for (double& value : other.problem.E.value) value *= factor;
    other.set_right_hand_side();
    return other;
}

std::vector<KnownProblem> known_problems() {
    std::vector<KnownProblem> list;
    add_unconstrained(list);
    add_free(list);
    add_nonnegative(list);
    add_box(list);
    add_friction(list);
    add_mixed(list);
    add_projected(list);
    add_apex(list);
    return list;
}

std::vector<KnownProblem> towers() {
    std::vector<KnownProblem> list;
    for (const bool is_reduced : {false, true}) {
        list.push_back(tower("friction_associated", Cone::friction(0.5), 0.125, Law::Associated, is_reduced));
        list.push_back(tower("friction_coulomb", Cone::friction(0.5), 0.125, Law::Coulomb, is_reduced));
        list.push_back(tower("nonnegative", Cone::nonnegative(1), 0.0, Law::Associated, is_reduced));
        list.push_back(tower("box", Cone::box({0}, {1000}), 0.0, Law::Associated, is_reduced));
        list.push_back(tower("free", Cone::free(1), 0.0, Law::Associated, is_reduced));
    }
    return list;
}

Problem inconsistent_problem() {
    Problem problem = known("inconsistent", diagonal({2, 1, 4}), matrix(3, 3, {1, 1, 0, 0, 1, -1, 1, 1, 0}), {},
                            {Cone::free(3)}, {3, -1, 1}, {0, 0, 0})
                          .problem;
    problem.b[2] += 1.0;
    return problem;
}

Problem singular_problem() {
    Problem problem =
        known("singular", diagonal({1, 0, 2}), matrix(1, 3, {1, 0, 1}), {}, {Cone::free(1)}, {2}, {0}).problem;
    problem.a[1] = 1.0;  // 0 · x₂ = 1
    return problem;
}

}  // namespace delassus::check
