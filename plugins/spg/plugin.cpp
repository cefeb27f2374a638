// SPDX-License-Identifier: BSD-3-Clause
#include "spg.hpp"

namespace {

using delassus::sdk::boolean_option;
using delassus::sdk::choice_option;
using delassus::sdk::integer_option;

constexpr const char* step_choices[] = {"alternating", "long"};

constexpr delassus_option options[] = {
    choice_option("steps", "alternating", step_choices,
                  "Barzilai-Borwein steps: long and short in turn, or always the long one"),
    integer_option("memory", "10", 1, 1000, "iterations",
                   "values of the objective among which the non-monotone line search takes the largest; 1 = monotone"),
    boolean_option("tangential", true, "form the short step from the part of the change that lies in the face"),
    boolean_option("face_steps", true, "now and then take a conjugate gradient step on the identified face"),
    integer_option("stall_iterations", "100000", 0, 1e9, "iterations",
                   "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr delassus::sdk::PluginInfo info{
    .name = "spg",
    .version = "0.1.0",
    .description = "Spectral projected gradient with diagonal preconditioner and fallback (P-SPG-FB)",
    .licence = "BSD-3-Clause",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START,
};

}  // namespace

DELASSUS_SOLVER_PLUGIN(delassus::spg::SpectralGradient, info, options)
