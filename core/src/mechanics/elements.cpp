// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/elements.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "delassus/error.hpp"

namespace delassus::mechanics {

// With the deformation gradient F = Σ x_a ⊗ g_a (g_a the gradients of the shape functions) and P the first
// Piola–Kirchhoff stress, node a feels f_a = −V P g_a, and moving node b by dx changes P by dP[dx ⊗ g_b].
//
// St. Venant–Kirchhoff: E = ½(FᵀF − I), S = λ tr(E) I + 2μ E, P = F S, dP = dF S + F dS with dE = sym(Fᵀ dF).
//
// Corotational linear: F = R U (polar decomposition); energy density μ‖F − R‖² + ½ λ tr²(U − I), so that
//     P = 2μ (F − R) + λ tr(U − I) R,     dP = 2μ dF + λ tr(Rᵀ dF) R + (λ tr(U − I) − 2μ) dR,
// where dR = R [ω]× and Y = Rᵀ dF gives [ω]× U + U [ω]× = Y − Yᵀ, that is (tr(U) I − U) ω = axial vector of Y − Yᵀ.
// K is the derivative of the forces exactly, not the usual R K₀ Rᵀ.
//
// Damping, for both: a stress τ(λ tr(Ė) I + 2μ Ė) with Ė = sym(Fᵀ Ḟ), which rigid motion does not feel.
struct Tetrahedron::Deformation {
    Matrix3d F = Matrix3d::Zero(), rate = Matrix3d::Zero();
    Matrix3d R = Matrix3d::Identity(), U = Matrix3d::Identity();  // corotational only
    Matrix3d turning = Matrix3d::Zero();                          // (tr(U) I − U)⁻¹
};

namespace {

Matrix3d symmetric_part(const Matrix3d& A) {
    return 0.5 * (A + A.transpose());
}

/// λ tr(E) I + 2μ E.
Matrix3d hooke(double lambda, double mu, const Matrix3d& E) {
    return lambda * E.trace() * Matrix3d::Identity() + 2.0 * mu * E;
}

}  // namespace

Tetrahedron::Tetrahedron(const std::array<std::int32_t, 4>& nodes, const std::array<Vector3d, 4>& positions,
                         const ElasticMaterial& material, ElementModel model)
    : nodes_(nodes),
      model_(model),
      lambda_(material.young * material.poisson / ((1.0 + material.poisson) * (1.0 - 2.0 * material.poisson))),
      mu_(0.5 * material.young / (1.0 + material.poisson)),
      density_(material.density),
      damping_(material.damping_time) {
    Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = positions[static_cast<std::size_t>(i) + 1] - positions[0];
    volume_ = edges.determinant() / 6.0;
    const double longest = edges.colwise().norm().maxCoeff();
    if (!(volume_ > 1e-12 * longest * longest * longest))
        throw InputError(
            fmt::format("the tetrahedron of nodes {}, {}, {}, {} has the volume {:.3g} m³; its nodes must be "
                        "ordered so that it is positive",
                        nodes[0], nodes[1], nodes[2], nodes[3], volume_));
    const Matrix3d inverse = edges.inverse();
    gradient_[0].setZero();
    for (int i = 0; i < 3; ++i) {
        gradient_[static_cast<std::size_t>(i) + 1] = inverse.row(i).transpose();
        gradient_[0] -= inverse.row(i).transpose();
    }
}

Tetrahedron::Deformation Tetrahedron::deformation(const std::array<NodePlacement, 4>& at) const {
    Deformation result;
    for (std::size_t a = 0; a < 4; ++a) {
        result.F += at[a].x * gradient_[a].transpose();
        result.rate += at[a].v * gradient_[a].transpose();
    }
    if (model_ == ElementModel::Corotational) {
        const Eigen::JacobiSVD<Matrix3d> svd(result.F, Eigen::ComputeFullU | Eigen::ComputeFullV);
        Matrix3d W = svd.matrixU();
        Vector3d values = svd.singularValues();
        if (W.determinant() * svd.matrixV().determinant() < 0.0) {  // an inverted element: the nearest rotation
            W.col(2) *= -1.0;
            values[2] *= -1.0;
        }
        result.R = W * svd.matrixV().transpose();
        result.U = svd.matrixV() * values.asDiagonal() * svd.matrixV().transpose();
        const Matrix3d sum = result.U.trace() * Matrix3d::Identity() - result.U;
        if (std::abs(sum.determinant()) > 1e-12) result.turning = sum.inverse();
    }
    return result;
}

double Tetrahedron::energy(const std::array<NodePlacement, 4>& at) const {
    const Deformation now = deformation(at);
    if (model_ == ElementModel::Corotational) {
        const double trace = now.U.trace() - 3.0;
        return volume_ * (mu_ * (now.F - now.R).squaredNorm() + 0.5 * lambda_ * trace * trace);
    }
    const Matrix3d E = 0.5 * (now.F.transpose() * now.F - Matrix3d::Identity());
    return volume_ * (0.5 * lambda_ * E.trace() * E.trace() + mu_ * E.squaredNorm());
}

void Tetrahedron::force(const std::array<NodePlacement, 4>& at, Forces& result) const {
    const Deformation now = deformation(at);
    Matrix3d P;
    if (model_ == ElementModel::Corotational) {
        P = 2.0 * mu_ * (now.F - now.R) + lambda_ * (now.U.trace() - 3.0) * now.R;
    } else {
        P = now.F * hooke(lambda_, mu_, 0.5 * (now.F.transpose() * now.F - Matrix3d::Identity()));
    }
    if (damped()) P += damping_ * now.F * hooke(lambda_, mu_, symmetric_part(now.F.transpose() * now.rate));
    for (std::size_t a = 0; a < 4; ++a)
        result.segment<3>(3 * static_cast<Eigen::Index>(a)) = -volume_ * (P * gradient_[a]);
}

void Tetrahedron::stiffness(const std::array<NodePlacement, 4>& at, Matrix& result) const {
    const Deformation now = deformation(at);
    Matrix3d S = Matrix3d::Zero();
    if (model_ == ElementModel::StVenantKirchhoff)
        S = hooke(lambda_, mu_, 0.5 * (now.F.transpose() * now.F - Matrix3d::Identity()));
    if (damped()) S += damping_ * hooke(lambda_, mu_, symmetric_part(now.F.transpose() * now.rate));
    for (std::size_t b = 0; b < 4; ++b) {
        for (int j = 0; j < 3; ++j) {
            const Matrix3d dF = Vector3d::Unit(j) * gradient_[b].transpose();
            Matrix3d dP = dF * S;
            if (model_ == ElementModel::StVenantKirchhoff) {
                dP += now.F * hooke(lambda_, mu_, symmetric_part(now.F.transpose() * dF));
            } else {
                const Matrix3d Y = now.R.transpose() * dF;
                const Vector3d axial(Y(2, 1) - Y(1, 2), Y(0, 2) - Y(2, 0), Y(1, 0) - Y(0, 1));
                const Matrix3d dR = now.R * skew(now.turning * axial);
                dP += 2.0 * mu_ * dF + lambda_ * Y.trace() * now.R + (lambda_ * (now.U.trace() - 3.0) - 2.0 * mu_) * dR;
            }
            if (damped()) dP += damping_ * now.F * hooke(lambda_, mu_, symmetric_part(dF.transpose() * now.rate));
            for (std::size_t a = 0; a < 4; ++a)
                result.block<3, 1>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b) + j) =
                    volume_ * (dP * gradient_[a]);
        }
    }
}

