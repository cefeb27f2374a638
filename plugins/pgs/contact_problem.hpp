// SPDX-License-Identifier: BSD-3-Clause
// The exact solution of a one-contact problem: N λ + q = u with a 3 × 3 (or 2 × 2) N and one friction cone.
//
// Notation: normal n first, tangents t; r = λ_n. With l = λ_t, both laws have three kinds of solution:
//   opening   λ = 0;
//   sticking  u = 0, λ = −N⁻¹q inside the cone;
//   sliding   ‖l‖ = μ r with u_t = −κ l for a κ ≥ 0, and u_n = 0 (exact Coulomb) or u_n = μ²κ r (associated, where
//             u = τ (μ, −l/‖l‖) lies on the border of the dual cone and κ = τ/(μ r)).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::pgs {

/// The eigenvalues of a symmetric 2 × 2 matrix and the rotation to its eigenvectors (c, s) and (−s, c).
struct Eigen2 {
    double value[2] = {0.0, 0.0};
    double c = 1.0, s = 0.0;

    /// Of [a b; b d], taken as positive semidefinite: eigenvalues below zero are rounding and become zero.
    static Eigen2 of(double a, double b, double d) {
        // One Jacobi rotation: t = tan of the angle, the smaller root of t² + 2θt − 1 = 0 with θ = (d − a)/(2b).
        Eigen2 result;
        double t = 0.0;
        if (b != 0.0) {
            const double theta = (d - a) / (2.0 * b);
            t = (theta >= 0.0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
        }
        result.c = 1.0 / std::sqrt(1.0 + t * t);
        result.s = -t * result.c;
        result.value[0] = std::max(0.0, a - t * b);
        result.value[1] = std::max(0.0, d + t * b);
        return result;
    }
    void to(const double* in, double* out) const {
        const double x = in[0], y = in[1];
        out[0] = c * x + s * y;
        out[1] = c * y - s * x;
    }
    void from(const double* in, double* out) const {
        const double x = in[0], y = in[1];
        out[0] = c * x - s * y;
        out[1] = c * y + s * x;
    }
};

/// The data of N that the solution of one contact needs, prepared once for all q and μ.
///
/// The matrix that is kept is N + δ I with δ = 2e-14 tr N: a singular N (a contact that moves in fewer directions than
/// it has rows) has neither a unique nor always a finite answer, and its Schur complement is rounding. A sweep takes
/// its q with the kept matrix, q = u − (N + δ I) λ, so there the shift is a proximal term ½δ‖λ_new − λ‖² that slows the
/// step by parts in 5e13 and leaves solutions where they are. Taken alone, the answer is off by a natural error of at
/// most 6e-14 (1 + μ) of ‖λ‖.
struct ContactMatrix {
    static constexpr double shift = 2e-14;
    int rows = 3;
    double nn = 0.0;
    double nt[2] = {0.0, 0.0};
    double tt[3] = {0.0, 0.0, 0.0};        ///< N_tt: (1,1), (1,2), (2,2); in the plane the first alone
    Eigen2 schur;                          ///< of S = N_tt − N_tn N_nt / N_nn
    Eigen2 tangent;                        ///< of N_tt
    double nt_schur[2] = {0.0, 0.0};       ///< N_tn in the eigenvectors of S
    double nt_tangent[2] = {0.0, 0.0};     ///< N_tn in the eigenvectors of N_tt
    double inverse_nn = 0.0;               ///< 1/N_nn, 0 if that is not positive
    double inverse_schur[2] = {0.0, 0.0};  ///< reciprocals of the eigenvalues of S, 0 where S is singular

