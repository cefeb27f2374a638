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

std::string scene(const std::string& name) {
    return (std::filesystem::path(DELASSUS_SOURCE_DIR) / "examples" / "scenes" / (name + ".yaml")).string();
}

TEST(LeaveOut, MeshFilesAloneMapTheirLibraries) {
    const auto without = mapped_libraries("plan " + scene("box_on_incline"));
    for (const char* library : {"libassimp", "libnglib"})
        EXPECT_EQ(without.find(library), std::string::npos) << library;
#ifdef DELASSUS_HAS_ASSIMP
    const auto surface = mapped_libraries("plan " + scene("mesh_die"));
    EXPECT_NE(surface.find("libassimp"), std::string::npos);
    EXPECT_EQ(surface.find("libnglib"), std::string::npos);
#endif
#ifdef DELASSUS_HAS_NETGEN
    const auto volume = mapped_libraries("plan " + scene("hanging_bar"));
    EXPECT_NE(volume.find("libnglib"), std::string::npos);
    EXPECT_EQ(volume.find("libassimp"), std::string::npos);
#endif
}

}  // namespace
}  // namespace delassus::tests
