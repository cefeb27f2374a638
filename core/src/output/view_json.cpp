// SPDX-License-Identifier: BSD-3-Clause
#include "output/view_json.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "delassus/version.hpp"
#include "support/json.hpp"

namespace delassus {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

/// RFC 4648, with padding.
std::string base64(std::span<const unsigned char> bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
        std::uint32_t group = 0;
        for (std::size_t i = 0; i < 3; ++i) group = group << 8U | (i < count ? bytes[at + i] : 0U);
        for (std::size_t i = 0; i < 4; ++i) text += i <= count ? digits[group >> (18U - 6U * i) & 63U] : '=';
    }
    return text;
}

/// values as Numbers in base64.
template <class Number, class Range>
std::string packed(const Range& values) {
    const std::vector<Number> numbers(values.begin(), values.end());
    return base64({reinterpret_cast<const unsigned char*>(numbers.data()), numbers.size() * sizeof(Number)});
}

Json shapes(const std::vector<Shape>& shapes) {
    Json list = Json::array();
    for (const auto& shape : shapes) {
        Json one = {{"kind", shape_names[static_cast<std::size_t>(shape.kind)]},
                    {"body", shape.body},
                    {"size", shape.size},
                    {"position", shape.pose.position},
                    {"orientation", shape.pose.orientation}};
        if (shape.mesh) {
            one["vertices"] = shape.mesh->vertices;
            one["triangles"] = shape.mesh->triangles;
        }
        list.push_back(std::move(one));
    }
    return list;
}

Json links(const std::vector<TrajectoryLink>& links) {
    Json list = Json::array();
    for (const auto& link : links)
        list.push_back({{"name", link.name}, {"kind", link.kind}, {"bodies", link.bodies}, {"points", link.points}});
    return list;
}

/// The poses of moving bodies for each frame, and those of fixed bodies once.
void add_poses(const RecordedSystem& system, Json& json) {
    constexpr std::ptrdiff_t size = 7;
    const auto bodies = static_cast<std::ptrdiff_t>(system.model.bodies.size());
    std::vector<double> moving;
    Json fixed = Json::object();
    for (std::ptrdiff_t frame = 0; frame < static_cast<std::ptrdiff_t>(system.t.size()); ++frame)
        for (std::ptrdiff_t body = 0; body < bodies; ++body) {
            const auto at = system.poses.begin() + (frame * bodies + body) * size;
            if (system.model.fixed[static_cast<std::size_t>(body)] == 0) {
                moving.insert(moving.end(), at, at + size);
            } else if (frame == 0) {
                fixed[std::to_string(body)] = std::vector<double>(at, at + size);
            }
        }
    json["poses"] = packed<float>(moving);
    json["fixed_poses"] = std::move(fixed);
}

/// The nodes that something shows, numbered anew.
void add_nodes(const RecordedSystem& system, Json& json) {
    const auto& model = system.model;
    std::vector<std::int32_t> shown = model.loose;
    for (const auto& triangle : model.surface) shown.insert(shown.end(), triangle.begin(), triangle.end());
    for (const auto& cable : model.cables) shown.insert(shown.end(), cable.begin(), cable.end());
    std::sort(shown.begin(), shown.end());
    shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
    std::vector<std::int32_t> place(model.nodes.size(), -1);
    for (std::size_t i = 0; i < shown.size(); ++i)
        place[static_cast<std::size_t>(shown[i])] = static_cast<std::int32_t>(i);
    const auto renumbered = [&](const auto& elements) {
        std::vector<std::int32_t> indices;
        for (const auto& element : elements)
            for (const auto node : element) indices.push_back(place[static_cast<std::size_t>(node)]);
        return packed<std::int32_t>(indices);
    };
    std::vector<double> positions;
    for (std::size_t frame = 0; frame < system.t.size(); ++frame)
        for (const auto node : shown) {
            const double* at = system.nodes.data() + 3 * (frame * model.nodes.size() + static_cast<std::size_t>(node));
            positions.insert(positions.end(), at, at + 3);
        }
    std::vector<std::array<std::int32_t, 1>> loose;
    for (const auto node : model.loose) loose.push_back({node});
    json["node_count"] = shown.size();
    json["nodes"] = packed<float>(positions);
    json["surface"] = renumbered(model.surface);
    json["cables"] = renumbered(model.cables);
    json["loose"] = renumbered(loose);
}

Json json_of(const RecordedSystem& system) {
    Json json = {{"name", system.name},
                 {"integrator", system.integrator},
                 {"solver", system.solver},
                 {"step", system.step},
                 {"steps", system.steps},
                 {"frames", system.frames},
                 {"gravity", system.model.gravity},
                 {"bodies", system.model.bodies},
                 {"fixed", system.model.fixed},
                 {"shapes", shapes(system.model.shapes)},
                 {"links", links(system.model.links)},
                 {"t", packed<double>(system.t)}};
    add_poses(system, json);
    add_nodes(system, json);
    json["contact_end"] = packed<std::int32_t>(system.contact_end);
    json["contacts"] = packed<float>(system.contacts);
    json["contacts_left_out"] = system.contacts_left_out;
    json["series"] = Json::array();
    for (const auto& series : system.series)
        json["series"].push_back({{"name", series.name},
                                  {"unit", series.unit},
                                  {"description", series.description},
                                  {"t", packed<double>(series.t)},
                                  {"values", packed<double>(series.values)}});
    return json;
}

}  // namespace

std::string view_json(const RecordedRun& run) {
    Json json = {{"delassus", DELASSUS_VERSION},
                 {"title", run.title},
                 {"status", run.status},
                 {"message", run.message},
                 {"systems", Json::array()}};
    for (const auto& system : run.systems) json["systems"].push_back(json_of(system));
    return json_text(json);
}

}  // namespace delassus
