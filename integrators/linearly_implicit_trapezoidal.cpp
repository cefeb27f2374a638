// SPDX-License-Identifier: BSD-3-Clause
// The linearly implicit trapezoidal method for differential variational inequalities: contacts, joints and friction
// with order 2 between impacts, one problem a step.
#include "dynamics/theta_method.hpp"

namespace delassus {
namespace {

// After Potra, Anitescu, Gavrea and Trinkle (IJNME 66, 2006), the reference of the seed's eq. 170. The trapezoidal rule
// is linearised once, with constraints, contacts and friction on the level of velocities, and a step is one
// complementarity problem:
//
//     (M + ½ h R + ¼ h² K) (v⁺ − v) = h f − ½ h² K v + C_qᵀ P_C + D_Aᵀ P_A,      q⁺ = q ∘ exp(½ h (v + v⁺))
//
// f and −K, −R being the forces at (q, v) and their derivatives. A linear model has one answer for the trapezoidal and
// the midpoint rule, so it is the balance of dynamics/theta_method.cpp with θ = ½. Here it differs from the paper:
//
// - The paper's order rests on exact derivatives. A problem with cones is symmetric: gyroscopic and follower forces and
//   the turns of mass matrices would have order 1. So the model is built about an extrapolated middle of the step,
//   f(q̃_θ, ṽ_θ) with ṽ⁺ − v⁺ = O(h²). What the symmetric H lacks then leaves O(h³) in a step, and the order is 2.
//   Linear forces are the same about any point, so stiff ones are as stable as the trapezoidal rule: A-stable, no
//   damping.
// - D is that of the middle and of the end, not of the beginning; what a row leaves of a gap or a constraint is
//   corrected by the row of the next step (theta_method.cpp, velocity_contacts.cpp). Nothing drifts.
// - Impacts follow Newton's law, as those of the other methods here, not Poisson's with its second problem.
// - Friction is Coulomb's in its round cone, with De Saxcé's term of the guess, not a pyramid.
//
// As in the paper, a step with a collision needs more than one problem: where a contact lands so that bodies overlap at
// the end of the step, positions are projected (one problem without friction); where one bounces with friction, De
// Saxcé's term is iterated, unless the solver knows Coulomb's law.
const RegisterTimestepper linearly_implicit_trapezoidal_row{
    {.name = "linearly_implicit_trapezoidal",
     .description =
         "linearised trapezoidal rule for contacts and constraints: order 2 between impacts, one problem a step",
     .options = {recovery_speed_option(), restitution_speed_option(), linearization_option()},
     .constraints = true,
     .unilateral = true,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         auto contacts = velocity_contact_settings(system, values[0], values[1]);
         contacts.once = true;
         return std::make_unique<ThetaMethod>(system, ThetaSettings{.name = "linearly_implicit_trapezoidal",
                                                                    .linearly_implicit = true,
                                                                    .contacts = contacts,
                                                                    .linearization_limit = values[2].real});
     }}};

}  // namespace
}  // namespace delassus
