// SPDX-License-Identifier: BSD-3-Clause
#include "pgs.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "options.hpp"

namespace delassus::petsc {

PartitionedGaussSeidel::PartitionedGaussSeidel(const sdk::OptionValues& options)
    : ordering_(pgs::ordering_of(options)), iteration_(options) {
    ensure_petsc();
    model_.join(part_);
}

PartitionedGaussSeidel::~PartitionedGaussSeidel() = default;

std::string PartitionedGaussSeidel::refusal(const sdk::ProblemView& problem) {
    if (!pgs::is_nonnegative_diagonal(problem.E)) return "E must be zero, or diagonal without negative entries";
    return {};
}

void PartitionedGaussSeidel::analyze(const sdk::LocalProblemView& problem) {
    const Session session;
    part_.analyze(Processes(*problem.raw), problem);
    operator_.analyze(part_.problem());
}

void PartitionedGaussSeidel::factorize(const sdk::LocalProblemView& problem) {
    const Session session;
    ++factorizations_;
    part_.factorize(problem);
    part_.processes().together([&] {
        operator_.factorize(part_.problem());
        model_.build(part_.problem(), operator_, true, iteration_.jacobi(), iteration_.exact(), ordering_);
        part_.find_places(model_);
    });
    diagonal_ = part_.diagonal(operator_);
    fill_immobile(part_.processes(), problem.cones, diagonal_);
}

sdk::Outcome PartitionedGaussSeidel::solve(const sdk::LocalProblemView& problem, const sdk::Request& request,
                                           sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    const Session session;
    CostMeter& meter = *part_.processes().meter();
    meter.begin(problem.raw->m_all, 0);
    part_.load(problem);
    const sdk::ProblemView& split = part_.problem();
    {
        const auto multiplying = meter.span(DELASSUS_PHASE_PRODUCTS);
        operator_.free_velocity(split, u_);
    }
    residual_.assign(split, diagonal_, u_);
    std::array<double, 2> sums = {0.0, lambda.allFinite() ? 0.0 : 1.0};
    for (std::size_t c = 0; c < split.cones.size(); ++c) {
        const double s = residual_.scaling()[c];
        sums[0] += s * s * u_.segment(split.cones[c].first_row, split.cones[c].rows).squaredNorm();
    }
    part_.processes().sum(sums);
    reference_ = sdk::reference_of(sums[0]);
    model_.set_right_hand_side(split, operator_, residual_.scaling());
    lambda_.setZero(problem.m);
    if (request.warm_start() && sums[1] == 0.0) lambda_ = lambda;
    for (const delassus_cone& cone : split.cones) sdk::project(cone, lambda_.data() + cone.first_row);

    sdk::Monitor monitor(request, iteration_.stall_window());
    {
        // A sweep multiplies and projects cone by cone.
        const auto sweeping = meter.span(DELASSUS_PHASE_PROJECTIONS);
        iteration_.run(model_, operator_, reference_, problem.coulomb, request, monitor, lambda_,
                       [&](const sdk::Vector& reactions) { return measured(reactions); });
    }
    lambda = monitor.best();
    x = part_.own(part_.velocity(operator_, monitor.best()));
    sdk::Outcome& outcome = monitor.outcome();
    if (const int processes = part_.processes().size(); processes > 1 && outcome.message.empty()) {
        char text[96];
        std::snprintf(text, sizeof text, "%d processes together send %.3g MB a sweep", processes,
                      1e-6 * static_cast<double>(part_.bytes_a_sweep()));
        outcome.message = text;
    }
    outcome.cost = meter.end();
    return outcome;
}

// From u = D H⁻¹(a + Dᵀλ) + E λ + b.
double PartitionedGaussSeidel::measured(const sdk::Vector& lambda) {
    const auto multiplying = part_.processes().meter()->span(DELASSUS_PHASE_PRODUCTS);
    const sdk::ProblemView& split = part_.problem();
    const sdk::Vector v = part_.velocity(operator_, lambda);
    u_ = split.b;
    if (split.m > 0) u_.noalias() += split.D * v;
    if (split.E.nonZeros() > 0) u_.noalias() += split.E * lambda;
    double sum = 0.0;
    for (std::size_t c = 0; c < split.cones.size(); ++c) {
        const auto first = split.cones[c].first_row;
        sum += residual_.squared_block(c, lambda.data() + first, u_.data() + first);
    }
    return std::sqrt(part_.processes().sum(sum)) / reference_;
}

}  // namespace delassus::petsc
