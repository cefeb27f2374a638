// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "delassus/error.hpp"
#include "delassus/errors.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/saddle_point.hpp"
#include "problem/prepared_problem.hpp"

namespace delassus {

using sdk::Vector;
using sdk::VectorView;

namespace {

/// The diagonal of N and r = D H⁻¹ a + b.
struct Mobility {
    Vector diagonal;
    Vector r;
};

void take_definite(const sdk::ProblemView& problem, const sdk::DelassusOperator& N, Mobility& mobility) {
    mobility.diagonal = N.diagonal();
    N.free_velocity(problem, mobility.r);
}

void add_compliance(const sdk::ProblemView& problem, Vector& diagonal) {
    for (Eigen::Index i = 0; i < problem.m; ++i) diagonal[i] += problem.E.coeff(i, i);
}

/// |diag H|⁻¹ in place of an H⁻¹ that does not exist.
Mobility of_singular(const sdk::ProblemView& problem) {
    const Vector h = sdk::magnitude_of_diagonal(problem);
    return {sdk::stand_in_diagonal(problem, h), problem.D * problem.a.cwiseQuotient(h) + problem.b};
}

Mobility of_unsymmetric(const sdk::ProblemView& problem) {
    const Eigen::SparseLU<sdk::SparseColumns> factor{sdk::SparseColumns(problem.H)};
    if (factor.info() != Eigen::Success) return of_singular(problem);
    Mobility mobility;
    mobility.diagonal.setZero(problem.m);
    Vector row(problem.n);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        row = problem.D.row(i).transpose();
        mobility.diagonal[i] = row.dot(Vector(factor.solve(row)));
    }
    add_compliance(problem, mobility.diagonal);
    mobility.r = problem.D * Vector(factor.solve(problem.a)) + problem.b;
    return mobility;
}

/// A reference below this share of the velocities without reactions counts as rest.
constexpr double vanishing_velocity = 1e-8;

double ratio(double numerator, double denominator) {
    return denominator > 0.0 ? numerator / denominator : numerator;
}

}  // namespace

struct ErrorMeter::Implementation {
    explicit Implementation(const PreparedProblem::Implementation& prepared_problem)
        : prepared(prepared_problem), view(prepared.raw) {
        take_mobility();
    }

    void take_mobility() {
        if (prepared.operator_of_definite) {
            take_definite(view, *prepared.operator_of_definite, mobility);
        } else if (prepared.structure == Structure::Unsymmetric) {
            mobility = of_unsymmetric(view);
        } else {
            mobility = of_singular(view);
        }
        r_norm = mobility.r.norm();
        residual.assign(view, mobility.diagonal, mobility.r);
    }

    /// u = D x + E λ + b, in the scratch vector.
    const Vector& constraint_velocity(const VectorView& x, const VectorView& lambda) const {
        plain_u = view.b;
        if (view.n > 0) plain_u.noalias() += view.D * x;
        if (view.E.nonZeros() > 0) plain_u.noalias() += view.E * lambda;
        return plain_u;
    }

    /// plain_u with the De Saxcé term where the law asks for it.
    const Vector& judged_velocity() const {
        judged_u = plain_u;
        if (!view.coulomb) return judged_u;
        for (const auto& cone : view.cones)
            if (cone.kind == DELASSUS_CONE_FRICTION)
                judged_u[cone.first_row] += sdk::FrictionCone::de_saxce(cone, plain_u.data() + cone.first_row);
        return judged_u;
    }

    /// Errors::rounding. A product of k terms is off by at most k ε times the product of the absolute values (Higham,
    /// Accuracy and Stability of Numerical Algorithms, eq. 3.5); the errors of single terms add up as √k, and ε counts
    /// for one.
    [[nodiscard]] double rounding(const VectorView& x, const VectorView& lambda) const {
        Vector& magnitude = work;
        magnitude = view.b.cwiseAbs();
        for (Eigen::Index row = 0; row < view.m; ++row) {
            for (sdk::SparseRowsView::InnerIterator entry(view.D, row); entry; ++entry)
                magnitude[row] += std::abs(entry.value() * x[entry.col()]);
            for (sdk::SparseRowsView::InnerIterator entry(view.E, row); entry; ++entry)
                magnitude[row] += std::abs(entry.value() * lambda[entry.col()]);
        }
        for (std::size_t c = 0; c < view.cones.size(); ++c) {
            const double s = residual.scaling()[c];
            for (std::int32_t i = view.cones[c].first_row; i < view.cones[c].first_row + view.cones[c].rows; ++i)
                magnitude[i] = s * magnitude[i] + std::abs(lambda[i]) / s;
        }
        return 0.5 * std::numeric_limits<double>::epsilon() * magnitude.norm() / residual.reference();
    }

    const PreparedProblem::Implementation& prepared;
    sdk::ProblemView view;
    Mobility mobility;
    sdk::NaturalResidual residual;
    double r_norm = 0.0;
    // Kept so that measuring again allocates nothing.
    mutable Vector plain_u, judged_u, work, momentum, impulse;
};

ErrorMeter::ErrorMeter(const PreparedProblem& problem)
    : implementation_(std::make_unique<Implementation>(*problem.implementation_)) {}
ErrorMeter::~ErrorMeter() = default;

