// SPDX-License-Identifier: BSD-3-Clause
#include "reactions.hpp"

#include <cmath>

namespace delassus::newton {

namespace {

using State = Piece::State;
using Block = std::array<double, 9>;

State evaluate_row(const Piece& piece, double w, double& lambda, Block& W) {
    lambda = -w / piece.compliance;
    W[0] = 0.0;
    if (lambda <= piece.lower) {
        lambda = piece.lower;
        return State::Lower;
    }
    if (lambda >= piece.upper) {
        lambda = piece.upper;
        return State::Upper;
    }
    W[0] = 1.0 / piece.compliance;
    return State::Inside;
}

State evaluate_friction(const Piece& piece, const double* w, double* lambda, Block& W) {
    const bool spatial = piece.rows == 3;
    const double z_n = -piece.p_n * w[0];
    const double z_1 = -piece.p_t * w[1], z_2 = spatial ? -piece.p_t * w[2] : 0.0;
    const double t = spatial ? std::sqrt(z_1 * z_1 + z_2 * z_2) : std::abs(z_1);
    W.fill(0.0);
    if (piece.slope * t <= -z_n) {
        for (std::int32_t i = 0; i < piece.rows; ++i) lambda[i] = 0.0;
        return State::Zero;
    }
    const double nn = piece.p_n * piece.p_n, tt = piece.p_t * piece.p_t;
    if (t <= piece.slope * z_n && piece.slope > 0.0) {
        lambda[0] = piece.p_n * z_n;
        lambda[1] = piece.p_t * z_1;
        if (spatial) lambda[2] = piece.p_t * z_2;
        W[0] = nn;
        W[4] = W[8] = tt;
        return State::Inside;
    }
    const double square = 1.0 + piece.slope * piece.slope;
    const double l_n = (z_n + piece.slope * t) / square, l_t = piece.slope * l_n;
    const double t_1 = t > 0.0 ? z_1 / t : 1.0, t_2 = t > 0.0 ? z_2 / t : 0.0;
    lambda[0] = piece.p_n * l_n;
    lambda[1] = piece.p_t * l_t * t_1;
    if (spatial) lambda[2] = piece.p_t * l_t * t_2;
    const double radial = piece.slope * piece.slope / square, across = spatial && t > 0.0 ? l_t / t : 0.0;
    const double mixed = piece.p_n * piece.p_t * piece.slope / square;
    W[0] = nn / square;
    W[1] = W[3] = mixed * t_1;
    W[2] = W[6] = mixed * t_2;
    W[4] = tt * (radial * t_1 * t_1 + across * t_2 * t_2);
    W[8] = tt * (radial * t_2 * t_2 + across * t_1 * t_1);
    W[5] = W[7] = tt * (radial - across) * t_1 * t_2;
    return State::Sliding;
}

}  // namespace

const char* unfit_compliance(const sdk::ProblemView& problem) {
    constexpr double same = 1e-12;  // relative, for values that were computed apart
    constexpr const char* positive = "it needs compliance, E > 0, in every row";
    const auto& E = problem.E;
    if (E.nonZeros() < problem.m) return positive;
    const auto* start = E.outerIndexPtr();
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        double diagonal = 0.0;
        for (auto e = start[i]; e < start[i + 1]; ++e) {
            if (E.innerIndexPtr()[e] == i) {
                diagonal = E.valuePtr()[e];
            } else if (E.valuePtr()[e] != 0.0) {
                return "it needs a diagonal E";
            }
        }
        if (!(diagonal > 0.0)) return positive;
    }
    for (const delassus_cone& cone : problem.cones) {
        if (sdk::is_separable(cone) || cone.rows < 3) continue;
        const double first = E.coeff(cone.first_row + 1, cone.first_row + 1);
        const double second = E.coeff(cone.first_row + 2, cone.first_row + 2);
        if (std::abs(first - second) > same * first) return "it needs the same E in both tangents of a contact";
    }
    return nullptr;
}

void Reactions::load(const sdk::ProblemView& problem) {
    pieces_.clear();
    const auto compliance = [&](std::int32_t row) { return problem.E.coeff(row, row); };
    for (const delassus_cone& cone : problem.cones) {
        const sdk::ConeOperations& operations = sdk::operations_of(cone);
        if (operations.is_separable()) {
            for (std::int32_t i = 0; i < cone.rows; ++i) {
                const sdk::Interval bounds = operations.interval(cone, i);
                const std::int32_t row = cone.first_row + i;
                pieces_.push_back({row, 1, false, bounds.lo, bounds.hi, compliance(row), 0.0, 0.0, 0.0});
            }
        } else {
            const double p_n = 1.0 / std::sqrt(compliance(cone.first_row));
            const double p_t = 1.0 / std::sqrt(compliance(cone.first_row + 1));
            pieces_.push_back({cone.first_row, cone.rows, true, 0.0, 0.0, 0.0, p_n, p_t,
                               sdk::friction_coefficient(cone) * p_n / p_t});
        }
    }
}

void Reactions::evaluate(const sdk::Vector& w, Linearisation& result) const {
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
        const Piece& piece = pieces_[k];
        const double* velocity = w.data() + piece.first;
        double* lambda = result.lambda.data() + piece.first;
        result.state[k] = piece.friction ? evaluate_friction(piece, velocity, lambda, result.W[k])
                                         : evaluate_row(piece, *velocity, *lambda, result.W[k]);
    }
}

}  // namespace delassus::newton
