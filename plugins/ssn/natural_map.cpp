// SPDX-License-Identifier: BSD-3-Clause
#include "natural_map.hpp"

#include <algorithm>
#include <cmath>

namespace delassus::ssn {

namespace {

using Triple = std::array<double, 3>;

double tangent_norm(const Piece& piece, const Triple& v) {
    return piece.rows == 3 ? std::sqrt(v[1] * v[1] + v[2] * v[2]) : std::abs(v[1]);
}

// w and z of one piece.
struct Point {
    Triple w{}, z{};
};

Point point_of(const Piece& piece, double theta, const Vector& lambda, const Vector& u, const Proximal& proximal) {
    Point point;
    for (std::int32_t i = 0; i < piece.rows; ++i) {
        const Eigen::Index row = piece.first + i;
        const double shift = proximal.centre ? proximal.tau * (lambda[row] - (*proximal.centre)[row]) : 0.0;
        point.w[static_cast<std::size_t>(i)] = u[row] + shift;
        point.z[static_cast<std::size_t>(i)] = lambda[row] - proximal.rho * (u[row] + shift);
    }
    if (theta > 0.0 && piece.cone)
        point.z[0] -= proximal.rho * theta * sdk::FrictionCone::de_saxce(*piece.cone, point.w.data());
    return point;
}

double clamp_row(const sdk::ScaledProblem& scaled, std::int32_t row, double z) {
    return std::min(scaled.upper()[row], std::max(scaled.lower()[row], z));
}

}  // namespace

void NaturalMap::load(const sdk::ScaledProblem& scaled) {
    scaled_ = &scaled;
    pieces_.clear();
    for (const auto& block : scaled.blocks())
        pieces_.push_back({.first = block.first, .rows = block.rows, .cone = &block.cone});
    for (const auto& run : scaled.intervals())
        for (std::int32_t i = 0; i < run.rows; ++i) pieces_.push_back({.first = run.first + i, .rows = 1});
    std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) { return a.first < b.first; });
}

void NaturalMap::evaluate(const Vector& lambda, const Vector& u, const Proximal& proximal, Vector& F) const {
    F.resize(lambda.size());
    for (const Piece& piece : pieces_) {
        Triple p = point_of(piece, theta_, lambda, u, proximal).z;
        if (piece.cone) {
            sdk::project(*piece.cone, p.data());
        } else {
            p[0] = clamp_row(*scaled_, piece.first, p[0]);
        }
        for (std::int32_t i = 0; i < piece.rows; ++i)
            F[piece.first + i] = lambda[piece.first + i] - p[static_cast<std::size_t>(i)];
    }
}

void NaturalMap::linearise(const Vector& lambda, const Vector& u, const Proximal& proximal, Vector& F, Vector& normal,
                           Vector& local) {
    const Eigen::Index m = lambda.size();
    F.resize(m);
    normal.setZero(m);
    local.setZero(m);
    for (Piece& piece : pieces_) {
        const auto [w, z] = point_of(piece, theta_, lambda, u, proximal);
        if (!piece.cone) {
            const double p = clamp_row(*scaled_, piece.first, z[0]);
            F[piece.first] = lambda[piece.first] - p;
            linearise_row(piece, z[0], F[piece.first], proximal, normal, local);
            continue;
        }
        Triple p = z;
        sdk::project(*piece.cone, p.data());
        for (std::int32_t i = 0; i < piece.rows; ++i)
            F[piece.first + i] = lambda[piece.first + i] - p[static_cast<std::size_t>(i)];
        linearise_friction(piece, z, p, w, F.data() + piece.first, proximal, normal.data() + piece.first,
                           local.data() + piece.first);
    }
}

void NaturalMap::linearise_row(Piece& piece, double z, double residual, const Proximal& proximal, Vector& normal,
                               Vector& local) const {
    const Eigen::Index row = piece.first;
    piece.active = z > scaled_->lower()[row] && z < scaled_->upper()[row] ? 1 : 0;
    piece.A[0] = piece.B[0] = 1.0;
    piece.M[0] = proximal.tau;
    (piece.active ? local[row] : normal[row]) = piece.active ? -residual / proximal.rho : -residual;
}

