// SPDX-License-Identifier: BSD-3-Clause
// What a run does not need is not mapped into its process.
#include <gtest/gtest.h>

#include "support/places.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::leave_out_test {
namespace {

TEST(LeaveOut, ApgdMapsNoHeavyLibrary) {
    const auto log = loader_log("solve " + example("box_stack") + " --solver apgd");
    EXPECT_NE(log.find("apgd.so"), std::string::npos);
    for (const char* library : {"libpetsc", "libdmumps", "libcholmod", "libmpi", "libhdf5", "libmuparser", "libqhull",
                                "/spg.so", "/cholmod.so", "/petsc.so"})
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

std::string scene(const std::string& name) {
    return (std::filesystem::path(tests::places::source) / "examples" / "scenes" / (name + ".yaml")).string();
}

TEST(LeaveOut, ConvexShapesAloneMapQhull) {
    EXPECT_EQ(loader_log("plan " + scene("box_on_incline")).find("libqhull"), std::string::npos);
#ifdef DELASSUS_HAS_QHULL
    EXPECT_NE(loader_log("plan " + scene("arch")).find("libqhull"), std::string::npos);
#endif
}

TEST(LeaveOut, ReducedBodiesAloneMapTheEigenSolver) {
    EXPECT_EQ(loader_log("plan " + scene("box_on_incline")).find("delassus_eigenmodes"), std::string::npos);
#ifdef DELASSUS_HAS_SPECTRA
    EXPECT_NE(loader_log("plan " + scene("modal_slider_crank")).find("delassus_eigenmodes"), std::string::npos);
#endif
}

TEST(LeaveOut, MeshFilesAloneMapTheirLibraries) {
    const auto without = loader_log("plan " + scene("box_on_incline"));
    for (const char* library : {"libassimp", "libnglib"})
        EXPECT_EQ(without.find(library), std::string::npos) << library;
#ifdef DELASSUS_HAS_ASSIMP
    const auto surface = loader_log("plan " + scene("mesh_die"));
    EXPECT_NE(surface.find("libassimp"), std::string::npos);
    EXPECT_EQ(surface.find("libnglib"), std::string::npos);
#endif
#ifdef DELASSUS_HAS_NETGEN
    const auto volume = loader_log("plan " + scene("hanging_bar"));
    EXPECT_NE(volume.find("libnglib"), std::string::npos);
    EXPECT_EQ(volume.find("libassimp"), std::string::npos);
#endif
}

}  // namespace
}  // namespace delassus::tests::leave_out_test
