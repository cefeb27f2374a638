// SPDX-License-Identifier: BSD-3-Clause
// The KSP with its preconditioner, made from the plugin's options and the user's own.
#pragma once

#include <functional>
#include <string>

#include "delassus/sdk/options.hpp"
#include "options.hpp"
#include "schur.hpp"
#include "system.hpp"

namespace delassus::petsc {

struct Settings {
    explicit Settings(const sdk::OptionValues& values);
    std::string method, preconditioner, schur_matrix;
    int restart, stall_window;
    double shift, inner_tolerance;
};

class Krylov {
public:
    /// Throws std::invalid_argument with a sentence for options that contradict one another or that PETSc does not
    /// take.
    Krylov(const Settings& settings, const std::string& petsc_options);

    void analyze(const sdk::ProblemView& problem);
    void factorize(const sdk::ProblemView& problem);

    /// Asked once an iteration with an approximate solution of C K C y = v, on every process; true stops.
    using Test = std::function<bool(const sdk::Vector& y)>;

    /// y ← about (C K C)⁻¹ v. Returns PETSc's name of the reason of an unforeseen end, else "".
    std::string solve(const sdk::Vector& v, sdk::Vector& y, const Test& test);

    [[nodiscard]] const sdk::Vector& scaling() const { return C_; }
    [[nodiscard]] const sdk::MpiCommunicator& communicator() const { return communicator_; }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    struct Watch;
    static PetscErrorCode converged(KSP ksp, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason,
                                    void* context);
    void configure(const sdk::ProblemView& problem);
    void probe(bool unsymmetric);
    [[nodiscard]] bool by_schur(const sdk::ProblemView& problem) const;
    [[nodiscard]] bool own_schur_matrix() const;
    [[nodiscard]] PetscObjectState pattern_state() const;

    Settings settings_;
    sdk::MpiCommunicator communicator_;
    OptionsDatabase database_;
    System system_{communicator_};
    SchurMatrix schur_{communicator_};
    KrylovHandle ksp_;
    sdk::Vector C_;
    bool schur_used_ = false;
    PetscObjectState pattern_ = 0;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus::petsc
