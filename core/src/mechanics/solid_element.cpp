// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/solid_element.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/error.hpp"

namespace delassus::mechanics {

namespace {

constexpr std::array<std::array<std::size_t, 3>, 4> tetrahedron_sides = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};

struct Corners {
    double volume = 0.0;
    NodeColumns gradient{3, 4};  // of the barycentric coordinates
};

template <class Nodes, class Positions>
Corners corners_of(const Nodes& nodes, const Positions& positions) {
    Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = positions[static_cast<std::size_t>(i) + 1] - positions[0];
    Corners result;
    result.volume = edges.determinant() / 6.0;
    const double longest = edges.colwise().norm().maxCoeff();
    if (!(result.volume > 1e-12 * longest * longest * longest))
        throw InputError(
            fmt::format("the tetrahedron of nodes {}, {}, {}, {} has the volume {:.3g} m³; its nodes must be "
                        "ordered so that it is positive",
                        nodes[0], nodes[1], nodes[2], nodes[3], result.volume));
    const Matrix3d inverse = edges.inverse();
    result.gradient.rightCols<3>() = inverse.transpose();
    result.gradient.col(0) = -result.gradient.rightCols<3>().rowwise().sum();
    return result;
}

Matrix3d symmetric_part(const Matrix3d& A) {
    return 0.5 * (A + A.transpose());
}

}  // namespace

void append_sides(const std::array<std::int32_t, 4>& nodes, std::vector<ElementSide>& sides) {
    for (const auto& [i, j, k] : tetrahedron_sides) sides.push_back({{nodes[i], nodes[j], nodes[k]}});
}

void append_sides(const std::array<std::int32_t, 10>& nodes, std::vector<ElementSide>& sides) {
    const auto middle = [&](std::size_t i, std::size_t j) {
        const std::array ends{std::min(i, j), std::max(i, j)};
        const auto edge = std::find(tetrahedron_edges.begin(), tetrahedron_edges.end(), ends);
        return nodes[4 + static_cast<std::size_t>(edge - tetrahedron_edges.begin())];
    };
    for (const auto& [i, j, k] : tetrahedron_sides)
        sides.push_back({{nodes[i], nodes[j], nodes[k]}, {middle(i, j), middle(j, k), middle(k, i)}});
}

std::vector<ElementSide> outer_sides(std::span<const ElementSide> sides) {
    std::vector<std::pair<std::array<std::int32_t, 3>, std::size_t>> sorted;  // corners, ascending, and the side
    for (std::size_t k = 0; k < sides.size(); ++k) {
        sorted.emplace_back(sides[k].corners, k);
        std::sort(sorted.back().first.begin(), sorted.back().first.end());
    }
    std::sort(sorted.begin(), sorted.end());
    std::vector<ElementSide> result;
    for (std::size_t k = 0; k < sorted.size();) {
        std::size_t end = k + 1;
        while (end < sorted.size() && sorted[end].first == sorted[k].first) ++end;
        if (end == k + 1) result.push_back(sides[sorted[k].second]);
        k = end;
    }
    return result;
}

SolidShape linear_tetrahedron(const std::array<std::int32_t, 4>& nodes, const std::array<Vector3d, 4>& positions) {
    const Corners corners = corners_of(nodes, positions);
    return {{{corners.volume, corners.gradient}}, {0.25, 0.25, 0.25, 0.25}};
}

