// SPDX-License-Identifier: BSD-3-Clause
// Positions moved back onto constraints and gaps, for timesteppers on the level of velocities (internal).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/row_ways.hpp"

namespace delassus {

class VelocityContacts;

/// Moves positions at the end of a step onto the constraints: C = 0, and no gap below what the step may leave.
class DELASSUS_API PositionProjection {
public:
    /// system outlives it.
    explicit PositionProjection(DynamicalSystem& system);

    /// Moves end.q by the least motion in the norm of H, of a step of size h; problem: that of the step, of velocities;
    /// left: as of RowWays; contacts: of this step. Adds what contacts gave by it to report.energy.recovered. Throws
    /// StepFailure if the motion is not finite or does not bring the constraints nearer to 0.
    void project(const State& begin, State& end, double h, const Problem& problem, std::span<const double> left,
                 const VelocityContacts& contacts, StepSolver& solver, StepReport& report, std::string_view method);
    /// What the last project() moved by, n: the step had erred by as much. Empty if it moved nothing, or if the step
    /// began with a penetration.
    [[nodiscard]] std::span<const double> moved() const {
        return moved_ ? std::span<const double>(delta_) : std::span<const double>();
    }
    /// Changes end.v by the least, in the norm of H, to where the constraints stay: C_q v + C_t = 0.
    void project_velocities(State& end, const SparseMatrix& H, StepSolver& solver, StepReport& report);

private:
    /// By how much constraints are off, and by how much the gaps lack that had no row in the problem so far.
    struct Lack {
        double constraints = 0.0, gaps = 0.0;
    };
    [[nodiscard]] Lack measure(const State& end, double h, const VelocityContacts& contacts);
    void assemble(const State& end, double h, const Lack& lack, const VelocityContacts& contacts);
    void make_compliant();
    void solve(StepSolver& solver, StepReport& report);
    void move(const State& begin, State& end, double h, StepSolver& solver, StepReport& report,
              std::string_view method);
    void require_nearer(const State& begin, const State& end, double h, double off, std::string_view method);

    DynamicalSystem& system_;
    std::vector<std::int32_t> blocks_;
    std::int32_t n_, m_;
    double resolution_;
    UnilateralRows rows_;
    std::vector<std::uint64_t> keys_;  // of the blocks that had rows in the problem, ascending
    MatrixAssembler D_;
    Problem problem_;
    Solution solution_;
    std::vector<double> constraint_, delta_, force_, diagonal_;
    RowWays ways_;
    bool moved_ = false;
};

}  // namespace delassus
