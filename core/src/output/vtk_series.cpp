// SPDX-License-Identifier: BSD-3-Clause
#include "output/vtk_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "output/surfaces.hpp"
#include "support/atomic_file.hpp"

namespace delassus {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say that they are little-endian");

/// The appended section of a VTK file: arrays as raw bytes, each after its length.
class Appended {
public:
    template <class Number>
    std::string add(std::string_view name, std::string_view type, int components, const std::vector<Number>& values) {
        const std::string element =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)",
                        type, name, components, bytes_.size());
        const auto length = static_cast<std::uint64_t>(values.size() * sizeof(Number));
        bytes_.append(reinterpret_cast<const char*>(&length), sizeof length);
        bytes_.append(reinterpret_cast<const char*>(values.data()), length);
        return element + "\n";
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

/// A file of one piece. head: the piece's counts, as attributes; body: its elements.
std::string polydata(double t, const std::string& head, const std::string& body, const Appended& data) {
    return fmt::format(
               "<?xml version=\"1.0\"?>\n"
               "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
               "<PolyData>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
               "format=\"ascii\">{:.17g}</DataArray>\n</FieldData>\n<Piece {}>\n",
               t, head) +
           body + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_" + data.bytes() +
           "\n</AppendedData>\n</VTKFile>\n";
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
    std::vector<float> points, speed;
    std::vector<std::int32_t> vertices, vertex_ends, lines, line_ends, corners, corner_ends, body_of_cell;
    const auto add_point = [&](const Vector3& point) {
        for (const double x : point) points.push_back(static_cast<float>(x));
    };
    const auto add_cell = [&](BodyIndex body) {
        body_of_cell.push_back(body);
        double v = 0.0;
        if (body != world_body) {
            const auto velocity = system_.velocities(state, body)[0];
            v = std::hypot(velocity[0], velocity[1], velocity[2]);
        }
        speed.push_back(static_cast<float>(v));
    };
    // Cells made of nodes belong to no body and have the mean speed of their nodes.
    const auto add_node_cell = [&](const auto& nodes) {
        double v = 0.0;
        for (const auto node : nodes) {
            const Vector3 w = system_.node_velocity(state, node);
            v += std::hypot(w[0], w[1], w[2]) / static_cast<double>(nodes.size());
        }
        body_of_cell.push_back(system_.body_count());
        speed.push_back(static_cast<float>(v));
    };
    // The cells come in the order that VTK wants them in: vertices, lines, polygons.
    for (BodyIndex body = 0; body < system_.body_count(); ++body) {
        vertices.push_back(body);
        vertex_ends.push_back(body + 1);
        add_point(system_.pose(state, body).position);
        add_cell(body);
    }
    const auto first_node = static_cast<std::int32_t>(points.size() / 3);
    for (std::int32_t node = 0; node < system_.node_count(); ++node) add_point(system_.node_position(state, node));
    for (const auto node : loose_nodes_) {
        vertices.push_back(first_node + node);
        vertex_ends.push_back(static_cast<std::int32_t>(vertices.size()));
        add_node_cell(std::array{node});
    }
    for (const auto& cable : cables_) {
        for (const auto node : cable) lines.push_back(first_node + node);
        line_ends.push_back(static_cast<std::int32_t>(lines.size()));
        add_node_cell(cable);
    }
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const BodyIndex body = system_.shapes()[i].body;
        const Pose pose = body == world_body ? Pose{} : system_.pose(state, body);
        const auto first = static_cast<std::int32_t>(points.size() / 3);
        for (const auto& vertex : surfaces_[i].vertices) add_point(transformed(pose, vertex));
        for (const auto& triangle : surfaces_[i].triangles) {
            for (const auto corner : triangle) corners.push_back(first + corner);
            corner_ends.push_back(static_cast<std::int32_t>(corners.size()));
            add_cell(body);
        }
    }
    for (const auto& triangle : elements_) {
        for (const auto node : triangle) corners.push_back(first_node + node);
        corner_ends.push_back(static_cast<std::int32_t>(corners.size()));
        add_node_cell(triangle);
    }
    Appended data;
    const std::string head = fmt::format(
        R"(NumberOfPoints="{}" NumberOfVerts="{}" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="{}")",
        points.size() / 3, vertex_ends.size(), line_ends.size(), corner_ends.size());
    std::string xml = "<CellData>\n" + data.add("body", "Int32", 1, body_of_cell) +
                      data.add("speed", "Float32", 1, speed) + "</CellData>\n";
    xml += "<Points>\n" + data.add("points", "Float32", 3, points) + "</Points>\n";
    xml += "<Verts>\n" + data.add("connectivity", "Int32", 1, vertices) + data.add("offsets", "Int32", 1, vertex_ends) +
           "</Verts>\n";
    xml += "<Lines>\n" + data.add("connectivity", "Int32", 1, lines) + data.add("offsets", "Int32", 1, line_ends) +
           "</Lines>\n";
    xml += "<Polys>\n" + data.add("connectivity", "Int32", 1, corners) + data.add("offsets", "Int32", 1, corner_ends) +
           "</Polys>\n";
    write_file_atomically(folder_ / file_name(number), polydata(state.t, head, xml, data));
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
    Appended data;
    const std::string head = fmt::format(
        R"(NumberOfPoints="{0}" NumberOfVerts="{0}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0")",
        contacts.size());
    std::string xml = "<PointData>\n" + data.add("force", "Float32", 3, force) + data.add("gap", "Float32", 1, gap) +
                      data.add("first", "Int32", 1, first) + data.add("second", "Int32", 1, second) + "</PointData>\n";
    xml += "<Points>\n" + data.add("points", "Float32", 3, points) + "</Points>\n";
    xml += "<Verts>\n" + data.add("connectivity", "Int32", 1, vertices) + data.add("offsets", "Int32", 1, ends) +
           "</Verts>\n";
    write_file_atomically(folder_ / contacts_file_name(number), polydata(t, head, xml, data));
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
