// SPDX-License-Identifier: BSD-3-Clause
// The linear equation of a Newton step (natural_map.hpp),
//
//     (A N B + M) δ_B = g,      N = D H⁻¹ Dᵀ + E  (scaled),
//
// in one of two forms that are equal in exact arithmetic:
// - rows: N is formed, and the matrix has a row for each active direction of each contact; the inactive ones are rows
//   of the identity, so that one pattern serves every step;
// - velocities: with v = H⁻¹Dᵀ B δ_B,
//       (H + Dᵀ Q D) v = Dᵀ B M⁻¹ g,   δ_B = M⁻¹ (g − A D v),   Q = B M⁻¹ A,  M ← M + A E B,
//   a matrix of the size of H with the pattern of H + DᵀD: sparse where N is not, and positive definite however many
//   rows depend on one another. It needs an E that couples no two contacts.
// M ~ τ is small, and the second form loses about ε/τ of the digits of δ_B, the first ε cond(N + τ1): steps of
// refinement with N itself bring them back.
#pragma once

#include <cstdint>
#include <vector>

#include "factor.hpp"
#include "natural_map.hpp"

namespace delassus::ssn {

enum class Form { Automatic, Rows, Velocities };

class NewtonSystem {
public:
    explicit NewtonSystem(Form form) : wanted_(form) {}

    /// Builds the pattern and the values that do not depend on the iterate. scaled: of the same problem, factorised.
    void factorize(const sdk::ProblemView& problem, const sdk::ScaledProblem& scaled, bool pattern_is_new);

    /// step ← the Newton step δ from a map that was linearised with these normal and local (m each), product ← N δ.
    /// False if the matrix is singular. tau: of the map's linearisation.
    [[nodiscard]] bool solve(const sdk::ScaledProblem& scaled, const NaturalMap& map, double tau, const Vector& normal,
                             const Vector& local, Vector& step, Vector& product);

    [[nodiscard]] std::int64_t analyses() const { return factor_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    // Rows of one piece in D̂ = P D (velocities): columns, and where column b's entries of the clique lie in the matrix.
    struct Clique {
        std::int32_t first, rows, columns;
        std::size_t index;  // in index_
        std::size_t value;  // in value_: rows values for each column
        std::size_t slot;   // in slot_: columns × columns positions
    };
    // Two pieces that N couples (rows form).
    struct Couple {
        std::int32_t row_piece, column_piece;
        std::array<std::int32_t, 3> slot;  // where column b of the block starts in the matrix
        std::array<double, 9> value;       // N of the two, column-major, leading dimension 3
    };

    void choose_form(const sdk::ProblemView& problem, const std::vector<sdk::RowGroup>& groups);
    void build_velocities(const sdk::ProblemView& problem, const sdk::ScaledProblem& scaled,
                          const std::vector<sdk::RowGroup>& groups);
    void build_rows(const sdk::ProblemView& problem, const sdk::ScaledProblem& scaled,
                    const std::vector<sdk::RowGroup>& groups);
    void assemble_velocities(const NaturalMap& map);
    void assemble_rows(const NaturalMap& map);
    void solve_local(const NaturalMap& map, const Vector& g, Vector& solution);

    Form wanted_;
    bool velocities_ = false;
    SparseColumns matrix_;
    Vector constant_;  // values of the matrix that every step starts from
    Factor factor_;
    std::int64_t factorizations_ = 0;

    std::vector<Clique> cliques_;
    std::vector<std::int32_t> index_, slot_;
    std::vector<double> value_;
    std::vector<std::array<double, 9>> compliance_;   // Ê of each piece, column-major, leading dimension 3
    std::vector<std::array<double, 9>> Q_, inverse_;  // of each piece; inverse_: of M + A Ê B
    Vector root_;                                     // diag(H)^(−½): the columns of D and H are scaled by it

    std::vector<Couple> couples_;
    Vector expanded_, correction_, residual_, velocity_, work_;
};

}  // namespace delassus::ssn
