// SPDX-License-Identifier: BSD-3-Clause
// By what a process knows that a launcher has started several of it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "delassus/distributed.hpp"

namespace delassus::launcher_test {
namespace {

/// An environment with these variables and without the others that launchers set, until it is destroyed.
class LaunchedAs {
public:
    using Variables = std::vector<std::pair<std::string, std::string>>;

    explicit LaunchedAs(const Variables& variables) {
        for (const char* name :
             {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK", "PMI_SIZE", "PMI_RANK", "MV2_COMM_WORLD_SIZE",
              "MV2_COMM_WORLD_RANK", "PMIX_RANK", "SLURM_STEP_NUM_TASKS", "SLURM_NTASKS"}) {
            const char* value = std::getenv(name);
            before_.emplace_back(name, value ? std::optional<std::string>(value) : std::nullopt);
            unsetenv(name);
        }
        for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), 1);
    }
    ~LaunchedAs() {
        for (const auto& [name, value] : before_)
            value ? setenv(name.c_str(), value->c_str(), 1) : unsetenv(name.c_str());
    }
    LaunchedAs(const LaunchedAs&) = delete;
    LaunchedAs& operator=(const LaunchedAs&) = delete;

    [[nodiscard]] std::pair<int, int> seen() const { return {process_count(), process_rank()}; }

private:
    std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

using Seen = std::pair<int, int>;
using Variables = LaunchedAs::Variables;

TEST(Launcher, IsKnownByItsEnvironment) {
    EXPECT_EQ(LaunchedAs(Variables{}).seen(), Seen(1, 0));
    EXPECT_EQ(LaunchedAs(Variables{{"OMPI_COMM_WORLD_SIZE", "4"}, {"OMPI_COMM_WORLD_RANK", "3"}}).seen(), Seen(4, 3));
    EXPECT_EQ(LaunchedAs(Variables{{"PMI_SIZE", "8"}, {"PMI_RANK", "5"}}).seen(), Seen(8, 5));
    EXPECT_EQ(LaunchedAs(Variables{{"PMIX_RANK", "6"}, {"SLURM_STEP_NUM_TASKS", "64"}}).seen(), Seen(64, 6));
}

// In a batch script Slurm's variables are there, but nobody has started processes of MPI; mpirun within a job of srun
// has the last word.
TEST(Launcher, SlurmAloneIsNone) {
    EXPECT_EQ(LaunchedAs(Variables{{"SLURM_NTASKS", "64"}, {"SLURM_STEP_NUM_TASKS", "64"}}).seen(), Seen(1, 0));
    EXPECT_EQ(LaunchedAs(Variables{{"PMIX_RANK", "6"}}).seen(), Seen(1, 0));
    EXPECT_EQ(LaunchedAs(Variables{{"OMPI_COMM_WORLD_SIZE", "2"},
                                   {"OMPI_COMM_WORLD_RANK", "1"},
                                   {"PMIX_RANK", "6"},
                                   {"SLURM_STEP_NUM_TASKS", "64"}})
                  .seen(),
              Seen(2, 1));
}

}  // namespace
}  // namespace delassus::launcher_test