// With the barycentric coordinates L_i, N_i = L_i (2 L_i − 1) at the corners and N_ij = 4 L_i L_j in the middles. The
// four points, with L = (a, b, b, b) and so on, integrate polynomials of degree two exactly, as the energy of small
// strains is (Hammer and Stroud 1956). The masses are in proportion to the diagonal of the consistent mass matrix
// (Hinton, Rock and Zienkiewicz 1976): equal shares of the total would be negative at the corners.
SolidShape quadratic_tetrahedron(const std::array<std::int32_t, 10>& nodes, const std::array<Vector3d, 10>& positions) {
    const Corners corners = corners_of(nodes, positions);
    for (std::size_t e = 0; e < 6; ++e) {
        const Vector3d &from = positions[tetrahedron_edges[e][0]], &to = positions[tetrahedron_edges[e][1]];
        if (!((positions[4 + e] - 0.5 * (from + to)).norm() <= 1e-6 * (to - from).norm()))
            throw InputError(fmt::format("the node {} is not in the middle between the nodes {} and {}", nodes[4 + e],
                                         nodes[tetrahedron_edges[e][0]], nodes[tetrahedron_edges[e][1]]));
    }
    const double b = (5.0 - std::sqrt(5.0)) / 20.0, a = 1.0 - 3.0 * b;
    SolidShape shape;
    for (std::size_t p = 0; p < 4; ++p) {
        std::array<double, 4> L{b, b, b, b};
        L[p] = a;
        SolidShape::Point point{0.25 * corners.volume, NodeColumns(3, 10)};
        const auto of_corner = [&](std::size_t i) { return corners.gradient.col(static_cast<Eigen::Index>(i)); };
        for (std::size_t i = 0; i < 4; ++i)
            point.gradient.col(static_cast<Eigen::Index>(i)) = (4.0 * L[i] - 1.0) * of_corner(i);
        for (std::size_t e = 0; e < 6; ++e) {
            const auto [i, j] = tetrahedron_edges[e];
            point.gradient.col(static_cast<Eigen::Index>(4 + e)) = 4.0 * (L[i] * of_corner(j) + L[j] * of_corner(i));
        }
        shape.points.push_back(point);
    }
    for (std::size_t k = 0; k < 10; ++k) shape.share.push_back(k < 4 ? 1.0 / 36.0 : 4.0 / 27.0);
    shape.own_bulk = 1.2;
    return shape;
}

SolidShape brick(const std::array<std::int32_t, 8>& nodes, const std::array<Vector3d, 8>& positions) {
    SolidShape shape;
    shape.share.assign(8, 0.0);
    double volume = 0.0;
    for (const auto& places : brick_tetrahedra) {
        std::array<std::int32_t, 4> named{};
        std::array<Vector3d, 4> at;
        for (std::size_t k = 0; k < 4; ++k) {
            named[k] = nodes[places[k]];
            at[k] = positions[places[k]];
        }
        const Corners corners = corners_of(named, at);
        volume += corners.volume;
        SolidShape::Point point{corners.volume, NodeColumns::Zero(3, 8)};
        for (std::size_t k = 0; k < 4; ++k) {
            point.gradient.col(static_cast<Eigen::Index>(places[k])) =
                corners.gradient.col(static_cast<Eigen::Index>(k));
            shape.share[places[k]] += 0.25 * corners.volume;
        }
        shape.points.push_back(point);
    }
    for (double& share : shape.share) share /= volume;
    return shape;
}

