// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory/model_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace delassus::trajectory {

using hdf5::Group;
using hdf5::Handle;

namespace {

/// The elements' numbers one after the other.
template <class Number, std::size_t size>
std::vector<Number> flat(const std::vector<std::array<Number, size>>& elements) {
    std::vector<Number> values;
    for (const auto& element : elements) values.insert(values.end(), element.begin(), element.end());
    return values;
}

void write_shapes(hid_t model, const std::vector<Shape>& shapes, const std::string& file) {
    if (shapes.empty()) return;
    std::vector<std::string> kinds;
    std::vector<std::int32_t> bodies, vertex_end, triangle_end, triangles;
    std::vector<double> sizes, poses, vertices;
    for (const auto& shape : shapes) {
        kinds.emplace_back(shape_names[static_cast<std::size_t>(shape.kind)]);
        bodies.push_back(shape.body);
        sizes.insert(sizes.end(), shape.size.begin(), shape.size.end());
        poses.insert(poses.end(), shape.pose.position.begin(), shape.pose.position.end());
        poses.insert(poses.end(), shape.pose.orientation.begin(), shape.pose.orientation.end());
        if (shape.mesh) {
            const auto more_vertices = flat(shape.mesh->vertices);
            const auto more_triangles = flat(shape.mesh->triangles);
            vertices.insert(vertices.end(), more_vertices.begin(), more_vertices.end());
            triangles.insert(triangles.end(), more_triangles.begin(), more_triangles.end());
        }
        vertex_end.push_back(static_cast<std::int32_t>(vertices.size() / 3));
        triangle_end.push_back(static_cast<std::int32_t>(triangles.size() / 3));
    }
    const Handle group = group_in(model, "shapes", false, file);
    const hid_t id = group.get();
    put_texts(id, "kind", kinds, file);
    put_rows(id, {"body", "1", "index of the body, -1: the world"}, bodies, {}, file);
    put_rows(id, {"size", "m", "sphere: radius; box: half edges; capsule, cylinder: radius, half length"}, sizes, {3},
             file);
    put_rows(id, {"pose", "m, 1", "of the shape in its body's frame: position and quaternion w x y z"}, poses, {7},
             file);
    put_rows(id, {"vertex_end", "1", "of convex shapes and terrains: where their vertices end"}, vertex_end, {}, file);
    put_rows(id, {"triangle_end", "1", "of convex shapes and terrains: where their triangles end"}, triangle_end, {},
             file);
    put_rows(id, {"vertices", "m", "of convex shapes and terrains, in the shape's frame"}, vertices, {3}, file);
    put_rows(
        id,
        {"triangles", "1", "of convex shapes and terrains: vertices of the same shape, counter-clockwise from outside"},
        triangles, {3}, file);
}

void write_modes(hid_t model, const std::vector<TrajectoryModes>& bodies, const std::string& file) {
    if (bodies.empty()) return;
    std::vector<std::int32_t> first, entry, modes, end;
    std::vector<double> places, shapes;
    for (const auto& body : bodies) {
        first.push_back(body.first_node);
        entry.push_back(body.entry);
        modes.push_back(body.modes);
        const auto own = flat(body.places);
        places.insert(places.end(), own.begin(), own.end());
        shapes.insert(shapes.end(), body.shapes.begin(), body.shapes.end());
        end.push_back(static_cast<std::int32_t>(places.size() / 3));
    }
    const Handle group = group_in(model, "reduced", false, file);
    const hid_t id = group.get();
    put_rows(id, {"first_node", "1", "of each elastic body of few modes"}, first, {}, file);
    put_rows(id, {"entry", "1", "first entry in frames/q: mass centre, quaternion w x y z, amplitudes"}, entry, {},
             file);
    put_rows(id, {"modes", "1", "their number"}, modes, {}, file);
    put_rows(id, {"place_end", "1", "where the places of its nodes end"}, end, {}, file);
    put_rows(id, {"places", "m", "of the nodes, in the body's frame"}, places, {3}, file);
    put_rows(id, {"shapes", "1", "displacements of the nodes for an amplitude of 1 m, mode after mode"}, shapes, {},
             file);
}

void write_links(hid_t model, const std::vector<TrajectoryLink>& links, const std::string& file) {
    if (links.empty()) return;
    std::vector<std::string> names, kinds;
    std::vector<std::int32_t> bodies;
    std::vector<double> points;
    for (const auto& link : links) {
        names.push_back(link.name);
        kinds.push_back(link.kind);
        bodies.insert(bodies.end(), link.bodies.begin(), link.bodies.end());
        for (const auto& point : link.points) points.insert(points.end(), point.begin(), point.end());
    }
    const Handle group = group_in(model, "links", false, file);
    put_texts(group.get(), "name", names, file);
    put_texts(group.get(), "kind", kinds, file);
    put_rows(group.get(), {"bodies", "1", "indices of the two bodies, -1: the world"}, bodies, {2}, file);
    put_rows(group.get(), {"points", "m", "where it holds each of them, in the body's frame"}, points, {2, 3}, file);
}

/// Datasets of the model, which are absent where they would be empty.
class Reader {
public:
    explicit Reader(const Group& group) : group_(group) {}

