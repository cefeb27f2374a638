// SPDX-License-Identifier: BSD-3-Clause
#include "krylov.hpp"

#include <array>
#include <exception>
#include <stdexcept>

#include "delassus/sdk/saddle_point.hpp"

namespace delassus::petsc {

using sdk::ProblemView;
using sdk::Vector;

Settings::Settings(const sdk::OptionValues& values)
    : method(values.choice("method")),
      preconditioner(values.choice("preconditioner")),
      schur_matrix(values.choice("schur_matrix")),
      restart(static_cast<int>(values.integer("restart"))),
      stall_window(static_cast<int>(values.integer("stall_window"))),
      shift(values.real("shift")),
      inner_tolerance(values.real("inner_tolerance")) {
    const bool definite_needed = method == "minres";
    if (definite_needed && preconditioner != "automatic" && preconditioner != "schur_diagonal" &&
        preconditioner != "none" && preconditioner != "jacobi")
        throw std::invalid_argument(
            "method minres needs a definite preconditioner: schur_diagonal, jacobi or none, not " + preconditioner);
    if (method == "schur_cg" && preconditioner != "automatic" && preconditioner.rfind("schur_", 0) != 0)
        throw std::invalid_argument(
            "method schur_cg works on the Schur complement: preconditioner must be one of schur_*, not " +
            preconditioner);
}

Krylov::Krylov(const Settings& settings, const std::string& petsc_options) : settings_(settings) {
    database_.parse(petsc_options);
    if (!database_.has_user_options()) return;
    // Only PETSc knows what it takes: a tiny problem is solved with the options, before any real one.
    probe(false);
    auto left = database_.unused();
    if (!left.empty() && settings_.preconditioner == "automatic") {
        probe(true);
        left = database_.unused();
    }
    analyses_ = factorizations_ = 0;
    if (left.empty()) return;
    std::string names;
    for (const auto& name : left) names += (names.empty() ? "" : ", ") + name;
    throw std::invalid_argument("petsc_options: PETSc does not know or use " + names +
                                " with this method and preconditioner");
}

// x + λ with 4 and 2 unknowns.
void Krylov::probe(bool unsymmetric) {
    constexpr std::array<std::int32_t, 5> h_start = {0, 1, 2, 3, 4};
    constexpr std::array<std::int32_t, 4> h_column = {0, 1, 2, 3};
    constexpr std::array<double, 4> ones = {1.0, 1.0, 1.0, 1.0};
    constexpr std::array<std::int32_t, 3> d_start = {0, 2, 4}, e_start = {0, 0, 0};
    constexpr std::array<double, 2> b = {1.0, 2.0};
    delassus_problem raw{};
    raw.n = 4;
    raw.m = 2;
    raw.H = {4, 4, 4, h_start.data(), h_column.data(), ones.data()};
    raw.D = {2, 4, 4, d_start.data(), h_column.data(), ones.data()};
    raw.E = {2, 2, 0, e_start.data(), nullptr, nullptr};
    raw.a = ones.data();
    raw.b = b.data();
    raw.h_block_count = 4;
    raw.h_block_start = h_start.data();
    raw.h_block_index = h_column.data();
    raw.needs = DELASSUS_CAN_FREE | (unsymmetric ? DELASSUS_CAN_H_UNSYMMETRIC : DELASSUS_CAN_H_DIAGONAL);
    const ProblemView problem(raw);
    analyze(problem);
    factorize(problem);
    Vector y;
    solve(Vector::Ones(6), y, [](const Vector&) { return false; });
}

bool Krylov::by_schur(const ProblemView& problem) const {
    if (problem.n == 0 || problem.m == 0) return false;
    if (settings_.preconditioner == "automatic")
        return settings_.method == "minres" || settings_.method == "schur_cg" ||
               problem.needs_any(DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE);
    return settings_.preconditioner.rfind("schur_", 0) == 0;
}

bool Krylov::own_schur_matrix() const {
    return settings_.schur_matrix != "selfp";
}

PetscObjectState Krylov::pattern_state() const {
    PetscObjectState sum = 0, state = 0;
    for (Mat matrix :
         {system_.exact(), system_.shifted(), schur_used_ && own_schur_matrix() ? schur_.get() : nullptr}) {
        if (!matrix) continue;
        check(MatGetNonzeroState(matrix, &state));
        sum += state;
    }
    return sum;
}

void Krylov::configure(const ProblemView& problem) {
    const bool symmetric = !problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC);
    const std::string direct = symmetric ? "cholesky" : "lu";
    const std::string& method = settings_.method;
    std::vector<std::pair<std::string, std::string>> own;
    own.emplace_back("ksp_type", method == "schur_cg" ? "fgmres" : method);
    if (method == "gmres" || method == "lgmres") own.emplace_back("ksp_pc_side", "right");
    if (method == "gmres" || method == "lgmres" || method == "fgmres" || method == "schur_cg")
        own.emplace_back("ksp_gmres_restart", std::to_string(settings_.restart));
    const auto factored = [&](const std::string& part, const std::string& kind) {
        own.emplace_back(part + "pc_type", kind);
        own.emplace_back(part + "pc_factor_mat_solver_type", "mumps");
        own.emplace_back(part + "mat_mumps_icntl_14", "100");
    };
    const std::string& preconditioner = settings_.preconditioner;
    if (schur_used_) {
        const std::string kind = preconditioner != "automatic" ? preconditioner.substr(6)
                                 : method == "minres"          ? "diagonal"
                                                               : "full";
        own.emplace_back("pc_type", "fieldsplit");
        own.emplace_back("pc_fieldsplit_type", "schur");
        own.emplace_back("pc_fieldsplit_schur_fact_type", kind == "diagonal" ? "diag" : kind);
        own.emplace_back("pc_fieldsplit_schur_precondition", own_schur_matrix() ? "user" : "selfp");
        own.emplace_back("fieldsplit_x_ksp_type", "preonly");
        if (problem.needs_any(DELASSUS_CAN_H_DIAGONAL)) {
            own.emplace_back("fieldsplit_x_pc_type", "jacobi");
        } else if (problem.needs_any(DELASSUS_CAN_H_BLOCKS) && communicator_.size() == 1) {
            // MUMPS' solve takes quadratic time in the number of separate blocks (10 000 bodies: 5.6 s).
            own.emplace_back("fieldsplit_x_pc_type", "cholesky");
            own.emplace_back("fieldsplit_x_pc_factor_mat_solver_type", "petsc");
        } else {
            factored("fieldsplit_x_", direct);
        }
        own.emplace_back("fieldsplit_lambda_ksp_type", method == "schur_cg" ? "cg" : "preonly");
        if (method == "schur_cg") own.emplace_back("fieldsplit_lambda_ksp_rtol", "1e-6");
        factored("fieldsplit_lambda_", own_schur_matrix() || symmetric ? "cholesky" : "lu");
    } else if (preconditioner == "none" || preconditioner == "jacobi") {
        own.emplace_back("pc_type", preconditioner);
    } else {
        factored("", direct);
    }
    database_.enter(own);