    ContactMatrix() = default;
    /// N: rows × rows, symmetric positive semidefinite; rows 2 or 3.
    ContactMatrix(int row_count, const double* N) : rows(row_count), nn(N[0]) {
        nt[0] = N[1];
        tt[0] = N[rows + 1];
        if (rows == 3) {
            nt[1] = N[2];
            tt[1] = N[5];
            tt[2] = N[8];
        }
        const double trace = nn + tt[0] + tt[2];
        nn += shift * trace;
        tt[0] += shift * trace;
        if (rows == 3) tt[2] += shift * trace;
        inverse_nn = nn > std::numeric_limits<double>::epsilon() * trace ? 1.0 / nn : 0.0;
        if (rows == 2) {
            schur.value[0] = std::max(0.0, tt[0] - nt[0] * nt[0] * inverse_nn);
            tangent.value[0] = tt[0];
        } else {
            schur = Eigen2::of(tt[0] - nt[0] * nt[0] * inverse_nn, tt[1] - nt[0] * nt[1] * inverse_nn,
                               tt[2] - nt[1] * nt[1] * inverse_nn);
            tangent = Eigen2::of(tt[0], tt[1], tt[2]);
        }
        schur.to(nt, nt_schur);
        tangent.to(nt, nt_tangent);
        for (int i = 0; i < 2; ++i)
            inverse_schur[i] =
                schur.value[i] > std::numeric_limits<double>::epsilon() * trace ? 1.0 / schur.value[i] : 0.0;
    }
};

namespace detail {

/// The sticking solution, if it exists and lies in the cone. p: q_t − N_tn q_n/N_nn in the eigenvectors of S.
///
/// Elimination of r: S l = −p and r = −(q_n + N_nt l)/N_nn.
inline bool stick(const ContactMatrix& N, double mu, const double* q, const double* p, double* lambda) {
    if (N.inverse_nn == 0.0) return false;
    double l[2];
    const int tangents = N.rows - 1;
    for (int i = 0; i < tangents; ++i) {
        if (N.inverse_schur[i] == 0.0 && p[i] != 0.0) return false;
        l[i] = -p[i] * N.inverse_schur[i];
    }
    if (tangents == 1) l[1] = 0.0;
    const double r = -(q[0] + N.nt_schur[0] * l[0] + N.nt_schur[1] * l[1]) * N.inverse_nn;
    if (!(r >= 0.0) || l[0] * l[0] + l[1] * l[1] > mu * mu * r * r) return false;
    lambda[0] = r;
    if (tangents == 1) {
        lambda[1] = l[0];
    } else {
        N.schur.from(l, lambda + 1);
    }
    return true;
}

/// p of stick().
inline void reduced_velocity(const ContactMatrix& N, const double* q, double* p) {
    const double ratio = q[0] * N.inverse_nn;
    const double reduced[2] = {q[1] - N.nt[0] * ratio, N.rows == 3 ? q[2] - N.nt[1] * ratio : 0.0};
    N.schur.to(reduced, p);
}

/// Sliding in the plane under the Coulomb law. l = −p/(S + κ) keeps the sign σ of −p, so |l| = μ r and
/// N_nn r + N_nt σ μ r + q_n = 0. The divisor is positive wherever sticking failed and q_n < 0: as a function of |l|
/// between 0 and |p|/S, |l| − μ r(|l|) is linear, negative at the left and positive at the right.
inline void slide_plane_coulomb(const ContactMatrix& N, double mu, const double* q, double p, double* lambda) {
    const double sign = p > 0.0 ? -1.0 : 1.0;
    const double divisor = N.nn + mu * sign * N.nt[0];
    const double r = divisor > 0.0 ? -q[0] / divisor : 0.0;
    lambda[0] = r;
    lambda[1] = sign * mu * r;
}

/// Sliding in the plane under the associated law: the better of the two border rays g = (1, ±μ), along which the
/// minimum of ½ r² gᵀNg + r qᵀg is at r = −qᵀg/gᵀNg.
inline void slide_plane_associated(const ContactMatrix& N, double mu, const double* q, double* lambda) {
    double best = 0.0;
    lambda[0] = lambda[1] = 0.0;
    for (const double slope : {mu, -mu}) {
        const double linear = q[0] + slope * q[1];
        const double quadratic = N.nn + 2.0 * slope * N.nt[0] + slope * slope * N.tt[0];
        if (linear >= 0.0 || quadratic <= 0.0) continue;
        const double decrease = linear * linear / quadratic;
        if (decrease <= best) continue;
        best = decrease;
        lambda[0] = -linear / quadratic;
        lambda[1] = slope * lambda[0];
    }
}

/// Root of an increasing function by Newton's method inside a bracket that shrinks at every evaluation.
/// function(x, slope) returns the value and sets the slope; its value at low is < 0 and at high ≥ 0. The last
/// evaluation need not be at the returned point. At most 200 evaluations; about five where Newton's method works.
template <class Function>
double bracketed_newton(double x, double low, double high, double scale, Function&& function) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    if (!(x > low && x < high)) x = 0.5 * (low + high);
    double last_step = high - low;
    for (int iteration = 0; iteration < 200; ++iteration) {
        double slope = 0.0;
        const double value = function(x, slope);
        if (std::abs(value) <= 8.0 * epsilon * scale) break;
        (value < 0.0 ? low : high) = x;
        if (high - low <= 4.0 * epsilon * std::abs(high)) break;
        double next = x - value / slope;
        // A Newton step must stay inside and be at most half of the one before last; else halve, over orders of
        // magnitude where the bracket spans them.
        if (!(next > low && next < high) || (iteration > 8 && std::abs(next - x) > 0.5 * last_step))
            next = low > 0.0 && high > 4.0 * low ? std::sqrt(low * high) : 0.5 * (low + high);
        last_step = std::abs(next - x);
        x = next;
        if (last_step <= 8.0 * epsilon * std::abs(x)) break;
    }
    return x;
}

/// Sliding in space under the Coulomb law. With u_n = 0 eliminated, (S + κ) l = −p and r(κ) = −(q_n + N_nt l)/N_nn;
/// the root of ‖l(κ)‖ = μ r(κ). It exists: at κ = 0 sticking has failed, so the left side is the greater, and
/// as κ → ∞, l → 0 and r → −q_n/N_nn > 0; from κ = ‖p‖ (N_nn + μ‖N_nt‖) / (−μ q_n) on the right side is the greater.
/// Newton's method on 1/(μ r) − 1/‖l‖, which is nearly linear in κ, as for trust regions.
inline void slide_coulomb(const ContactMatrix& N, double mu, const double* q, const double* p, double& kappa,
                          double* lambda) {
    const double p_norm = std::sqrt(p[0] * p[0] + p[1] * p[1]);
    const double* w = N.nt_schur;
    const double w_norm = std::sqrt(w[0] * w[0] + w[1] * w[1]);
    const double high = 1.0000001 * p_norm * (N.nn + mu * w_norm) / (-mu * q[0]);
    double l[2] = {0.0, 0.0}, r = 0.0, length = 0.0;
    const auto value = [&](double k, double& slope) {
        const double d0 = 1.0 / (N.schur.value[0] + k), d1 = 1.0 / (N.schur.value[1] + k);
        l[0] = -p[0] * d0;
        l[1] = -p[1] * d1;
        r = -(q[0] + w[0] * l[0] + w[1] * l[1]) * N.inverse_nn;
        length = std::sqrt(l[0] * l[0] + l[1] * l[1]);
        if (r <= 0.0) {
            slope = 0.0;
            return -1.0;
        }
        // l' = −l/(S + κ), ‖l‖' = l·l'/‖l‖, r' = −N_nt l'/N_nn; the value is relative: ‖l‖ (1/‖l‖ − 1/(μ r)).
        const double length_slope = -(l[0] * l[0] * d0 + l[1] * l[1] * d1) / length;
        const double r_slope = (w[0] * l[0] * d0 + w[1] * l[1] * d1) * N.inverse_nn;
        const double ratio = length / (mu * r);
        slope = -length_slope / length + ratio * r_slope / r;
        return 1.0 - ratio;
    };
    // The first guess takes r ≈ −q_n/N_nn and S ≈ its mean.
    double start = kappa;
    if (!(start > 0.0 && start < high))
        start = p_norm * N.nn / (-mu * q[0]) - 0.5 * (N.schur.value[0] + N.schur.value[1]);
    kappa = bracketed_newton(start, 0.0, high, 1.0, value);
    double slope = 0.0;
    value(kappa, slope);
    r = std::max(0.0, r);
    const double factor = length > 0.0 ? mu * r / length : 0.0;
    const double scaled[2] = {l[0] * factor, l[1] * factor};
    lambda[0] = r;
    N.schur.from(scaled, lambda + 1);
}

/// min over ‖l‖ ≤ radius of ½ lᵀN_tt l + cᵀl in the eigenvectors of N_tt: (N_tt + κ) l = −c, κ ≥ 0, κ (‖l‖ − radius) =
/// 0. kappa holds a guess on entry.
inline void disc(const Eigen2& tangent, double radius, const double* c, double& kappa, double* l) {
    const double c_norm = std::sqrt(c[0] * c[0] + c[1] * c[1]);
    const double smallest = std::min(tangent.value[0], tangent.value[1]);
    const double largest = std::max(tangent.value[0], tangent.value[1]);
    double length = 0.0;
    const auto at = [&](double k) {
        for (int i = 0; i < 2; ++i) l[i] = c[i] == 0.0 ? 0.0 : -c[i] / (tangent.value[i] + k);
        length = std::sqrt(l[0] * l[0] + l[1] * l[1]);
    };
    at(0.0);
    if (length <= radius) {
        kappa = 0.0;
        return;
    }
    // ‖c‖/(largest + κ) ≤ ‖l‖ ≤ ‖c‖/(smallest + κ) brackets κ.
    const double low = std::max(0.0, c_norm / radius - largest);
    const double high = c_norm / radius - smallest;
    kappa = bracketed_newton(kappa, low * (1.0 - 1e-12), high * (1.0 + 1e-12), 1.0, [&](double k, double& slope) {
        at(k);
        slope = (l[0] * l[0] / (tangent.value[0] + k) + l[1] * l[1] / (tangent.value[1] + k)) * radius /
                (length * length * length);
        return radius / length - 1.0;
    });
    at(kappa);
    const double factor = radius / length;
    l[0] *= factor;
    l[1] *= factor;
}

/// Sliding in space under the associated law: λ minimises ½ λᵀNλ + qᵀλ over the cone. For a given r, l is the minimiser
/// over the disc of radius μ r; what is left, φ(r), is convex because it is a partial minimum of a convex function over
/// a convex set, and φ'(r) = N_nn r + N_nt l + q_n − μ²κ r. Its root by Newton's method, with φ'' from the derivative
/// of (N_tt + κ) l = −(q_t + N_tn r), ‖l‖ = μ r: with A = (N_tt + κ)⁻¹,
///     dκ/dr = −(μ² r + lᵀA N_tn)/(lᵀA l),   dl/dr = −A (l dκ/dr + N_tn).
inline void slide_associated(const ContactMatrix& N, double mu, const double* q, double& kappa, double* lambda) {
    const double* w = N.nt_tangent;
    double qt[2], l[2] = {0.0, 0.0};
    N.tangent.to(q + 1, qt);
    const double q_norm = std::sqrt(qt[0] * qt[0] + qt[1] * qt[1]);
    const double scale = std::abs(q[0]) + mu * q_norm;
    const auto derivative = [&](double r, double& slope) {
        const double c[2] = {qt[0] + w[0] * r, qt[1] + w[1] * r};
        disc(N.tangent, mu * r, c, kappa, l);
        double a[2];
        for (int i = 0; i < 2; ++i) {
            const double e = N.tangent.value[i] + kappa;
            a[i] = e > 0.0 ? 1.0 / e : 0.0;
        }
        double kappa_slope = 0.0;
        if (kappa > 0.0)
            kappa_slope =
                -(mu * mu * r + l[0] * a[0] * w[0] + l[1] * a[1] * w[1]) / (l[0] * l[0] * a[0] + l[1] * l[1] * a[1]);
        slope = N.nn - mu * mu * (kappa + r * kappa_slope);
        for (int i = 0; i < 2; ++i) slope -= w[i] * a[i] * (l[i] * kappa_slope + w[i]);
        return N.nn * r + w[0] * l[0] + w[1] * l[1] + q[0] - mu * mu * kappa * r;
    };
    // φ'(0) = q_n − μ‖q_t‖ < 0 as λ = 0 is no solution; φ'' > 0 far out unless N is singular along the cone.
    const double guess = lambda[0];
    double low = 0.0, slope = 0.0;
    double high = guess > 0.0 ? guess : scale / std::max(N.nn + mu * mu * (N.tt[0] + N.tt[2]), 1e-300);
    double start = -1.0;
    for (int doublings = 0; doublings < 200; ++doublings) {
        const double value = derivative(high, slope);
        const double newton = slope > 0.0 ? high - value / slope : -1.0;
        start = newton;
        if (value >= 0.0) break;
        low = high;
        high = std::max(2.0 * high, std::min(1.5 * newton, 64.0 * high));
    }
    const double r = bracketed_newton(start, low, high, scale, derivative);
    derivative(r, slope);
    lambda[0] = r;
    N.tangent.from(l, lambda + 1);
}

}  // namespace detail

