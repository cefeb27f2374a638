// SPDX-License-Identifier: BSD-3-Clause
#include "output/vtk_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "output/surfaces.hpp"
#include "support/atomic_file.hpp"

namespace delassus {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say that they are little-endian");

template <class Number>
constexpr std::string_view vtk_type = std::is_same_v<Number, float> ? "Float32" : "Int32";

/// The appended section of a VTK file: arrays as raw bytes, each after its length.
class Appended {
public:
    /// The element of an array of so many values, whose bytes come after those of the arrays before it: add().
    template <class Number>
    std::string element(std::string_view name, int components, std::size_t count) {
        const std::string text =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)",
                        vtk_type<Number>, name, components, end_);
        end_ += sizeof(std::uint64_t) + count * sizeof(Number);
        return text + "\n";
    }
    template <class Number>
    static void add(const std::vector<Number>& values, std::string& bytes) {
        const auto length = static_cast<std::uint64_t>(values.size() * sizeof(Number));
        bytes.append(reinterpret_cast<const char*>(&length), sizeof length);
        bytes.append(reinterpret_cast<const char*>(values.data()), length);
    }

private:
    std::size_t end_ = 0;
};

/// A file of one piece up to its appended section. head: the piece's counts, as attributes; body: its elements.
std::string polydata(double t, std::string_view head, std::string_view body) {
    return fmt::format(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        "<PolyData>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
        "format=\"ascii\">{:.17g}</DataArray>\n</FieldData>\n<Piece {}>\n{}</Piece>\n</PolyData>\n"
        "<AppendedData encoding=\"raw\">\n_",
        t, head, body);
}
constexpr std::string_view end_of_file = "\n</AppendedData>\n</VTKFile>\n";

void add_point(const Vector3& point, std::vector<float>& points) {
    for (const double x : point) points.push_back(static_cast<float>(x));
}

/// How far from the origin bodies and shapes reach at the start: the size at which planes are drawn.
double extent_of(const MultibodySystem& system) {
    double extent = 1.0;
    for (BodyIndex body = 0; body < system.body_count(); ++body)
        for (const double x : system.body(body).pose.position) extent = std::max(extent, std::abs(x));
    return 1.5 * extent;
}

}  // namespace

VtkSeries::VtkSeries(std::filesystem::path folder, std::string name, const MultibodySystem& system)
    : folder_(std::move(folder)), name_(std::move(name)), system_(system) {
    const double plane_size = extent_of(system);
    const int corners = corners_of_circles(system.shapes());
    for (const auto& shape : system.shapes()) surfaces_.push_back(surface_of(shape, plane_size, corners));
    elements_ = system.element_surface();
    loose_nodes_ = system.loose_nodes();
    cables_ = system.cables();
    find_cells();
}

// The cells come in the order that VTK wants them in: vertices, lines, polygons. Their corners are numbers of points:
// bodies, nodes, surfaces of shapes.
void VtkSeries::find_cells() {
    std::vector<std::int32_t> body, vertices, vertex_ends, lines, line_ends, corners, corner_ends;
    const std::int32_t bodies = system_.body_count(), first_node = bodies;
    const auto add_cell = [&](const auto& points, std::int32_t first, std::int32_t of, auto& all, auto& ends) {
        for (const std::int32_t point : points) all.push_back(first + point);
        ends.push_back(static_cast<std::int32_t>(all.size()));
        body.push_back(of);
    };
    for (BodyIndex i = 0; i < bodies; ++i) add_cell(std::array{i}, 0, i, vertices, vertex_ends);
    for (const auto node : loose_nodes_) add_cell(std::array{node}, first_node, bodies, vertices, vertex_ends);
    for (const auto& cable : cables_) add_cell(cable, first_node, bodies, lines, line_ends);
    std::int32_t point_count = first_node + system_.node_count();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        for (const auto& triangle : surfaces_[i].triangles)
            add_cell(triangle, point_count, system_.shapes()[i].body, corners, corner_ends);
        point_count += static_cast<std::int32_t>(surfaces_[i].vertices.size());
    }
    for (const auto& triangle : elements_) add_cell(triangle, first_node, bodies, corners, corner_ends);

    counts_ = fmt::format(
        R"(NumberOfPoints="{}" NumberOfVerts="{}" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="{}")",
        point_count, vertex_ends.size(), line_ends.size(), corner_ends.size());
    Appended data;
    const auto add = [&](const char* section, const auto& points, const auto& ends) {
        elements_xml_ += fmt::format("<{}>\n", section);
        elements_xml_ += data.element<std::int32_t>("connectivity", 1, points.size());
        elements_xml_ += data.element<std::int32_t>("offsets", 1, ends.size());
        elements_xml_ += fmt::format("</{}>\n", section);
        for (const auto* array : {&points, &ends}) Appended::add(*array, cells_);
    };
    add("Verts", vertices, vertex_ends);
    add("Lines", lines, line_ends);
    add("Polys", corners, corner_ends);
    elements_xml_ += "<CellData>\n" + data.element<std::int32_t>("body", 1, body.size());
    Appended::add(body, cells_);
    elements_xml_ += data.element<float>("speed", 1, body.size()) + "</CellData>\n";
    elements_xml_ +=
        "<Points>\n" + data.element<float>("points", 3, 3 * static_cast<std::size_t>(point_count)) + "</Points>\n";
}

std::string VtkSeries::file_name(std::int64_t number) const {
    return fmt::format("{}_{:06}.vtp", name_, number);
}

