// SPDX-License-Identifier: BSD-3-Clause
// What models have that bodies cannot have, mended, and each mend noted as a loss.
//
// The second moments S = ½ tr(J) 1 − J of a mass are positive semidefinite, and J = tr(S) 1 − S. Where those of a model
// are not (its moments of inertia break A + B ≥ C), the nearest S that is has 0 in place of what is negative.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "delassus/error.hpp"
#include "model_import/model.hpp"

namespace delassus::model_import {

namespace {

/// kg m²: of a ball of water of this mass.
double inertia_of_water(double mass) {
    const double radius = std::cbrt(3.0 * mass / (4.0 * std::numbers::pi * 1000.0));
    return 0.4 * mass * radius * radius;
}

/// Of that, where an inertia is 0 but for the rounding of who wrote the model. A point mass may have more.
constexpr double least_share_of_water = 1e-10;

bool has_extent(const ModelShape& shape) {
    switch (shape.form) {
        case Form::Sphere:
            return shape.size.x() > 0.0;
        case Form::Box:
            return (shape.size.array() > 0.0).all();
        case Form::Capsule:
        case Form::Cylinder:
            return shape.size.x() > 0.0 && shape.size.y() > 0.0;
        default:
            return true;
    }
}

}  // namespace

void drop_flat_shapes(Model& model) {
    for (ModelBody& body : model.bodies) {
        for (ModelShape& shape : body.shapes)  // a capsule without a straight part is a ball
            if (shape.form == Form::Capsule && shape.size.x() > 0.0 && shape.size.y() == 0.0) shape.form = Form::Sphere;
        std::erase_if(body.shapes, [&](const ModelShape& shape) {
            const bool finite = shape.size.allFinite() && shape.position.allFinite();
            if (finite && has_extent(shape)) return false;
            model.lose(fmt::format("shape \"{}\"", shape.name.empty() ? body.name : shape.name),
                       "a size of it is not positive: left out");
            return true;
        });
    }
}

void repair_inertias(Model& model) {
    for (ModelBody& body : model.bodies) {
        if (body.fixed || !(body.mass > 0.0)) continue;
        const std::string what = fmt::format("body \"{}\"", body.name);
        if (!body.inertia.allFinite()) throw InputError(fmt::format("the inertia of {} is not finite", what));
        const Matrix3d J = 0.5 * (body.inertia + body.inertia.transpose());
        const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(0.5 * J.trace() * Matrix3d::Identity() - J);
        const Vector3d moments = solver.eigenvalues();
        const double size = J.norm();
        if (moments.minCoeff() < -1e-10 * size) {  // a scene takes what rounding does to a flat body
            const Matrix3d S =
                solver.eigenvectors() * moments.cwiseMax(0.0).asDiagonal() * solver.eigenvectors().transpose();
            body.inertia = S.trace() * Matrix3d::Identity() - S;
            model.lose(what, fmt::format("no body has its inertia (A + B < C): balanced, by {:.2g} %",
                                         100.0 * (body.inertia - J).norm() / size));
        }
        const Eigen::SelfAdjointEigenSolver<Matrix3d> whole(body.inertia);
        if (whole.eigenvalues().minCoeff() > least_share_of_water * inertia_of_water(body.mass)) continue;
        const double bound = std::max(inertia_of_water(body.mass), 1e-6 * whole.eigenvalues().maxCoeff());
        body.inertia = body.inertia + bound * Matrix3d::Identity();
        model.lose(what,
                   fmt::format("an inertia of zero about an axis: {:.3g} kg m² more, that of a ball of water", bound));
    }
}

}  // namespace delassus::model_import
