// SPDX-License-Identifier: BSD-3-Clause
// Meshes in files: what is read, and what is refused with the file and the place.
#include "delassus/mesh_files.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "delassus/error.hpp"
#include "support/places.hpp"

namespace delassus::mesh_files_test {
namespace {

class MeshFile : public testing::Test {
protected:
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path write(const std::string& name, const std::string& text) {
        std::filesystem::create_directories(folder_);
        std::ofstream(folder_ / name) << text;
        return folder_ / name;
    }
    template <class Read>
    std::string refusal(Read&& read) {
        try {
            read();
        } catch (const InputError& error) {
            const std::string text = error.what();
            const auto at = text.find(folder_.string());
            return at == std::string::npos ? text : text.substr(at + folder_.string().size() + 1);
        }
        return "taken";
    }

private:
    std::filesystem::path folder_ =
        std::filesystem::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
};

/// A tetrahedron with legs of 1 along the axes from (x, 0, 0), as OBJ, after `first` points.
std::string tetrahedron(int x, int first) {
    std::string text = fmt::format("v {0} 0 0\nv {1} 0 0\nv {0} 1 0\nv {0} 0 1\n", x, x + 1);
    for (const auto& face : {std::array{1, 3, 2}, std::array{1, 2, 4}, std::array{2, 3, 4}, std::array{1, 4, 3}})
        text += fmt::format("f {} {} {}\n", face[0] + first, face[1] + first, face[2] + first);
    return text;
}

double volume(const Mesh& mesh) {
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
        const auto &a = mesh.vertices[static_cast<std::size_t>(t[0])],
                   &b = mesh.vertices[static_cast<std::size_t>(t[1])],
                   &c = mesh.vertices[static_cast<std::size_t>(t[2])];
        sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return sum / 6.0;
}

#ifdef DELASSUS_HAS_ASSIMP

TEST_F(MeshFile, ObjectFileHasItsPartsAndItsScale) {
    const auto parts = read_surface_mesh(write("two.obj", tetrahedron(0, 0) + tetrahedron(5, 4)), 2.0);
    ASSERT_EQ(parts.size(), 2U);
    for (const auto& part : parts) {
        EXPECT_EQ(part.vertices.size(), 4U);
        EXPECT_EQ(part.triangles.size(), 4U);
        EXPECT_NEAR(volume(part), 8.0 / 6.0, 1e-12);
    }
    EXPECT_EQ(parts[1].vertices[0][0], 10.0);
}

TEST_F(MeshFile, StereolithographyJoinsItsCorners) {
    std::string text = "solid s\n";
    const char* corner[4] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    for (const auto& face : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{1, 2, 3}, std::array{0, 3, 2}}) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int k : face) text += std::string("vertex ") + corner[k] + "\n";
        text += "endloop\nendfacet\n";
    }
    const auto parts = read_surface_mesh(write("s.stl", text + "endsolid s\n"));
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].vertices.size(), 4U);
    EXPECT_NEAR(volume(parts[0]), 1.0 / 6.0, 1e-12);
}

TEST_F(MeshFile, PolygonsBecomeTriangles) {
    const auto parts = read_surface_mesh(write(
        "cube.off",
        "OFF\n8 6 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 "
        "7 3\n4 0 4 6 2\n4 1 3 7 5\n"));
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].triangles.size(), 12U);
    EXPECT_NEAR(volume(parts[0]), 1.0, 1e-12);
}

TEST_F(MeshFile, WrongSurfacesAreToldInOneSentence) {
    const auto told = [&](const std::string& name, const std::string& text, double scale = 1.0) {
        const auto file = write(name, text);
        return refusal([&] { static_cast<void>(read_surface_mesh(file, scale)); });
    };
    std::string open = tetrahedron(0, 0);
    open.resize(open.size() - 8);
    EXPECT_EQ(told("open.obj", open).rfind("open.obj: the mesh is open at the edge from vertex ", 0), 0U);
    std::string turned = tetrahedron(0, 0);
    turned.replace(turned.find("f 1 3 2"), 7, "f 1 2 3");
    EXPECT_EQ(told("turned.obj", turned).rfind("turned.obj: two triangles of the mesh run from vertex ", 0), 0U);
    EXPECT_EQ(told("two.obj", tetrahedron(0, 0) + "v 9 0 0\nv 10 0 0\nv 9 1 0\nf 5 6 7\n")
                  .rfind("two.obj, part 2: the mesh is open at the edge from vertex ", 0),
              0U);
    EXPECT_EQ(told("text.obj", "no mesh\n").rfind("text.obj: ", 0), 0U);
    EXPECT_EQ(told("text.xyzw", "no mesh\n").rfind("text.xyzw: no mesh can be read: ", 0), 0U);
    EXPECT_EQ(told("scaled.obj", tetrahedron(0, 0), -1.0), "the scale of a mesh is -1; it must be positive");
    EXPECT_EQ(refusal([] { static_cast<void>(read_surface_mesh("none.obj")); }), "none.obj: there is no such file");
}

