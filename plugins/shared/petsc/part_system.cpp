// SPDX-License-Identifier: BSD-3-Clause
#include "part_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "delassus/sdk/residual.hpp"

namespace delassus::petsc {

namespace {

std::size_t place(std::int64_t i) {
    return static_cast<std::size_t>(i);
}

constexpr int panel = 16;  // right-hand sides at a time

}  // namespace

void PartSystem::analyze(const Processes& processes, const sdk::LocalProblemView& problem) {
    if (problem.raw->n_all >= std::numeric_limits<PetscInt>::max())
        throw std::runtime_error("the problem has more unknowns than this PETSc can count (2^31)");
    bodies_.analyze(processes, problem);
    coupled_ = !problem.needs_any(DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS);
    inverse_.reset();
    number_.resize(place(columns().size()));
    for (Eigen::Index i = 0; i < columns().size(); ++i) number_[place(i)] = static_cast<PetscInt>(columns().number(i));
    std::vector<std::int32_t> cone_of(place(problem.m));
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c)
        for (std::int32_t i = 0; i < problem.cone(c).rows; ++i)
            cone_of[place(problem.cone(c).first_row + i)] = static_cast<std::int32_t>(c);
    bool couples = false;
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (auto e = place(problem.E.row_start[place(i)]); e < place(problem.E.row_start[place(i) + 1]); ++e) {
            const auto j = problem.E.column[e] - problem.first_row();
            if (j == i) continue;
            couples = couples || j < 0 || j >= problem.m || cone_of[place(j)] != cone_of[place(i)] ||
                      problem.cone(cone_of[place(i)]).kind != DELASSUS_CONE_FRICTION;
        }
    if (processes.any(couples))
        throw std::runtime_error("E couples rows other than those of one contact, which this solver cannot take");
    // H itself, for products, and for its factor where it couples bodies.
    check(MatCreate(processes.get(), H_.make()));
    check(MatSetType(H_.get(), MATAIJ));
    const auto n = static_cast<PetscInt>(problem.n);
    check(MatSetSizes(H_.get(), n, n, PETSC_DETERMINE, PETSC_DETERMINE));
    std::vector<PetscInt> here(place(n)), there(place(n));
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (auto e = place(problem.H.row_start[place(i)]); e < place(problem.H.row_start[place(i) + 1]); ++e) {
            const auto j = problem.H.column[e] - problem.first_column();
            ++(j >= 0 && j < problem.n ? here : there)[place(i)];
        }
    check(MatSeqAIJSetPreallocation(H_.get(), 0, here.data()));
    check(MatMPIAIJSetPreallocation(H_.get(), 0, here.data(), 0, there.data()));
    check(MatSetOption(H_.get(), MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
    check(MatCreateVecs(H_.get(), solution_.make(), right_.make()));
}

void PartSystem::fill_H(const sdk::LocalProblemView& problem, Mat matrix) {
    std::vector<PetscInt> column;
    std::vector<double> value;
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        const auto begin = place(problem.H.row_start[place(i)]), end = place(problem.H.row_start[place(i) + 1]);
        column.assign(problem.H.column.begin() + static_cast<std::ptrdiff_t>(begin),
                      problem.H.column.begin() + static_cast<std::ptrdiff_t>(end));
        value.assign(problem.H.value.begin() + static_cast<std::ptrdiff_t>(begin),
                     problem.H.value.begin() + static_cast<std::ptrdiff_t>(end));
        const auto row = static_cast<PetscInt>(problem.first_column() + i);
        check(MatSetValues(matrix, 1, &row, static_cast<PetscInt>(column.size()), column.data(), value.data(),
                           ADD_VALUES));
    }
}

void PartSystem::factorize(const sdk::LocalProblemView& problem) {
    bodies_.factorize(problem);
    LocalRows local;
    processes().together([&] {
        D_ = local.view(problem.D, columns(), 0, problem.m);
        std::vector<Eigen::Triplet<double, std::int32_t>> entries;
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (auto e = place(problem.E.row_start[place(i)]); e < place(problem.E.row_start[place(i) + 1]); ++e)
                entries.emplace_back(static_cast<std::int32_t>(i),
                                     static_cast<std::int32_t>(problem.E.column[e] - problem.first_row()),
                                     problem.E.value[e]);
        E_.resize(problem.m, problem.m);
        E_.setFromTriplets(entries.begin(), entries.end());
    });
    check(MatZeroEntries(H_.get()));
    fill_H(problem, H_.get());
    assemble(H_.get());
    diagonal_.setZero(problem.m);
    if (coupled_) {
        factor_coupled(problem);
        find_coupled_diagonal();
    } else if (columns().size() > 0) {
        sdk::CompressedRows W;
        bodies_.inverse().half_solve_rows(sdk::SparseRowsView(D_.rows(), D_.cols(), D_.nonZeros(), D_.outerIndexPtr(),
                                                              D_.innerIndexPtr(), D_.valuePtr()),
                                          W);
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (auto e = place(W.start[place(i)]); e < place(W.start[place(i) + 1]); ++e)
                diagonal_[i] += W.value[e] * W.value[e];
    }
    for (Eigen::Index i = 0; i < problem.m; ++i) diagonal_[i] += E_.coeff(i, i);
    fill_immobile(processes(), problem.cones, diagonal_);
    cone_scaling_ = sdk::block_scaling(problem.cones, diagonal_);
}

void PartSystem::factor_coupled(const sdk::LocalProblemView& problem) {
    if (problem.raw->n_all == 0) return;
    if (!inverse_.get()) make_linear_solver(processes(), H_.get(), LinearSolver::Mumps, inverse_);
    if (!set_up(inverse_.get()))
        throw sdk::NumericalFailure("the Cholesky factorisation of H failed: H is not positive definite");
}

// Each row of D goes through H⁻¹. Processes take turns; a panel is carried to the owners of its columns and back.
void PartSystem::find_coupled_diagonal() {
    const auto local = columns().size();
    std::vector<double> rows(place(local) * panel), solved(rows.size());
    Mat right = nullptr, solution = nullptr, factor = nullptr;
    PC preconditioner = nullptr;
    check(KSPGetPC(inverse_.get(), &preconditioner));
    check(PCFactorGetMatrix(preconditioner, &factor));
    const auto n = static_cast<PetscInt>(columns().own());
    check(MatCreateDense(processes().get(), n, PETSC_DECIDE, PETSC_DETERMINE, panel, nullptr, &right));
    check(MatDuplicate(right, MAT_DO_NOT_COPY_VALUES, &solution));
    const auto most = processes().max(static_cast<std::int64_t>(D_.rows()));
    for (int turn = 0; turn < processes().size(); ++turn)
        for (std::int64_t first = 0;; first += panel) {
            const bool mine = turn == processes().rank() && first < D_.rows();
            if (first >= most || !processes().any(mine)) break;
            const std::int64_t count = mine ? std::min<std::int64_t>(panel, D_.rows() - first) : 0;
            std::fill(rows.begin(), rows.end(), 0.0);
            for (std::int64_t k = 0; k < count; ++k)
                for (sdk::SparseRows::InnerIterator e(D_, first + k); e; ++e)
                    rows[place(e.col()) * panel + place(k)] = e.value();
            solved = rows;
            columns().collect(solved.data(), panel);
            double* values = nullptr;
            PetscInt stride = 0;
            check(MatDenseGetLDA(right, &stride));
            check(MatDenseGetArrayWrite(right, &values));
            for (PetscInt i = 0; i < n; ++i)
                for (int k = 0; k < panel; ++k)
                    values[k * stride + i] = solved[place(columns().first_own() + i) * panel + place(k)];
            check(MatDenseRestoreArrayWrite(right, &values));
            check(MatAssemblyBegin(right, MAT_FINAL_ASSEMBLY));
            check(MatAssemblyEnd(right, MAT_FINAL_ASSEMBLY));
            check(MatMatSolve(factor, right, solution));
            const double* result = nullptr;
            check(MatDenseGetLDA(solution, &stride));
            check(MatDenseGetArrayRead(solution, &result));
            for (PetscInt i = 0; i < n; ++i)
                for (int k = 0; k < panel; ++k)
                    solved[place(columns().first_own() + i) * panel + place(k)] = result[k * stride + i];
            check(MatDenseRestoreArrayRead(solution, &result));
            columns().bring(solved.data(), panel);
            for (std::int64_t k = 0; k < count; ++k)
                for (sdk::SparseRows::InnerIterator e(D_, first + k); e; ++e)
                    diagonal_[first + k] += e.value() * solved[place(e.col()) * panel + place(k)];
        }
    MatDestroy(&right);
    MatDestroy(&solution);
}

void PartSystem::load(const sdk::LocalProblemView& problem) {
    coulomb_ = problem.coulomb;
    no_blocks_.assign(1, 0);
    raw_rows_ = {};
    raw_rows_.struct_size = sizeof raw_rows_;
    raw_rows_.law = problem.raw->law;
    raw_rows_.m = static_cast<std::int32_t>(problem.m);
    raw_rows_.b = problem.raw->b;
    raw_rows_.cone_count = static_cast<std::int32_t>(problem.raw->cone_count);
    raw_rows_.cone_stride = problem.raw->cone_stride;
    raw_rows_.cones = problem.raw->cones;
    raw_rows_.h_block_start = no_blocks_.data();
    raw_rows_.needs = problem.needs;
    rows_ = std::make_unique<sdk::ProblemView>(raw_rows_);
    sdk::Vector v = problem.a;
    apply_inverse(v);
    r_ = problem.b + apply_D(v);
    double square = 0.0;
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const double s = cone_scaling_[place(c)];
        square += s * s * r_.segment(problem.cone(c).first_row, problem.cone(c).rows).squaredNorm();
    }
    reference_ = sdk::reference_of(processes().sum(square));
}

