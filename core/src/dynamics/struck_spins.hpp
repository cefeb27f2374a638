// SPDX-License-Identifier: BSD-3-Clause
// Bodies that spin by themselves but for impacts within a step (internal).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

/// Of a body that nothing acts on but weight and an impact at τ: it spins as it did until then, and from then on by
/// itself again, Φ being its free motion and δ what the impact changes ω by:
///
///     ω⁺ = Φ_{h−τ}(Φ_τ(ω) + δ)
///
/// A step that adds δ to Φ_h(ω) has the gyroscopic torque of the wrong ω after τ, which is O(h) off.
class StruckSpins {
public:
    struct Spin {
        std::size_t number;           ///< in the spins of the step
        std::int32_t column;          ///< the first of ω
        double part;                  ///< τ/h
        std::array<double, 3> until;  ///< what it turns by until τ
        std::array<double, 3> after;  ///< and from then on
        std::array<double, 3> speed;  ///< ω⁺
    };

    /// spins: of the step of size h from `begin`; impacts: of each velocity, with θ; result: the velocities at the end,
    /// n, in which δ = result − Φ_h(ω). What is found stays until the next call.
    void find(const DynamicalSystem& system, const State& begin, double h, double theta,
              std::span<const FreeSpin> spins, std::span<const VelocityContacts::OnVelocity> impacts,
              std::span<const double> result);
    [[nodiscard]] std::span<const Spin> spins() const { return struck_; }

private:
    std::vector<Spin> struck_;
    State state_;
    std::vector<FreeSpin> moved_;
};

}  // namespace delassus
