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
#include "delassus/prepared.hpp"
#include "delassus/problem.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus {

[[nodiscard]] DELASSUS_API std::string_view name_of(Structure structure);

/// The names of the DELASSUS_CAN_* bits that are set, as used in sidecars and by `delassus plugins info`.
[[nodiscard]] DELASSUS_API std::vector<std::string> capability_names(std::uint64_t bits);
/// The inverse; throws InputError on an unknown name.
[[nodiscard]] DELASSUS_API std::uint64_t capabilities_of(const std::vector<std::string>& names);

class ErrorMeter;

/// A validated problem with its structure, needs and identity, laid out for the plugin border. Owns everything that
/// raw() points to; cheap to move, not to be copied by accident. Used by one thread at a time, solves
/// included: they measure errors in memory of the problem.
class DELASSUS_API PreparedProblem final : public Prepared {
public:
    /// Throws InputError if the problem is not valid. Factors H once if it is neither diagonal nor block-diagonal, to
    /// learn whether it is definite.
    ///
    /// also_needs: DELASSUS_CAN_* bits that the problem gets beyond its own, as if it were more general: kinds of
    /// cones, and H_DEFINITE, with which a diagonal or block-diagonal H counts as sparse and is factorised.
    explicit PreparedProblem(Problem problem, std::uint64_t also_needs = 0);
    ~PreparedProblem() override;
    PreparedProblem(PreparedProblem&&) noexcept;
    PreparedProblem& operator=(PreparedProblem&&) noexcept;

    [[nodiscard]] const Problem& problem() const;
    /// What crosses the border; valid as long as this object.
    [[nodiscard]] const delassus_problem& raw() const;

    /// Replaces a (n) and b (m); everything analysed or factorised stays valid. Throws InputError on a wrong size or a
    /// value that is not finite.
    void set_right_hand_side(Array<double> a, Array<double> b);

    /// Replaces this problem by another one, and leaves this one's arrays in the other. If the entries have the same
    /// places, analysis and scratch memory are reused, and nothing is allocated as long as H is block-diagonal. Throws
    /// as the constructor; both are then unchanged.
    void renew(Problem&& problem);
    /// The same with a copy of the problem.
    void renew(const Problem& problem);

    /// Threads that share the work of renewing and measuring it where it is large; results stay the same to the bit.
    void use(const sdk::Team& team);

    /// Changes the friction law.
    void set_law(Law law);

    /// The same problem under another friction law. Shares the factorisation of H.
    [[nodiscard]] PreparedProblem with_law(Law law) const;

    /// Measures solutions of this problem (delassus/errors.hpp); made at the first call, valid until the right-hand
    /// side changes. One thread at a time.
    [[nodiscard]] const ErrorMeter& meter() const;

    [[nodiscard]] const Communicator& communicator() const override;
    [[nodiscard]] const delassus_problem* whole() const override { return &raw(); }
    [[nodiscard]] const delassus_local_problem* part() const override { return nullptr; }
    [[nodiscard]] const std::string& name() const override { return problem().name; }
    [[nodiscard]] Law law() const override { return problem().law; }
    [[nodiscard]] std::span<const double> a() const override;
    [[nodiscard]] std::span<const double> b() const override;
    [[nodiscard]] std::span<const Cone> cones() const override { return problem().cones; }
    [[nodiscard]] double diagonal(std::size_t i) const override;
    [[nodiscard]] std::int64_t all_rows() const override { return raw().m; }
    [[nodiscard]] Structure structure() const override;
    [[nodiscard]] std::uint64_t needs() const override;
    [[nodiscard]] std::string describe(std::uint64_t missing) const override;
    [[nodiscard]] Errors measure(std::span<const double> x, std::span<const double> lambda) const override;
    [[nodiscard]] double natural(const double* x, const double* lambda) const override;
    [[nodiscard]] double reference() const override;
    [[nodiscard]] double norm_in_rows(std::span<const double> v) const override;
    void velocity_of(std::span<const double> lambda, std::vector<double>& x) const override;
    void free_velocities(std::vector<double>& x) const override;
    [[nodiscard]] RoundingOfBalance rounding_of_balance(const Solution& solution) const override;
    [[nodiscard]] double proven_size(const Solution& answer) const override;
    [[nodiscard]] std::unique_ptr<Prepared> under(Law law) const override;

private:
    friend class ErrorMeter;
    PreparedProblem();
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
