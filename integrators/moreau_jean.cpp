// SPDX-License-Identifier: BSD-3-Clause
// Moreau and Jean's θ-method: contacts, impacts and constraints on the level of velocities. Order 2 for θ = ½.
#include <cmath>

#include "dynamics/theta_method.hpp"

namespace delassus {
namespace {

// The balance of dynamics/theta_method.cpp. θ = ½ is the implicit midpoint rule, which keeps the energy of linear
// systems; θ = 1 damps like implicit Euler. It is solved by Newton's method with the matrix of the first guess, ṽ⁺ = v,
// each iteration one problem. The first guess is off by O(h), its result by O(h²), and that of the second iteration by
// O(h³): two iterations have order 2 whatever the forces. The second is left out where it would change nothing.
//
// Constraints hold on the level of velocities. Afterwards positions are projected onto C = 0 and g ≥ 0, so that nothing
// drifts.
std::vector<OptionInfo> moreau_jean_options() {
    return {
        {.key = "theta",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "0.5",
         .minimum = 0.5,
         .maximum = 1.0,
         .doc = "where in the step forces are taken; 1/2: order 2, no damping; above: order 1, damping"},
        {.key = "iterations",
         .type = DELASSUS_OPTION_INTEGER,
         .default_value = "2",
         .minimum = 1.0,
         .maximum = 50.0,
         .doc =
             "of Newton's method, each a problem: 2 give order 2 for all forces, 1 where none turns with the bodies"},
        {.key = "newton_tolerance",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "1e-10",
         .minimum = 0.0,
         .maximum = 0.1,
         .doc = "no further iteration where it would change the right-hand sides by less than this share"},
        recovery_speed_option(),
        restitution_speed_option(),
        linearization_option()};
}

const RegisterTimestepper moreau_jean_row{
    {.name = "moreau_jean",
     .description = "Moreau and Jean's theta-method: order 2 between impacts, contacts on velocity level",
     .options = moreau_jean_options(),
     .constraints = true,
     .unilateral = true,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ThetaMethod>(
             system, ThetaSettings{.name = "moreau_jean",
                                   .theta = values[0].real,
                                   .iterations = static_cast<int>(values[1].integer),
                                   .tolerance = values[2].real,
                                   .contacts = velocity_contact_settings(system, values[3], values[4]),
                                   .linearization_limit = values[5].real});
     }}};

}  // namespace
}  // namespace delassus
