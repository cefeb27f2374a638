// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/model_import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "delassus/error.hpp"
#include "model_import/model.hpp"
#include "problem/cone_kinds.hpp"
#include "support/call_in_child.hpp"
#include "support/module.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace model_import {
namespace {

struct Format {
    const char *root, *name, *module, *symbol, *library;
};

constexpr std::array<Format, 3> formats = {
    {{"mujoco", "MJCF", "delassus_import_mjcf", "delassus_import_mjcf_read", "tinyxml2"},
     {"robot", "URDF", "delassus_import_urdf", "delassus_import_urdf_read", "liburdfdom"},
     {"sdf", "SDF", "delassus_import_sdf", "delassus_import_sdf_read", "libsdformat"}}};

/// Visits the tags of elements, without their brackets, in their order, until visit returns false.
template <class Visitor>
void for_each_tag(std::string_view text, Visitor&& visit) {
    for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
        const auto skip = [&](std::string_view begin, std::string_view end) {
            if (text.compare(at, begin.size(), begin) != 0) return false;
            at = text.find(end, at + begin.size());
            return true;
        };
        if (skip("<!--", "-->") || skip("<![CDATA[", "]]>") || skip("<?", "?>") || skip("<!", ">")) continue;
        std::size_t end = at + 1;
        for (char quote = '\0'; end < text.size() && (quote != '\0' || text[end] != '>'); ++end) {
            if (text[end] == quote)
                quote = '\0';
            else if (quote == '\0' && (text[end] == '"' || text[end] == '\''))
                quote = text[end];
        }
        if (!visit(text.substr(at + 1, end - at - 1))) return;
        at = end;
    }
}

/// The name of the first element.
std::string root_of(const std::string& text) {
    std::string root;
    for_each_tag(text, [&](std::string_view tag) {
        root = tag.substr(0, tag.find_first_of(" \t\r\n/"));
        return false;
    });
    return root;
}

// The libraries that read models take a call for each level, and use up the stack.
void check_nesting(const std::string& text, const std::filesystem::path& file) {
    constexpr int most = 1000;
    int depth = 0;
    for_each_tag(text, [&](std::string_view tag) {
        if (tag.starts_with('/'))
            --depth;
        else if (!tag.ends_with('/'))
            ++depth;
        if (depth > most)
            throw InputError(fmt::format("{}: its elements are nested more than {} deep", file.string(), most));
        return true;
    });
}

const Format& format_of(const std::filesystem::path& file) {
    const std::string text = read_file(file);
    check_nesting(text, file);
    const std::string root = root_of(text);
    for (const Format& one : formats)
        if (root == one.root) return one;
    throw InputError(fmt::format("{}: {}; a model is an XML file with the root <mujoco>, <robot> or <sdf>",
                                 file.string(),
                                 root.empty() ? "it has no XML element" : fmt::format("its root is <{}>", root)));
}

/// Simulators whose contacts are soft take any friction, and models use 1e15 for "never slides".
void bound_frictions(Model& model) {
    const double most = operations_of(ConeKind::Friction).named_parameters()[0].most;
    const auto bound = [&](double& friction, const std::string& what) {
        if (!(friction > most)) return;
        model.lose(what, fmt::format("a friction of {:.6g}: it becomes {:.6g}, the largest of scenes", friction, most));
        friction = most;
    };
    for (auto& material : model.materials) bound(material.friction, fmt::format("material \"{}\"", material.name));
    for (auto& pair : model.material_pairs)
        bound(pair.friction, fmt::format("the pair of materials \"{}\" and \"{}\"",
                                         model.materials[static_cast<std::size_t>(pair.first)].name,
                                         model.materials[static_cast<std::size_t>(pair.second)].name));
}

}  // namespace

std::string Names::take(const std::string& wanted, const std::string& otherwise) {
    const std::string base = wanted.empty() ? otherwise : wanted;
    const auto is_taken = [&](const std::string& name) {
        return name == "world" || std::find(taken_.begin(), taken_.end(), name) != taken_.end();
    };
    std::string name = base;
    for (int k = 2; is_taken(name); ++k) name = fmt::format("{}_{}", base, k);
    taken_.push_back(name);
    return name;
}

