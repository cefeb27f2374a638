// SPDX-License-Identifier: BSD-3-Clause
// Problems that each process of a run makes its own part of (docs/partitioned.md).
#pragma once

#include <string_view>

#include "delassus/generate.hpp"
#include "delassus/partitioned.hpp"

namespace delassus {

/// The own part of generate_pile(): the same problem, bit for bit, for any number of processes. Spheres are numbered by
/// recursive bisection of the lattice's boxes, so that ranges of numbers are compact; a contact belongs to the sphere
/// of the smaller number. Processes tell one another only how many contacts they have. Time and memory are linear in
/// the own spheres. Throws InputError as generate() does. Collective.
[[nodiscard]] DELASSUS_API PartitionedProblem generate_partitioned(const Communicator& communicator,
                                                                   const PileParameters& parameters);

/// Whether the text has the form of a generated problem: "pile" or "pile:KEY=VALUE,…", and nothing on disk has that
/// name.
[[nodiscard]] DELASSUS_API bool is_generated_problem(std::string_view text);

/// The parameters in such a text, as in "pile:contacts=1000000,seed=1"; keys that are absent have their defaults.
/// Throws InputError for another form, an unknown key (with the nearest name), or a value out of range.
[[nodiscard]] DELASSUS_API PileParameters pile_parameters(std::string_view text);

/// The text that gives these parameters.
[[nodiscard]] DELASSUS_API std::string to_text(const PileParameters& parameters);

}  // namespace delassus