void PartSystem::apply_inverse(sdk::Vector& v) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    if (coupled_) {
        if (inverse_.get()) solve(inverse_.get(), v);
        return;
    }
    sdk::Vector all = sdk::Vector::Zero(columns().size());
    all.segment(columns().first_own(), columns().own()) = v;
    bodies_.inverse().apply(all);
    v = all.segment(columns().first_own(), columns().own());
}

sdk::Vector PartSystem::apply_H(const sdk::Vector& v) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    check(VecPlaceArray(right_.get(), v.data()));
    check(MatMult(H_.get(), right_.get(), solution_.get()));
    check(VecResetArray(right_.get()));
    const double* values = nullptr;
    check(VecGetArrayRead(solution_.get(), &values));
    sdk::Vector result = Eigen::Map<const sdk::Vector>(values, v.size());
    check(VecRestoreArrayRead(solution_.get(), &values));
    return result;
}

sdk::Vector PartSystem::apply_D(const sdk::Vector& v) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    sdk::Vector all(columns().size());
    all.segment(columns().first_own(), columns().own()) = v;
    columns().bring(all.data());
    return D_ * all;
}

std::string refusal_of_compliance(const sdk::ProblemView& problem) {
    for (const delassus_cone& cone : problem.cones)
        for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i)
            for (sdk::SparseRowsView::InnerIterator e(problem.E, i); e; ++e)
                if (e.col() != i && (cone.kind != DELASSUS_CONE_FRICTION || e.col() < cone.first_row ||
                                     e.col() >= cone.first_row + cone.rows))
                    return "E couples rows other than those of one contact";
    return {};
}