void NaturalMap::linearise_friction(Piece& piece, const Triple& z, const Triple& p, const Triple& w, const double* F,
                                    const Proximal& proximal, double* normal, double* local) const {
    const double mu = sdk::friction_coefficient(*piece.cone);
    const auto rows = static_cast<std::size_t>(piece.rows);
    piece.A.fill(0.0);
    piece.B.fill(0.0);
    piece.M.fill(0.0);
    if (!(p[0] > 0.0)) {  // the apex
        piece.active = 0;
        for (std::size_t i = 0; i < rows; ++i) normal[i] = -F[i];
        return;
    }
    const double distance = tangent_norm(piece, z);
    if (mu > 0.0 && distance <= mu * z[0]) {  // inside
        piece.active = piece.rows;
        for (std::size_t i = 0; i < rows; ++i) {
            piece.A[4 * i] = piece.B[4 * i] = 1.0;
            piece.M[4 * i] = proximal.tau;
            local[i] = -w[i];
        }
        return;
    }
    // The surface. For μ = 0 the cone is the ray (1, 0, 0) and has no circumference.
    Triple t{};
    if (distance > 0.0)
        for (std::size_t i = 1; i < rows; ++i) t[i] = z[i] / distance;
    const double norm = std::sqrt(1.0 + mu * mu);
    piece.B[0] = 1.0 / norm;
    for (std::size_t i = 1; i < rows; ++i) piece.B[i] = mu * t[i] / norm;
    piece.active = 1;
    Triple stiffness{};  // K/ρ
    const double radius = mu * p[0];
    if (rows == 3 && radius > 1e-12 * distance) {
        piece.B[4] = -t[2];
        piece.B[5] = t[1];
        piece.active = 2;
        stiffness[1] = std::max(0.0, distance / radius - 1.0) / proximal.rho;
    }
    // A = Bᵀ G: row k is b_kᵀ + (b_k · e_n) θ μ dᵀ, d = w_t/‖w_t‖; where w_t vanishes, sliding would oppose the
    // friction.
    Triple d{};  // times θ
    if (theta_ > 0.0) {
        const double speed = tangent_norm(piece, w);
        for (std::size_t i = 1; i < rows; ++i) d[i] = theta_ * (speed > 0.0 ? w[i] / speed : -t[i]);
    }
    const auto active = static_cast<std::size_t>(piece.active);
    for (std::size_t k = 0; k < active; ++k)
        for (std::size_t i = 0; i < rows; ++i) piece.A[3 * i + k] = piece.B[3 * k + i] + mu * piece.B[3 * k] * d[i];
    for (std::size_t i = 0; i < rows; ++i) normal[i] = -F[i];
    for (std::size_t k = 0; k < active; ++k) {
        double component = 0.0;
        for (std::size_t i = 0; i < rows; ++i) component += piece.B[3 * k + i] * F[i];
        for (std::size_t i = 0; i < rows; ++i) normal[i] += component * piece.B[3 * k + i];
        local[k] = -component * (1.0 / proximal.rho + stiffness[k]);  // 1/(ρ j) = 1/ρ + K/ρ
        for (std::size_t l = 0; l < active; ++l) {
            double product = 0.0;
            for (std::size_t i = 0; i < rows; ++i) product += piece.A[3 * i + k] * piece.B[3 * l + i];
            piece.M[3 * l + k] = proximal.tau * product + (k == l ? stiffness[k] : 0.0);
        }
    }
}

void NaturalMap::expand(const Vector& v, Vector& result) const {
    result.resize(v.size());
    for (const Piece& piece : pieces_) {
        for (std::int32_t i = 0; i < piece.rows; ++i) {
            double sum = 0.0;
            for (std::int32_t k = 0; k < piece.active; ++k)
                sum += piece.B[static_cast<std::size_t>(3 * k + i)] * v[piece.first + k];
            result[piece.first + i] = sum;
        }
    }
}

void NaturalMap::contract(const Vector& v, Vector& result) const {
    result.resize(v.size());
    for (const Piece& piece : pieces_) {
        for (std::int32_t k = 0; k < piece.rows; ++k) {
            double sum = 0.0;
            if (k < piece.active)
                for (std::int32_t i = 0; i < piece.rows; ++i)
                    sum += piece.A[static_cast<std::size_t>(3 * i + k)] * v[piece.first + i];
            result[piece.first + k] = sum;
        }
    }
}

void NaturalMap::add_diagonal(const Vector& v, Vector& result) const {
    for (const Piece& piece : pieces_)
        for (std::int32_t k = 0; k < piece.active; ++k)
            for (std::int32_t l = 0; l < piece.active; ++l)
                result[piece.first + k] += piece.M[static_cast<std::size_t>(3 * l + k)] * v[piece.first + l];
}

}  // namespace delassus::ssn
