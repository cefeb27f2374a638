// SPDX-License-Identifier: BSD-3-Clause
// What ParaView is given: the cells of a frame, as they stand in the file.
#include <gtest/gtest.h>

#include <cstring>

#include "output/vtk_series.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::vtk_test {
namespace {

/// An array of the appended section: the one with that name after the element `part`.
template <class Number>
std::vector<Number> array_of(const std::string& file, const std::string& part, const std::string& name) {
    const auto element = file.find("Name=\"" + name + "\"", file.find("<" + part + ">"));
    const auto offset = file.find("offset=\"", element) + 8;
    const auto start = file.find('_', file.find("<AppendedData")) + 1 + std::stoul(file.substr(offset));
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, file.data() + start, sizeof bytes);
    std::vector<Number> values(bytes / sizeof(Number));
    std::memcpy(values.data(), file.data() + start + sizeof bytes, bytes);
    return values;
}

TEST(VtkSeries, ShowsBodiesNodesCablesAndBlocks) {
    const Scene scene = parse_scene(R"(
step: 0.1
end: 1
bodies:
  - {name: ball, mass: 1, position: [0, 0, 1], velocity: [3, 4, 0], shapes: [{sphere: {radius: 0.1}}]}
nodes:
  - {name: hook, fixed: true, position: [4, 0, 1]}
  - {name: bead, mass: 1, position: [4, 0, 0.5], velocity: [0, 2, 0]}
elastic_blocks:
  - {name: block, edges: [0.2, 0.2, 0.2], cells: [1, 1, 1], order: 1}
cables:
  - {name: string, nodes: [hook, bead]}
)",
                                    "test");
    const auto& system = *scene.systems[0].system;
    const ScratchFolder scratch;
    const VtkSeries series(scratch.path(), "main", system);
    series.write(0, system.initial_state());
    const std::string file = text_of(scratch / "main_000000.vtp");
    EXPECT_NE(file.find("NumberOfVerts=\"3\" NumberOfLines=\"1\""), std::string::npos);
    const std::size_t section = file.find("<AppendedData");
    EXPECT_NEAR(static_cast<double>(series.picture_bytes()), static_cast<double>(file.size() - section), 300.0);
    const auto points = array_of<float>(file, "Points", "points");
    const auto point = [&](std::int32_t index) {
        return std::vector<float>(points.begin() + 3 * index, points.begin() + 3 * index + 3);
    };
    const auto vertices = array_of<std::int32_t>(file, "Verts", "connectivity");
    ASSERT_EQ(vertices.size(), 3u);  // the ball's centre, hook, bead
    EXPECT_EQ(point(vertices[0]), (std::vector<float>{0.0F, 0.0F, 1.0F}));
    EXPECT_EQ(point(vertices[1]), (std::vector<float>{4.0F, 0.0F, 1.0F}));
    EXPECT_EQ(array_of<std::int32_t>(file, "Verts", "offsets"), (std::vector<std::int32_t>{1, 2, 3}));
    const auto line = array_of<std::int32_t>(file, "Lines", "connectivity");
    EXPECT_EQ(line, (std::vector<std::int32_t>{vertices[1], vertices[2]}));
    EXPECT_EQ(array_of<std::int32_t>(file, "Lines", "offsets"), std::vector<std::int32_t>{2});
    // Vertices, lines, then triangles: the sphere's, and the 12 of the block, in its corners.
    const auto triangles = array_of<std::int32_t>(file, "Polys", "offsets").size();
    const auto body = array_of<std::int32_t>(file, "CellData", "body");
    const auto speed = array_of<float>(file, "CellData", "speed");
    ASSERT_EQ(body.size(), 4 + triangles);
    ASSERT_EQ(speed.size(), body.size());
    EXPECT_EQ(std::vector(body.begin(), body.begin() + 5), (std::vector<std::int32_t>{0, 1, 1, 1, 0}));
    EXPECT_EQ(std::vector(speed.begin(), speed.begin() + 5), (std::vector<float>{5.0F, 0.0F, 2.0F, 1.0F, 5.0F}));
    const auto corners = array_of<std::int32_t>(file, "Polys", "connectivity");
    for (std::size_t i = corners.size() - 36; i < corners.size(); ++i) {
        EXPECT_EQ(body.back(), 1);
        for (const float x : point(corners[i])) EXPECT_TRUE(x == 0.0F || x == 0.2F) << x;
    }
}

}  // namespace
}  // namespace delassus::tests::vtk_test