    [[nodiscard]] std::vector<std::int32_t> integers(const char* name, std::int64_t least, std::int64_t end,
                                                     std::size_t width = 1) const {
        if (!group_.has(name)) return {};
        const auto values = group_.integers(name, group_.count(name));
        if (values.size() % width != 0) group_.refuse(fmt::format("/{} must have rows of {} numbers", name, width));
        for (const auto value : values)
            if (value < least || value >= end)
                group_.refuse(fmt::format("/{} holds {}, which must be from {} to {}", name, value, least, end - 1));
        return {values.begin(), values.end()};
    }
    [[nodiscard]] std::vector<double> numbers(const char* name, std::size_t width) const {
        if (!group_.has(name)) return {};
        auto values = group_.numbers(name, group_.count(name));
        if (values.size() % width != 0) group_.refuse(fmt::format("/{} must have rows of {} numbers", name, width));
        if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); }))
            group_.refuse(fmt::format("/{} holds a number that is not finite", name));
        return values;
    }
    [[nodiscard]] std::vector<std::string> texts(const char* name) const {
        return group_.has(name) ? group_.texts(name) : std::vector<std::string>{};
    }
    void must_have(const char* name, std::size_t found, std::size_t wanted) const {
        if (found != wanted) group_.refuse(fmt::format("/{} has {} rows, but must have {}", name, found, wanted));
    }
    [[noreturn]] void refuse(const std::string& why) const { group_.refuse(why); }

private:
    const Group& group_;
};

template <class Element, class Number>
std::vector<Element> rows_of(const std::vector<Number>& values) {
    std::vector<Element> rows(values.size() / std::tuple_size_v<Element>);
    for (std::size_t i = 0; i < rows.size(); ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * std::tuple_size_v<Element>),
                    std::tuple_size_v<Element>, rows[i].begin());
    return rows;
}

std::vector<TrajectoryModes> read_modes(const Group& model, std::int64_t nodes) {
    if (!model.has("reduced")) return {};
    const Group group = model.group("reduced");
    const Reader in(group);
    const auto first = in.integers("first_node", 0, nodes), entry = in.integers("entry", 0, std::int64_t{1} << 31),
               modes = in.integers("modes", 1, std::int64_t{1} << 20), end = in.integers("place_end", 0, nodes + 1);
    const auto places = rows_of<Vector3>(in.numbers("places", 3));
    const std::vector<double> shapes = in.numbers("shapes", 1);
    for (const auto& [name, count] :
         {std::pair{"entry", entry.size()}, {"modes", modes.size()}, {"place_end", end.size()}})
        in.must_have(name, count, first.size());
    std::vector<TrajectoryModes> bodies;
    std::size_t place = 0, shape = 0;
    for (std::size_t k = 0; k < first.size(); ++k) {
        const auto last = static_cast<std::size_t>(end[k]);
        if (last < place || last > places.size() || first[k] + static_cast<std::int64_t>(last - place) > nodes)
            group.refuse("/place_end does not fit the places and the nodes");
        TrajectoryModes body{first[k], entry[k], modes[k], {}, {}};
        body.places.assign(places.begin() + static_cast<std::ptrdiff_t>(place),
                           places.begin() + static_cast<std::ptrdiff_t>(last));
        const std::size_t count = 3 * body.places.size() * static_cast<std::size_t>(body.modes);
        if (shape + count > shapes.size()) group.refuse("/shapes is too short for the modes");
        body.shapes.assign(shapes.begin() + static_cast<std::ptrdiff_t>(shape),
                           shapes.begin() + static_cast<std::ptrdiff_t>(shape + count));
        place = last;
        shape += count;
        bodies.push_back(std::move(body));
    }
    return bodies;
}

