// SPDX-License-Identifier: BSD-3-Clause
// Bodies that joints connect, taken as one piece: its assembly, and the rows that others imply.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <memory>
#include <vector>

#include "delassus/multibody.hpp"
#include "mechanics/model.hpp"

namespace delassus::mechanics {

/// Moving bodies that joints connect with each other, over any number of joints, and all rows of these joints. Rows are
/// numbered within the linkage here; numbers() gives their numbers in the whole system.
class Linkage {
public:
    /// The linkages of a system. bodies and joints outlive them.
    static std::vector<Linkage> of(const std::vector<Body>& bodies, const std::vector<Joint>& joints,
                                   const Placements& at);

    [[nodiscard]] const std::vector<std::int32_t>& numbers() const { return numbers_; }
    /// Whether rows can repeat each other: a tree of joints has independent ones.
    [[nodiscard]] bool has_loops() const { return has_loops_; }
    /// Diameter of the joints and mass centres at t = 0, at least that of a body's inertia, m.
    [[nodiscard]] double size() const { return size_; }
    /// The joint, motor or start of a row: joint "hinge".
    [[nodiscard]] std::string owner_of(std::size_t row) const;
    /// The owners of those rows, which are independent, on which another one depends; motors alone if there are any:
    /// motor "first", motor "second".
    [[nodiscard]] std::string owners_of_implying(const State& state, std::size_t row,
                                                 const std::vector<std::size_t>& rows) const;

    /// These rows, which are independent, are chosen before all others. is_certain(number in the whole system).
    template <class Predicate>
    void take_as_certain(Predicate&& is_certain) {
        certain_.clear();
        for (std::size_t i = 0; i < numbers_.size(); ++i)
            if (is_certain(numbers_[i])) certain_.push_back(i);
    }

    [[nodiscard]] bool is_certain(std::size_t row) const {
        return std::binary_search(certain_.begin(), certain_.end(), row);
    }

    /// The largest of a body: m and rad, or m/s and rad/s.
    struct Largest {
        double linear = 0.0, angular = 0.0;
        void include(const Vector3d& line, const Vector3d& turn);
    };
    [[nodiscard]] Largest displacement(const State& from, const State& to) const;
    /// of_given: of velocities alone that are not 0 in `from`.
    [[nodiscard]] Largest velocity_change(const State& from, const State& to, bool of_given = false) const;
    [[nodiscard]] Largest speed(const State& state) const;

    /// Of the worst of some rows: |C|/size or |C| of an angle; or |Ċ|/size in 1/s, and as a share of the largest sum of
    /// |terms| of a row's Ċ.
    struct Residual {
        double value = 0.0;
        std::size_t row = 0;
        double share = 0.0;
    };
    [[nodiscard]] Residual residual(const State& state, const std::vector<std::size_t>& rows) const;
    [[nodiscard]] Residual rate_residual(const State& state, const std::vector<std::size_t>& rows) const;
    /// Whether a residual is rounding. A speed is where it moves nothing in a second.
    [[nodiscard]] bool is_rounding(const Residual& position) const;
    [[nodiscard]] static bool is_rounding_of_rates(const Residual& rate);

    /// Rows, which are no rows of the system, by which joints are where their `start` says, or as fast as their
    /// `start_rate`.
    [[nodiscard]] const std::vector<std::size_t>& starts() const { return starts_; }
    [[nodiscard]] const std::vector<std::size_t>& start_rates() const { return start_rates_; }
    [[nodiscard]] bool has_starts() const { return !(starts_.empty() && start_rates_.empty()); }
    /// In how many parts joints go to their starts, so that loops stay nearly closed on the way; 1 without loops.
    [[nodiscard]] int parts_of_starts() const;
    /// From now on starts() lead to this share of the starts.
    void set_share_of_starts(double share) { share_ = share; }

