// SPDX-License-Identifier: BSD-3-Clause
// What a problem needs of a solver, and a problem made ready to be shown to one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/plugin.h"
#include "delassus/problem.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus {

/// The structure of H, detected from its values, never declared. A problem may at most count as a more general one.
enum class Structure {
    Reduced,       ///< n = 0
    Diagonal,      ///< positive diagonal
    Blocks,        ///< definite diagonal blocks of at most 16 rows (connected components of the pattern)
    Definite,      ///< sparse symmetric positive definite
    Semidefinite,  ///< symmetric, singular to working precision, no negative curvature
    Indefinite,    ///< symmetric with negative curvature
    Unsymmetric
};

[[nodiscard]] DELASSUS_API std::string_view name_of(Structure structure);

/// The names of the DELASSUS_CAN_* bits that are set, as used in sidecars and by `delassus plugins info`.
[[nodiscard]] DELASSUS_API std::vector<std::string> capability_names(std::uint64_t bits);
/// The inverse; throws InputError on an unknown name.
[[nodiscard]] DELASSUS_API std::uint64_t capabilities_of(const std::vector<std::string>& names);

class ErrorMeter;

/// A validated problem with its structure, needs and identity, laid out for the plugin border. Owns everything that
/// raw() points to; cheap to move, not to be copied by accident. Used by one thread at a time, solves
/// included: they measure errors in memory of the problem.
class PreparedProblem {
public:
    /// Throws InputError if the problem is not valid. Factors H once if it is neither diagonal nor block-diagonal, to
    /// learn whether it is definite.
    ///
    /// also_needs: DELASSUS_CAN_* bits that the problem gets beyond its own, as if it were more general: kinds of
    /// cones, and H_DEFINITE, with which a diagonal or block-diagonal H counts as sparse and is factorised.
    DELASSUS_API explicit PreparedProblem(Problem problem, std::uint64_t also_needs = 0);
    DELASSUS_API ~PreparedProblem();
    DELASSUS_API PreparedProblem(PreparedProblem&&) noexcept;
    DELASSUS_API PreparedProblem& operator=(PreparedProblem&&) noexcept;

    [[nodiscard]] DELASSUS_API const Problem& problem() const;
    [[nodiscard]] DELASSUS_API Structure structure() const;
    /// DELASSUS_CAN_* bits that a solver must have for this problem, whatever the settings of the solve.
    [[nodiscard]] DELASSUS_API std::uint64_t needs() const;
    /// What crosses the border; valid as long as this object.
    [[nodiscard]] DELASSUS_API const delassus_problem& raw() const;

    /// Replaces a (n) and b (m); everything analysed or factorised stays valid. Throws InputError on a wrong size or a
    /// value that is not finite.
    DELASSUS_API void set_right_hand_side(Array<double> a, Array<double> b);

    /// Replaces this problem by another one, and leaves this one's arrays in the other. If the entries have the same
    /// places, analysis and scratch memory are reused, and nothing is allocated as long as H is block-diagonal. Throws
    /// as the constructor; both are then unchanged.
    DELASSUS_API void renew(Problem&& problem);
    /// The same with a copy of the problem.
    DELASSUS_API void renew(const Problem& problem);

    /// Threads that share the work of renewing and measuring it where it is large; results stay the same to the bit.
    DELASSUS_API void use(const sdk::Team& team);

    /// Changes the friction law.
    DELASSUS_API void set_law(Law law);

    /// The same problem under another friction law. Shares the factorisation of H.
    [[nodiscard]] DELASSUS_API PreparedProblem with_law(Law law) const;

    /// Measures solutions of this problem (delassus/errors.hpp); made at the first call, valid until the right-hand
    /// side changes. One thread at a time.
    [[nodiscard]] DELASSUS_API const ErrorMeter& meter() const;

    /// The missing needs as a person would say them, e.g. "1421 friction cones, the exact Coulomb law".
    [[nodiscard]] DELASSUS_API std::string describe(std::uint64_t missing) const;

private:
    friend class ErrorMeter;
    PreparedProblem();
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
