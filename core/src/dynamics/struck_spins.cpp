// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/struck_spins.hpp"

#include <cstddef>

namespace delassus {

// Euler's equations have products of ω alone, so that t ω(t s) is a free motion in s if ω is: Φ_{c h}(ω) = Φ_h(c ω)/c,
// with the same turn. One call has all bodies, each with its own c = τ/h.
void StruckSpins::find(const DynamicalSystem& system, const State& begin, double h, double theta,
                       std::span<const FreeSpin> spins, std::span<const VelocityContacts::OnVelocity> impacts,
                       std::span<const double> result) {
    struck_.clear();
    for (std::size_t k = 0; k < spins.size(); ++k) {
        const VelocityContacts::OnVelocity& impact = impacts[static_cast<std::size_t>(spins[k].column)];
        if (!spins[k].alone || !impact.alone) continue;
        if (struck_.empty()) state_ = begin;
        Spin& spin = struck_.emplace_back();
        spin.number = k;
        spin.column = spins[k].column;
        spin.part = 1.0 - theta - impact.late / impact.share;
        for (std::size_t i = 0; i < 3; ++i) state_.v[static_cast<std::size_t>(spin.column) + i] *= spin.part;
    }
    if (struck_.empty()) return;
    system.free_spins(state_, h, moved_);
    for (Spin& spin : struck_) {
        const FreeSpin& until = moved_[spin.number];
        spin.until = until.turn;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t column = static_cast<std::size_t>(spin.column) + i;
            spin.speed[i] = spin.part > 0.0 ? until.speed[i] / spin.part : begin.v[column];
            spin.speed[i] += result[column] - spins[spin.number].speed[i];
            state_.v[column] = (1.0 - spin.part) * spin.speed[i];
        }
    }
    system.free_spins(state_, h, moved_);
    for (Spin& spin : struck_) {
        spin.after = moved_[spin.number].turn;
        if (!(spin.part < 1.0)) continue;
        for (std::size_t i = 0; i < 3; ++i) spin.speed[i] = moved_[spin.number].speed[i] / (1.0 - spin.part);
    }
}

}  // namespace delassus
