// SPDX-License-Identifier: BSD-3-Clause
// What a run does not need is not mapped into its process.
#include <gtest/gtest.h>

#include "support/run_command.hpp"

namespace delassus::tests {
namespace {

/// The libraries that the dynamic loader maps during a run, from its own log.
std::string mapped_libraries(const std::string& arguments) {
    const ScratchFolder scratch;
    const auto result = run_shell("LD_DEBUG=files LD_DEBUG_OUTPUT=" + (scratch / "log").string() + " " +
                                  DELASSUS_COMMAND + " " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::string log;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) log += text_of(entry.path());
    EXPECT_NE(log.find("libdelassus.so"), std::string::npos) << "the loader's log is empty";
    return log;
}

TEST(LeaveOut, ApgdMapsNoHeavyLibrary) {
    const auto log = mapped_libraries("solve " + example("box_stack") + " --solver apgd");
    EXPECT_NE(log.find("apgd.so"), std::string::npos);
    for (const char* library :
         {"libpetsc", "libdmumps", "libcholmod", "libmpi", "libhdf5", "/spg.so", "/cholmod.so", "/petsc.so"})
        EXPECT_EQ(log.find(library), std::string::npos) << library;
}

TEST(LeaveOut, ListingLoadsNoPlugin) {
    const auto log = mapped_libraries("plugins list");
    for (const char* library : {"/apgd.so", "/spg.so", "/pgs.so", "/cholmod.so", "/petsc.so", "/mumps.so", "libmpi"})
        EXPECT_EQ(log.find(library), std::string::npos) << library;
}

TEST(LeaveOut, FclibFilesAloneMapHdf5) {
    const ScratchFolder scratch;
    const auto file = (scratch / "stack.hdf5").string();
    ASSERT_EQ(run_command("convert " + example("box_stack") + " --law coulomb " + file).exit_code, 0);
    EXPECT_NE(mapped_libraries("inspect " + file).find("libhdf5"), std::string::npos);
    EXPECT_EQ(mapped_libraries("inspect " + example("box_stack")).find("libhdf5"), std::string::npos);
}

}  // namespace
}  // namespace delassus::tests
