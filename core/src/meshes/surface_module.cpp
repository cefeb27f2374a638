// SPDX-License-Identifier: BSD-3-Clause
// Surfaces through assimp; see mechanics/mesh_modules.hpp.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <type_traits>

#include "delassus/error.hpp"
#include "mechanics/mesh_modules.hpp"
#include "meshes/mesh_bytes.hpp"
#include "meshes/text_vertices.hpp"
#include "support/call_in_child.hpp"
#include "support/text_file.hpp"

namespace {

delassus::Mesh read(const std::filesystem::path& file, delassus::Vector3& middle) {
    delassus::Mesh mesh;
    Assimp::Importer importer;
    // Nodes are put where the file's hierarchy has them. Points and lines are left out.
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    constexpr unsigned steps = aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType;
    const std::string text = delassus::read_file(file);
    const delassus::meshes::TextVertices vertices(file, text);
    middle = vertices.empty() ? delassus::Vector3{} : vertices.middle();
    const std::string moved = vertices.empty() ? std::string() : vertices.moved_by(middle);
    const aiScene* scene =
        vertices.empty() ? importer.ReadFile(file.string(), steps)
                         : importer.ReadFileFromMemory(moved.data(), moved.size(), steps, file.extension().c_str() + 1);
    if (scene == nullptr)
        throw delassus::InputError(
            fmt::format("{}: no mesh can be read: {}", file.string(), importer.GetErrorString()));
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        const auto first = static_cast<std::int32_t>(mesh.vertices.size());
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiVector3D& p = part.mVertices[i];
            mesh.vertices.push_back({middle[0] + p.x, middle[1] + p.y, middle[2] + p.z});
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

extern "C" DELASSUS_API void delassus_surface_mesh_read(const std::filesystem::path& file, delassus::Mesh& mesh,
                                                        delassus::Vector3& middle) {
    using namespace delassus;
    const std::string bytes = call_in_child(file, "assimp", meshes::seconds_to_read(file), [&] {
        Vector3 of_file{};
        const Mesh found = read(file, of_file);
        return std::string(reinterpret_cast<const char*>(of_file.data()), sizeof of_file) +
               meshes::pack(found.vertices, found.triangles);
    });
    std::memcpy(middle.data(), bytes.data(), sizeof middle);
    meshes::unpack(bytes.substr(sizeof middle), mesh.vertices, mesh.triangles);
}

static_assert(std::is_same_v<decltype(&delassus_surface_mesh_read), DelassusSurfaceMeshRead>);
