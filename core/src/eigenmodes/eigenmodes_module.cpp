// SPDX-License-Identifier: BSD-3-Clause
// Modes by Spectra's Lanczos method with implicit restarts, in shift-and-invert mode; see mechanics/eigenmodes.hpp.
#include <Spectra/SymEigsShiftSolver.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "delassus/sdk/sparse_factor.hpp"
#include "mechanics/eigenmodes.hpp"

namespace {

using delassus::InputError;
using delassus::sdk::SparseColumns;
using delassus::sdk::SparseFactor;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// With y = M^½ φ the problem K φ = ω² M φ is a standard one of M^{−½} K M^{−½}. This applies its shifted inverse
/// M^½ (K + shift M)⁻¹ M^½.
class Inverse {
public:
    using Scalar = double;
    Inverse(const SparseFactor& factor, const VectorXd& root) : factor_(factor), root_(root) {}
    [[nodiscard]] Eigen::Index rows() const { return root_.size(); }
    [[nodiscard]] Eigen::Index cols() const { return root_.size(); }
    void set_shift(double) {}  // the factor has it
    void perform_op(const double* in, double* out) const {
        VectorXd x = root_.cwiseProduct(Eigen::Map<const VectorXd>(in, root_.size()));
        factor_.solve(x);
        Eigen::Map<VectorXd>(out, root_.size()) = root_.cwiseProduct(x);
    }

private:
    const SparseFactor& factor_;
    const VectorXd& root_;
};

/// K⁻¹ f. Where a shift keeps the factor definite, x ← (K + shift M)⁻¹ (f + shift M x) converges to it: by the factor
/// shift/(ω² + shift) with the smallest ω² beyond the motions without force, of which x is kept free.
VectorXd response(const SparseFactor& factor, const VectorXd& mass, const MatrixXd& rigid, double shift,
                  const VectorXd& f) {
    constexpr int most_iterations = 200;
    VectorXd x = VectorXd::Zero(f.size());
    for (int i = 0; i < most_iterations; ++i) {
        VectorXd next = f + shift * mass.cwiseProduct(x);
        factor.solve(next);
        if (rigid.cols() == 0) return next;
        next -= rigid * (rigid.transpose() * mass.cwiseProduct(next));
        const double change = (next - x).norm();
        x = std::move(next);
        if (change <= 1e-14 * x.norm()) break;
    }
    return x;
}

}  // namespace

extern "C" DELASSUS_API void delassus_eigenmodes_find(const delassus::SparseMatrix& K, const VectorXd& mass,
                                                      const MatrixXd& rigid, double shift, const MatrixXd& loads,
                                                      std::int32_t count, delassus::mechanics::Eigenmodes& result) {
    const Eigen::Index n = mass.size();
    // Rows of a symmetric matrix are its columns.
    SparseColumns A =
        Eigen::Map<const SparseColumns>(n, n, K.entries(), K.row_start.data(), K.column.data(), K.value.data());
    for (Eigen::Index i = 0; i < n; ++i) A.coeffRef(i, i) += shift * mass[i];
    SparseFactor factor;
    factor.analyze(A, n);
    if (!factor.factorize(A))
        throw InputError("the stiffness of an elastic body is not positive definite where it is held");
    result.responses.resize(n, loads.cols());
    for (Eigen::Index j = 0; j < loads.cols(); ++j)
        result.responses.col(j) = response(factor, mass, rigid, shift, loads.col(j));
    result.squares.resize(0);
    result.modes.resize(n, 0);
    if (count == 0) return;
    const VectorXd root = mass.cwiseSqrt();
    Inverse inverse(factor, root);
    const Eigen::Index subspace = std::min<Eigen::Index>(n, std::max<Eigen::Index>(2 * count + 10, 20));
    Spectra::SymEigsShiftSolver<Inverse> solver(inverse, count, subspace, -shift);
    // A start that is no mode, and the same in each run.
    VectorXd start = VectorXd::LinSpaced(n, 1.0, 2.0);
    for (Eigen::Index i = 0; i < n; ++i) start[i] *= (i * 7919 % 13 < 6 ? 1.0 : -1.0);
    solver.init(start.data());
    const Eigen::Index found =
        solver.compute(Spectra::SortRule::LargestMagn, 1000, 1e-12, Spectra::SortRule::SmallestAlge);
    if (solver.info() != Spectra::CompInfo::Successful)
        throw InputError(fmt::format("of {} modes of an elastic body only {} were found", count, found));
    result.squares = solver.eigenvalues();
    result.modes = root.cwiseInverse().asDiagonal() * solver.eigenvectors();
}