std::string VtkSeries::contacts_file_name(std::int64_t number) const {
    return fmt::format("{}.contacts_{:06}.vtp", name_, number);
}

// A point has three floats. A cell has its body, its speed, where it ends and its corners, each in four bytes.
std::int64_t VtkSeries::picture_bytes() const {
    constexpr std::size_t point = 12, vertex = 16, line = 20, triangle = 24;
    std::size_t bytes = static_cast<std::size_t>(system_.body_count()) * (point + vertex) +
                        static_cast<std::size_t>(system_.node_count()) * point + loose_nodes_.size() * vertex +
                        cables_.size() * line + elements_.size() * triangle;
    for (const Mesh& surface : surfaces_)
        bytes += surface.vertices.size() * point + surface.triangles.size() * triangle;
    return static_cast<std::int64_t>(bytes);
}

void VtkSeries::write(std::int64_t number, const State& state) const {
    constexpr std::size_t beside_arrays = 256;  // bytes: their lengths, and the end of the file
    std::vector<float> points, speed, of_body;
    // Cells made of nodes have the mean speed of their nodes.
    const auto add_node_cell = [&](const auto& nodes) {
        double v = 0.0;
        for (const auto node : nodes) {
            const Vector3 w = system_.node_velocity(state, node);
            v += std::hypot(w[0], w[1], w[2]) / static_cast<double>(nodes.size());
        }
        speed.push_back(static_cast<float>(v));
    };
    for (BodyIndex body = 0; body < system_.body_count(); ++body) {
        add_point(system_.pose(state, body).position, points);
        const Vector3 v = system_.velocities(state, body)[0];
        of_body.push_back(static_cast<float>(std::hypot(v[0], v[1], v[2])));
    }
    for (std::int32_t node = 0; node < system_.node_count(); ++node)
        add_point(system_.node_position(state, node), points);
    speed = of_body;
    for (const auto node : loose_nodes_) add_node_cell(std::array{node});
    for (const auto& cable : cables_) add_node_cell(cable);
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const BodyIndex body = system_.shapes()[i].body;
        const Pose pose = body == world_body ? Pose{} : system_.pose(state, body);
        for (const auto& vertex : surfaces_[i].vertices) add_point(transformed(pose, vertex), points);
        speed.insert(speed.end(), surfaces_[i].triangles.size(),
                     body == world_body ? 0.0F : of_body[static_cast<std::size_t>(body)]);
    }
    for (const auto& triangle : elements_) add_node_cell(triangle);
    std::string file = polydata(state.t, counts_, elements_xml_);
    file.reserve(file.size() + static_cast<std::size_t>(picture_bytes()) + beside_arrays);
    file += cells_;
    Appended::add(speed, file);
    Appended::add(points, file);
    file += end_of_file;
    write_file_atomically(folder_ / file_name(number), file);
}

void VtkSeries::write_contacts(std::int64_t number, double t, const std::vector<ContactRecord>& contacts) const {
    std::vector<float> points, force, gap;
    std::vector<std::int32_t> first, second, vertices, ends;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const ContactRecord& contact = contacts[i];
        for (std::size_t k = 0; k < 3; ++k) {
            points.push_back(static_cast<float>(contact.point[k]));
            force.push_back(static_cast<float>(contact.force[k]));
        }
        gap.push_back(static_cast<float>(contact.gap));
        first.push_back(contact.bodies[0]);
        second.push_back(contact.bodies[1]);
        vertices.push_back(static_cast<std::int32_t>(i));
        ends.push_back(static_cast<std::int32_t>(i + 1));
    }
    const std::string head = fmt::format(
        R"(NumberOfPoints="{0}" NumberOfVerts="{0}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0")",
        contacts.size());
    Appended data;
    std::string bytes;
    const auto element = [&](const char* name, int components, const auto& values) {
        Appended::add(values, bytes);
        return data.element<typename std::decay_t<decltype(values)>::value_type>(name, components, values.size());
    };
    std::string xml = "<PointData>\n" + element("force", 3, force);
    xml += element("gap", 1, gap);
    xml += element("first", 1, first);
    xml += element("second", 1, second) + "</PointData>\n";
    xml += "<Points>\n" + element("points", 3, points) + "</Points>\n";
    xml += "<Verts>\n" + element("connectivity", 1, vertices);
    xml += element("offsets", 1, ends) + "</Verts>\n";
    std::string file = polydata(t, head, xml);
    file += bytes;
    file += end_of_file;
    write_file_atomically(folder_ / contacts_file_name(number), file);
}

void write_vtk_collection(const std::filesystem::path& file, const std::string& folder,
                          const std::vector<VtkCollectionPart>& parts) {
    std::string xml =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "<Collection>\n";
    const auto add = [&](double t, std::size_t part, const std::string& name) {
        xml += fmt::format("<DataSet timestep=\"{:.17g}\" part=\"{}\" file=\"{}/{}\"/>\n", t, part, folder, name);
    };
    for (std::size_t part = 0; part < parts.size(); ++part)
        for (std::size_t i = 0; i < parts[part].times->size(); ++i) {
            const double t = (*parts[part].times)[i];
            const auto number = static_cast<std::int64_t>(i);
            add(t, part, parts[part].series->file_name(number));
            if (parts[part].contacts) add(t, parts.size() + part, parts[part].series->contacts_file_name(number));
        }
    write_file_atomically(file, xml + "</Collection>\n</VTKFile>\n");
}

}  // namespace delassus