    check(KSPCreate(communicator_.get(), ksp_.make()));
    check(KSPSetOptionsPrefix(ksp_.get(), database_.prefix().c_str()));
    check(KSPSetOperators(ksp_.get(), system_.exact(), system_.shifted()));
    check(KSPSetTolerances(ksp_.get(), settings_.inner_tolerance, 1e-300, 1e8, 100000));
    PC pc = nullptr;
    check(KSPGetPC(ksp_.get(), &pc));
    check(PCSetType(pc, schur_used_ ? PCFIELDSPLIT : PCNONE));
    if (schur_used_) {
        check(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));  // before the Schur matrix, which other types ignore
        check(PCFieldSplitSetIS(pc, "x", system_.x_rows()));
        check(PCFieldSplitSetIS(pc, "lambda", system_.lambda_rows()));
        if (own_schur_matrix()) check(PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, schur_.get()));
    }
    check(KSPSetFromOptions(ksp_.get()));
}

void Krylov::analyze(const ProblemView& problem) {
    C_ = sdk::saddle_point_scaling(problem);
    ksp_.reset();
    if (problem.n + problem.m == 0) return;
    schur_used_ = by_schur(problem);
    system_.analyze(problem, C_);
    if (schur_used_ && own_schur_matrix()) {
        const bool blocks = settings_.schur_matrix == "automatic" && problem.needs_any(DELASSUS_CAN_H_BLOCKS);
        schur_.analyze(problem, system_.layout(), blocks);
    }
    pattern_ = 0;
}

