// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/errors.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/saddle_point.hpp"
#include "delassus/sdk/sparse_lu.hpp"
#include "problem/cone_sums.hpp"
#include "problem/dense_rows.hpp"
#include "problem/prepared_problem.hpp"

namespace delassus {

using sdk::Vector;
using sdk::VectorView;

static_assert(sizeof(Errors) == error_measures.size() * sizeof(double), "every measure has a row");

namespace {

/// The diagonal of N and r = D H⁻¹ a + b.
struct Reference {
    Vector diagonal;
    Vector r;
};

void add_compliance(const sdk::ProblemView& problem, Vector& diagonal) {
    for (Eigen::Index i = 0; i < problem.m; ++i) diagonal[i] += problem.E.coeff(i, i);
}

/// |diag H|⁻¹ in place of an H⁻¹ that does not exist.
Reference of_singular(const sdk::ProblemView& problem) {
    const Vector h = sdk::magnitude_of_diagonal(problem);
    return {sdk::stand_in_diagonal(problem, h), problem.D * problem.a.cwiseQuotient(h) + problem.b};
}

Reference of_unsymmetric(const sdk::ProblemView& problem) {
    sdk::SparseLu factor;
    if (!factor.factorize(problem.H)) return of_singular(problem);
    Reference reference;
    reference.diagonal.setZero(problem.m);
    Vector row(problem.n);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        row = problem.D.row(i).transpose();
        reference.diagonal[i] = row.dot(factor.solve(row));
    }
    add_compliance(problem, reference.diagonal);
    reference.r = problem.D * factor.solve(problem.a) + problem.b;
    return reference;
}

/// A reference below this share of the velocities without reactions counts as rest.
constexpr double vanishing_velocity = 1e-8;

}  // namespace

struct ErrorMeter::Implementation {
    explicit Implementation(const PreparedProblem::Implementation& prepared_problem)
        : prepared(prepared_problem), view(prepared.raw) {
        take_mobility();
    }

    /// Returns whether r and the diagonal of N, which is not negative, are finite, judged by their sums.
    bool take_mobility() {
        const Vector* diagonal = &reference.diagonal;
        if (prepared.mobility) {
            diagonal =
                &prepared.mobility->free_velocity(view, prepared.shares_columns, prepared.useful_team(), reference.r);
        } else {
            reference = prepared.structure == Structure::Unsymmetric ? of_unsymmetric(view) : of_singular(view);
        }
        r_norm = reference.r.norm();
        residual.assign(view, *diagonal, reference.r);
        return std::isfinite(r_norm) && std::isfinite(diagonal->sum());
    }

    /// u = D x + E λ + b, in the scratch vector.
    const Vector& constraint_velocity(const VectorView& x, const VectorView& lambda) const {
        plain_u = view.b;
        if (view.n > 0) plain_u.noalias() += view.D * x;
        if (view.E.nonZeros() > 0) plain_u.noalias() += view.E * lambda;
        return plain_u;
    }

    /// What a pass over rows computes.
    enum class Pass { Both, Velocities, Impulse };

    /// Multiplies the rows of one cone, which share their columns, by x, and adds their part of Dᵀλ to the impulse.
    template <Pass pass>
    struct RowsAtSolution {
        const double *x, *lambda;  // λ: of the cone's rows
        double *u, *magnitude;     // of the cone's rows
        Vector& impulse;
        template <int length>
        void operator()(const DenseRows<length>& rows) const {
            using Array = typename DenseRows<length>::Array;
            Array x_of_columns, pushed = Array::Zero();
            if constexpr (pass != Pass::Impulse) x_of_columns = rows.gather(x);
            for (std::int32_t i = 0; i < rows.count; ++i) {
                const auto row = rows.row(i);
                if constexpr (pass != Pass::Impulse) {
                    const Array terms = row * x_of_columns;
                    u[i] += terms.sum();
                    magnitude[i] += terms.abs().sum();
                }
                if constexpr (pass != Pass::Velocities) pushed += lambda[i] * row;
            }
            if constexpr (pass != Pass::Velocities)
                for (int k = 0; k < length; ++k) impulse[rows.column[k]] += pushed[k];
        }
    };

