// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "delassus/errors.hpp"
#include "delassus/needs.hpp"
#include "problem/mobility.hpp"
#include "problem/structure.hpp"

namespace delassus {

struct PreparedProblem::Implementation {
    Problem problem;
    Structure structure = Structure::Reduced;
    std::uint64_t also_needs = 0;
    BlockPartition blocks;
    std::vector<delassus_cone> cones;
    std::vector<double> parameters;    ///< of all cones, one after another: solvers read them in every sweep
    std::vector<char> shares_columns;  ///< of cones: whether all rows have their entries in D in the same columns
    delassus_problem raw{};
    /// Factored where H is definite or n = 0; null otherwise. The error meter measures with it.
    std::shared_ptr<Mobility> mobility;
    mutable std::unique_ptr<ErrorMeter> meter;
    RedundancyCheck redundancy;
    sdk::Team team;

    /// The team where the problem is large enough to share work on it.
    [[nodiscard]] sdk::Team useful_team() const { return team.if_worth(raw.m >= 2048); }

    void lay_out();
    /// Points raw to the arrays of the problem and to the numbers of the cones, which lay_out() placed.
    void point_to_arrays();
    /// Whether the other problem has as many columns, and the entries of H in the same places.
    [[nodiscard]] bool same_places_of_H(const Problem& other) const;
    /// Whether the entries of D and E, and cones of the same kinds, are in the same places too.
    [[nodiscard]] bool same_places_of_rows(const Problem& other) const;
    /// Exchanges the problem for one with the same places of H.
    void exchange(Problem& other, bool new_places);
    void find_shared_columns();
    void detect_structure();
    /// new_places: whether entries of D or E stand elsewhere than at the last call.
    void derive_needs(bool new_places);
    /// Replaces the needs of another law by those of the present one.
    void set_law_needs();
    /// Makes the identities from the content.
    void identify();
    /// Takes identities that no other problem of this process has. The pattern gets a new one only if the places are
    /// new.
    void identify_anew(bool new_places);
};

}  // namespace delassus
