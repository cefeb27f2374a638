// SPDX-License-Identifier: BSD-3-Clause
// A problem of which each process holds a part, made ready to be solved and judged (docs/partitioned.md).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/errors.hpp"
#include "delassus/export.hpp"
#include "delassus/partitioned.hpp"
#include "delassus/plugin.h"
#include "delassus/prepared.hpp"
#include "delassus/solver.hpp"

namespace delassus {

class PartMeter;

/// A validated part with the structure of the whole, its needs and identity, laid out for the plugin border. Every
/// member that is marked collective, or measures or computes (Prepared), is called by all processes in the same order;
/// what it returns or throws is the same on all of them.
class DELASSUS_API PreparedPart final : public Prepared {
public:
    /// Checks the parts, finds the structure of H and what the problem needs. Throws InputError if a part is not valid,
    /// or E or, beside cones that are not linear, H is not symmetric. Collective.
    PreparedPart(std::shared_ptr<const Communicator> communicator, PartitionedProblem problem);
    ~PreparedPart() override;
    PreparedPart(PreparedPart&&) noexcept;
    PreparedPart& operator=(PreparedPart&&) noexcept;

    [[nodiscard]] const PartitionedProblem& problem() const;
    /// What crosses the border; valid as long as this object.
    [[nodiscard]] const delassus_local_problem& raw() const;
    /// How many entries of x that others own the rows of this process have to do with.
    [[nodiscard]] std::int64_t ghosts() const;

    /// Changes the friction law; on all processes alike.
    void set_law(Law law);
    /// Replaces the own a (n) and b (m). Throws InputError on a wrong size or a value that is not finite. Collective.
    void set_right_hand_side(std::vector<double> a, std::vector<double> b);

    [[nodiscard]] const Communicator& communicator() const override;
    [[nodiscard]] const delassus_problem* whole() const override { return nullptr; }
    [[nodiscard]] const delassus_local_problem* part() const override { return &raw(); }
    [[nodiscard]] const std::string& name() const override { return problem().name; }
    [[nodiscard]] Law law() const override { return problem().law; }
    [[nodiscard]] std::span<const double> a() const override { return problem().a; }
    [[nodiscard]] std::span<const double> b() const override { return problem().b; }
    [[nodiscard]] std::span<const Cone> cones() const override { return problem().cones; }
    [[nodiscard]] double diagonal(std::size_t i) const override;
    [[nodiscard]] std::int64_t all_rows() const override { return raw().m_all; }
    /// Of the whole H. Diagonal and Blocks only if every block lies within one process.
    [[nodiscard]] Structure structure() const override;
    /// DELASSUS_CAN_PARTITIONED is among them.
    [[nodiscard]] std::uint64_t needs() const override;
    [[nodiscard]] std::string describe(std::uint64_t missing) const override;
    /// As ErrorMeter computes it of a whole problem; the two differ by rounding. Throws Unsupported for an unsymmetric
    /// H. The first call after a change of the problem computes S and r.
    [[nodiscard]] Errors measure(std::span<const double> x, std::span<const double> lambda) const override;
    [[nodiscard]] double natural(const double* x, const double* lambda) const override;
    [[nodiscard]] double reference() const override;
    [[nodiscard]] double norm_in_rows(std::span<const double> v) const override;
    void velocity_of(std::span<const double> lambda, std::vector<double>& x) const override;
    void free_velocities(std::vector<double>& x) const override;
    [[nodiscard]] RoundingOfBalance rounding_of_balance(const Solution& solution) const override;
    [[nodiscard]] double proven_size(const Solution& answer) const override;
    /// Null: each process would need its part twice.
    [[nodiscard]] std::unique_ptr<Prepared> under(Law law) const override;

private:
    friend class PartMeter;
    friend class PartProof;
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// What one process had of a partitioned problem, and what it cost it.
struct ProcessReport {
    std::int64_t n = 0, m = 0;     ///< own columns and rows
    std::int64_t ghosts = 0;       ///< columns of others that its rows have to do with
    std::int64_t bytes_sent = 0;   ///< by the core since the start; a solver's own library counts for itself
    std::int64_t peak_memory = 0;  ///< bytes resident at most so far
    SolveCost cost = {};
};

/// Of all processes, by rank. cost: what the own solve cost. Collective.
[[nodiscard]] DELASSUS_API std::vector<ProcessReport> process_reports(const PreparedPart& problem,
                                                                      const SolveCost& cost);

/// The report as JSON text with the processes beside it (docs/report.md).
[[nodiscard]] DELASSUS_API std::string to_json(const SolveReport& report, const std::vector<ProcessReport>& processes);

}  // namespace delassus
