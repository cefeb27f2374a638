// SPDX-License-Identifier: BSD-3-Clause
#include "scene/mass_properties.hpp"

#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <vector>

#include "delassus/error.hpp"

namespace delassus::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A homogeneous solid of density one: V = ∫dV, c = ∫x dV / V in its own frame, ∫(x − c)(x − c)ᵀ dV. About c, so that
/// digits are not lost to a distance from the origin.
struct Moments {
    double volume = 0.0;
    Vector3d centre = Vector3d::Zero();
    Matrix3d second = Matrix3d::Zero();
};

Moments centred(double volume, double xx, double yy, double zz) {
    Moments moments;
    moments.volume = volume;
    moments.second.diagonal() << volume * xx, volume * yy, volume * zz;
    return moments;
}

// A capsule is a cylinder of half length l and two half balls of radius r, whose centroids lie 3r/8 beyond its ends:
//     ∫z² of a half ball about the capsule's middle = V_h (r²/5 + 2 l · 3r/8 + l²)
Moments capsule(double r, double l) {
    const double cylinder = 2.0 * std::numbers::pi * r * r * l, ball = 4.0 / 3.0 * std::numbers::pi * r * r * r;
    Moments moments;
    moments.volume = cylinder + ball;
    const double across = cylinder * r * r / 4.0 + ball * r * r / 5.0;
    moments.second.diagonal() << across, across, cylinder * l * l / 3.0 + ball * (r * r / 5.0 + 0.75 * l * r + l * l);
    return moments;
}

// A closed surface is a sum of tetrahedra with any point, here its first, of signed volume V = a·(b×c)/6:
//     ∫x dV = V s/4,   ∫x xᵀ dV = V (s sᵀ + aaᵀ + bbᵀ + ccᵀ)/20,   s = a + b + c
Moments closed_surface(const Mesh& mesh) {
    Moments moments;
    if (mesh.vertices.empty()) return moments;
    const Vector3d origin(mesh.vertices.front().data());
    Vector3d first = Vector3d::Zero();
    for (const auto& triangle : mesh.triangles) {
        std::array<Vector3d, 3> corner;
        for (std::size_t i = 0; i < 3; ++i)
            corner[i] = Vector3d(mesh.vertices[static_cast<std::size_t>(triangle[i])].data()) - origin;
        const double volume = corner[0].dot(corner[1].cross(corner[2])) / 6.0;
        const Vector3d sum = corner[0] + corner[1] + corner[2];
        moments.volume += volume;
        first += volume / 4.0 * sum;
        Matrix3d second = sum * sum.transpose();
        for (const auto& point : corner) second += point * point.transpose();
        moments.second += volume / 20.0 * second;
    }
    if (!(moments.volume > 0.0)) return moments;
    const Vector3d centre = first / moments.volume;
    moments.centre = origin + centre;
    moments.second -= moments.volume * centre * centre.transpose();
    return moments;
}

Moments moments_of(const Shape& shape) {
    const auto& [a, b, c] = shape.size;
    constexpr double pi = std::numbers::pi;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return centred(4.0 / 3.0 * pi * a * a * a, a * a / 5.0, a * a / 5.0, a * a / 5.0);
        case ShapeKind::Box:
            return centred(8.0 * a * b * c, a * a / 3.0, b * b / 3.0, c * c / 3.0);
        case ShapeKind::Capsule:
            return capsule(a, b);
        case ShapeKind::Cylinder:
            return centred(2.0 * pi * a * a * b, a * a / 4.0, a * a / 4.0, b * b / 3.0);
        case ShapeKind::Convex:
            return closed_surface(*shape.mesh);
        case ShapeKind::Plane:
            break;
        case ShapeKind::Terrain:
        case ShapeKind::HeightField:
            throw InputError("terrain has no volume, so mass and inertia cannot follow from it");
    }
    throw InputError("a plane has no volume, so mass and inertia cannot follow from it");
}

}  // namespace

MassProperties mass_properties(std::span<const Shape> shapes) {
    std::vector<Moments> all;  // in the frame of the body
    Moments total;
    for (const auto& shape : shapes) {
        Moments own = moments_of(shape);
        if (!(own.volume > 0.0)) throw InputError("a shape without volume: mass and inertia cannot follow from it");
        const auto& [w, x, y, z] = shape.pose.orientation;
        const Matrix3d A = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
        own.centre = Vector3d(shape.pose.position.data()) + A * own.centre;
        own.second = (A * own.second * A.transpose()).eval();
        total.volume += own.volume;
        total.centre += own.volume * own.centre;
        all.push_back(own);
    }
    total.centre /= total.volume;
    for (const Moments& own : all) {
        const Vector3d way = own.centre - total.centre;
        total.second += own.second + own.volume * way * way.transpose();
    }
    // J = tr(S) 1 − S with S = ∫(x − c)(x − c)ᵀ dV.
    const Matrix3d J = total.second.trace() * Matrix3d::Identity() - total.second;
    const Vector3d& centre = total.centre;
    return {total.volume, {centre[0], centre[1], centre[2]}, {J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)}};
}

}  // namespace delassus::scene
