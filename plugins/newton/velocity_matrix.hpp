// SPDX-License-Identifier: BSD-3-Clause
// The matrix of a Newton step on the velocities, H + Dᵀ W D, and its factor.
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/sdk/sparse_factor.hpp"
#include "envelope_factor.hpp"
#include "reactions.hpp"

namespace delassus::newton {

/// W has one block for each piece. The envelope of the velocities in reverse order is taken where it is small: bodies
/// are numbered from the root of a tree to its leaves, and elimination from the leaves on fills nothing in. Else
/// multifrontal Cholesky.
class VelocityMatrix {
public:
    /// The patterns of H and D. Two blocks of H are coupled where one piece has both.
    void analyze(const sdk::ProblemView& problem, const std::vector<Piece>& pieces);
    /// The values of H and D.
    void load(const sdk::ProblemView& problem);
    /// Factors H + Dᵀ W D. False if it is not definite in floating point.
    [[nodiscard]] bool factorize(const sdk::ProblemView& problem, const Linearisation& at);
    /// v ← (H + Dᵀ W D)⁻¹ v.
    void solve(sdk::Vector& v);

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }

private:
    /// The columns of one piece, ascending in reverse order, and its dense rows of D.
    struct Clique {
        std::int32_t first, rows, columns;
        std::size_t index;  // in index_
        std::size_t value;  // in value_ and image_: `columns` values a row
    };

    void make_images(const Linearisation& at);
    void assemble_envelope(const sdk::ProblemView& problem, const Linearisation& at);
    void assemble_sparse(const sdk::ProblemView& problem, const Linearisation& at);
    void analyze_sparse(const sdk::ProblemView& problem);

    std::int32_t n_ = 0;
    std::vector<Clique> cliques_;
    std::vector<std::int32_t> index_;
    std::vector<double> value_, image_;  // rows of D, and of W D
    std::vector<std::int32_t> filled_;   // where a column lies in the clique that is being filled

    bool by_envelope_ = true;
    EnvelopeFactor envelope_;
    sdk::SparseFactor factor_;
    sdk::SparseColumns matrix_;  // lower triangle
    std::vector<std::size_t> start_of_column_, clique_of_column_, place_of_column_;
    std::vector<double> work_;
    sdk::Vector reversed_;
    std::int64_t analyses_ = 0;
};

}  // namespace delassus::newton
