// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/cable.hpp"

#include <cmath>

namespace delassus::mechanics {

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