// With the deformation gradient F = Σ x_a ⊗ g_a (g_a = ∇N_a), the first Piola–Kirchhoff stress P and the volume V_p
// that a point stands for, node a feels f_a = −Σ V_p P g_a, and moving node b by dx changes P by dP[dx ⊗ g_b].
//
// St. Venant–Kirchhoff: E = ½(FᵀF − I), θ = tr(E), energy density μ‖E‖² + ½ λ θ², so that
//     P = F (2μ E + λ θ I),     dP = dF (2μ E + λ θ I) + 2μ F dE + λ dθ F,     dE = sym(Fᵀ dF), dθ = F : dF.
//
// Corotational linear: F = R U (polar decomposition), θ = tr(U − I), energy density μ‖F − R‖² + ½ λ θ², so that
//     P = 2μ (F − R) + λ θ R,     dP = 2μ dF + (λ θ − 2μ) dR + λ dθ R,     dθ = R : dF,
// where dR = R [ω]× and Y = Rᵀ dF gives [ω]× U + U [ω]× = Y − Yᵀ, that is (tr(U) I − U) ω = axial vector of Y − Yᵀ.
// K is the derivative of the forces exactly, not the usual R K₀ Rᵀ.
//
// In an element the energy ½ λ θ² is that of c times the mean θ̄ = Σ V_p θ_p/V and of 1 − c times the points' own,
// ½ λ (c V θ̄² + (1 − c) Σ V_p θ_p²): above, λ θ is λ (c θ̄ + (1 − c) θ_p), and with B the one of F and R that θ's
// derivative names, s_p,a = V_p B g_a and s = Σ s_p, the last term of dP gives λ (c s sᵀ/V + (1 − c) Σ s_p s_pᵀ/V_p).
// With means alone (c = 1) a layer of elements that bends hides the change of volume in each, and a cantilever one
// element deep is 11 % too soft at ν = 0.3. With none (c = 0) elements lock as λ/μ grows. So the points have their own
// up to the λ/μ at which they do not yet lock.
//
// Damping, for both: a stress F (2μτ Ė + λτ tr(Ė) I) with Ė = sym(Fᵀ Ḟ), which rigid motion does not feel; tr(Ė) is
// shared out likewise. Damping by the mass adds −α m_a v_a.
namespace {

/// Σ x_a ⊗ g_a.
Matrix3d gradient_of(const NodeColumns& x, const NodeColumns& g) {
    Matrix3d result = Matrix3d::Zero();
    for (Eigen::Index a = 0; a < x.cols(); ++a) result += x.col(a) * g.col(a).transpose();
    return result;
}

// The rotation R of F = R U. Newton's method for Xᵀ X = I, X ← ½ (γ X + X⁻ᵀ/γ) with the scale γ² = ‖X⁻¹‖/‖X‖, keeps R
// and converges quadratically, here in four or so iterations (Higham, SIAM J. Sci. Stat. Comput. 7, 1986). Of an
// element that is nearly flat or inverted it is the nearest rotation, by singular values.
Matrix3d rotation_of(const Matrix3d& F) {
    constexpr double nearly_flat = 1e-3, nearly_there = 1e-9;
    constexpr int most_iterations = 12;
    Matrix3d X = F;
    const double size = F.norm();
    if (F.determinant() > nearly_flat * size * size * size) {
        for (int i = 0; i < most_iterations; ++i) {
            Matrix3d Y;
            Y << X.col(1).cross(X.col(2)), X.col(2).cross(X.col(0)), X.col(0).cross(X.col(1));
            Y /= X.col(0).dot(Y.col(0));
            const double gamma = std::sqrt(Y.norm() / X.norm());
            const Matrix3d next = 0.5 * gamma * X + (0.5 / gamma) * Y;
            const double change = (next - X).norm();
            X = next;
            if (change <= nearly_there) return X;
        }
    }
    const Eigen::JacobiSVD<Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix3d W = svd.matrixU();
    if (W.determinant() * svd.matrixV().determinant() < 0.0) W.col(2) *= -1.0;
    return W * svd.matrixV().transpose();
}

}  // namespace

struct ElasticSolid::Point {
    Matrix3d F, rate;
    Matrix3d R = Matrix3d::Identity();
    Matrix3d turning = Matrix3d::Zero();  // (tr(U) I − U)⁻¹
    double theta = 0.0, swell = 0.0;      // θ_p and tr(Ė) of its own, then as they count
};

struct ElasticSolid::Strain {
    std::array<Point, 6> points;  // as many as there are in the shape
    double squares = 0.0;         // c V θ̄² + (1 − c) Σ V_p θ_p²
};

ElasticSolid::ElasticSolid(SolidShape shape, const ElasticMaterial& material, ElementModel model)
    : model_(model),
      lambda_(material.young * material.poisson / ((1.0 + material.poisson) * (1.0 - 2.0 * material.poisson))),
      mu_(0.5 * material.young / (1.0 + material.poisson)),
      density_(material.density),
      damping_(material.damping_time),
      damping_rate_(material.damping_rate),
      own_(lambda_ > shape.own_bulk * mu_ ? shape.own_bulk * mu_ / lambda_ : 1.0),
      shape_(std::move(shape)) {
    for (const auto& point : shape_.points) volume_ += point.volume;
}

