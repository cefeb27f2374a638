// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "collision/broad_phase.hpp"
#include "collision/swept_pair.hpp"

namespace delassus::collision {

class Detector : public CollisionDetector {
public:
    explicit Detector(CollisionSetup setup);
    void detect(std::span<const Pose> poses, double envelope, std::vector<ContactPoint>& contacts,
                const sdk::Team& team, std::span<const BodyDisplacement> displacements) override;

private:
    void place(std::span<const Pose> poses);
    /// sweeps_ ← of the shapes.
    void sweep(std::span<const Pose> poses, std::span<const BodyDisplacement> displacements);
    void collide_pairs(double envelope, std::vector<ContactPoint>& contacts, const sdk::Team& team);
    /// Of each thread its own.
    struct Worker {
        NarrowPhase still;
        SweptPair swept;
    };
    /// Appends the contacts of pairs_[first] to pairs_[last − 1].
    void collide_pairs(std::size_t first, std::size_t last, double envelope, Worker& by,
                       std::vector<ContactPoint>& contacts);
    [[nodiscard]] bool may_touch(std::int32_t shape_a, std::int32_t shape_b) const;
    [[nodiscard]] bool is_fixed(std::int32_t body) const;

    CollisionSetup setup_;
    std::vector<Solid> solids_;
    std::vector<Matrix3d> local_rotations_;
    std::vector<Placed> placed_;
    std::vector<Sweep> sweeps_;
    std::vector<Matrix3d> body_rotations_;
    std::vector<std::int32_t> bounded_;  ///< shapes that are neither planes nor terrains
    std::vector<std::int32_t> planes_, terrains_;
    std::vector<BroadPhase::Box> boxes_;  ///< of bounded_
    struct Ball {
        Vector3d center;
        double radius;
    };
    std::vector<Ball> balls_;  ///< about bounded_: each holds its shape
    double slack_ = 0.0;       ///< a tenth of the mean reach, m
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs_, with_ground_, merged_;
    BroadPhase broad_phase_;
    std::vector<Worker> workers_;
    std::vector<std::vector<ContactPoint>> found_;  ///< by runs of pairs
};

}  // namespace delassus::collision
