// SPDX-License-Identifier: BSD-3-Clause
// Scalar functions of the configuration from which joints, motors, springs and bushings are made.
//
// A *feature* is a vector of the world frame that is affine in the poses: an axis fixed in a body, the span between two
// points of bodies, a constant. It is a sum of at most two parts s (l x + A c̄), with the pose (x, A) of a body, l = 1
// for a point and 0 for an axis, and s = ±1.
//
// A *row* is C = f(u · w) − offset − drive(t) of two features u and w, with f(c) = scale · c, or √c for a length; or it
// has the angle of a joint in place of f (angle.hpp). The derivatives of f follow from those of the features by the
// product rule. Along increments (δx in the world frame, θ in the body frame), with δA = A [θ]× :
//
//     part:       J_x = s l I,   J_θ = −s A [c̄]×
//     velocity:   s (l v + A (ω × c̄))
//     curvature:  s A (ω × (ω × c̄))            (second derivative in time at v̇ = 0), and
//                 s (l v̇ + A (ω̇ × c̄)) more of a body whose motion is prescribed
//     stiffness:  ∂(J_θᵀ y)/∂θ = ∂(s c̄ × Aᵀ y)/∂θ = s [c̄]× [Aᵀ y]×   (for fixed y)
//
//     c = u · w:  ∇c = J_uᵀ w + J_wᵀ u,   c̈ = ü · w + 2 u̇ · ẇ + u · ẅ,
//                 ∇²c = ∂(J_uᵀ w)/∂q + ∂(J_wᵀ u)/∂q + J_uᵀ J_w + J_wᵀ J_u
//     C = f(c):   ∇C = f' ∇c,   C̈ = f' c̈ + f'' ċ²,   ∇²C = f' ∇²c + f'' ∇c ∇cᵀ
//
// ∇²C is the derivative of ∇C along increments. It is not symmetric where ∇C is not zero on a rotation.
#pragma once

#include <array>
#include <optional>

#include "delassus/multibody.hpp"
#include "mechanics/angle.hpp"
#include "mechanics/placement.hpp"
#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

struct Part {
    BodyIndex body = world_body;
    double sign = 1.0;
    bool point = false;               ///< l
    Vector3d arm = Vector3d::Zero();  ///< c̄
};

struct Feature {
    std::array<Part, 2> parts;
    int count = 0;

    static Feature axis(BodyIndex body, const Vector3d& direction) {
        Feature feature;
        feature.parts[0] = {body, 1.0, false, direction};
        feature.count = 1;
        return feature;
    }
    /// p_second − p_first, the points in the frames of their bodies.
    static Feature span(BodyIndex first, const Vector3d& first_point, BodyIndex second, const Vector3d& second_point) {
        Feature feature;
        feature.parts[0] = {second, 1.0, true, second_point};
        feature.parts[1] = {first, -1.0, true, first_point};
        feature.count = 2;
        return feature;
    }
};

/// The bodies of a row that move, and dense numbers for their columns: gradient and Hessian are over these.
struct RowColumns {
    static constexpr int most = 4;
    std::array<std::int32_t, most> column{};
    std::array<BodyIndex, most> body{};
    int bodies = 0;

    /// Adds a body, once.
    void add(BodyIndex index, std::int32_t its_column) {
        if (place(its_column) >= 0) return;
        body[static_cast<std::size_t>(bodies)] = index;
        column[static_cast<std::size_t>(bodies++)] = its_column;
    }

    [[nodiscard]] int place(std::int32_t wanted) const {
        for (int k = 0; k < bodies; ++k)
            if (column[static_cast<std::size_t>(k)] == wanted) return 6 * k;
        return -1;
    }
};

using RowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6 * RowColumns::most, 1>;
using RowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 6 * RowColumns::most, 6 * RowColumns::most>;

struct Row {
    Feature u, w;
    std::optional<Angle> angle = std::nullopt;  ///< in place of f(c); derivatives are those where its joint holds
    double scale = 1.0;
    bool length = false;  ///< f(c) = √c, then u = w
    double offset = 0.0;
    const Motion* drive = nullptr;

    /// Of the bodies that move freely; with_prescribed: also of those whose motion is prescribed, by negative numbers.
    [[nodiscard]] RowColumns columns(const Placements& at, bool with_prescribed = false) const;
    /// C.
    [[nodiscard]] double value(const Placements& at, double t) const;
    /// ∇C over columns().
    void gradient(const Placements& at, const RowColumns& columns, RowVector& result) const;
    /// ∂C/∂t at fixed q.
    [[nodiscard]] double rate(const Placements& at, double t) const;
    /// C̈ at v̇ = 0.
    [[nodiscard]] double curvature(const Placements& at, double t) const;
    /// λ f' w: the force that λ is along u. Of features alone.
    [[nodiscard]] Vector3d force(const Placements& at, double lambda) const;
    /// ∇²C over columns(): entry (i, j) is the derivative of ∇C_i along increment j.
    void hessian(const Placements& at, const RowColumns& columns, RowMatrix& result) const;
};

/// H += factor · g gᵀ, over columns. Columns of prescribed bodies are left out.
void add_row_product(const RowColumns& columns, const RowVector& g, double factor, MatrixAssembler& H);
/// H += factor · matrix, over columns; its symmetric part if asked. Columns of prescribed bodies are left out.
void add_local(const RowColumns& columns, const RowMatrix& matrix, double factor, Tangent tangent, MatrixAssembler& H);

}  // namespace delassus::mechanics