ElasticSolid::Strain ElasticSolid::strain(const NodeColumns& x, const NodeColumns& v) const {
    Strain result;
    double theta = 0.0, swell = 0.0;  // the means
    for (std::size_t p = 0; p < shape_.points.size(); ++p) {
        Point& point = result.points[p];
        point.F = gradient_of(x, shape_.points[p].gradient);
        point.rate = gradient_of(v, shape_.points[p].gradient);
        if (model_ == ElementModel::Corotational) {
            point.R = rotation_of(point.F);
            const Matrix3d U = symmetric_part(point.R.transpose() * point.F);
            const Matrix3d sum = U.trace() * Matrix3d::Identity() - U;
            if (std::abs(sum.determinant()) > 1e-12) point.turning = sum.inverse();
            point.theta = U.trace() - 3.0;
        } else {
            point.theta = 0.5 * (point.F.squaredNorm() - 3.0);
        }
        point.swell = point.F.cwiseProduct(point.rate).sum();
        theta += shape_.points[p].volume / volume_ * point.theta;
        swell += shape_.points[p].volume / volume_ * point.swell;
    }
    result.squares = (1.0 - own_) * volume_ * theta * theta;
    for (std::size_t p = 0; p < shape_.points.size(); ++p) {
        Point& point = result.points[p];
        result.squares += own_ * shape_.points[p].volume * point.theta * point.theta;
        point.theta = (1.0 - own_) * theta + own_ * point.theta;
        point.swell = (1.0 - own_) * swell + own_ * point.swell;
    }
    return result;
}

bool ElasticSolid::inverted(const NodeColumns& x) const {
    return std::any_of(shape_.points.begin(), shape_.points.end(),
                       [&](const auto& point) { return gradient_of(x, point.gradient).determinant() <= 0.0; });
}

double ElasticSolid::energy(const NodeColumns& x) const {
    const Strain now = strain(x, NodeColumns::Zero(3, x.cols()));
    double result = 0.5 * lambda_ * now.squares;
    for (std::size_t p = 0; p < shape_.points.size(); ++p) {
        const Point& point = now.points[p];
        const double square = model_ == ElementModel::Corotational
                                  ? (point.F - point.R).squaredNorm()
                                  : 0.25 * (point.F.transpose() * point.F - Matrix3d::Identity()).squaredNorm();
        result += shape_.points[p].volume * mu_ * square;
    }
    return result;
}

void ElasticSolid::force(const NodeColumns& x, const NodeColumns& v, double* result) const {
    const Strain now = strain(x, v);
    Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic>> f(result, 3, x.cols());
    f.setZero();
    for (std::size_t p = 0; p < shape_.points.size(); ++p) {
        const Point& point = now.points[p];
        Matrix3d P;
        if (model_ == ElementModel::Corotational) {
            P = 2.0 * mu_ * (point.F - point.R) + lambda_ * point.theta * point.R;
        } else {
            P = mu_ * point.F * (point.F.transpose() * point.F - Matrix3d::Identity()) +
                lambda_ * point.theta * point.F;
        }
        if (damping_ > 0.0)
            P += damping_ * (2.0 * mu_ * point.F * symmetric_part(point.F.transpose() * point.rate) +
                             lambda_ * point.swell * point.F);
        P *= -shape_.points[p].volume;
        f.noalias() += P * shape_.points[p].gradient;
    }
    if (damping_rate_ > 0.0)
        for (Eigen::Index a = 0; a < x.cols(); ++a)
            f.col(a) -= damping_rate_ * mass(static_cast<std::size_t>(a)) * v.col(a);
}

namespace {

using Square = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// column of K += change, three entries for each node.
void add_column(const NodeColumns& change, Eigen::Index column, Square& K) {
    for (Eigen::Index i = 0; i < change.size(); ++i) K(i, column) += change.data()[i];
}

/// K += factor left rightᵀ.
void add_outer(double factor, const NodeColumns& left, const NodeColumns& right, Square& K) {
    for (Eigen::Index i = 0; i < left.size(); ++i)
        for (Eigen::Index j = 0; j < right.size(); ++j) K(i, j) += factor * left.data()[i] * right.data()[j];
}

}  // namespace

