// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/beam_frame.hpp"

#include <cmath>

namespace delassus::mechanics {

// Below s = 0.05 by the series of x/sin x and tan x/(4x); both converge to s = 39.
BeamFactors beam_factors(double s) {
    if (s < 0.05) {
        constexpr double w1 = 1.0 / 24.0, w2 = 7.0 / 5760.0, w3 = 31.0 / 967680.0, w4 = 127.0 / 154828800.0;
        constexpr double z0 = 0.25, z1 = 1.0 / 192.0, z2 = 1.0 / 7680.0, z3 = 17.0 / 5160960.0, z4 = 62.0 / 743178240.0;
        return {1.0 + s * (w1 + s * (w2 + s * (w3 + s * w4))), -(w1 + s * (w2 + s * (w3 + s * w4))),
                z0 + s * (z1 + s * (z2 + s * (z3 + s * z4))),  w1 + s * (2.0 * w2 + s * (3.0 * w3 + s * 4.0 * w4)),
                -(w2 + s * (2.0 * w3 + s * 3.0 * w4)),         z1 + s * (2.0 * z2 + s * (3.0 * z3 + s * 4.0 * z4))};
    }
    const double angle = std::sqrt(s), x = 0.5 * angle, quarter = 0.25 * angle;
    const double sine = std::sin(x), tangent = std::tan(quarter);
    BeamFactors f{};
    f.w = x / sine;
    f.w_s = (sine - x * std::cos(x)) / (8.0 * x * sine * sine);
    f.y = (1.0 - f.w) / s;
    f.y_s = -(f.w_s + f.y) / s;
    f.z = tangent / angle;
    f.z_s = (quarter * (1.0 + tangent * tangent) - tangent) / (2.0 * s * angle);
    return f;
}

BeamFrame::BeamFrame(const Matrix3d& first, const Matrix3d& second)
    : phi(logarithm(Quaterniond(Matrix3d(first.transpose() * second)))),
      R(first * exponential(0.5 * phi).toRotationMatrix()),
      f(beam_factors(phi.squaredNorm())),
      W(f.w * Matrix3d::Identity() + f.y * phi * phi.transpose()),
      Z(-0.5 * f.z * skew(phi)) {}

}  // namespace delassus::mechanics