std::array<double, 2> nearest_fraction(double ratio) {
    // Continued fractions until the terms become too long.
    double before_n = 0.0, before_d = 1.0, n = 1.0, d = 0.0, rest = std::abs(ratio);
    for (int step = 0; step < 40; ++step) {
        const double whole = std::floor(rest);
        const double next_n = whole * n + before_n, next_d = whole * d + before_d;
        if (next_n >= 1000.0 || next_d >= 1000.0) break;
        before_n = std::exchange(n, next_n);
        before_d = std::exchange(d, next_d);
        if (std::abs(n / d - std::abs(ratio)) <= 1e-12 * std::abs(ratio) || rest == whole) break;
        rest = 1.0 / (rest - whole);
    }
    return {std::copysign(n, ratio), d};
}

std::vector<Vector3d> sphere_points() {
    const double golden = 0.5 * (1.0 + std::sqrt(5.0));
    std::vector<Vector3d> points;
    for (const double a : {-1.0, 1.0})
        for (const double b : {-golden, golden})
            for (int axis = 0; axis < 3; ++axis) {
                Vector3d point = Vector3d::Zero();
                point[axis] = a;
                point[(axis + 1) % 3] = b;
                points.push_back(point.normalized());
            }
    double edge = 2.0 / std::sqrt(1.0 + golden * golden);
    for (int level = 0; level < 2; ++level) {
        const std::size_t count = points.size();
        double shortest = 2.0;
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = i + 1; j < count; ++j)
                if ((points[i] - points[j]).norm() < 1.25 * edge) {
                    points.push_back((points[i] + points[j]).normalized());
                    shortest = std::min(shortest, (points.back() - points[i]).norm());
                }
        edge = shortest;
    }
    return points;
}

}  // namespace model_import

ImportedScene import_model(const std::filesystem::path& file, const std::filesystem::path& scene,
                           const ImportSettings& settings) {
    using namespace model_import;
    if (!(settings.end > 0.0) || !std::isfinite(settings.end))
        throw InputError(fmt::format("the end of the scene is {} s; it must be positive", settings.end));
    if (!std::isfinite(settings.height) || settings.height < 0.0)
        throw InputError(fmt::format("the height over the ground is {} m; it must not be negative", settings.height));
    const Format& format = format_of(file);
    if (!settings.keyframe.empty() && std::string_view(format.name) != "MJCF")
        throw InputError(
            fmt::format("{}: only MJCF models have keyframes, and this is {}", file.string(), format.name));
    if (settings.floating && std::string_view(format.name) != "URDF")
        throw InputError(
            fmt::format("{}: {} says itself which bodies float; only the root of a URDF model may be set "
                        "free",
                        file.string(), format.name));
    const auto read = reinterpret_cast<ReadModel*>(
        module_symbol(format.module, format.symbol,
                      fmt::format("{}: {} cannot be imported", file.string(), format.name), format.library));
    const auto read_into = [&](Model& model) {
        try {
            model.package_paths = settings.package_paths;
            read(std::filesystem::absolute(file), settings, model);
            drop_flat_shapes(model);
            if (settings.fixed_base) hold_base(model);
            merge_fixed(model);
            repair_inertias(model);
            bound_frictions(model);
            part_bodies(model, settings.apart);
            if (settings.ground) add_ground(model, settings.height);
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}: {}", file.string(), error.what()));
        }
    };
    // The libraries crash on some files, as on chains of very many links: a child process tries first.
    constexpr unsigned most_seconds = 600;
    call_in_child(file, format.library, most_seconds, [&] {
        Model tried;
        read_into(tried);
        return std::string();
    });
    Model model;
    read_into(model);
    ImportedScene result;
    result.format = format.name;
    write_scene(model, file, scene, settings, result);
    return result;
}

}  // namespace delassus