std::vector<Shape> read_shapes(const Group& model, std::int64_t body_count) {
    if (!model.has("shapes")) return {};
    const Group group = model.group("shapes");
    const Reader in(group);
    const auto kinds = in.texts("kind");
    const auto bodies = in.integers("body", -1, body_count);
    const auto sizes = rows_of<Vector3>(in.numbers("size", 3));
    const auto poses = rows_of<std::array<double, 7>>(in.numbers("pose", 7));
    const auto vertices = rows_of<Vector3>(in.numbers("vertices", 3));
    const auto count = static_cast<std::int64_t>(vertices.size());
    const auto triangles = rows_of<std::array<std::int32_t, 3>>(in.integers("triangles", 0, count, 3));
    const auto vertex_end = in.integers("vertex_end", 0, count + 1);
    const auto triangle_end = in.integers("triangle_end", 0, static_cast<std::int64_t>(triangles.size()) + 1);
    in.must_have("body", bodies.size(), kinds.size());
    in.must_have("size", sizes.size(), kinds.size());
    in.must_have("pose", poses.size(), kinds.size());
    in.must_have("vertex_end", vertex_end.size(), kinds.size());
    in.must_have("triangle_end", triangle_end.size(), kinds.size());
    std::vector<Shape> shapes(kinds.size());
    std::int32_t vertex = 0, triangle = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        const auto kind = std::find(shape_names.begin(), shape_names.end(), kinds[i]);
        if (kind == shape_names.end()) in.refuse(fmt::format("/kind holds \"{}\", which is no shape", kinds[i]));
        Shape& shape = shapes[i];
        shape.kind = static_cast<ShapeKind>(kind - shape_names.begin());
        shape.body = bodies[i];
        shape.size = sizes[i];
        std::copy_n(poses[i].begin(), 3, shape.pose.position.begin());
        std::copy_n(poses[i].begin() + 3, 4, shape.pose.orientation.begin());
        if (vertex_end[i] < vertex || triangle_end[i] < triangle) in.refuse("/vertex_end or /triangle_end descends");
        if (is_mesh(shape.kind)) {
            Mesh mesh{{vertices.begin() + vertex, vertices.begin() + vertex_end[i]},
                      {triangles.begin() + triangle, triangles.begin() + triangle_end[i]}};
            for (const auto& corners : mesh.triangles)
                for (const auto corner : corners)
                    if (corner >= vertex_end[i] - vertex) in.refuse("/triangles names a vertex of another shape");
            shape.mesh = std::make_shared<const Mesh>(std::move(mesh));
        }
        vertex = vertex_end[i];
        triangle = triangle_end[i];
    }
    return shapes;
}

std::vector<TrajectoryLink> read_links(const Group& model, std::int64_t body_count) {
    if (!model.has("links")) return {};
    const Group group = model.group("links");
    const Reader in(group);
    const auto names = in.texts("name"), kinds = in.texts("kind");
    const auto bodies = rows_of<std::array<std::int32_t, 2>>(in.integers("bodies", -1, body_count, 2));
    const auto points = rows_of<std::array<double, 6>>(in.numbers("points", 6));
    in.must_have("kind", kinds.size(), names.size());
    in.must_have("bodies", bodies.size(), names.size());
    in.must_have("points", points.size(), names.size());
    std::vector<TrajectoryLink> links;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const auto& p = points[i];
        links.push_back({names[i], kinds[i], bodies[i], {Vector3{p[0], p[1], p[2]}, Vector3{p[3], p[4], p[5]}}});
    }
    return links;
}

