// SPDX-License-Identifier: BSD-3-Clause
// The row of a servo with a limit in a step (internal).
//
// A row with a compliance c is the law of a force τ = (−rate − u)/c between bounds, u being a speed (UnilateralRows).
// The force of a step is the one at a share ϑ of it, so the row is that of a step of size ϑ h from its beginning, with
// the speed u_ϑ = D̄ ((1 − ϑ) v + ϑ v⁺). With P = h τ,
//
//     D̄ v⁺ + ((1 − ϑ) D̄ v + rate)/ϑ + c/(ϑ h) P = 0
//
// A damper d slows its row down as exp(−z), z = h d D̄ diag(H)⁻¹ D̄ᵀ, if (exponential fitting; Liniger and Willoughby,
// SIAM J. Numer. Anal. 7, 1970)
//
//     ϑ = 1/(1 − exp(−z)) − 1/z = ½ + z/12 − …
//
// With ϑ = ½ a stiff one would turn the speed round in each step. The gain g = 1/c = d + ϑ h k and g · rate are known
// for ϑ = θ and ϑ = 1, which says d, k and what is wanted at other times.
//
// After an impact at τ it has the rest r = h − τ of the step: its force is that in the middle of it, of the speed D̄ v⁺
// and the way τ u⁻ + ½ r D̄ v⁺.
#pragma once

namespace delassus {

class LimitedServo {
public:
    /// Of a row for steps of a size, m/s or rad/s, and that over N or N m.
    struct Row {
        double rate, compliance;
    };
    /// at_theta, at_end: for steps of θ h and h from the beginning; mobility: D diag(H)⁻¹ Dᵀ.
    LimitedServo(const Row& at_theta, const Row& at_end, double theta, double h, double mobility);

    /// Its entry of E. struck: when an impact changes its speed, s after the beginning; not before h: none does.
    [[nodiscard]] double compliance(double struck) const;
    /// Its b. speed: of the row at the beginning.
    [[nodiscard]] double rate(double struck, double speed) const;

private:
    [[nodiscard]] double gain(double way) const { return damping_ + way * stiffness_; }
    /// g · rate at a share of the step.
    [[nodiscard]] double pull(double share) const;

    double theta_, h_;
    double stiffness_, damping_;  // k, d
    double pull_at_theta_, pull_at_end_;
    double share_;  // ϑ
};

}  // namespace delassus
