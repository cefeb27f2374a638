// SPDX-License-Identifier: BSD-3-Clause
// CHOLMOD in C++: one symmetric matrix, its ordering and its factor, with the library's workspace owned beside it.
#pragma once

#include <cholmod.h>

#include <functional>
#include <string>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus_cholmod {

using delassus::sdk::SparseColumns;
using delassus::sdk::SparseRows;
using delassus::sdk::SparseRowsView;
using delassus::sdk::Vector;

enum class Ordering { Automatic, Amd, Metis, Best };
enum class Method { Automatic, Simplicial, Supernodal };

/// L Lᵀ of a definite matrix (simplicial or supernodal), or L Δ Lᵀ of a quasi-definite one (simplicial only), without
/// pivoting, in the order of rows that keeps L sparse. Quiet: nothing is ever printed. Not copyable.
class Cholesky {
public:
    enum class Kind { Definite, QuasiDefinite };

    Cholesky(Kind kind, Ordering ordering, Method method);
    ~Cholesky();
    Cholesky(const Cholesky&) = delete;
    Cholesky& operator=(const Cholesky&) = delete;

    /// Orders the rows and finds the pattern of L. A: square, both triangles or the lower one; values are not read.
    /// Throws delassus::sdk::NumericalFailure if CHOLMOD cannot.
    void analyze(const SparseColumns& A);

    /// Factors A + shift·1; A as analysed, with other values. False if a pivot is not positive (zero for a
    /// quasi-definite matrix) or not finite. Throws NumericalFailure if memory runs out.
    [[nodiscard]] bool factorize(const SparseColumns& A, double shift = 0.0);

    /// v ← (A + shift·1)⁻¹ v.
    void solve(Vector& v) const;

    /// For each row of D (rows × the matrix's size), the sparse column L⁻¹ P Dᵀ e_row of Z, by which D A⁻¹ Dᵀ = Zᵀ Z.
    /// visit(row, reach, values): the indices where it may differ from zero, ascending, and the whole column; the
    /// indices depend on the patterns alone. Definite matrices only. Costs, per row, the entries of L in the columns
    /// that the row reaches in the elimination tree.
    using Visitor = std::function<void(Eigen::Index, const std::vector<std::int32_t>&, const Vector&)>;
    void half_solve(const SparseRows& D, const Visitor& visit) const;

    /// Floating-point operations of a factorisation and entries of L, known after analyze.
    [[nodiscard]] double flops() const { return flops_; }
    [[nodiscard]] double entries() const { return entries_; }
    /// A cheap upper bound of the reciprocal condition number: the ratio of the extreme pivots.
    [[nodiscard]] double reciprocal_condition() const;
    [[nodiscard]] bool supernodal() const { return factor_ && factor_->is_super != 0; }

private:
    [[nodiscard]] cholmod_sparse view(const SparseColumns& A) const;

    Kind kind_;
    mutable cholmod_common common_;
    cholmod_factor* factor_ = nullptr;
    mutable cholmod_dense *solution_ = nullptr, *work_y_ = nullptr, *work_e_ = nullptr;
    double flops_ = 0.0, entries_ = 0.0;
};

}  // namespace delassus_cholmod
