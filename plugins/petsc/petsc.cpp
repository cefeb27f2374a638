// SPDX-License-Identifier: BSD-3-Clause
// The plugin: Krylov methods of PETSc on the saddle-point system, with refinement around them. README.md has the
// method.
#include <cmath>
#include <cstdio>

#include "delassus/sdk/saddle_point.hpp"
#include "delassus/sdk/solver.hpp"
#include "krylov.hpp"

namespace delassus::petsc {

using namespace delassus::sdk;

namespace {

constexpr const char* methods[] = {"fgmres", "gmres", "lgmres",     "gcr",     "minres",
                                   "bcgs",   "tfqmr", "richardson", "preonly", "schur_cg"};
constexpr const char* preconditioners[] = {"automatic",      "schur_full",    "schur_lower", "schur_upper",
                                           "schur_diagonal", "factorization", "jacobi",      "none"};
constexpr const char* schur_matrices[] = {"automatic", "diagonal", "selfp"};

constexpr delassus_option options[] = {
    choice_option("method", "fgmres", methods, "Krylov method; schur_cg: fgmres around CG on the Schur complement"),
    choice_option("preconditioner", "automatic", preconditioners,
                  "schur_*: fieldsplit of x and lambda; factorization: of the whole matrix; automatic: schur_full for "
                  "a definite H, else factorization"),
    choice_option("schur_matrix", "automatic", schur_matrices,
                  "what preconditions the Schur complement: D diag(H)^-1 D' + E; automatic takes the inverse of small "
                  "blocks exactly; selfp: PETSc's own"),
    integer_option("restart", "50", 1, 10000, "iterations", "length of a cycle of the GMRES family"),
    integer_option(
        "stall_window", "1000", 0, 1000000, "iterations",
        "the solve ends as stalled if the residual falls by less than 1 % within this many iterations; 0: never"),
    real_option("shift", "1e-10", 0.0, 1e-2, "",
                "shift on the diagonal of the scaled preconditioner, never of the operator; keeps it regular where "
                "rows are redundant"),
    real_option("inner_tolerance", "1e-8", 0.0, 1.0, "",
                "reduction of the residual after which it is computed afresh in higher precision"),
    text_option("petsc_options", "", "PETSc's own options without prefix, e.g. -ksp_type gcr -pc_type asm"),
};

std::string scientific(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1e", value);
    return text;
}

}  // namespace

class PetscSolver : public Solver {
public:
    explicit PetscSolver(const OptionValues& values) : method_(values.choice("method")) {
        const Settings settings(values);
        ensure_petsc();
        const Session session;
        krylov_ = std::make_unique<Krylov>(settings, values.text("petsc_options"));
    }
    ~PetscSolver() override {
        const Session session;
        krylov_.reset();
    }
    PetscSolver(const PetscSolver&) = delete;
    PetscSolver& operator=(const PetscSolver&) = delete;

    [[nodiscard]] std::string refusal(const ProblemView& problem) override {
        if (problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC) && (method_ == "minres" || method_ == "schur_cg"))
            return "method " + method_ + " needs a symmetric H; fgmres takes any";
        return {};
    }

    void analyze(const ProblemView& problem) override {
        const Session session;
        error_.analyze(problem);
        krylov_->analyze(problem);
    }

    void factorize(const ProblemView& problem) override {
        const Session session;
        error_.factorize(problem);
        krylov_->factorize(problem);
    }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override;

    [[nodiscard]] std::int64_t analyses() const override { return krylov_->analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return krylov_->factorizations(); }

private:
    [[nodiscard]] SaddlePointError::Value measure(const ProblemView& problem, const Vector& z,
                                                  Vector* residual = nullptr) {
        lambda_ = -z.tail(problem.m);
        return error_.measure(problem, z.head(problem.n), lambda_, residual);
    }

    std::string method_;
    std::unique_ptr<Krylov> krylov_;
    SaddlePointError error_;
    Vector lambda_;
};