void Krylov::factorize(const ProblemView& problem) {
    if (problem.n + problem.m == 0) return;
    C_ = sdk::saddle_point_scaling(problem);
    system_.factorize(problem, C_, settings_.shift);
    if (schur_used_ && own_schur_matrix()) schur_.factorize(problem, system_.layout(), C_, settings_.shift);
    if (!ksp_.get()) configure(problem);
    // PETSc repeats the symbolic factorisation exactly if a pattern has changed.
    if (const auto state = pattern_state(); state != pattern_) {
        pattern_ = state;
        ++analyses_;
    }
    check(KSPSetOperators(ksp_.get(), system_.exact(), system_.shifted()));
    check(KSPSetUp(ksp_.get()));
    check(KSPSetUpOnBlocks(ksp_.get()));
    ++factorizations_;
}

struct Krylov::Watch {
    Krylov& krylov;
    const Test& test;
    Vector& y;
    double first_norm = 0.0, milestone = 0.0;
    PetscInt milestone_iteration = 0;
    std::exception_ptr failure;
};

// Nothing may be thrown through PETSc: an exception is kept, and the processes agree to stop.
PetscErrorCode Krylov::converged(KSP ksp, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason,
                                 void* context) {
    auto& watch = *static_cast<Watch*>(context);
    *reason = KSP_CONVERGED_ITERATING;
    if (!(norm < PETSC_INFINITY)) {
        *reason = KSP_DIVERGED_NANORINF;
        return 0;
    }
    if (iteration == 0) {
        watch.first_norm = watch.milestone = norm;
        if (norm == 0.0) *reason = KSP_CONVERGED_ATOL;
        return 0;
    }
    try {
        Vec built = nullptr;
        check(KSPBuildSolution(ksp, nullptr, &built));
        watch.krylov.system_.gather(built, watch.y);
        if (watch.test(watch.y)) {
            *reason = KSP_CONVERGED_ITS;
            return 0;
        }
    } catch (...) {
        watch.failure = std::current_exception();
        *reason = KSP_DIVERGED_BREAKDOWN;
        return 0;
    }
    PetscReal relative = 0.0, absolute = 0.0, divergence = 0.0;
    PetscInt limit = 0;
    KSPGetTolerances(ksp, &relative, &absolute, &divergence, &limit);
    if (norm <= relative * watch.first_norm) *reason = KSP_CONVERGED_RTOL;
    if (norm > divergence * watch.first_norm) *reason = KSP_DIVERGED_DTOL;
    if (norm < 0.99 * watch.milestone) {
        watch.milestone = norm;
        watch.milestone_iteration = iteration;
    }
    const int window = watch.krylov.settings_.stall_window;
    if (window > 0 && iteration - watch.milestone_iteration > window) *reason = KSP_DIVERGED_ITS;
    return 0;
}

std::string Krylov::solve(const Vector& v, Vector& y, const Test& test) {
    y.setZero(v.size());
    Watch watch{*this, test, y, 0.0, 0.0, 0, nullptr};
    check(KSPSetConvergenceTest(ksp_.get(), &Krylov::converged, &watch, nullptr));
    system_.scatter(v, system_.right_hand_side());
    check(KSPSolve(ksp_.get(), system_.right_hand_side(), system_.solution()));
    if (watch.failure) std::rethrow_exception(watch.failure);
    system_.gather(system_.solution(), y);
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(ksp_.get(), &reason));
    return reason < 0 ? KSPConvergedReasons[reason] : "";
}

}  // namespace delassus::petsc