    /// If rows or starts() are far from holding, state ← positions at which all of them nearly do, so that it can be
    /// seen which ones imply others.
    void approach(State& state) const;
    /// state ← the nearest positions, in the mass metric, at which these rows hold. The residual that is left.
    Residual assemble_positions(State& state, const std::vector<std::size_t>& rows) const;
    /// state ← the nearest velocities, in the mass metric, at which the rates of these rows vanish. zeros_follow:
    /// those of mass centres and of turning that are 0 change before the others.
    Residual assemble_velocities(State& state, const std::vector<std::size_t>& rows, bool zeros_follow) const;
    /// state ← such velocities for the joints, without motors and starts, as far as there are any.
    void fit_velocities(State& state) const;

    /// Independent rows that imply the others, ascending, at a state at which the scleronomic rows hold. All rows if
    /// those of the linkage are independent in general, or too many to tell.
    [[nodiscard]] std::vector<std::size_t> independent_rows(const State& state) const;
    /// Whether other rows are by far better to keep at this state, and which.
    [[nodiscard]] bool better_rows(const State& state, std::vector<std::size_t>& kept) const;
    /// Independent rows at this state alone, to the relative threshold.
    [[nodiscard]] std::vector<std::size_t> rows_by_rank(const State& state, double threshold) const;

private:
    static constexpr std::size_t most_dense_rows = 500;

    /// A row of a joint; `row` is null for that of a gear.
    struct RowOfJoint {
        const Joint* joint;
        const Row* row;
        const std::string* motor;  // null for a row of the joint itself
        bool driven;               // depends on time, or leads to a start
        bool length;               // in m, else rad
        const JointCoordinate* start = nullptr;
    };
    enum class Metric { Mass, Length };
    struct Values;
    struct Rank;

    Linkage(const std::vector<Body>& bodies, const std::vector<Joint>& joints, std::vector<BodyIndex> members,
            const std::vector<std::int32_t>& own_joints, std::shared_ptr<Placements> at);
    void place(const State& state) const;
    /// C, C_t and C_q of rows.
    void evaluate(const State& state, const std::vector<std::size_t>& rows, Values& values) const;
    [[nodiscard]] double unit_of(std::size_t row) const { return rows_[row].length ? size_ : 1.0; }
    /// C_q over the unit lengths of the metric.
    [[nodiscard]] Eigen::SparseMatrix<double, Eigen::RowMajor> scaled(const Values& values, Metric metric) const;
    [[nodiscard]] Eigen::VectorXd unscaled(const Eigen::VectorXd& change, Metric metric) const;
    /// The shortest change in the metric with C_q change = −value; directions below the threshold are left alone.
    /// marks: 1 of entries that may change, else 0; then C_q change comes as near to −value as they let it.
    [[nodiscard]] Eigen::VectorXd shortest(const Values& values, const Eigen::VectorXd& value, Metric metric,
                                           double threshold, const Eigen::VectorXd* marks = nullptr) const;
    void increment(State& state, const Eigen::VectorXd& change) const;
    /// Gauss–Newton iterations, at most so many.
    Residual settle(State& state, const std::vector<std::size_t>& rows, Metric metric, double threshold,
                    int iterations) const;
    [[nodiscard]] Rank rank_at(const State& state, const std::vector<std::size_t>& rows, double threshold,
                               bool motions = false) const;
    /// state ← moved along a free motion by a finite amount. False if there is none that leads away.
    bool move(State& state, std::uint32_t seed) const;

    const std::vector<Body>* bodies_;
    std::vector<BodyIndex> members_, prescribed_;
    std::vector<RowOfJoint> rows_;
    std::vector<std::int32_t> numbers_;
    std::vector<std::size_t> all_, scleronomic_, certain_, starts_, start_rates_;
    double share_ = 1.0;  // of the starts
    bool has_loops_ = false;
    std::vector<double> arms_;         // of members: the farthest joint from the mass centre, or the radius of inertia
    double size_ = 0.0, reach_ = 0.0;  // reach: largest coordinate
    std::shared_ptr<Placements> at_;   // of all linkages; columns: within each. Work space of the call that runs
};

}  // namespace delassus::mechanics
