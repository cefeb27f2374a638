// SPDX-License-Identifier: BSD-3-Clause
#include "condensed_system.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace delassus::petsc {

namespace {

constexpr double largest_regularization = 1e-4;
// Columns a process. A pile of ten layers of spheres has 1000 entries of the factor a column at 100 000 columns, and
// 300 more with each threefold number: 6 GB at this limit.
constexpr std::int64_t most_factored = 500000;
constexpr double most_gained = 1e-10;  // factor by which conjugate gradients lower their residual at a time

}  // namespace

double CondensedSystem::corrector_residual(double tau, double degree, double equations) {
    constexpr double loosest = 1e-3;
    const double root = std::sqrt(degree), size = root * std::sqrt(tau);
    const double forcing = 0.1 * std::min(root * tau, std::sqrt(tau) * std::max(equations, root * tau));
    return std::clamp(forcing / std::max(size, equations), tightest_residual, loosest);
}

void CondensedSystem::analyze(const sdk::LocalProblemView& problem) {
    PartSystem::analyze(Processes(*problem.raw), problem);
    groups_ = coupled_rows(problem);
    const std::string& wanted = settings_.preconditioner;
    kind_ = wanted == "hypre"                                         ? LinearSolver::Hypre
            : wanted == "bjacobi"                                     ? LinearSolver::BlockJacobi
            : wanted == "schwarz"                                     ? LinearSolver::Schwarz
            : wanted == "mumps"                                       ? LinearSolver::Mumps
            : problem.raw->n_all > most_factored * processes().size() ? LinearSolver::Schwarz
                                                                      : LinearSolver::Mumps;
    krylov_.reset();
    matrix_.reset();
    ++analyses_;
}

void CondensedSystem::load(const sdk::LocalProblemView& problem, PartCones& cones) {
    problem_ = &problem;
    PartSystem::load(problem);
    delta_ = settings_.regularization;
    R_.setOnes(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        const auto row = static_cast<std::size_t>(i);
        for (auto e = static_cast<std::size_t>(problem.H.row_start[row]);
             e < static_cast<std::size_t>(problem.H.row_start[row + 1]); ++e)
            if (problem.H.column[e] == problem.first_column() + i && problem.H.value[e] > 0.0)
                R_[i] = 1.0 / std::sqrt(problem.H.value[e]);
    }
    double rho = reference();
    if (problem.raw->m_all == 0)
        if (const double size = norm(R_.cwiseProduct(problem.a)); size > 0.0) rho = size;
    std::array<double, 2> sums = {diagonal().sum(), static_cast<double>((diagonal().array() > 0.0).count())};
    processes().sum(sums);
    p_ = ipm::row_scale(problem.cones, diagonal(), sums[1] > 0.0 ? sums[0] / sums[1] : 1.0);
    x_scale_ = rho * R_;
    z_scale_ = rho * p_;
    a_ = R_.cwiseProduct(problem.a) / rho;
    b_ = p_.cwiseProduct(problem.b) / rho;
    cones.load(PartSystem::rows(), z_scale_, processes());
}

sdk::Vector CondensedSystem::times_E(const sdk::Vector& z) const {
    if (E().nonZeros() == 0) return sdk::Vector::Zero(z.size());
    return p_.cwiseProduct(E() * p_.cwiseProduct(z));
}

void CondensedSystem::find_T(const Complementarity& cones, const sdk::Vector& theta) {
    t_.assign(3 * groups_.size(), Triple{});
    std::int32_t first = 0;
    for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
        const int rows = groups_[g];
        Eigen::Matrix3d block = Eigen::Matrix3d::Zero();  // Ê, then Uᵀ Ê U + θ + δ
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < rows; ++j)
                block(i, j) = p_[first + i] * E().coeff(first + i, first + j) * p_[first + j];
        if (block.isZero(0.0)) {
            for (int i = 0; i < rows; ++i)
                t_[3 * g + static_cast<std::size_t>(i)][static_cast<std::size_t>(i)] =
                    1.0 / (theta[first + i] + delta_);
            continue;
        }
        if (const ipm::Basis* basis = cones.row_basis(g)) {
            Eigen::Matrix3d U;
            for (int k = 0; k < 3; ++k)
                for (int i = 0; i < 3; ++i)
                    U(i, k) = (*basis)[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
            block = U.transpose() * block * U;
        }
        for (int i = 0; i < rows; ++i) block(i, i) += theta[first + i] + delta_;
        const Eigen::Matrix3d inverse = [&] {
            Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
            // The rows' sizes differ by up to 80 decades where one is held: scaled, the inverse exists.
            Eigen::VectorXd root = block.diagonal().head(rows).cwiseSqrt().cwiseInverse();
            const Eigen::MatrixXd scaled = root.asDiagonal() * block.topLeftCorner(rows, rows) * root.asDiagonal();
            result.topLeftCorner(rows, rows) = root.asDiagonal() * scaled.inverse() * root.asDiagonal();
            return result;
        }();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                t_[3 * g + static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = inverse(i, j);
    }
}