/// A cube of this size about (at, at, −at) m, its faces as lists of corners.
struct Cube {
    double size, at;

    static constexpr int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                        {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    [[nodiscard]] std::string corner(int k) const {
        const auto x = [&](int bit, double middle) { return middle + ((k >> bit & 1) != 0 ? 0.5 : -0.5) * size; };
        return fmt::format("{:.17g} {:.17g} {:.17g}", x(2, at), x(1, at), x(0, -at));
    }
    [[nodiscard]] std::string obj() const {
        std::string text = "# a cube\r\n";
        for (int k = 0; k < 8; ++k) text += fmt::format("v  {}\r\n", corner(k));
        for (const auto& f : faces) text += fmt::format("f {} {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[3] + 1);
        return text;
    }
    [[nodiscard]] std::string ply(const std::string& last = "3 1 5 7 3") const {
        std::string text =
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty uchar red\nproperty double x\nproperty double "
            "y\nproperty "
            "double z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n";
        for (int k = 0; k < 8; ++k) text += fmt::format("7 {}\n", corner(k));
        for (int k = 0; k < 5; ++k)
            text += fmt::format("4 {} {} {} {}\n", faces[k][0], faces[k][1], faces[k][2], faces[k][3]);
        return text + last + "\n";
    }
    [[nodiscard]] std::string stl() const {
        std::string text = "solid s\n";
        for (const auto& f : faces)
            for (const auto& t : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
                text += "facet normal 0 0 0\nouter loop\n";
                for (const int k : t) text += "  vertex " + corner(k) + "\n";
                text += "endloop\nendfacet\n";
            }
        return text + "endsolid s\n";
    }
    [[nodiscard]] std::string off() const {
        std::string text = "OFF\n8 6 0\n";
        for (int k = 0; k < 8; ++k) text += corner(k) + "\n";
        for (const auto& f : faces) text += fmt::format("4 {} {} {} {}\n", f[0], f[1], f[2], f[3]);
        return text;
    }
    /// Six times the volume, about a corner.
    [[nodiscard]] static double volume(const Mesh& mesh) {
        Mesh moved = mesh;
        for (auto& vertex : moved.vertices)
            for (std::size_t i = 0; i < 3; ++i) vertex[i] -= mesh.vertices[0][i];
        return mesh_files_test::volume(moved);
    }
};

TEST_F(MeshFile, ASmallBodyFarFromTheOriginKeepsItsShape) {
    for (const double at : {0.0, 1.0, 1234.567, 4.0e6}) {
        const Cube cube{0.01, at};
        for (const auto& [name, text] :
             {std::pair{"c.obj", cube.obj()}, {"c.ply", cube.ply("4 1 5 7 3")}, {"c.STL", cube.stl()}}) {
            const auto parts = read_surface_mesh(write(name, text));
            ASSERT_EQ(parts.size(), 1U) << name;
            EXPECT_EQ(parts[0].vertices.size(), 8U) << name;
            // The text's own digits: 17 of the coordinates.
            EXPECT_NEAR(Cube::volume(parts[0]) / 1e-6, 1.0, 1e-6 + 1e-15 * at / cube.size) << name << " at " << at;
            double middle = 0.0;
            for (const auto& vertex : parts[0].vertices) middle += vertex[1] / 8.0;
            EXPECT_NEAR(middle, at, 1e-9 + 1e-15 * at) << name;
        }
    }
}

TEST_F(MeshFile, LostDigitsAreTold) {
    const auto told = [&](const std::string& name, const std::string& text) {
        const auto file = write(name, text);
        return refusal([&] { static_cast<void>(read_surface_mesh(file)); });
    };
    EXPECT_EQ(told("near.off", Cube{0.01, 1.0}.off()), "taken");
    const std::string far = told("far.off", Cube{1.0, 4000.0}.off());
    EXPECT_NE(far.find("single precision, with an error of 2.4e-04 m"), std::string::npos) << far;
    // Two bodies in one file, far from each other.
    const std::string two = told("two.obj", tetrahedron(0, 0) + tetrahedron(100000, 4));
    EXPECT_EQ(two.rfind("two.obj, part 1: a surface of size", 0), 0U) << two;
}

TEST_F(MeshFile, NumbersAreCheckedBeforeTheyAreUsed) {
    const auto told = [&](const std::string& name, const std::string& text) {
        const auto file = write(name, text);
        return refusal([&] { static_cast<void>(read_surface_mesh(file)); });
    };
    const Cube cube{1.0, 0.0};
    EXPECT_EQ(told("beyond.ply", cube.ply("4 1 5 333 3")).find("beyond.ply: triangle "), 0U)
        << told("beyond.ply", cube.ply("4 1 5 333 3"));
    EXPECT_NE(told("beyond.ply", cube.ply("4 1 5 333 3")).find("has the vertex 334, and there are "),
              std::string::npos);
    EXPECT_NE(told("below.ply", cube.ply("4 1 5 -7 3")), "taken");
    std::string obj = cube.obj();
    obj.replace(obj.rfind("8"), 1, "999");
    EXPECT_NE(told("beyond.obj", obj), "taken");
    std::string nan = cube.obj();
    const auto place = nan.find("0.5 0.5 0.5");
    nan.replace(place, 3, "nan");
    const auto line = 1 + std::count(nan.begin(), nan.begin() + static_cast<std::ptrdiff_t>(place), '\n');
    EXPECT_EQ(told("nan.obj", nan), "nan.obj, line " + std::to_string(line) + ": the vertex is not finite");
    std::string infinite = cube.stl();
    infinite.replace(infinite.find("0.5"), 3, "1e999");
    EXPECT_NE(told("infinite.stl", infinite).find("not finite"), std::string::npos);
}

#endif

#ifdef DELASSUS_HAS_NETGEN

/// Two tetrahedra that share a face, or what `elements` says, as Netgen writes them.
std::string netgen(const std::string& elements, const std::string& points = "5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n") {
    return "mesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelements\n0\nvolumeelements\n" + elements +
           "edgesegmentsgi2\n0\npoints\n" + points + "endmesh\n";
}

double volume(const TetrahedralMesh& mesh) {
    double sum = 0.0;
    for (const auto& element : mesh.tetrahedra) {
        std::array<Vector3, 3> e;
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < 3; ++i)
                e[k][i] = mesh.vertices[static_cast<std::size_t>(element[k + 1])][i] -
                          mesh.vertices[static_cast<std::size_t>(element[0])][i];
        sum += (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) + e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
               6.0;
    }
    return sum;
}

TEST_F(MeshFile, NetgenFileHasItsTetrahedra) {
    const auto mesh = read_tetrahedral_mesh(write("two.vol", netgen("2\n1 4 1 3 2 4\n1 4 2 3 5 4\n")), 2.0);
    EXPECT_EQ(mesh.vertices.size(), 5U);
    EXPECT_EQ(mesh.tetrahedra.size(), 2U);
    EXPECT_NEAR(volume(mesh), 8.0 * (1.0 / 6.0 + 1.0 / 3.0), 1e-12);
}

TEST_F(MeshFile, WrongTetrahedraAreToldInOneSentence) {
    const auto told = [&](const std::string& name, const std::string& text) {
        const auto file = write(name, text);
        return refusal([&] { static_cast<void>(read_tetrahedral_mesh(file)); });
    };
    EXPECT_EQ(told("i.vol", netgen("2\n1 4 1 3 2 4\n1 4 2 5 3 4\n")),
              "i.vol: element 2 is inverted, with the volume -0.333 m³");
    EXPECT_EQ(told("u.vol", netgen("1\n1 4 1 3 2 4\n")), "u.vol: point 5 belongs to no element");
    EXPECT_EQ(told("n.vol", netgen("3\n1 4 1 3 2 4\n1 4 2 3 5 4\n1 4 2 3 5 4\n")),
              "n.vol: more than two elements share the face of points 2, 3, 4, the last of them element 3");
    EXPECT_EQ(told("e.vol", netgen("0\n")), "e.vol: it has no tetrahedra");
    EXPECT_EQ(told("t.vol", "no mesh\n"), "t.vol: it has no tetrahedra");
    EXPECT_EQ(told("r.vol", netgen("1\n1 4 1 3 2 9\n")), "r.vol is damaged: Netgen fails on it.");
    EXPECT_EQ(told("c.vol", netgen("2\n1 4 1 3 2 4\n").substr(0, 90)), "c.vol is damaged: Netgen fails on it.");
    EXPECT_EQ(refusal([] { static_cast<void>(read_tetrahedral_mesh("none.vol")); }), "none.vol: there is no such file");
}

#ifdef DELASSUS_HAS_ASSIMP
TEST_F(MeshFile, SurfaceIsFilledWithTetrahedra) {
    const auto file =
        std::filesystem::path(tests::places::source) / "examples" / "scenes" / "meshes" / "icosahedron.obj";
    const double exact = 5.0 * (3.0 + std::sqrt(5.0)) / 12.0 * 1e-3;
    const auto coarse = read_tetrahedral_mesh(file);
    EXPECT_NEAR(volume(coarse) / exact, 1.0, 1e-6);
    EXPECT_GE(coarse.vertices.size(), 12U);
    const auto again = read_tetrahedral_mesh(file);
    EXPECT_EQ(coarse.vertices, again.vertices) << "equal files give equal meshes";
    EXPECT_EQ(coarse.tetrahedra, again.tetrahedra);
    const auto fine = read_tetrahedral_mesh(file, 2.0, 1);
    EXPECT_EQ(fine.tetrahedra.size(), 8 * coarse.tetrahedra.size());
    EXPECT_NEAR(volume(fine) / exact, 8.0, 1e-5);
    EXPECT_THROW(static_cast<void>(read_tetrahedral_mesh(file, 1.0, -1)), InputError);
}
#endif

#endif

}  // namespace
}  // namespace delassus::mesh_files_test
