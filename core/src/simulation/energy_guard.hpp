// SPDX-License-Identifier: BSD-3-Clause
// Energy that nothing supplies: the sign of a step that is too long for its method (internal).
#pragma once

#include <cmath>

#include "delassus/scene.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

struct SimulationTotals;

// Joints and contacts take energy or leave it. So E = K + V never exceeds E₀ in truth, but for what loads, motors and
// given motions supply, S. Where a method does not account for that, nobody knows, and nothing is watched. Kinetic
// energy comes from the start, from the potential or from outside, so that
//
//     A = K₀ + max_k (V₀ − V_k)⁺ + W + Σ |S_i|
//
// is the most that there can have been up to now, W being what contacts gave by pushing apart what penetrated, and S_i
// what each row and the forces supply in each step. Methods err: a growth by some percent of A is an inaccuracy, one by
// A itself means that the motion is not that of the system. The guard compares E − S − E₀ − W with limit · max(A,
// floor), where floor = ½ ‖2 h g‖²_M + ‖1e-10 q/h‖²_M + 1e-10 |E₀|: a step cannot tell a motion below a free fall over
// two steps from rest (a stiff part that starts off its equilibrium overshoots by about that), nor one by the last
// digits of the positions, and energies of far bodies are rounded.
class EnergyGuard {
public:
    /// system outlives it.
    explicit EnergyGuard(const SceneSystem& system);

    /// Whether energy is known, and what is supplied.
    [[nodiscard]] static bool watches(const SimulationTotals& totals);

    /// What the method took, J: beside what is supplied, what contacts take, and `damped`; or, where these are not
    /// accounted for and nothing takes any, what the energy fell by. 0 where it is not known.
    [[nodiscard]] double loss(const SimulationTotals& totals) const;

    /// Ends a sentence about a growth.
    [[nodiscard]] static const char* though(const SimulationTotals& totals);

    /// G at an energy E − S after a step that recovered so much more than is in the totals, J. again: it counts
    /// for the step before, too.
    [[nodiscard]] DELASSUS_API static double growth(const SimulationTotals& totals, double energy, double recovered,
                                                    bool again = false);

    /// max(A, floor), where it is not known what is supplied with the least that this can be; longest_step: of the
    /// run, s.
    [[nodiscard]] double scale(const SimulationTotals& totals, double longest_step) const;

private:
    bool has_contacts_, has_damping_;  // or stops, or dry friction
    double fall_;                      // ½ ‖2 g‖²_M, of a step of 1 s
    double digits_;                    // ‖1e-10 q‖²_M with the largest coordinate in each place, of a step of 1 s
};

// Below that a growth is an error all the same. Joints and contacts take energy or leave it, so that E never rises:
//
//     G = max(E − E₀, (E − W) − min(E − W)),      with E − S − D in the place of E
//
// (D: by how much S may be off). The one counts what bodies get that a step lets sink in and the next ones lift. The
// other sees a rise that friction hides, and not what they lift. What overlaps at the start gives energy, which is no
// growth, as long as the deepest overlap shrinks. What of G does not come back adds up over a run. All of it may come
// to B = accuracy · max(A, floor) until the time T at which the scene ends (by itself: a run that is ended before and
// goes on later takes the same steps). Half of B is free, for what comes and goes; of the rest a step may take the
// share of the time that is left:
//
//     G⁺ ≤ max(B/2, G + (B − G) h/(T − t)),      G: the largest growth up to now
//
// with T in place of T − t beyond T. A step that takes more is too long and goes in parts, each halving of which lowers
// what it takes by 2ᵖ for a method of order p. Where a halving leaves more than 0.7 of it, as where an impact gives
// energy, parts do not help and the step counts as it is, and so do all once B is used up, and where anything supplies
// energy, as S is known to O(h²) only.
class EnergyWatch {
public:
    /// A step that takes more than its share.
    class Gain : public StepTooLong {
    public:
        using StepTooLong::StepTooLong;
    };

    /// All outlive it. accuracy: a share, > 0.
    EnergyWatch(const EnergyGuard& guard, const SceneSystem& system, double accuracy)
        : guard_(guard), system_(system), accuracy_(accuracy) {}

    /// Before a step of size h from t; the totals stay there until its end.
    void begin(const SimulationTotals& totals, double t, double h);
    /// Before it is taken, as one or in parts. again: with the step before.
    void begin_trial(bool again) {
        recovered_ = 0.0;
        again_ = again;
    }
    /// After each part: energy that contacts gave by pushing apart what penetrated, J.
    void note_recovered(double energy) { recovered_ += energy; }
    /// After the last, of size h: throws Gain if the step takes more than its share, and shorter parts may take less.
    void require_within(double energy, double h);
    /// Parts cannot be taken: whatever this step takes is allowed.
    void give_up() { allowed_ = HUGE_VAL; }

private:
    const EnergyGuard& guard_;
    const SceneSystem& system_;
    double accuracy_;
    const SimulationTotals* totals_ = nullptr;
    double h_ = 0.0, before_ = 0.0, allowed_ = 0.0, recovered_ = 0.0;
    double last_taken_ = 0.0;  // by the trial before, of this step
    bool again_ = false;
};

}  // namespace delassus