void CondensedSystem::apply_T(sdk::Vector& v) const {
    std::int32_t first = 0;
    for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
        const auto rows = static_cast<std::size_t>(groups_[g]);
        Triple result{};
        for (std::size_t i = 0; i < rows; ++i)
            for (std::size_t j = 0; j < rows; ++j) result[i] += t_[3 * g + i][j] * v[first + static_cast<int>(j)];
        for (std::size_t i = 0; i < rows; ++i) v[first + static_cast<int>(i)] = result[i];
    }
}

void CondensedSystem::factorize(const Complementarity& cones, const sdk::Vector& theta) {
    const auto span = processes().meter()->span(DELASSUS_PHASE_LINEAR_SYSTEMS);
    theta_ = theta;
    if (problem_->raw->n_all == 0) return;
    if (!matrix_.get()) make_matrix(*problem_, groups_, matrix_);
    std::vector<std::int32_t> local;
    Eigen::MatrixXd values, weighted, block;
    while (true) {
        ++factorizations_;
        find_T(cones, theta);
        check(MatZeroEntries(matrix_.get()));
        fill_H(*problem_, matrix_.get());
        std::int32_t first = 0;
        for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
            const int rows = groups_[g];
            dense_rows(first, rows, local, values);
            if (local.empty()) continue;
            for (int i = 0; i < rows; ++i) values.row(i) *= p_[first + i];
            if (const ipm::Basis* basis = cones.row_basis(g)) {
                Eigen::MatrixXd U(rows, rows);
                for (int k = 0; k < rows; ++k)
                    for (int i = 0; i < rows; ++i)
                        U(i, k) = (*basis)[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
                weighted.noalias() = U.transpose() * values;
                values.swap(weighted);
            }
            weighted.setZero(rows, values.cols());
            for (int i = 0; i < rows; ++i)
                for (int j = 0; j < rows; ++j)
                    weighted.row(i) +=
                        t_[3 * g + static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] * values.row(j);
            block.noalias() = values.transpose() * weighted;
            add(local, block, matrix_.get());
        }
        assemble(matrix_.get());
        scale(matrix_.get(), R_);
        if (!krylov_.get()) make_linear_solver(processes(), matrix_.get(), kind_, krylov_, settings_.schwarz);
        if (set_up(krylov_.get())) return;
        delta_ *= 10.0;
        if (!(delta_ <= largest_regularization))
            throw sdk::NumericalFailure(
                "the factorisation broke down for every regularisation up to 1e-4: E is not positive semidefinite, or "
                "H is not definite");
    }
}

void CondensedSystem::solve_once(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g,
                                 double enough, sdk::Vector& dx, sdk::Vector& dz) {
    dz = g;
    apply_T(dz);
    cones.reactions_from_basis(dz);
    dx = f + times_transposed_D(dz);
    if (krylov_.get()) {
        check(KSPSetTolerances(krylov_.get(), most_gained, enough, 1e10, static_cast<PetscInt>(settings_.most_inner)));
        PartSystem::solve(krylov_.get(), dx);
        PetscInt count = 0;
        check(KSPGetIterationNumber(krylov_.get(), &count));
        inner_iterations_ += count;
    }
    dz = times_D(dx);
    cones.rows_to_basis(dz);
    dz = g - dz;
    apply_T(dz);
    for (Eigen::Index i = 0; i < dz.size(); ++i)
        if (cones.is_held(i)) dz[i] = 0.0;
}

void CondensedSystem::find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g,
                                const sdk::Vector& dx, const sdk::Vector& dz, sdk::Vector& f_rest,
                                sdk::Vector& g_rest) const {
    sdk::Vector z = dz;
    cones.reactions_from_basis(z);
    f_rest = f - times_H(dx) + times_transposed_D(z);
    sdk::Vector product = times_D(dx) + times_E(z);
    cones.rows_to_basis(product);
    g_rest = g - product - theta_.cwiseProduct(dz);
    for (Eigen::Index i = 0; i < g.size(); ++i)
        if (cones.is_held(i)) g_rest[i] = 0.0;
}

double CondensedSystem::weighted_norm(const sdk::Vector& f, const sdk::Vector& g) const {
    const double square = g.cwiseQuotient((theta_.array() + 1.0).matrix().cwiseSqrt()).squaredNorm();
    return std::sqrt(processes().sum(f.squaredNorm() + square));
}

std::string CondensedSystem::description() const {
    char text[96];
    if (kind_ == LinearSolver::Mumps) {
        std::snprintf(text, sizeof text, "Cholesky factors by MUMPS, regularisation %.0e", delta_);
    } else {
        std::snprintf(text, sizeof text, "%lld iterations of CG with %s, regularisation %.0e",
                      static_cast<long long>(inner_iterations_),
                      kind_ == LinearSolver::Hypre     ? "BoomerAMG"
                      : kind_ == LinearSolver::Schwarz ? "overlapping Schwarz"
                                                       : "incomplete Cholesky on each process",
                      delta_);
    }
    return text;
}

}  // namespace delassus::petsc
