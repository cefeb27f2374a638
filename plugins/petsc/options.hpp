// SPDX-License-Identifier: BSD-3-Clause
// One solver's entries in PETSc's options database. All carry a prefix of their own, so that two solvers, and whatever
// else uses PETSc in the process, do not meet.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace delassus::petsc {

class OptionsDatabase {
public:
    OptionsDatabase();
    ~OptionsDatabase();
    OptionsDatabase(const OptionsDatabase&) = delete;
    OptionsDatabase& operator=(const OptionsDatabase&) = delete;

    [[nodiscard]] const std::string& prefix() const { return prefix_; }

    /// Takes the user's text, e.g. "-ksp_type gcr -fieldsplit_lambda_pc_type jacobi". Throws std::invalid_argument for
    /// what is no option, or for one that would make PETSc print.
    void parse(const std::string& text);

    /// Removes everything and enters the plugin's own choices; the user's come last and win.
    void enter(const std::vector<std::pair<std::string, std::string>>& own);

    /// The user's options that PETSc has not asked for since they were entered.
    [[nodiscard]] std::vector<std::string> unused() const;
    [[nodiscard]] bool has_user_options() const { return !user_.empty(); }

private:
    void clear();
    int number_ = 1;
    std::string prefix_;
    std::vector<std::pair<std::string, std::string>> user_;
    std::vector<std::string> entered_;
};

}  // namespace delassus::petsc
