// SPDX-License-Identifier: BSD-3-Clause
#include "admm.hpp"

#include <cmath>

namespace delassus::petsc {

namespace {

const double equation_factor = std::sqrt(1000.0);  // plugins/admm/row_scaling.hpp

}  // namespace

struct PartitionedAdmm::Run {
    const sdk::LocalProblemView& problem;
    const sdk::Request& request;
    sdk::Monitor monitor;
    std::int64_t iteration = 0;
};

PartitionedAdmm::PartitionedAdmm(const sdk::OptionValues& options)
    : initial_penalty_(options.real("rho")),
      over_relaxation_(options.real("over_relaxation")),
      adaptive_(options.boolean("adaptive_rho")),
      anderson_wanted_(options.choice("acceleration") == "anderson"),
      memory_(static_cast<int>(options.integer("memory"))),
      stall_iterations_(options.integer("stall_iterations")) {
    ensure_petsc();
}

PartitionedAdmm::~PartitionedAdmm() {
    const Session session;
    resolvent_ = {};
    system_ = {};
}

void PartitionedAdmm::analyze(const sdk::LocalProblemView& problem) {
    const Session session;
    system_.analyze(Processes(*problem.raw), problem);
    resolvent_.analyze(system_, problem);
}

void PartitionedAdmm::factorize(const sdk::LocalProblemView& problem) {
    const Session session;
    system_.factorize(problem);
    find_scale(problem);
    resolvent_.load_matrices(scale_);
    resolvent_.set_penalty(problem, initial_penalty_);
}

void PartitionedAdmm::find_scale(const sdk::LocalProblemView& problem) {
    const sdk::Vector& diagonal = system_.diagonal();
    scale_.resize(problem.m);
    for (std::int64_t c = 0; c < problem.raw->cone_count; ++c) {
        const delassus_cone& cone = problem.cone(c);
        const bool whole = !sdk::is_separable(cone);
        const double block = 1.0 / std::sqrt(diagonal.segment(cone.first_row, cone.rows).sum() / cone.rows);
        for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i)
            scale_[i] = whole || !(diagonal[i] > 0.0) ? block : 1.0 / std::sqrt(diagonal[i]);
        if (sdk::operations_of(cone).is_linear) scale_.segment(cone.first_row, cone.rows) *= equation_factor;
    }
}

sdk::Outcome PartitionedAdmm::solve(const sdk::LocalProblemView& problem, const sdk::Request& request,
                                    sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    const Session session;
    CostMeter& meter = *system_.processes().meter();
    meter.begin(problem.raw->m_all, 300);
    // Not the penalty that the last solve ended with: a run that goes on from a checkpoint has to take the same path.
    resolvent_.set_penalty(problem, initial_penalty_);
    system_.load(problem);
    law_.load(system_.rows(), scale_);
    resolvent_.load(problem);
    Run run{problem, request, sdk::Monitor(request, stall_iterations_)};
    lambda_.setZero(problem.m);
    if (request.warm_start() && !system_.processes().any(!lambda.allFinite() || !x.allFinite())) {
        lambda_ = lambda.cwiseQuotient(scale_);
        law_.apply(lambda_, lambda_);
    }
    // The state ŷ that a solution with these λ̂ and û would have.
    reactions_ = lambda_.cwiseProduct(scale_);
    const double error = system_.measured(problem, reactions_, x_);
    sdk::Vector u = problem.b + system_.apply_D(x_);
    if (system_.E().nonZeros() > 0) u += system_.E() * reactions_;
    y_ = lambda_ - resolvent_.penalty() * scale_.cwiseProduct(u);
    if (!run.monitor.check(0, nullptr, reactions_, error)) iterate(run);
    meter.clock().end_iterations();
    lambda = run.monitor.best();
    x = system_.velocity(problem, lambda);
    run.monitor.outcome().cost = meter.end();
    return run.monitor.outcome();
}

void PartitionedAdmm::iterate(Run& run) {
    anderson_.reset(system_.processes(), run.problem.m, memory_);
    penalty_rule_.reset(run.problem.m);
    bool extrapolated = false;
    double accepted = 0.0;  // ‖step‖ of the latest point that was not rejected
    while (true) {
        ++run.iteration;
        system_.processes().meter()->clock().next_iteration();
        project(y_, lambda_);
        w_ = 2.0 * lambda_ - y_;
        resolvent_.apply(w_, mu_, u_);
        if (judge(run)) return;

        // ‖μ − λ‖ is the combined residual of Goldstein et al. (2014); under a convex law a plain step never grows it.
        step_ = over_relaxation_ * (mu_ - lambda_);
        const double length = system_.norm(step_);
        if (extrapolated && !(length <= accepted)) {
            y_ = plain_;
            anderson_.clear();
            extrapolated = false;
            continue;
        }
        accepted = length;
        plain_ = y_ + step_;
        extrapolated = false;
        if (adaptive_ && change_penalty(run)) continue;
        if (anderson_wanted_) {
            anderson_.push(step_, plain_);
            extrapolated = anderson_.extrapolate(y_);
        }
        if (!extrapolated) y_ = plain_;
    }
}

void PartitionedAdmm::project(const sdk::Vector& y, sdk::Vector& lambda) {
    const auto span = system_.processes().meter()->span(DELASSUS_PHASE_PROJECTIONS);
    law_.apply(y, lambda);
}

// μ̂ and û obey the equations of motion up to rounding, so that their natural error costs no product with N; a claim
// rests on velocities computed anew. True: stop.
bool PartitionedAdmm::judge(Run& run) {
    reactions_ = mu_.cwiseProduct(scale_);
    velocities_ = u_.cwiseQuotient(scale_);
    double error = system_.natural(reactions_, velocities_);
    if (error <= sdk::Monitor::aim * run.request.tolerance()) error = system_.measured(run.problem, reactions_, x_);
    return run.monitor.check(run.iteration, nullptr, reactions_, error);
}

// Asks the rule; on a change ŷ moves so that λ̂ and ẑ of the point after the step stay.
bool PartitionedAdmm::change_penalty(const Run& run) {
    const double before = resolvent_.penalty();
    z_ = (lambda_ - y_) / before;
    const double after = penalty_rule_.next(lambda_, z_, run.monitor.best_residual(), run.iteration, before,
                                            [this](const sdk::Vector& v) { return system_.norm(v); });
    if (after == before) return false;
    resolvent_.set_penalty(run.problem, after);
    project(plain_, lambda_);
    y_ = lambda_ + (after / before) * (plain_ - lambda_);
    anderson_.clear();
    return true;
}

}  // namespace delassus::petsc
