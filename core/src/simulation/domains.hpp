// SPDX-License-Identifier: BSD-3-Clause
// Which process steps which body of a system, and which bodies of others it has beside them (docs/partitioned.md,
// "Simulating").
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/scene.hpp"

namespace delassus {

/// A ball around what a body may touch before the ghosts are looked for again.
struct Reach {
    Vector3 centre{};
    double radius = 0.0;  ///< m; negative: it touches nothing
};

class DELASSUS_API Domains {
public:
    /// Of a finished system without nodes. The system must outlive this.
    explicit Domains(const SceneSystem& system);

    /// The bodies that move, ascending; what follows counts among these.
    [[nodiscard]] const std::vector<BodyIndex>& moving() const { return moving_; }
    /// The radius about its mass centre within which a body has its shapes, m; −1 without shapes.
    [[nodiscard]] const std::vector<double>& radii() const { return radii_; }
    /// Whether a body is many times larger than most: its contacts with others are theirs.
    [[nodiscard]] const std::vector<bool>& large() const { return large_; }

    /// The process of each moving body, by recursive bisection of their centres into parts of about equal weight.
    /// Bodies that joints, springs and bushings link stay together, unless they weigh more than half of a process's
    /// share. weights: > 0. The same for equal arguments, to the bit.
    [[nodiscard]] std::vector<std::int32_t> owners(std::span<const Vector3> centres, std::span<const double> weights,
                                                   int processes) const;

    /// For a process, whether it needs each moving body: its own, those that may touch its own where the contact falls
    /// to it, those that are linked to its own.
    [[nodiscard]] std::vector<bool> needed(std::span<const std::int32_t> owners, std::span<const Reach> reach,
                                           std::int32_t process) const;

    /// Of two bodies that touch or are linked, the one with the lesser number has the rows on its process.
    [[nodiscard]] std::int64_t decides(std::size_t body) const {
        return static_cast<std::int64_t>(body) + (large_[body] ? static_cast<std::int64_t>(moving_.size()) : 0);
    }

private:
    std::vector<BodyIndex> moving_;
    std::vector<double> radii_;
    std::vector<bool> large_;
    std::vector<std::pair<std::int32_t, std::int32_t>> links_;  ///< of moving bodies
    std::vector<std::int32_t> cluster_;                         ///< of each moving body, by its first one
};

}  // namespace delassus