    /// u and the sum of the magnitudes of its terms for the rows of a cone, and its part of impulse = Dᵀ λ.
    template <Pass pass>
    void pass_over_rows(std::size_t c, const double* x, const double* lambda, double* u, double* magnitude) const {
        const delassus_matrix &D = view.raw->D, &E = view.raw->E;
        const auto& cone = prepared.cones[c];
        const auto first = cone.first_row;
        for (std::int32_t i = 0; i < cone.rows && pass != Pass::Impulse; ++i) {
            u[i] = view.b[first + i];
            magnitude[i] = std::abs(u[i]);
        }
        const bool done = prepared.shares_columns[c] && E.entries == 0 &&
                          for_dense_rows(D, cone, RowsAtSolution<pass>{x, lambda + first, u, magnitude, impulse});
        if (done) return;
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const auto row = first + i;
            const auto add = [&](double term) {
                u[i] += term;
                magnitude[i] += std::abs(term);
            };
            for (auto k = D.row_start[row]; k < D.row_start[row + 1]; ++k) {
                if constexpr (pass != Pass::Impulse) add(D.value[k] * x[D.column[k]]);
                if constexpr (pass != Pass::Velocities) impulse[D.column[k]] += D.value[k] * lambda[row];
            }
            for (auto k = E.row_start[row]; k < E.row_start[row + 1] && pass != Pass::Impulse; ++k)
                add(E.value[k] * lambda[E.column[k]]);
        }
    }

    /// One pass over D and E, cone by cone, which leaves the impulse Dᵀ λ as well. On the rounding: a product of k
    /// terms is off by at most k ε times the product of the absolute values (Higham, Accuracy and Stability of
    /// Numerical Algorithms, eq. 3.5); the errors of single terms add up as √k, and ε counts for one.
    /// The sums are those of parts of the cones, added up in their order: the same bits for any number of threads.
    [[nodiscard]] ConeSums sums_over_cones(const double* x, const double* lambda) const {
        constexpr std::size_t part = 512;
        const std::size_t cones = prepared.cones.size(), parts = (cones + part - 1) / part;
        const sdk::Team team = prepared.useful_team();
        impulse.setZero(view.n);
        const std::size_t scratch = 3 * static_cast<std::size_t>(largest_cone());
        work.resize(scratch * static_cast<std::size_t>(team.size()));
        part_sums.assign(parts, {});
        const auto range = [&](std::size_t k) { return std::pair(k * part, std::min(cones, (k + 1) * part)); };
        if (team.size() == 1) {
            for (std::size_t k = 0; k < parts; ++k)
                add_cones<Pass::Both>(range(k), x, lambda, work.data(), part_sums[k]);
        } else {
            // The impulse is the sum of its terms in the order of the cones: one member makes it while others begin.
            std::atomic<std::size_t> next = 0;
            team.run([&](int member) {
                double* memory = work.data() + scratch * static_cast<std::size_t>(member);
                for (std::size_t task; (task = next.fetch_add(1)) <= parts;) {
                    if (task == 0) {
                        for (std::size_t c = 0; c < cones; ++c) pass_over_rows<Pass::Impulse>(c, x, lambda, {}, {});
                    } else {
                        add_cones<Pass::Velocities>(range(task - 1), x, lambda, memory, part_sums[task - 1]);
                    }
                }
            });
        }
        ConeSums sums;
        for (const ConeSums& one : part_sums) sums += one;
        return sums;
    }

    /// Adds the parts of the cones from first to second − 1. memory: three times the rows of the largest cone.
    template <Pass pass>
    void add_cones(std::pair<std::size_t, std::size_t> range, const double* x, const double* lambda, double* memory,
                   ConeSums& total) const {
        ConeSums sums;  // in registers
        for (std::size_t c = range.first; c < range.second; ++c) {
            const auto& cone = prepared.cones[c];
            const double* lambda_c = lambda + cone.first_row;
            double *u = memory, *magnitude = u + cone.rows, *trial = magnitude + cone.rows;
            prefetch_after(view.raw->D, cone.first_row);
            pass_over_rows<pass>(c, x, lambda, u, magnitude);
            add_block(cone, residual.scaling()[c], view.coulomb, lambda_c, u, magnitude, trial, sums);
        }
        total = sums;
    }

    [[nodiscard]] std::int32_t largest_cone() const {
        std::int32_t rows = 0;
        for (const auto& cone : view.cones) rows = std::max(rows, cone.rows);
        return rows;
    }

    const PreparedProblem::Implementation& prepared;
    sdk::ProblemView view;
    Reference reference;
    sdk::NaturalResidual residual;
    double r_norm = 0.0;
    mutable std::int64_t measurements = 0;
    // Kept so that measuring again allocates nothing.
    mutable Vector plain_u, momentum, impulse;
    mutable std::vector<double> work;
    mutable std::vector<ConeSums> part_sums;
};

