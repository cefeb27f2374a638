// SPDX-License-Identifier: BSD-3-Clause
#include "condensed_system.hpp"

#include <Eigen/LU>
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

void CondensedSystem::analyze(const PartSystem& system, const sdk::LocalProblemView& problem) {
    system_ = &system;
    groups_ = coupled_rows(problem);
    kind_ = wanted_ == "hypre"                                               ? LinearSolver::Hypre
            : wanted_ == "bjacobi"                                           ? LinearSolver::BlockJacobi
            : wanted_ == "schwarz"                                           ? LinearSolver::Schwarz
            : wanted_ == "mumps"                                             ? LinearSolver::Mumps
            : problem.raw->n_all > most_factored * system.processes().size() ? LinearSolver::Schwarz
                                                                             : LinearSolver::Mumps;
    krylov_.reset();
    matrix_.reset();
    ++analyses_;
}

void CondensedSystem::load(const PartSystem& system, const sdk::LocalProblemView& problem, const sdk::Vector& scale) {
    system_ = &system;
    scale_ = scale;
    delta_ = regularization_;
    R_.setOnes(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        const auto row = static_cast<std::size_t>(i);
        for (auto e = static_cast<std::size_t>(problem.H.row_start[row]);
             e < static_cast<std::size_t>(problem.H.row_start[row + 1]); ++e)
            if (problem.H.column[e] == problem.first_column() + i && problem.H.value[e] > 0.0)
                R_[i] = 1.0 / std::sqrt(problem.H.value[e]);
    }
}

sdk::Vector CondensedSystem::apply_E(const sdk::Vector& z) const {
    if (system_->E().nonZeros() == 0) return sdk::Vector::Zero(z.size());
    return scale_.cwiseProduct(system_->E() * scale_.cwiseProduct(z));
}

void CondensedSystem::find_T(const Complementarity& cones, const sdk::Vector& theta) {
    t_.assign(3 * groups_.size(), Triple{});
    std::int32_t first = 0;
    for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
        const int rows = groups_[g];
        Eigen::Matrix3d E = Eigen::Matrix3d::Zero();
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < rows; ++j)
                E(i, j) = scale_[first + i] * system_->E().coeff(first + i, first + j) * scale_[first + j];
        if (E.isZero(0.0)) {
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
            E = U.transpose() * E * U;
        }
        for (int i = 0; i < rows; ++i) E(i, i) += theta[first + i] + delta_;
        const Eigen::Matrix3d inverse = [&] {
            Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
            // The rows' sizes differ by up to 80 decades where one is held: scaled, the inverse exists.
            Eigen::VectorXd root = E.diagonal().head(rows).cwiseSqrt().cwiseInverse();
            const Eigen::MatrixXd scaled = root.asDiagonal() * E.topLeftCorner(rows, rows) * root.asDiagonal();
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

void CondensedSystem::factorize(const sdk::LocalProblemView& problem, const Complementarity& cones,
                                const sdk::Vector& theta) {
    const auto span = system_->processes().meter()->span(DELASSUS_PHASE_LINEAR_SYSTEMS);
    theta_ = theta;
    if (problem.raw->n_all == 0) return;
    if (!matrix_.get()) system_->make_matrix(problem, groups_, matrix_);
    std::vector<std::int32_t> local;
    Eigen::MatrixXd values, weighted, block;
    while (true) {
        ++factorizations_;
        find_T(cones, theta);
        check(MatZeroEntries(matrix_.get()));
        PartSystem::fill_H(problem, matrix_.get());
        std::int32_t first = 0;
        for (std::size_t g = 0; g < groups_.size(); first += groups_[g++]) {
            const int rows = groups_[g];
            system_->dense_rows(first, rows, local, values);
            if (local.empty()) continue;
            for (int i = 0; i < rows; ++i) values.row(i) *= scale_[first + i];
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
            system_->add(local, block, matrix_.get());
        }
        PartSystem::assemble(matrix_.get());
        system_->scale(matrix_.get(), R_);
        if (!krylov_.get()) make_linear_solver(system_->processes(), matrix_.get(), kind_, krylov_, schwarz_);
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
    dx = f + system_->apply_transpose(scale_.cwiseProduct(dz));
    if (krylov_.get()) {
        check(KSPSetTolerances(krylov_.get(), most_gained, enough, 1e10, static_cast<PetscInt>(most_inner_)));
        dx.array() *= R_.array();
        system_->solve(krylov_.get(), dx);
        dx.array() *= R_.array();
        PetscInt count = 0;
        check(KSPGetIterationNumber(krylov_.get(), &count));
        inner_iterations_ += count;
    }
    dz = scale_.cwiseProduct(system_->apply_D(dx));
    cones.rows_to_basis(dz);
    dz = g - dz;
    apply_T(dz);
    for (Eigen::Index i = 0; i < dz.size(); ++i)
        if (cones.is_held(i)) dz[i] = 0.0;
}

double CondensedSystem::solve(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough,
                              Start start, sdk::Vector& dx, sdk::Vector& dz) {
    const auto norm = [this](const sdk::Vector& x, const sdk::Vector& z) {
        double square = z.size() > 0 ? z.cwiseQuotient((theta_.array() + 1.0).matrix().cwiseSqrt()).squaredNorm() : 0.0;
        square += x.cwiseProduct(R_).squaredNorm();
        return std::sqrt(system_->processes().sum(square));
    };
    const double size = norm(f, g);
    if (start == Start::Zero || !(size > 0.0)) {
        dx.setZero(f.size());
        dz.setZero(g.size());
    }
    if (!(size > 0.0)) return 0.0;
    f_rest_ = f;
    g_rest_ = g;
    double rest = size;
    if (start == Start::Given) {
        find_rest(cones, f, g, dx, dz);
        rest = norm(f_rest_, g_rest_);
        if (rest <= enough * size) return rest / size;
        if (!(rest < size)) return solve(cones, f, g, enough, Start::Zero, dx, dz);
    }
    // By rounding, the residual that conjugate gradients carry along is not the system's own: they start again.
    const bool direct = kind_ == LinearSolver::Mumps;
    const int refinements = direct ? refinements_ : 4 * refinements_;
    for (int refinement = 0;; ++refinement) {
        solve_once(cones, f_rest_, g_rest_, 0.3 * enough * size, correction_x_, correction_z_);
        dx += correction_x_;
        dz += correction_z_;
        find_rest(cones, f, g, dx, dz);
        const double next = norm(f_rest_, g_rest_);
        if (!(next < rest)) {
            if (refinement > 0 || start == Start::Given) {
                dx -= correction_x_;
                dz -= correction_z_;
                return rest / size;
            }
            return next / size;
        }
        const bool slow = next > 0.5 * rest;
        rest = next;
        if (rest <= enough * size || slow || refinement >= refinements) return rest / size;
    }
}

void CondensedSystem::find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g,
                                const sdk::Vector& dx, const sdk::Vector& dz) {
    sdk::Vector z = dz;
    cones.reactions_from_basis(z);
    f_rest_ = f - system_->apply_H(dx) + system_->apply_transpose(scale_.cwiseProduct(z));
    sdk::Vector product = scale_.cwiseProduct(system_->apply_D(dx)) + apply_E(z);
    cones.rows_to_basis(product);
    g_rest_ = g - product - theta_.cwiseProduct(dz);
    for (Eigen::Index i = 0; i < g.size(); ++i)
        if (cones.is_held(i)) g_rest_[i] = 0.0;
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