void Tetrahedron::damping(const std::array<NodePlacement, 4>& at, Matrix& result) const {
    const Deformation now = deformation(at);
    for (std::size_t b = 0; b < 4; ++b) {
        for (int j = 0; j < 3; ++j) {
            const Matrix3d dF = Vector3d::Unit(j) * gradient_[b].transpose();
            const Matrix3d dP = damping_ * now.F * hooke(lambda_, mu_, symmetric_part(now.F.transpose() * dF));
            for (std::size_t a = 0; a < 4; ++a)
                result.block<3, 1>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b) + j) =
                    volume_ * (dP * gradient_[a]);
        }
    }
}

Cable::Cable(const std::array<std::int32_t, 2>& nodes, const std::array<Vector3d, 2>& positions,
             const CableParameters& parameters)
    : nodes_(nodes),
      length_(std::isnan(parameters.rest_length) ? (positions[1] - positions[0]).norm() : parameters.rest_length),
      stiffness_(parameters.young * parameters.area / length_),
      damping_(stiffness_ * parameters.damping_time),
      mass_(parameters.density * parameters.area * length_),
      slack_(parameters.slack) {}

Cable::Stretch Cable::stretch(const std::array<NodePlacement, 2>& at) const {
    Stretch now;
    const Vector3d span = at[1].x - at[0].x;
    now.relative_velocity = at[1].v - at[0].v;
    now.length = span.norm();
    now.along = span / now.length;
    now.rate = now.along.dot(now.relative_velocity);
    now.slack = slack_ && now.length < length_;
    if (!now.slack) now.tension = stiffness_ * (now.length - length_) + damping_ * now.rate;
    return now;
}

double Cable::energy(const std::array<NodePlacement, 2>& at) const {
    const Stretch now = stretch(at);
    return now.slack ? 0.0 : 0.5 * stiffness_ * (now.length - length_) * (now.length - length_);
}

void Cable::force(const std::array<NodePlacement, 2>& at, Forces& result) const {
    const Stretch now = stretch(at);
    result << now.tension * now.along, -now.tension * now.along;
}

// f₁ = −T e with e = r/ℓ: −∂f₁/∂r = e (∂T/∂r)ᵀ + (T/ℓ)(I − e eᵀ), ∂T/∂r = k e + c (ṙ − (e·ṙ) e)/ℓ.
void Cable::stiffness(const std::array<NodePlacement, 2>& at, Matrix& result) const {
    const Stretch now = stretch(at);
    Matrix3d block = Matrix3d::Zero();
    if (!now.slack) {
        const Vector3d slope =
            stiffness_ * now.along + damping_ / now.length * (now.relative_velocity - now.rate * now.along);
        block = now.along * slope.transpose() +
                now.tension / now.length * (Matrix3d::Identity() - now.along * now.along.transpose());
    }
    result << block, -block, -block, block;
}

void Cable::damping(const std::array<NodePlacement, 2>& at, Matrix& result) const {
    const Stretch now = stretch(at);
    const Matrix3d block =
        now.slack ? Matrix3d(Matrix3d::Zero()) : Matrix3d(damping_ * now.along * now.along.transpose());
    result << block, -block, -block, block;
}

}  // namespace delassus::mechanics
