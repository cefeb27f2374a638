// SPDX-License-Identifier: BSD-3-Clause
// Options of all plugins that sweep.
#pragma once

#include "delassus/sdk/options.hpp"
#include "delassus/sdk/solver.hpp"
#include "sweep_order.hpp"

namespace delassus::pgs {

inline constexpr const char* variants[] = {"forward", "symmetric", "jacobi"};
inline constexpr const char* local_solvers[] = {"diagonal", "exact"};
inline constexpr const char* orderings[] = {"auto", "given", "spaced", "coloured", "domains"};
inline constexpr const char* accelerations[] = {"none", "anderson"};

inline constexpr delassus_option variant_option =
    sdk::choice_option("variant", "forward", variants,
                       "order of the blocks: forward, forward and back in one iteration, or all at once (damped)");
inline constexpr delassus_option local_solver_option = sdk::choice_option(
    "local_solver", "diagonal", local_solvers,
    "friction blocks: one projected step of length 1/largest eigenvalue, or the one-contact problem");
inline constexpr delassus_option omega_option =
    sdk::real_option("omega", "1.5", 1e-3, 1.999, "", "over- or underrelaxation of the local step");
inline constexpr delassus_option ordering_option = sdk::choice_option(
    "ordering", "auto", orderings,
    "order of the blocks in a sweep: as in the problem; as in the problem, with neighbours kept a little apart; by "
    "colours that share no body; inside of domains of bodies, then between them; auto: domains where there are a "
    "thousand blocks, else spaced");
inline constexpr delassus_option acceleration_option =
    sdk::choice_option("acceleration", "anderson", accelerations, "extrapolation of the sweeps");
inline constexpr delassus_option memory_option =
    sdk::integer_option("memory", "5", 1, 100, "points", "differences that anderson keeps");
inline constexpr delassus_option check_every_option =
    sdk::integer_option("check_every", "0", 0, 1e9, "iterations",
                        "iterations between measurements of the natural error; 0: five, or 5 % of the iterations done");
inline constexpr delassus_option stall_window_option =
    sdk::integer_option("stall_window", "1000000", 0, 1e15, "iterations",
                        "the solve ends as stalled after this many iterations without a gain of 1 %; 0: never");

inline Ordering ordering_of(const sdk::OptionValues& options) {
    const std::string ordering = options.choice("ordering");
    return ordering == "given"      ? Ordering::Given
           : ordering == "spaced"   ? Ordering::Spaced
           : ordering == "coloured" ? Ordering::Coloured
           : ordering == "domains"  ? Ordering::Domains
                                    : Ordering::Auto;
}

}  // namespace delassus::pgs
