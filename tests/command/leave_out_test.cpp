// SPDX-License-Identifier: BSD-3-Clause
// What a run does not need is not mapped into its process.
#include <gtest/gtest.h>

#include "support/run_command.hpp"

namespace delassus::tests {
namespace {

TEST(LeaveOut, ApgdMapsNoHeavyLibrary) {
    const auto log = loader_log("solve " + example("box_stack") + " --solver apgd");
    EXPECT_NE(log.find("apgd.so"), std::string::npos);
    for (const char* library :
         {"libpetsc", "libdmumps", "libcholmod", "libmpi", "libhdf5", "/spg.so", "/cholmod.so", "/petsc.so"})
        EXPECT_EQ(log.find(library), std::string::npos) << library;
}

TEST(LeaveOut, ListingLoadsNoPlugin) {
    const auto log = loader_log("plugins list");
    for (const char* library : {"/apgd.so", "/spg.so", "/pgs.so", "/cholmod.so", "/petsc.so", "/mumps.so", "libmpi"})
        EXPECT_EQ(log.find(library), std::string::npos) << library;
}

TEST(LeaveOut, FclibFilesAloneMapHdf5) {
    const ScratchFolder scratch;
    const auto file = (scratch / "stack.hdf5").string();
    ASSERT_EQ(run_command("convert " + example("box_stack") + " --law coulomb " + file).exit_code, 0);
    EXPECT_NE(loader_log("inspect " + file).find("libhdf5"), std::string::npos);
    EXPECT_EQ(loader_log("inspect " + example("box_stack")).find("libhdf5"), std::string::npos);
}

}  // namespace
}  // namespace delassus::tests