/// Bytes of texts, each as long as the longest.
std::uint64_t size_of(const std::vector<std::string>& texts) {
    std::size_t longest = 1;
    for (const auto& text : texts) longest = std::max(longest, text.size());
    return texts.size() * longest;
}

template <class Element>
std::uint64_t size_of(const std::vector<Element>& rows) {
    return rows.size() * sizeof(Element);
}

}  // namespace

std::uint64_t largest_size(const TrajectoryModel& model) {
    constexpr std::uint64_t of_a_shape = 256;         // kind, body, size, pose, ends
    constexpr std::uint64_t of_headers = 512 * 1024;  // trees of chunks included
    std::uint64_t bytes = of_headers + size_of(model.bodies) + size_of(model.fixed) + size_of(model.nodes) +
                          size_of(model.node_entry) + size_of(model.loose) + size_of(model.surface) +
                          size_of(model.cables) + of_a_shape * model.shapes.size();
    for (const Shape& shape : model.shapes)
        if (shape.mesh) bytes += size_of(shape.mesh->vertices) + size_of(shape.mesh->triangles);
    for (const TrajectoryModes& body : model.reduced)
        bytes += sizeof(TrajectoryModes) + size_of(body.places) + size_of(body.shapes);
    std::vector<std::string> names, kinds;
    for (const TrajectoryLink& link : model.links) {
        names.push_back(link.name);
        kinds.push_back(link.kind);
    }
    return bytes + size_of(model.links) + size_of(names) + size_of(kinds);
}

void write_model(hid_t system, const TrajectoryModel& model, const std::string& file) {
    const Handle group = group_in(system, "model", false, file);
    const hid_t id = group.get();
    put_rows(id, {"gravity", "m/s^2", "acceleration"}, flat(std::vector{model.gravity}), {3}, file);
    put_rows(id, {"fixed", "1", "of each body: 1 if it never moves"}, model.fixed, {}, file);
    put_rows(id, {"nodes", "m", "positions at the start"}, flat(model.nodes), {3}, file);
    put_rows(id, {"node_entry", "1", "of each node: its first entry in frames/q, -1 if it is fixed"}, model.node_entry,
             {}, file);
    put_rows(id, {"loose", "1", "nodes that no tetrahedron holds"}, model.loose, {}, file);
    put_rows(id, {"surface", "1", "of the tetrahedra: triangles of nodes, counter-clockwise from outside"},
             flat(model.surface), {3}, file);
    put_rows(id, {"cables", "1", "their two nodes"}, flat(model.cables), {2}, file);
    write_modes(id, model.reduced, file);
    write_shapes(id, model.shapes, file);
    write_links(id, model.links, file);
}

TrajectoryModel read_model(const Group& system) {
    if (!system.has("model"))
        system.refuse("/model is missing: an older Delassus wrote this trajectory; run the scene again");
    const Group group = system.group("model");
    const Reader in(group);
    TrajectoryModel model;
    model.bodies = system.has("bodies") ? system.texts("bodies") : std::vector<std::string>{};
    const auto bodies = static_cast<std::int64_t>(model.bodies.size());
    const auto gravity = rows_of<Vector3>(in.numbers("gravity", 3));
    in.must_have("gravity", gravity.size(), 1);
    model.gravity = gravity[0];
    model.fixed = in.integers("fixed", 0, 2);
    in.must_have("fixed", model.fixed.size(), model.bodies.size());
    model.nodes = rows_of<Vector3>(in.numbers("nodes", 3));
    const auto nodes = static_cast<std::int64_t>(model.nodes.size());
    model.node_entry = in.integers("node_entry", -1, std::int64_t{1} << 31);
    in.must_have("node_entry", model.node_entry.size(), model.nodes.size());
    model.loose = in.integers("loose", 0, nodes);
    model.surface = rows_of<std::array<std::int32_t, 3>>(in.integers("surface", 0, nodes, 3));
    model.cables = rows_of<std::array<std::int32_t, 2>>(in.integers("cables", 0, nodes, 2));
    model.reduced = read_modes(group, nodes);
    model.shapes = read_shapes(group, bodies);
    model.links = read_links(group, bodies);
    return model;
}

}  // namespace delassus::trajectory