ErrorMeter::ErrorMeter(const PreparedProblem& problem)
    : implementation_(std::make_unique<Implementation>(*problem.implementation_)) {}
ErrorMeter::~ErrorMeter() = default;

bool ErrorMeter::renew() {
    auto& self = *implementation_;
    std::construct_at(&self.view, self.prepared.raw);  // maps cannot be assigned
    return self.take_mobility();
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
    ++self.measurements;
    const ConeSums sums = self.sums_over_cones(x.data(), lambda.data());
    double balance = 0.0;
    if (problem.n > 0) {
        Vector& momentum = self.momentum;
        momentum.noalias() = problem.H * x;
        balance = ratio((momentum - self.impulse - problem.a).norm(),
                        std::max({momentum.norm(), self.impulse.norm(), problem.a.norm()}));
    }
    return errors_of(sums, self.residual.reference(), self.r_norm, lambda.norm(), balance);
}

double ErrorMeter::reference() const {
    return implementation_->residual.reference();
}

double ErrorMeter::norm_in_rows(std::span<const double> v) const {
    const auto& self = *implementation_;
    const auto& problem = self.view;
    if (static_cast<Eigen::Index>(v.size()) != problem.n)
        throw InputError(fmt::format("{} velocities do not fit a problem with n = {}", v.size(), problem.n));
    if (problem.n == 0) return 0.0;
    self.plain_u.noalias() = problem.D * VectorView(v.data(), problem.n);
    double sum = 0.0;
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const double s = self.residual.scaling()[c];
        sum += s * s * self.plain_u.segment(problem.cones[c].first_row, problem.cones[c].rows).squaredNorm();
    }
    return std::sqrt(sum);
}

std::int64_t ErrorMeter::measurements() const {
    return implementation_->measurements;
}

double ErrorMeter::natural(const double* x, const double* lambda_values) const {
    const auto& self = *implementation_;
    const auto& problem = self.view;
    const VectorView lambda(lambda_values, problem.m);
    if (x || problem.n == 0)
        return self.residual.natural(lambda, self.constraint_velocity(VectorView(x, problem.n), lambda));
    if (!self.prepared.mobility) return std::numeric_limits<double>::quiet_NaN();
    self.prepared.mobility->velocity(problem, lambda.data(), self.momentum);
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
    if (const auto& mobility = implementation_->prepared.mobility) {
        Vector& x = implementation_->momentum;
        mobility->velocity(problem, nullptr, x);
        const double free = std::sqrt(std::abs(problem.a.dot(x)));
        if (scale <= vanishing_velocity * free) scale = free;
    }
    return ratio(energy_norm(difference), scale);
}

void ErrorMeter::velocity_of(std::span<const double> lambda_values, std::vector<double>& x) const {
    const auto& self = *implementation_;
    if (self.view.n > 0 && !self.prepared.mobility)
        throw InputError("velocities follow from reactions alone only where H is definite");
    if (!lambda_values.empty() && static_cast<Eigen::Index>(lambda_values.size()) != self.view.m)
        throw InputError(
            fmt::format("{} reactions do not fit a problem with m = {}", lambda_values.size(), self.view.m));
    x.resize(static_cast<std::size_t>(self.view.n));
    if (x.empty()) return;
    self.prepared.mobility->velocity(self.view, lambda_values.empty() ? nullptr : lambda_values.data(), self.momentum);
    std::copy(self.momentum.begin(), self.momentum.end(), x.begin());
}

}  // namespace delassus