/// Exact Coulomb law: λ in the cone ⊥ N λ + q + (μ‖u_t‖, 0, 0) in the dual cone. Writes λ (rows). kappa: a guess of the
/// sliding multiplier on entry (0 = none), the multiplier on return. An opening velocity q_n ≥ 0 always gives λ = 0.
inline void solve_coulomb(const ContactMatrix& N, double mu, const double* q, double& kappa, double* lambda) {
    if (q[0] >= 0.0 || N.inverse_nn == 0.0) {
        std::fill_n(lambda, N.rows, 0.0);
        return;
    }
    if (mu == 0.0) {
        std::fill_n(lambda, N.rows, 0.0);
        lambda[0] = -q[0] * N.inverse_nn;
        return;
    }
    double p[2];
    detail::reduced_velocity(N, q, p);
    if (detail::stick(N, mu, q, p, lambda)) return;
    if (N.rows == 2) {
        detail::slide_plane_coulomb(N, mu, q, p[0], lambda);
    } else {
        detail::slide_coulomb(N, mu, q, p, kappa, lambda);
    }
}

/// Associated law: min ½ λᵀNλ + qᵀλ over the cone. λ holds a guess on entry (its normal part alone is used) and the
/// solution on return; kappa as above.
inline void solve_associated(const ContactMatrix& N, double mu, const double* q, double& kappa, double* lambda) {
    const double q_tangent = N.rows == 3 ? std::sqrt(q[1] * q[1] + q[2] * q[2]) : std::abs(q[1]);
    if (q[0] >= mu * q_tangent) {
        std::fill_n(lambda, N.rows, 0.0);
        return;
    }
    if (mu == 0.0) {
        std::fill_n(lambda, N.rows, 0.0);
        lambda[0] = -q[0] * N.inverse_nn;
        return;
    }
    const double guess = lambda[0];
    double p[2];
    detail::reduced_velocity(N, q, p);
    if (detail::stick(N, mu, q, p, lambda)) return;
    lambda[0] = guess;
    if (N.rows == 2) {
        detail::slide_plane_associated(N, mu, q, lambda);
    } else {
        detail::slide_associated(N, mu, q, kappa, lambda);
    }
}

}  // namespace delassus::pgs
