// SPDX-License-Identifier: BSD-3-Clause
// Problems that are read and written by two threads at once.
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"

namespace delassus::files_in_threads_test {
namespace {

class Files : public testing::Test {
protected:
    void SetUp() override {
        folder_ = std::filesystem::path(testing::TempDir()) /
                  (std::string("delassus-") + testing::UnitTest::GetInstance()->current_test_info()->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    /// Each of two threads writes its problem some times and reads it again.
    void write_and_read(const std::string& ending) const {
        std::vector<std::jthread> hosts;
        bool equal[2] = {false, false};
        for (int k = 0; k < 2; ++k)
            hosts.emplace_back([this, k, &ending, &good = equal[k]] {
                SpherePileParameters parameters;
                parameters.contacts = 40 + k;
                Problem problem = generate_sphere_pile(parameters);
                problem.law = Law::Coulomb;  // the law of FCLib files
                good = true;
                for (int repeat = 0; repeat < 5; ++repeat) {
                    const auto file = folder_ / (std::to_string(k) + "-" + std::to_string(repeat) + ending);
                    write_problem(problem, file);
                    const Problem read = read_problem(file);
                    good = good && read.a == problem.a && read.b == problem.b && read.m() == problem.m();
                }
            });
        hosts.clear();
        EXPECT_TRUE(equal[0]);
        EXPECT_TRUE(equal[1]);
    }

private:
    std::filesystem::path folder_;
};

TEST_F(Files, FoldersByTwoThreads) {
    write_and_read("");
}

#ifdef DELASSUS_HAS_HDF5
TEST_F(Files, FclibByTwoThreads) {
    write_and_read(".hdf5");
}
#endif

}  // namespace
}  // namespace delassus::files_in_threads_test
