// SPDX-License-Identifier: BSD-3-Clause
// Siconos' solvers of frictional contact, as a peer in comparisons. README.md says how it is kept fair.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsVerbose.h>
#include <SolverOptions.h>

#include "contact_problem.hpp"
#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/solver.hpp"

namespace delassus::siconos {

using namespace delassus::sdk;

namespace {

struct Method {
    const char* name;
    int id;
    bool blocks;               // works on 3×3 blocks; otherwise on compressed columns
    std::int64_t first_visit;  // iterations of the first call; large where a new call forgets what was learned,
    double growth;             // and then each call is so much longer
};
constexpr std::array methods{
    Method{"nsgs", SICONOS_FRICTION_3D_NSGS, true, 16, 1.25},
    Method{"nsn_ac", SICONOS_FRICTION_3D_NSN_AC, false, 200, 2.0},
    Method{"nsn_fb", SICONOS_FRICTION_3D_NSN_FB, false, 200, 2.0},
    Method{"nsn_nm", SICONOS_FRICTION_3D_NSN_NM, false, 200, 2.0},
    Method{"admm", SICONOS_FRICTION_3D_ADMM, false, 2000, 2.0},
    Method{"vi_eg", SICONOS_FRICTION_3D_VI_EG, true, 500, 2.0},
    Method{"vi_fpp", SICONOS_FRICTION_3D_VI_FPP, true, 500, 2.0},
    Method{"prox", SICONOS_FRICTION_3D_PROX, true, 200, 2.0},
    Method{"tfp", SICONOS_FRICTION_3D_TFP, true, 200, 2.0},
    Method{"aclmfp", SICONOS_FRICTION_3D_ACLMFP, true, 200, 2.0},
};
constexpr const char* method_names[] = {"nsgs",  "nsn_ac", "nsn_fb", "nsn_nm", "admm",
                                        "vi_eg", "vi_fpp", "prox",   "tfp",    "aclmfp"};
constexpr const char* local_solvers[] = {"hybrid", "newton", "projection"};

constexpr delassus_option options[] = {
    choice_option("method", "nsgs", method_names, "Siconos' solver of the friction problem"),
    choice_option("local_solver", "hybrid", local_solvers, "solver of one contact, for nsgs"),
    boolean_option("scaling", true, "scale each contact by one scalar, so that units do not matter; false: as given"),
    integer_option("stall_iterations", "20000", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr PluginInfo info{
    .name = "siconos",
    .version = "0.1.0",
    .description = "the solvers of Siconos Numerics for friction, for comparison",
    .licence = "BSD-3-Clause AND Apache-2.0",
    .capabilities = DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_FRICTION | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL |
                    DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE |
                    DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START,
    .flags = DELASSUS_FLAG_PEER,  // Siconos exits the process on some of its internal errors
};

const Method& method_of(const std::string& name) {
    return *std::find_if(methods.begin(), methods.end(), [&](const Method& method) { return name == method.name; });
}

// Frees what solver_options_delete left of it (deletes_options.cpp).
void free_structure([[maybe_unused]] SolverOptions* settings) {
#ifdef DELASSUS_FREE_SICONOS_OPTIONS
    std::free(settings);
#endif
}

struct DeleteOptions {
    void operator()(SolverOptions* settings) const {
        const std::vector<SolverOptions*> inner(settings->internalSolvers,
                                                settings->internalSolvers + settings->numberOfInternalSolvers);
        solver_options_delete(settings);
        for (SolverOptions* one : inner) free_structure(one);
        free_structure(settings);
    }
};
using OptionsHandle = std::unique_ptr<SolverOptions, DeleteOptions>;

int local_solver_id(const std::string& name) {
    return name == "newton"       ? SICONOS_FRICTION_3D_ONECONTACT_NSN
           : name == "projection" ? SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration
                                  : SICONOS_FRICTION_3D_ONECONTACT_NSN_GP_HYBRID;
}

}  // namespace

class Siconos : public Solver {
public:
    explicit Siconos(const OptionValues& values)
        : method_(method_of(values.choice("method"))),
          local_solver_(values.choice("local_solver")),
          stall_(values.integer("stall_iterations")),
          contacts_(values.boolean("scaling"), method_.blocks) {
        numerics_set_verbose(0);
    }

    void analyze(const ProblemView& problem) override { contacts_.analyze(problem); }

    void factorize(const ProblemView& problem) override { contacts_.factorize(problem); }

    Outcome solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                  MutableVectorView lambda) override;

private:
    [[nodiscard]] OptionsHandle settings() const;

    const Method& method_;
    std::string local_solver_;
    std::int64_t stall_;
    ContactProblem contacts_;
};

OptionsHandle Siconos::settings() const {
    OptionsHandle handle(solver_options_create(method_.id));
    if (!handle) throw std::bad_alloc();
    if (method_.id == SICONOS_FRICTION_3D_NSGS) {
        SolverOptions* standard = handle->internalSolvers[0];
        solver_options_update_internal(handle.get(), 0, local_solver_id(local_solver_));
        free_structure(standard);
    }
    return handle;
}

// Siconos judges by its own error, with its own divisor, and cannot be stopped from outside. So it is called
// repeatedly, each time from where the last call ended and for twice as many iterations. Its tolerance is lowered while
// it is content but the natural error is not met.
Outcome Siconos::solve(const ProblemView& problem, const Request& request, MutableVectorView x,
                       MutableVectorView lambda) {
    contacts_.load(problem);
    Vector start = Vector::Zero(problem.m), velocity(problem.n);
    if (request.warm_start() && lambda.allFinite()) start = lambda;
    Vector reaction = contacts_.embedded(start);
    Vector contact_velocity = Vector::Zero(reaction.size());

    Monitor monitor(request, stall_);
    double tolerance = request.tolerance();
    std::int64_t iterations = 0, visit = method_.first_visit;
    bool ended = monitor.check(0, velocity.data(), start, contacts_.natural(problem, start, velocity));
    while (!ended) {
        const OptionsHandle handle = settings();
        const std::int64_t allowed = std::min(visit, request.max_iterations() - iterations);
        handle->iparam[SICONOS_IPARAM_MAX_ITER] = static_cast<int>(std::min<std::int64_t>(allowed, 1 << 30));
        handle->dparam[SICONOS_DPARAM_TOL] = tolerance;
        const int code = fc3d_driver(&contacts_.raw(), reaction.data(), contact_velocity.data(), handle.get());
        const std::int64_t done = std::clamp<std::int64_t>(handle->iparam[SICONOS_IPARAM_ITER_DONE], 1, allowed);
        iterations += done;
        const Vector reached = contacts_.restricted(reaction);
        const double natural = contacts_.natural(problem, reached, velocity);
        ended = monitor.check(iterations, velocity.data(), reached, natural);
        if (ended) break;
        const bool content = code == 0;
        if (content) tolerance *= std::clamp(0.5 * request.tolerance() / natural, 1e-3, 0.5);
        const bool exhausted = content ? tolerance < 1e-18 : done < allowed;
        if (exhausted) {
            monitor.outcome().status = DELASSUS_STALLED;
            monitor.outcome().message = content ? "Siconos is content with an error that is not the natural one"
                                                : "Siconos gave up with code " + std::to_string(code);
            break;
        }
        visit = static_cast<std::int64_t>(std::ceil(method_.growth * static_cast<double>(visit)));
    }
    lambda = monitor.best().size() == problem.m ? monitor.best() : start;
    x = contacts_.velocity(problem, lambda);
    return monitor.outcome();
}

}  // namespace delassus::siconos

DELASSUS_SOLVER_PLUGIN(delassus::siconos::Siconos, delassus::siconos::info, delassus::siconos::options)
