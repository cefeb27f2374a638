// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "delassus/prepared_part.hpp"
#include "delassus/sdk/cones.hpp"
#include "partitioned/coupled_inverse.hpp"
#include "partitioned/halo.hpp"
#include "partitioned/local_inverse.hpp"
#include "problem/structure.hpp"

namespace delassus {

class PartMeter;

struct PreparedPart::Implementation {
    std::shared_ptr<const Communicator> communicator;
    PartitionedProblem problem;
    Structure structure = Structure::Reduced;
    /// Whether an entry of H has its row on one process and its column on another.
    bool coupled = false;
    /// Whether E has an entry, on any process.
    bool compliant = false;
    Halo columns;  ///< of the foreign columns of H and D
    Halo rows;     ///< of those of E
    /// The own rows of H with columns counted from the first own one; empty where H is coupled.
    SparseMatrix H;
    BlockPartition blocks;
    std::vector<std::int64_t> block_start, block_index;
    std::vector<delassus_cone> cones;
    std::vector<double> parameters;
    /// Cones of all processes, rows for those of kinds whose rows separate, by kind.
    std::array<std::int64_t, sdk::cone_table.size()> counts = {};
    delassus_local_problem raw{};
    /// Where H is definite: this, or, where it is coupled, the factors of C H C with C = |diag H|^(−½), own entries.
    std::unique_ptr<LocalInverse> inverse;
    std::unique_ptr<CoupledInverse> factors;
    std::vector<double> C;
    mutable std::unique_ptr<PartMeter> meter;

    void find_halos();
    void check_symmetry() const;
    void detect_structure();
    void factorize_coupled();
    /// v ← H⁻¹ v, own entries. Collective.
    void apply_inverse(std::vector<double>& v) const;
    /// x ← H⁻¹(a + Dᵀλ), own entries, where H has an inverse. Collective.
    void velocity_of(const double* lambda, std::vector<double>& x) const;
    /// |diag H| with the mean of the others for a zero, own entries; 1 where all are zero.
    [[nodiscard]] std::vector<double> magnitude_of_diagonal() const;
    /// s of each own cone from the own rows' diagonal of N: sdk::block_scaling() with the mean over the cones of all
    /// processes. Collective.
    [[nodiscard]] std::vector<double> cone_scaling(const std::vector<double>& diagonal) const;
    void lay_out();
    void count_cones();
    void derive_needs();
    [[nodiscard]] bool certain_redundancy() const;
    void set_law_needs();
    void identify();
    [[nodiscard]] PartMeter& measuring() const;
    /// Whether |diag H| stands in for an H that has no inverse.
    [[nodiscard]] bool stands_in() const {
        return structure == Structure::Semidefinite || structure == Structure::Indefinite;
    }
    /// The largest on all processes.
    [[nodiscard]] double largest(double value) const;
    [[nodiscard]] std::int64_t largest(std::int64_t value) const;
};

}  // namespace delassus