void ErrorMeter::renew() {
    auto& self = *implementation_;
    std::construct_at(&self.view, self.prepared.raw);  // maps cannot be assigned
    self.take_mobility();
}

Errors ErrorMeter::measure(std::span<const double> x_values, std::span<const double> lambda_values) const {
    const auto& self = *implementation_;
    const auto& problem = self.view;
    if (static_cast<Eigen::Index>(x_values.size()) != problem.n ||
        static_cast<Eigen::Index>(lambda_values.size()) != problem.m)
        throw InputError(fmt::format("a solution with {} and {} entries does not fit a problem with n = {}, m = {}",
                                     x_values.size(), lambda_values.size(), problem.n, problem.m));
    const VectorView x(x_values.data(), problem.n);
    const VectorView lambda(lambda_values.data(), problem.m);
    const Vector& plain_u = self.constraint_velocity(x, lambda);
    const Vector& u = self.judged_velocity();

    Errors errors;
    errors.natural = self.residual.natural(lambda, plain_u);
    errors.rounding = self.rounding(x, lambda);
    if (problem.n > 0) {
        Vector &momentum = self.momentum, &impulse = self.impulse;
        momentum.noalias() = problem.H * x;
        impulse.noalias() = problem.D.transpose() * lambda;
        errors.balance = ratio((momentum - impulse - problem.a).norm(),
                               std::max({momentum.norm(), impulse.norm(), problem.a.norm()}));
    }

    double cone_sum = 0.0, dual_sum = 0.0, gap_sum = 0.0, siconos_sum = 0.0;
    Vector& work = self.work;
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const auto& cone = problem.cones[c];
        const auto& operations = sdk::operations_of(cone);
        const double s = self.residual.scaling()[c];
        const auto lambda_c = lambda.segment(cone.first_row, cone.rows);
        const auto u_c = u.segment(cone.first_row, cone.rows);
        auto work_c = work.segment(cone.first_row, cone.rows);
        work_c = lambda_c;
        operations.project(cone, work_c.data());
        cone_sum += (lambda_c - work_c).squaredNorm() / (s * s);
        work_c = u_c;
        operations.project_dual(cone, work_c.data());
        dual_sum += (u_c - work_c).squaredNorm() * s * s;
        gap_sum += operations.gap(cone, lambda.data() + cone.first_row, u.data() + cone.first_row);
        work_c = lambda_c - u_c;
        operations.project(cone, work_c.data());
        siconos_sum += (lambda_c - work_c).squaredNorm();
    }
    const double reference = self.residual.reference();
    errors.cone = std::sqrt(cone_sum) / reference;
    errors.dual = std::sqrt(dual_sum) / reference;
    errors.gap = std::abs(gap_sum) / (reference * reference);
    errors.siconos = ratio(std::sqrt(siconos_sum), std::max({self.r_norm, lambda.norm(), u.norm()}));
    return errors;
}

double ErrorMeter::natural(const double* x, const double* lambda_values) const {
    const auto& self = *implementation_;
    const auto& problem = self.view;
    const VectorView lambda(lambda_values, problem.m);
    if (x || problem.n == 0)
        return self.residual.natural(lambda, self.constraint_velocity(VectorView(x, problem.n), lambda));
    if (!self.prepared.operator_of_definite) return std::numeric_limits<double>::quiet_NaN();
    self.prepared.operator_of_definite->velocity(problem, lambda, self.momentum);
    return self.residual.natural(lambda, self.constraint_velocity(VectorView(self.momentum.data(), problem.n), lambda));
}

double ErrorMeter::velocity(std::span<const double> x_values, std::span<const double> reference_values) const {
    const auto& problem = implementation_->view;
    if (static_cast<Eigen::Index>(x_values.size()) != problem.n || x_values.size() != reference_values.size())
        throw InputError(fmt::format("velocities with {} and {} entries do not fit a problem with n = {}",
                                     x_values.size(), reference_values.size(), problem.n));
    if (problem.n == 0) return 0.0;
    const VectorView reference(reference_values.data(), problem.n);
    const Vector difference = VectorView(x_values.data(), problem.n) - reference;
    const auto energy_norm = [&](const auto& v) { return std::sqrt(std::abs(v.dot(Vector(problem.H * v)))); };
    double scale = energy_norm(reference);
    if (const auto& N = implementation_->prepared.operator_of_definite) {
        const double free = std::sqrt(std::abs(problem.a.dot(N->velocity(problem, Vector::Zero(problem.m).eval()))));
        if (scale <= vanishing_velocity * free) scale = free;
    }
    return ratio(energy_norm(difference), scale);
}

void ErrorMeter::velocity_of(std::span<const double> lambda_values, std::vector<double>& x) const {
    const auto& self = *implementation_;
    if (self.view.n > 0 && !self.prepared.operator_of_definite)
        throw InputError("velocities follow from reactions alone only where H is definite");
    if (static_cast<Eigen::Index>(lambda_values.size()) != self.view.m)
        throw InputError(
            fmt::format("{} reactions do not fit a problem with m = {}", lambda_values.size(), self.view.m));
    x.resize(static_cast<std::size_t>(self.view.n));
    if (x.empty()) return;
    self.prepared.operator_of_definite->velocity(self.view, VectorView(lambda_values.data(), self.view.m),
                                                 self.momentum);
    std::copy(self.momentum.begin(), self.momentum.end(), x.begin());
}

}  // namespace delassus