void ElasticSolid::stiffness(const NodeColumns& x, const NodeColumns& v, double* result) const {
    const Strain now = strain(x, v);
    NodeColumns s = NodeColumns::Zero(3, x.cols()), swelling = s, swelling_rate = s, change(3, x.cols());
    Square K(result, x.size(), x.size());
    K.setZero();
    const bool corotational = model_ == ElementModel::Corotational;
    for (std::size_t p = 0; p < shape_.points.size(); ++p) {
        const Point& point = now.points[p];
        const NodeColumns& g = shape_.points[p].gradient;
        const double volume = shape_.points[p].volume;
        const NodeColumns own = volume * (corotational ? point.R : point.F) * g;
        s += own;
        if (own_ > 0.0) add_outer(own_ * lambda_ / volume, own, own, K);
        Matrix3d S = Matrix3d::Zero();
        if (!corotational)
            S = mu_ * (point.F.transpose() * point.F - Matrix3d::Identity()) +
                lambda_ * point.theta * Matrix3d::Identity();
        if (damping_ > 0.0) {
            S += damping_ * (2.0 * mu_ * symmetric_part(point.F.transpose() * point.rate) +
                             lambda_ * point.swell * Matrix3d::Identity());
            const NodeColumns swells = volume * point.F * g, swells_faster = volume * point.rate * g;
            swelling += swells;
            swelling_rate += swells_faster;
            if (own_ > 0.0) add_outer(damping_ * own_ * lambda_ / volume, swells, swells_faster, K);
        }
        for (Eigen::Index b = 0; b < x.cols(); ++b)
            for (int j = 0; j < 3; ++j) {
                const Matrix3d dF = Vector3d::Unit(j) * g.col(b).transpose();
                Matrix3d dP = dF * S;
                if (corotational) {
                    const Matrix3d Y = point.R.transpose() * dF;
                    const Vector3d axial(Y(2, 1) - Y(1, 2), Y(0, 2) - Y(2, 0), Y(1, 0) - Y(0, 1));
                    dP += 2.0 * mu_ * dF +
                          (lambda_ * point.theta - 2.0 * mu_) * point.R * skew(Vector3d(point.turning * axial));
                } else {
                    dP += 2.0 * mu_ * point.F * symmetric_part(point.F.transpose() * dF);
                }
                if (damping_ > 0.0) dP += 2.0 * mu_ * damping_ * point.F * symmetric_part(dF.transpose() * point.rate);
                dP *= volume;
                change.noalias() = dP * g;
                add_column(change, 3 * b + j, K);
            }
    }
    add_outer((1.0 - own_) * lambda_ / volume_, s, s, K);
    if (damping_ > 0.0) add_outer(damping_ * (1.0 - own_) * lambda_ / volume_, swelling, swelling_rate, K);
}

void ElasticSolid::damping(const NodeColumns& x, double* result) const {
    Square R(result, x.size(), x.size());
    R.setZero();
    for (Eigen::Index i = 0; i < x.size(); ++i) R(i, i) = damping_rate_ * mass(static_cast<std::size_t>(i / 3));
    if (damping_ == 0.0) return;
    NodeColumns swelling = NodeColumns::Zero(3, x.cols()), change(3, x.cols());
    for (const auto& [volume, g] : shape_.points) {
        const Matrix3d F = x * g.transpose();
        const NodeColumns swells = volume * F * g;
        swelling += swells;
        if (own_ > 0.0) add_outer(damping_ * own_ * lambda_ / volume, swells, swells, R);
        for (Eigen::Index b = 0; b < x.cols(); ++b)
            for (int j = 0; j < 3; ++j) {
                const Matrix3d dF = Vector3d::Unit(j) * g.col(b).transpose();
                const Matrix3d dP = 2.0 * mu_ * damping_ * volume * F * symmetric_part(F.transpose() * dF);
                change.noalias() = dP * g;
                add_column(change, 3 * b + j, R);
            }
    }
    add_outer(damping_ * (1.0 - own_) * lambda_ / volume_, swelling, swelling, R);
}

}  // namespace delassus::mechanics
