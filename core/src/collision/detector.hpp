// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "collision/broad_phase.hpp"
#include "collision/flush_neighbours.hpp"
#include "collision/swept_pair.hpp"

namespace delassus::collision {

class Detector : public CollisionDetector {
public:
    explicit Detector(CollisionSetup setup);
    void detect(std::span<const Pose> poses, double envelope, std::vector<ContactPoint>& contacts,
                const sdk::Team& team, std::span<const BodyDisplacement> displacements) override;
    void detect_pair(std::int32_t shape_a, std::int32_t shape_b, const Pose& pose_a, const Pose& pose_b,
                     double envelope, std::vector<ContactPoint>& contacts) override;

private:
    void place(std::span<const Pose> poses);
    /// A shape on a body in this pose.
    void place(std::int32_t shape, const Pose& pose, const Matrix3d& rotation, Placed& placed) const;
    /// sweeps_ ← of the shapes.
    void sweep(std::span<const Pose> poses, std::span<const BodyDisplacement> displacements);
    void collide_pairs(double envelope, std::vector<ContactPoint>& contacts, const sdk::Team& team);
    /// Of each thread its own.
    struct Worker {
        NarrowPhase still;
        SweptPair swept;
        std::vector<const Placed*> of_a, of_b;  ///< neighbours of the pair's shapes
    };
    /// Appends the contacts of two shapes so placed, which move so.
    void collide_pair(std::int32_t shape_a, std::int32_t shape_b, Placed& a, Placed& b, const Sweep& of_a,
                      const Sweep& of_b, double envelope, Worker& by, std::vector<ContactPoint>& contacts);
    /// Appends the contacts of pairs_[first] to pairs_[last − 1].
    void collide_pairs(std::size_t first, std::size_t last, double envelope, Worker& by,
                       std::vector<ContactPoint>& contacts);
    [[nodiscard]] bool may_touch(std::int32_t shape_a, std::int32_t shape_b) const;
    [[nodiscard]] bool is_fixed(std::int32_t body) const;
    /// The envelope of a shape, or of a pair, m.
    [[nodiscard]] double near_of(std::int32_t shape, double envelope) const {
        return setup_.near.empty() ? envelope : std::min(envelope, setup_.near[static_cast<std::size_t>(shape)]);
    }
    [[nodiscard]] double near_of(std::int32_t a, std::int32_t b, double envelope) const {
        return std::min(near_of(a, envelope), near_of(b, envelope));
    }
    /// Whether two shapes of one solid may be flush, and whether that changes while they move past each other.
    [[nodiscard]] bool may_be_flush(std::int32_t shape_a, std::int32_t shape_b) const;
    [[nodiscard]] bool pass_flush(std::int32_t shape_a, std::int32_t shape_b) const;
    /// neighbours_ and has_neighbours_ from the places of all shapes.
    void find_neighbours();
    /// Those of a shape that another one may touch.
    void collect_neighbours(std::int32_t shape, std::int32_t other, std::vector<const Placed*>& neighbours) const;
    /// Leaves out those of a pair's contacts from `first` on that neighbours cover.
    void leave_out_covered(std::int32_t a, std::int32_t b, const Placed& placed_a, const Placed& placed_b,
                           std::size_t first, Worker& by, std::vector<ContactPoint>& contacts) const;

    CollisionSetup setup_;
    std::vector<Solid> solids_;
    std::vector<Matrix3d> local_rotations_;
    std::vector<Placed> placed_;
    Placed one_, other_;  ///< the shapes of detect_pair()
    std::vector<Sweep> sweeps_;
    std::vector<Matrix3d> body_rotations_;
    std::vector<std::int32_t> bounded_;     ///< shapes that are neither planes nor terrains
    std::vector<std::int32_t> in_bounded_;  ///< of shapes: their place in bounded_, or −1
    std::vector<std::int32_t> planes_, terrains_;
    std::vector<BroadPhase::Box> boxes_;  ///< of bounded_
    struct Ball {
        Vector3d center;
        double radius;
    };
    std::vector<Ball> balls_;  ///< about bounded_: each holds its shape
    double slack_ = 0.0;       ///< a tenth of the mean reach, m
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs_, with_ground_, merged_;
    std::vector<std::int32_t> solid_;  ///< of shapes
    bool given_moves_ = false;         ///< a body that is of the world's solid but not fixed
    /// Shapes and neighbours, both ways round, ascending: those that stay flush, and those of this detection.
    std::vector<BroadPhase::Pair> neighbours_, passing_;
    std::vector<char> has_neighbours_;  ///< of shapes: whether they may have any; empty before the first detection
    BroadPhase broad_phase_;
    std::vector<Worker> workers_;
    std::vector<std::vector<ContactPoint>> found_;  ///< by runs of pairs
};

}  // namespace delassus::collision