// Krylov methods work in double precision and lose digits where K is ill-conditioned, so they run inside iterative
// refinement: r = f − K z in long double, then K d = r by the KSP, then z ← z + d. Inside, every iterate z + d is
// measured as the host will do it.
Outcome PetscSolver::solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                           MutableVectorView lambda) {
    const Session session;
    const auto n = problem.n, m = problem.m;
    const auto& communicator = krylov_->communicator();
    const Vector& C = krylov_->scaling();
    constexpr double worthwhile = 0.5;  // a refinement that gains less is a stall, if it happens twice in a row

    error_.begin(problem);
    Outcome outcome;
    Vector z = Vector::Zero(n + m), residual, y, trial, best;
    if (request.warm_start()) z << x, -lambda;
    auto value = measure(problem, z, &residual);
    best = z;
    const auto keep = [&] {
        x = best.head(n);
        lambda = -best.tail(m);
        outcome.residual = value.natural;
    };
    const auto finish = [&](delassus_status status, const std::string& message = {}) {
        keep();
        outcome.status = status;
        outcome.message = message;
        return outcome;
    };
    const auto solved = [&] { return communicator.agree(error_.meets(value, request.tolerance()) ? 0 : 1) == 0; };

    if (const auto stop = communicator.progress(request, 0, x.data(), (keep(), lambda.data()));
        stop != DELASSUS_CONTINUE)
        return finish(status_of(stop));
    if (n + m == 0 || solved()) return finish(DELASSUS_SOLVED);
    if (request.max_iterations() == 0) return finish(DELASSUS_ITERATION_LIMIT);

    delassus_answer answer = DELASSUS_CONTINUE;
    bool over = false, done = false;
    const auto consider = [&] {  // the candidate `trial`, one iteration further
        ++outcome.iterations;
        const auto trial_value = trial.allFinite() ? measure(problem, trial) : SaddlePointError::Value{};
        if (communicator.agree(trial_value.worst() < value.worst() ? 0 : 1) == 0) {
            best = trial;
            value = trial_value;
        }
        const Vector reactions = trial.allFinite() ? Vector(-trial.tail(m)) : Vector(-best.tail(m));
        answer = communicator.progress(request, outcome.iterations, (trial.allFinite() ? trial : best).data(),
                                       reactions.data());
        done = solved();
        over = outcome.iterations >= request.max_iterations();
        return answer != DELASSUS_CONTINUE || done || over;
    };

    int poor = 0;
    std::string reason;
    while (true) {
        const double before = value.worst();
        Vector v = C.cwiseProduct(residual);
        const double size = v.norm();
        if (!(size > 0.0)) break;
        v /= size;
        const auto counted = outcome.iterations;
        const auto candidate = [&](const Vector& scaled) {
            trial = z + size * C.cwiseProduct(scaled);
            return consider();
        };
        reason = krylov_->solve(v, y, candidate);
        if (outcome.iterations == counted) candidate(y);  // methods without a test, as preonly
        if (answer != DELASSUS_CONTINUE) return finish(status_of(answer));
        if (done) return finish(DELASSUS_SOLVED);
        if (over) return finish(DELASSUS_ITERATION_LIMIT);
        z = best;
        value = measure(problem, z, &residual);
        poor = communicator.agree(value.worst() > worthwhile * before ? 1 : 0) != 0 ? poor + 1 : 0;
        if (poor >= 2) break;
    }
    std::string message =
        "refinement ends at natural " + scientific(value.natural) + ", balance " + scientific(value.balance);
    if (!reason.empty()) message += "; PETSc says " + reason;
    return finish(DELASSUS_STALLED, message);
}

constexpr std::uint64_t capabilities =
    DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
    DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC | DELASSUS_CAN_REDUCED |
    DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START | DELASSUS_CAN_DISTRIBUTED;

}  // namespace delassus::petsc

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PetscSolver,
                       (delassus::sdk::PluginInfo{
                           .name = "petsc",
                           .version = "1.0.0",
                           .description = "Krylov methods of PETSc on the saddle-point system; distributed under MPI",
                           .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
                           .capabilities = delassus::petsc::capabilities,
                           .flags = DELASSUS_FLAG_MPI}),
                       delassus::petsc::options)
