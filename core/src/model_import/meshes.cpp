// SPDX-License-Identifier: BSD-3-Clause
// Meshes in files that a model names, and where such files are.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"
#include "mechanics/convex_hull.hpp"
#include "model_import/mesh_reading.hpp"
#include "model_import/model.hpp"

namespace delassus::model_import {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
    std::error_code error;
    return fs::exists(path, error);
}

std::vector<fs::path> folders_in(const char* variable, const char* below) {
    std::vector<fs::path> folders;
    const char* value = std::getenv(variable);
    std::string text = value != nullptr ? value : "";
    while (!text.empty()) {
        const auto colon = text.find(':');
        if (colon != 0) folders.push_back(fs::path(text.substr(0, colon)) / below);
        text = colon == std::string::npos ? "" : text.substr(colon + 1);
    }
    return folders;
}

Vector3d point_of(const Mesh& mesh, std::int32_t vertex) {
    return Eigen::Map<const Vector3d>(mesh.vertices[static_cast<std::size_t>(vertex)].data());
}

/// Whether no vertex lies before a face, by more than 1e-6 of the size.
bool is_convex(const Mesh& mesh) {
    Eigen::AlignedBox3d box;
    for (std::size_t k = 0; k < mesh.vertices.size(); ++k) box.extend(point_of(mesh, static_cast<std::int32_t>(k)));
    const double most = 1e-6 * box.diagonal().norm();
    return std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& triangle) {
        const Vector3d a = point_of(mesh, triangle[0]);
        const Vector3d normal = (point_of(mesh, triangle[1]) - a).cross(point_of(mesh, triangle[2]) - a).normalized();
        for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
            if (normal.dot(point_of(mesh, static_cast<std::int32_t>(k)) - a) > most) return false;
        return true;
    });
}

}  // namespace

fs::path find_file(const std::string& address, const fs::path& model, const std::vector<fs::path>& folders) {
    const fs::path folder = model.parent_path();
    const auto mark = address.find("://");
    const std::string scheme = mark == std::string::npos ? "" : address.substr(0, mark);
    fs::path rest = mark == std::string::npos ? address : address.substr(mark + 3);
    if (scheme.empty() || scheme == "file") {
        const fs::path file = rest.is_absolute() ? rest : folder / rest;
        return is_there(file) ? file : fs::path();
    }
    if ((scheme != "package" && scheme != "model") || rest.empty()) return {};
    if (rest.is_absolute()) {  // package:///
        if (is_there(rest)) return rest;
        rest = rest.relative_path();
        if (rest.empty()) return {};
    }
    for (const fs::path& place : folders) {
        if (is_there(place / rest)) return place / rest;
        if (place.filename() == *rest.begin() && is_there(place.parent_path() / rest))
            return place.parent_path() / rest;
    }
    // The first part names a folder, which lies somewhere above the model or beside such a folder.
    const fs::path name = *rest.begin();
    for (fs::path above = folder;; above = above.parent_path()) {
        if (is_there(above / rest)) return above / rest;
        if (above.filename() == name && is_there(above.parent_path() / rest)) return above.parent_path() / rest;
        if (above == above.root_path() || above.empty()) break;
    }
    for (const auto& [variable, below] : {std::pair("ROS_PACKAGE_PATH", ""), std::pair("AMENT_PREFIX_PATH", "share"),
                                          std::pair("GAZEBO_MODEL_PATH", ""), std::pair("GZ_SIM_RESOURCE_PATH", ""),
                                          std::pair("IGN_GAZEBO_RESOURCE_PATH", ""), std::pair("SDF_PATH", "")})
        for (const fs::path& place : folders_in(variable, below)) {
            if (is_there(place / rest)) return place / rest;
            if (place.filename() == name && is_there(place.parent_path() / rest)) return place.parent_path() / rest;
        }
    return {};
}

void add_mesh(Model& model, const ModelShape& at, const std::string& address, const Vector3d& scale,
              const fs::path& model_file, const std::string& what, std::vector<ModelShape>& shapes) {
    const fs::path file = find_file(address, model_file, model.package_paths);
    if (file.empty() || std::filesystem::is_directory(file))
        return model.lose(what, fmt::format("its mesh \"{}\" is not there", address));
    if (!((scale.array() != 0.0).all() && scale.allFinite()))
        return model.lose(what, fmt::format("the scale of its mesh is {}, {}, {}", scale.x(), scale.y(), scale.z()));
    const bool plain = scale.x() > 0.0 && scale.x() == scale.y() && scale.x() == scale.z();
    std::vector<Mesh> parts;
    bool open = false;
    try {
        parts = read_surface_mesh(file, 1.0);
    } catch (const InputError& error) {
        try {
            const RawMesh raw = read_raw_mesh(file);
            Mesh& mesh = parts.emplace_back();
            for (const Vector3d& point : raw.points) mesh.vertices.push_back(array(point));
            open = true;
        } catch (const InputError&) {
            return model.lose(what, fmt::format("its mesh is of no use: {}", error.what()));
        }
    }
    if (open) {
        const ConvexHull hull = convex_hull(parts[0].vertices);
        if (hull.vertices.empty()) return model.lose(what, "a mesh without volume: left out");
        parts[0].vertices = hull.vertices;
        parts[0].triangles.clear();
        for (const auto& face : hull.faces)
            for (std::size_t k = 2; k < face.size(); ++k) parts[0].triangles.push_back({face[0], face[k - 1], face[k]});
    }
    if (open)
        model.lose(what, "an open mesh: the convex hull of its points collides");
    else if (!std::all_of(parts.begin(), parts.end(), is_convex))
        model.lose(what, "a concave mesh: the convex hulls of its parts collide");
    if (plain && !open) {
        ModelShape& shape = shapes.emplace_back(at);
        shape.form = Form::MeshFile;
        shape.file = file;
        shape.scale = scale.x();
        return;
    }
    const bool turned_out = scale.prod() < 0.0;  // a mirror image has its triangles the other way round
    for (const Mesh& part : parts) {
        ModelShape& shape = shapes.emplace_back(at);
        shape.form = Form::Hull;
        shape.name = file.stem().string();
        for (std::size_t k = 0; k < part.vertices.size(); ++k)
            shape.points.push_back(scale.cwiseProduct(point_of(part, static_cast<std::int32_t>(k))));
        shape.triangles = part.triangles;
        if (turned_out)
            for (auto& triangle : shape.triangles) std::swap(triangle[1], triangle[2]);
    }
}

ModelShape ellipsoid(Model& model, ModelShape at, const Vector3d& radii, const std::string& what) {
    if ((radii.array() == radii.x()).all()) {
        at.form = Form::Sphere;
        at.size.x() = radii.x();
        return at;
    }
    at.form = Form::Hull;
    for (const Vector3d& point : sphere_points()) at.points.push_back(radii.cwiseProduct(point));
    model.lose(what, "an ellipsoid: a polyhedron of 162 points in its surface stands in");
    return at;
}

void keep_all_apart(Model& model, const std::vector<std::int32_t>& bodies) {
    const auto touches = [&](std::int32_t body) {
        return !model.bodies[static_cast<std::size_t>(body)].shapes.empty();
    };
    for (std::size_t a = 0; a < bodies.size(); ++a)
        for (std::size_t b = a + 1; b < bodies.size(); ++b)
            if (touches(bodies[a]) && touches(bodies[b])) model.apart.push_back({bodies[a], bodies[b]});
}

}  // namespace delassus::model_import
