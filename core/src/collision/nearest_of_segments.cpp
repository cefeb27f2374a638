// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "collision/separation.hpp"

namespace delassus::collision {

// The squared distance is a convex quadratic of (s, t) on the unit square. Its minimum is at the lines' nearest points,
// if those lie inside, or on the border, where t is clamped and s solved anew.
void nearest_of_segments(const Vector3d& p, const Vector3d& u, const Vector3d& q, const Vector3d& v, Vector3d& on_p,
                         Vector3d& on_q) {
    const Vector3d w = p - q;
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
    const double determinant = uu * vv - uv * uv;
    double s = determinant > 1e-14 * uu * vv ? std::clamp((uv * vw - vv * uw) / determinant, 0.0, 1.0) : 0.0;
    double t = vv > 0.0 ? (uv * s + vw) / vv : 0.0;
    if (t < 0.0 || t > 1.0 || vv == 0.0) {
        t = std::clamp(t, 0.0, 1.0);
        s = uu > 0.0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0.0;
    }
    on_p = p + s * u;
    on_q = q + t * v;
}

}  // namespace delassus::collision
