// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/bordered_factor.hpp"

#include <Eigen/SparseLU>
#include <cmath>

namespace delassus {

// ---- Elimination of the border ----
//
// [A b; cᵀ d] {z; y} = {f; g}, where A is factorised (LU with partial pivoting, scaled) and may be nearly singular, as
// K is near a limit point. Crout's and Doolittle's eliminations one after the other (mixed block elimination, Govaerts
// and Pryce, BIT 33, 1993) are then as accurate as an elimination of the whole matrix:
//
//     Aᵀ v = c, A u = b,    y₁ = (g − v·f)/(d − v·b)
//     A ζ = f − b y₁,       y₂ = (g − d y₁ − c·ζ)/(d − c·u)
//     z = ζ − u y₂,         y = y₁ + y₂
//
// The border stays out of the factor, in which a full row would fill everything.

struct BorderedFactor::Implementation {
    using Sparse = Eigen::SparseMatrix<double>;
    // Its transpose() is no const member.
    mutable Eigen::SparseLU<Sparse> factor;
    Vector row_scale, column_scale;  // of A: n + m
    Vector b, c, u, v;
    double d = 0.0, by_rows = 0.0, by_columns = 0.0;
    double load_unit = 1.0, row_unit = 1.0;
    std::int32_t n = 0, m = 0;
};

BorderedFactor::BorderedFactor() : implementation_(std::make_unique<Implementation>()) {}
BorderedFactor::~BorderedFactor() = default;

bool BorderedFactor::factorise(const SparseMatrix& K, const SparseMatrix& M, double shift, const SparseMatrix& D,
                               const Vector& root, const Vector& row_scale, const Vector& p, const Vector& w,
                               double w_mu) {
    auto& self = *implementation_;
    const std::int32_t n = K.rows, m = D.rows;
    self.n = n;
    self.m = m;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(K.value.size() + M.value.size() + 2 * D.value.size());
    const auto each = [](const SparseMatrix& A, auto&& visit) {
        for (std::int32_t row = 0; row < A.rows; ++row)
            for (auto e = static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row)]);
                 e < static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row) + 1]); ++e)
                visit(row, A.column[e], A.value[e]);
    };
    const auto add = [&](std::int32_t i, std::int32_t j, double value) {
        entries.emplace_back(i, j, value / (root[i] * root[j]));
    };
    each(K, add);
    each(M, [&](std::int32_t i, std::int32_t j, double value) { add(i, j, shift * value); });
    each(D, [&](std::int32_t i, std::int32_t j, double value) {
        const double scaled = value * row_scale[i] / root[j];
        entries.emplace_back(n + i, j, scaled);
        entries.emplace_back(j, n + i, -scaled);
    });
    Implementation::Sparse A(n + m, n + m);
    A.setFromTriplets(entries.begin(), entries.end());
    self.factor.compute(A);
    if (self.factor.info() != Eigen::Success) return false;
    // Unknowns are x root, λ/row_scale and μ/load_unit.
    self.column_scale.resize(n + m);
    self.column_scale << root.cwiseInverse(), row_scale;
    self.row_scale = self.column_scale;
    self.b.setZero(n + m);
    self.b.head(n) = -p.cwiseQuotient(root);
    self.c.setZero(n + m);
    self.c.head(n) = w.cwiseQuotient(root);
    const double size = self.b.norm();
    self.load_unit = size > 0.0 ? 1.0 / size : 1.0;
    self.b *= self.load_unit;
    self.row_unit = 1.0 / std::hypot(self.c.norm(), w_mu * self.load_unit);
    if (!std::isfinite(self.row_unit)) return false;
    self.c *= self.row_unit;
    self.d = w_mu * self.load_unit * self.row_unit;
    if (n + m > 0) {
        self.u = self.factor.solve(self.b);
        self.v = self.factor.transpose().solve(self.c);
    } else {
        self.u.resize(0);
        self.v.resize(0);
    }
    self.by_rows = self.d - self.v.dot(self.b);
    self.by_columns = self.d - self.c.dot(self.u);
    return std::isfinite(self.by_rows) && std::isfinite(self.by_columns) && self.by_rows != 0.0 &&
           self.by_columns != 0.0;
}

BorderedFactor::Solution BorderedFactor::solve(const Vector& a, const Vector& b, double c) const {
    const auto& self = *implementation_;
    Vector f(self.n + self.m);
    f << a, b;
    f = f.cwiseProduct(self.row_scale);
    const double g = c * self.row_unit;
    const double first = (g - self.v.dot(f)) / self.by_rows;
    Vector zeta(self.n + self.m);
    if (f.size() > 0) zeta = self.factor.solve(f - self.b * first);
    const double second = (g - self.d * first - self.c.dot(zeta)) / self.by_columns;
    const Vector z = (zeta - self.u * second).cwiseProduct(self.column_scale);
    return {z.head(self.n), z.tail(self.m), (first + second) * self.load_unit};
}

Vector BorderedFactor::solve_inside(const Vector& a, const Vector& b) const {
    const auto& self = *implementation_;
    Vector f(self.n + self.m);
    f << a, b;
    const Vector z = self.factor.solve(f.cwiseProduct(self.row_scale));
    return z.cwiseProduct(self.column_scale).head(self.n);
}

}  // namespace delassus