std::vector<std::int32_t> coupled_rows(const sdk::LocalProblemView& problem) {
    std::vector<std::int32_t> groups;
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const delassus_cone& cone = problem.cone(c);
        if (cone.kind == DELASSUS_CONE_FRICTION) {
            groups.push_back(cone.rows);
        } else {
            groups.insert(groups.end(), place(cone.rows), 1);
        }
    }
    return groups;
}

sdk::Vector PartSystem::apply_transpose(const sdk::Vector& lambda) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    sdk::Vector all = D_.transpose() * lambda;
    columns().collect(all.data());
    return all.segment(columns().first_own(), columns().own());
}

sdk::Vector PartSystem::velocity(const sdk::LocalProblemView& problem, const sdk::Vector& lambda) const {
    sdk::Vector x = problem.a + apply_transpose(lambda);
    apply_inverse(x);
    return x;
}

double PartSystem::natural(const sdk::Vector& lambda, const sdk::Vector& u) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    double sum = 0.0;
    std::vector<double> trial;
    for (std::size_t c = 0; c < cone_scaling_.size(); ++c) {
        const delassus_cone& cone = rows_->cones[c];
        const double square = cone_scaling_[c] * cone_scaling_[c];
        const double* l = lambda.data() + cone.first_row;
        const double* v = u.data() + cone.first_row;
        if (sdk::operations_of(cone).is_linear) {
            for (std::int32_t i = 0; i < cone.rows; ++i) sum += square * v[i] * v[i];
            continue;
        }
        trial.resize(place(cone.rows));
        for (std::int32_t i = 0; i < cone.rows; ++i) trial[place(i)] = l[i] - square * v[i];
        if (coulomb_) trial[0] -= square * sdk::de_saxce(cone, v);
        sdk::project(cone, trial.data());
        for (std::int32_t i = 0; i < cone.rows; ++i)
            sum += (l[i] - trial[place(i)]) * (l[i] - trial[place(i)]) / square;
    }
    return std::sqrt(processes().sum(sum)) / reference_;
}

sdk::Vector PartSystem::velocities(const sdk::LocalProblemView& problem, const sdk::Vector& lambda,
                                   const sdk::Vector& x) const {
    sdk::Vector u = problem.b + apply_D(x);
    if (E_.nonZeros() > 0) u += E_ * lambda;
    return u;
}

