// SPDX-License-Identifier: BSD-3-Clause
// A system whose bodies several processes share in a run (docs/partitioned.md, "Simulating").
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/registry.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/shared_steps.hpp"
#include "dynamics/step_memory.hpp"
#include "simulation/domains.hpp"
#include "simulation/part_of_system.hpp"

namespace delassus {

/// Every process knows where all bodies are. Contacts, matrices, reactions and what the method remembers it has of its
/// own bodies alone. Members marked collective are called by all processes in the same order, with the same states.
class SharedRun {
public:
    /// What of a system cannot be shared; empty if all can.
    static std::string obstacle(const SceneSystem& system);

    /// system and registry outlive this; solver takes the scene's configuration from there and is told of this.
    /// Collective.
    SharedRun(SceneSystem& system, SteppingMethod method, std::shared_ptr<const Communicator> communicator,
              const Registry& registry, StepSolver& solver);
    ~SharedRun();

    /// Before a step of size h: shares the bodies out anew where ghosts may be too few by its end, or where the
    /// processes have too unequal work. Then timestepper ← one for the bodies of this process and its ghosts, with the
    /// memory of before. Collective.
    void prepare(const State& whole, double h, std::unique_ptr<Timestepper>& timestepper);
    /// A step, after prepare(). report: as of the whole system, but for contacts and reactions, which are those of this
    /// process. Collective.
    void step(State& whole, double h, Timestepper& timestepper, StepSolver& solver, StepReport& report);

    /// The memory of the method for the whole system, the same on all processes. Collective.
    [[nodiscard]] StepMemory memory(const Timestepper& timestepper) const;
    /// What the next prepare() begins with.
    void set_memory(StepMemory memory);
    /// Forgets what the method remembers; the next prepare() begins anew.
    void restart();

    /// Brings the contacts and reactions of all processes to process 0. Collective.
    void collect_contacts(StepReport& report) const;
    /// Of all processes, in the last step, m; ≥ 0.
    [[nodiscard]] double penetration() const { return penetration_; }
    [[nodiscard]] int processes() const { return communicator_->size(); }

    /// Of all processes, by rank. Collective.
    [[nodiscard]] std::vector<Simulation::Share> shares() const;
    /// How often bodies were shared out.
    [[nodiscard]] std::int64_t divisions() const { return divisions_; }

private:
    void share_out(const State& whole, double h, std::unique_ptr<Timestepper>& timestepper);
    [[nodiscard]] bool ghosts_suffice(const State& whole, double h) const;
    /// How far the rim of a body moves within h at most by its speed and its weight, m.
    [[nodiscard]] double way_of(std::size_t body, const State& whole, double h) const;
    [[nodiscard]] Vector3 centre_of(std::size_t body, const State& whole) const;
    [[nodiscard]] State local_state(const State& whole) const;
    /// Puts the own bodies of all processes into the whole state.
    void exchange_states(const State& local, State& whole) const;
    /// Places in q of angles of joints (MultibodySystem::angle_position()), and the processes that compute them.
    [[nodiscard]] std::vector<std::pair<std::size_t, std::int32_t>> angles_of_owners() const;
    void complete(StepReport& report, double h);

    SceneSystem& system_;
    SteppingMethod method_;
    std::shared_ptr<const Communicator> communicator_;
    SharedSteps steps_;
    Domains domains_;
    std::vector<std::int32_t> owners_;  ///< of each moving body
    std::vector<Vector3> centres_;      ///< when ghosts were looked for
    std::vector<double> allowance_;     ///< how far each moving body may go since then, m
    std::vector<double> weights_;       ///< of each moving body
    PartOfSystem part_;
    std::vector<std::int32_t> local_;  ///< moving bodies of the part, by number among all moving ones
    StepMemory begin_;                 ///< for the next share_out(), where there is no method yet
    bool has_begin_ = false, unbalanced_ = false;
    std::int64_t steps_since_ = 0, divisions_ = 0;
    double penetration_ = 0.0;
};

}  // namespace delassus
