// SPDX-License-Identifier: BSD-3-Clause
// Tetrahedra through Netgen's library; see mechanics/mesh_modules.hpp.
#include <fmt/format.h>

#include <memory>
#include <type_traits>

#include "delassus/error.hpp"
#include "mechanics/mesh_modules.hpp"
#include "meshes/mesh_bytes.hpp"
#include "support/call_in_child.hpp"

namespace nglib {
#include <nglib.h>
}

namespace {

using delassus::InputError;
using delassus::TetrahedralMesh;

struct Delete {
    void operator()(nglib::Ng_Mesh* mesh) const { nglib::Ng_DeleteMesh(mesh); }
};
using MeshPointer = std::unique_ptr<nglib::Ng_Mesh, Delete>;

void take(nglib::Ng_Mesh* from, const std::string& who, TetrahedralMesh& mesh) {
    for (int i = 1; i <= nglib::Ng_GetNP(from); ++i) {
        delassus::Vector3 point{};
        nglib::Ng_GetPoint(from, i, point.data());
        mesh.vertices.push_back(point);
    }
    for (int i = 1; i <= nglib::Ng_GetNE(from); ++i) {
        int corners[NG_VOLUME_ELEMENT_MAXPOINTS];
        if (nglib::Ng_GetVolumeElement(from, i, corners) != nglib::NG_TET)
            throw InputError(fmt::format("{}: element {} is no tetrahedron of four points", who, i));
        // Netgen's tetrahedra have the opposite orientation.
        mesh.tetrahedra.push_back({corners[0] - 1, corners[2] - 1, corners[1] - 1, corners[3] - 1});
    }
}

/// Processor time to fill a surface, s.
constexpr unsigned seconds_to_fill = 600;

/// Runs work(mesh) in a child process and takes the mesh over.
template <class Work>
void in_child(const std::filesystem::path& file, unsigned seconds, TetrahedralMesh& mesh, Work&& work) {
    const std::string bytes = delassus::call_in_child(file, "Netgen", seconds, [&] {
        nglib::Ng_Init();
        TetrahedralMesh made;
        work(made);
        return delassus::meshes::pack(made.vertices, made.tetrahedra);
    });
    delassus::meshes::unpack(bytes, mesh.vertices, mesh.tetrahedra);
}

}  // namespace

extern "C" DELASSUS_API void delassus_volume_mesh_read(const std::filesystem::path& file, TetrahedralMesh& mesh) {
    in_child(file, delassus::meshes::seconds_to_read(file), mesh, [&](TetrahedralMesh& made) {
        const MeshPointer loaded(nglib::Ng_LoadMesh(file.c_str()));
        take(loaded.get(), file.string(), made);
    });
}

extern "C" DELASSUS_API void delassus_volume_mesh_fill(const delassus::Mesh& surface, int refinements,
                                                       const std::filesystem::path& file, TetrahedralMesh& mesh) {
    in_child(file, seconds_to_fill, mesh, [&](TetrahedralMesh& made) {
        const MeshPointer filled(nglib::Ng_NewMesh());
        for (auto point : surface.vertices) nglib::Ng_AddPoint(filled.get(), point.data());
        for (const auto& triangle : surface.triangles) {
            int corners[3] = {triangle[0] + 1, triangle[1] + 1, triangle[2] + 1};
            nglib::Ng_AddSurfaceElement(filled.get(), nglib::NG_TRIG, corners);
        }
        nglib::Ng_Meshing_Parameters parameters;
        if (nglib::Ng_GenerateVolumeMesh(filled.get(), &parameters) != nglib::NG_OK)
            throw InputError(fmt::format("{}: Netgen cannot fill it with tetrahedra", file.string()));
        for (int i = 0; i < refinements; ++i) nglib::Ng_Uniform_Refinement(filled.get());
        take(filled.get(), file.string(), made);
    });
}

static_assert(std::is_same_v<decltype(&delassus_volume_mesh_read), DelassusVolumeMeshRead>);
static_assert(std::is_same_v<decltype(&delassus_volume_mesh_fill), DelassusVolumeMeshFill>);
