// SPDX-License-Identifier: BSD-3-Clause
// Surfaces through assimp; see mechanics/mesh_modules.hpp.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <type_traits>

#include "delassus/error.hpp"
#include "mechanics/mesh_modules.hpp"
#include "meshes/mesh_bytes.hpp"
#include "support/call_in_child.hpp"

namespace {

delassus::Mesh read(const std::filesystem::path& file) {
    delassus::Mesh mesh;
    Assimp::Importer importer;
    // Nodes are put where the file's hierarchy has them. Points and lines are left out.
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = importer.ReadFile(
        file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType);
    if (scene == nullptr)
        throw delassus::InputError(
            fmt::format("{}: no mesh can be read: {}", file.string(), importer.GetErrorString()));
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        const auto first = static_cast<std::int32_t>(mesh.vertices.size());
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiVector3D& p = part.mVertices[i];
            mesh.vertices.push_back({p.x, p.y, p.z});
        }
        for (unsigned i = 0; i < part.mNumFaces; ++i) {
            const aiFace& face = part.mFaces[i];
            if (face.mNumIndices != 3) continue;
            std::array<std::int32_t, 3> triangle{};
            for (unsigned k = 0; k < 3; ++k) triangle[k] = first + static_cast<std::int32_t>(face.mIndices[k]);
            mesh.triangles.push_back(triangle);
        }
    }
    if (mesh.triangles.empty()) throw delassus::InputError(fmt::format("{}: it has no triangles", file.string()));
    return mesh;
}

}  // namespace

extern "C" DELASSUS_API void delassus_surface_mesh_read(const std::filesystem::path& file, delassus::Mesh& mesh) {
    using namespace delassus;
    const std::string bytes = call_in_child(file, "assimp", meshes::seconds_to_read(file), [&] {
        const Mesh found = read(file);
        return meshes::pack(found.vertices, found.triangles);
    });
    meshes::unpack(bytes, mesh.vertices, mesh.triangles);
}

static_assert(std::is_same_v<decltype(&delassus_surface_mesh_read), DelassusSurfaceMeshRead>);