double PartSystem::measured(const sdk::LocalProblemView& problem, const sdk::Vector& lambda, sdk::Vector& x) const {
    x = velocity(problem, lambda);
    return natural(lambda, velocities(problem, lambda, x));
}

void PartSystem::dense_rows(std::int32_t first, std::int32_t rows, std::vector<std::int32_t>& local,
                            Eigen::MatrixXd& values) const {
    local.clear();
    for (std::int32_t i = first; i < first + rows; ++i)
        for (sdk::SparseRows::InnerIterator e(D_, i); e; ++e) local.push_back(static_cast<std::int32_t>(e.col()));
    std::sort(local.begin(), local.end());
    local.erase(std::unique(local.begin(), local.end()), local.end());
    values.setZero(rows, static_cast<Eigen::Index>(local.size()));
    for (std::int32_t i = 0; i < rows; ++i) {
        Eigen::Index k = 0;
        for (sdk::SparseRows::InnerIterator e(D_, first + i); e; ++e) {
            while (local[place(k)] != e.col()) ++k;
            values(i, k) = e.value();
        }
    }
}

// MATPREALLOCATOR counts what all processes set, theirs and others', and so the matrix gets its exact pattern.
void PartSystem::make_matrix(const sdk::LocalProblemView& problem, const std::vector<std::int32_t>& group_rows,
                             MatrixHandle& matrix) const {
    const auto n = static_cast<PetscInt>(problem.n);
    MatrixHandle counter;
    check(MatCreate(processes().get(), counter.make()));
    check(MatSetType(counter.get(), MATPREALLOCATOR));
    check(MatSetSizes(counter.get(), n, n, PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatSetUp(counter.get()));
    fill_H(problem, counter.get());
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        const auto row = static_cast<PetscInt>(problem.first_column() + i);
        const double zero = 0.0;
        check(MatSetValues(counter.get(), 1, &row, 1, &row, &zero, ADD_VALUES));
    }
    std::vector<std::int32_t> local;
    Eigen::MatrixXd values;
    std::int32_t first = 0;
    for (const std::int32_t rows : group_rows) {
        dense_rows(first, rows, local, values);
        add(local, Eigen::MatrixXd::Zero(values.cols(), values.cols()), counter.get());
        first += rows;
    }
    assemble(counter.get());
    check(MatCreate(processes().get(), matrix.make()));
    check(MatSetType(matrix.get(), MATAIJ));
    check(MatSetSizes(matrix.get(), n, n, PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatPreallocatorPreallocate(counter.get(), PETSC_TRUE, matrix.get()));
    check(MatSetOption(matrix.get(), MAT_SPD, PETSC_TRUE));
    check(MatSetOption(matrix.get(), MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
}

void PartSystem::add(const std::vector<std::int32_t>& local, const Eigen::MatrixXd& values, Mat matrix) const {
    std::array<PetscInt, 64> small;
    std::vector<PetscInt> large;
    PetscInt* numbers = small.data();
    if (local.size() > small.size()) {
        large.resize(local.size());
        numbers = large.data();
    }
    for (std::size_t k = 0; k < local.size(); ++k) numbers[k] = number_[place(local[k])];
    const auto count = static_cast<PetscInt>(local.size());
    check(MatSetValues(matrix, count, numbers, count, numbers, values.data(), ADD_VALUES));  // symmetric
}

void PartSystem::assemble(Mat matrix) {
    check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
}

void PartSystem::scale(Mat matrix, const sdk::Vector& R) const {
    check(VecPlaceArray(right_.get(), R.data()));
    check(MatDiagonalScale(matrix, right_.get(), right_.get()));
    check(VecResetArray(right_.get()));
}

void PartSystem::solve(KSP krylov, sdk::Vector& v) const {
    const auto span = processes().meter()->span(DELASSUS_PHASE_LINEAR_SYSTEMS);
    check(VecPlaceArray(right_.get(), v.data()));
    check(KSPSolve(krylov, right_.get(), solution_.get()));
    check(VecResetArray(right_.get()));
    const double* values = nullptr;
    check(VecGetArrayRead(solution_.get(), &values));
    v = Eigen::Map<const sdk::Vector>(values, v.size());
    check(VecRestoreArrayRead(solution_.get(), &values));
}

namespace {

// With PC_ASM_BASIC the preconditioner is symmetric, as conjugate gradients need it.
void make_schwarz(PC preconditioner, Mat matrix, Schwarz settings) {
    check(PCSetType(preconditioner, PCASM));
    check(PCASMSetType(preconditioner, PC_ASM_BASIC));
    check(PCASMSetOverlap(preconditioner, settings.overlap));
    PetscInt own = 0;
    check(MatGetLocalSize(matrix, &own, nullptr));
    const auto count =
        static_cast<PetscInt>(std::max<std::int64_t>(1, (own + settings.columns - 1) / settings.columns));
    IS* domains = nullptr;
    check(PCASMCreateSubdomains(matrix, count, &domains));
    check(PCASMSetLocalSubdomains(preconditioner, count, domains, nullptr));
    check(PCASMDestroySubdomains(count, domains, nullptr));
}

}  // namespace

void make_linear_solver(const Processes& processes, Mat matrix, LinearSolver kind, KrylovHandle& krylov,
                        Schwarz schwarz) {
    PetscReal squares = 0.0;  // MUMPS orders by products of entries, and crashes where these are no numbers
    check(MatNorm(matrix, NORM_FROBENIUS, &squares));
    if (!std::isfinite(squares * squares))
        throw sdk::NumericalFailure("the numbers of the matrix to factor are too large for double precision");
    check(KSPCreate(processes.get(), krylov.make()));
    check(KSPSetOperators(krylov.get(), matrix, matrix));
    PC preconditioner = nullptr;
    check(KSPGetPC(krylov.get(), &preconditioner));
    check(KSPSetType(krylov.get(), kind == LinearSolver::Mumps ? KSPPREONLY : KSPCG));
    check(KSPSetNormType(krylov.get(), kind == LinearSolver::Mumps ? KSP_NORM_NONE : KSP_NORM_UNPRECONDITIONED));
    switch (kind) {
        case LinearSolver::Mumps: {
            check(PCSetType(preconditioner, PCCHOLESKY));
            check(PCFactorSetMatSolverType(preconditioner, MATSOLVERMUMPS));
            check(PCFactorSetUpMatSolverType(preconditioner));
            Mat factor = nullptr;
            check(PCFactorGetMatrix(preconditioner, &factor));
            check(MatMumpsSetIcntl(factor, 14, 50));  // per cent of memory beyond the estimate
            check(MatMumpsSetIcntl(factor, 24, 0));   // a zero pivot is an error
            break;
        }
        case LinearSolver::Hypre:
            check(PCSetType(preconditioner, PCHYPRE));
            check(PCHYPRESetType(preconditioner, "boomeramg"));
            break;
        case LinearSolver::BlockJacobi:
            check(PCSetType(preconditioner, PCBJACOBI));
            break;
        case LinearSolver::Schwarz:
            make_schwarz(preconditioner, matrix, schwarz);
            break;
    }
    check(KSPSetUp(krylov.get()));
    if (kind != LinearSolver::BlockJacobi && kind != LinearSolver::Schwarz) return;
    KSP* local = nullptr;
    PetscInt count = 0;
    if (kind == LinearSolver::Schwarz) {
        check(PCASMGetSubKSP(preconditioner, &count, nullptr, &local));
    } else {
        check(PCBJacobiGetSubKSP(preconditioner, &count, nullptr, &local));
    }
    for (PetscInt k = 0; k < count; ++k) {
        PC block = nullptr;
        check(KSPSetType(local[k], KSPPREONLY));
        check(KSPGetPC(local[k], &block));
        Mat domain = nullptr;
        PetscInt size = 0;
        check(KSPGetOperators(local[k], &domain, nullptr));
        check(MatGetSize(domain, &size, nullptr));
        if (size == 0) {  // CHOLMOD takes no empty matrix
            check(PCSetType(block, PCNONE));
        } else if (kind == LinearSolver::Schwarz) {
            check(PCSetType(block, PCCHOLESKY));
            check(PCFactorSetMatSolverType(block, MATSOLVERCHOLMOD));
        } else {
            check(PCSetType(block, PCICC));
            check(PCFactorSetShiftType(block, MAT_SHIFT_POSITIVE_DEFINITE));
        }
    }
}

bool set_up(KSP krylov) {
    Mat matrix = nullptr;
    check(KSPGetOperators(krylov, &matrix, nullptr));
    check(KSPSetOperators(krylov, matrix, matrix));  // its values are new
    check(KSPSetUp(krylov));
    check(KSPSetUpOnBlocks(krylov));
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    PC preconditioner = nullptr;
    PCFailedReason failed = PC_NOERROR;
    check(KSPGetConvergedReason(krylov, &reason));
    check(KSPGetPC(krylov, &preconditioner));
    check(PCGetFailedReason(preconditioner, &failed));
    return failed == PC_NOERROR && reason != KSP_DIVERGED_PC_FAILED;
}

}  // namespace delassus::petsc
