// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "hdf5/isolated.hpp"
#include "output/recorded.hpp"
#include "simulation/step_columns.hpp"
#include "support/text_file.hpp"
#include "trajectory/model_file.hpp"

namespace delassus::trajectory {
namespace {

using hdf5::Group;
using hdf5::Handle;

std::int64_t row_count(const Group& group, const char* name) {
    const auto shape = group.shape(name);
    if (shape.empty()) group.refuse(fmt::format("/{} must have rows", name));
    return shape[0];
}

/// The least and the greatest value of each of `most`/2 stretches, in the order of time.
RecordedSeries thinned(const StepColumn& column, const std::vector<double>& t, const std::vector<double>& values,
                       std::int64_t most) {
    RecordedSeries series{column.name, column.unit, column.plot, {}, {}};
    const auto count = static_cast<std::int64_t>(values.size());
    if (count <= most) {
        series.t = t;
        series.values = values;
        return series;
    }
    const std::int64_t stretches = most / 2;
    for (std::int64_t k = 0; k < stretches; ++k) {
        const auto first = values.begin() + k * count / stretches, last = values.begin() + (k + 1) * count / stretches;
        auto [low, high] = std::minmax_element(first, last);
        if (high < low) std::swap(low, high);
        for (const auto at : {low, high}) {
            series.t.push_back(t[static_cast<std::size_t>(at - values.begin())]);
            series.values.push_back(*at);
        }
    }
    return series;
}

void read_steps(const Group& steps, std::int64_t points, RecordedSystem& system) {
    std::int64_t count = row_count(steps, "t");
    for (const StepColumn& column : step_columns)
        if (column.plot) count = std::min(count, row_count(steps, column.name));
    system.steps = std::max<std::int64_t>(0, count - 1);
    const auto t = steps.first_numbers("t", count);
    for (const StepColumn& column : step_columns) {
        if (!column.plot) continue;
        std::vector<double> values;
        if (column.integer()) {
            const auto integers = steps.integers(column.name, count);
            values.assign(integers.begin(), integers.end());
        } else {
            values = steps.first_numbers(column.name, count);
        }
        system.series.push_back(thinned(column, t, values, points));
    }
}

/// At most `most` of the rows 0 … count − 1, evenly, the first and the last included.
std::vector<std::int64_t> chosen_rows(std::int64_t count, std::int64_t most) {
    std::vector<std::int64_t> rows;
    const std::int64_t chosen = std::min(count, most);
    for (std::int64_t i = 0; i < chosen; ++i)
        rows.push_back(chosen == 1 ? 0 : (i * (count - 1) + (chosen - 1) / 2) / (chosen - 1));
    return rows;
}

/// to ← the positions of the body's nodes: c + A (X + Φ s) with q = (c, A, s), A being a unit quaternion (w, u) that
/// turns p to p + 2 w u × p + 2 u × (u × p).
void place_nodes(const TrajectoryModes& body, const double* q, double* to) {
    const double w = q[3];
    const Vector3 u = {q[4], q[5], q[6]};
    const auto cross = [](const Vector3& a, const Vector3& b) {
        return Vector3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const std::size_t entries = 3 * body.places.size();
    for (std::size_t node = 0; node < body.places.size(); ++node) {
        Vector3 place = body.places[node];
        for (std::size_t mode = 0; mode < static_cast<std::size_t>(body.modes); ++mode)
            for (std::size_t i = 0; i < 3; ++i) place[i] += q[7 + mode] * body.shapes[mode * entries + 3 * node + i];
        const Vector3 once = cross(u, place), twice = cross(u, once);
        for (std::size_t i = 0; i < 3; ++i) to[3 * node + i] = q[i] + place[i] + 2.0 * (w * once[i] + twice[i]);
    }
}

void read_nodes(const Group& frames, const std::vector<std::int64_t>& rows, RecordedSystem& system) {
    const auto& model = system.model;
    if (model.nodes.empty()) return;
    const bool moving = !model.reduced.empty() || std::any_of(model.node_entry.begin(), model.node_entry.end(),
                                                              [](auto entry) { return entry >= 0; });
    const std::int64_t width = moving ? frames.shape("q").at(1) : 0;
    for (const auto& body : model.reduced)
        if (std::int64_t{body.entry} + 7 + body.modes > width)
            frames.refuse("/q is too narrow for the modes of the model");
    for (const auto entry : model.node_entry)
        if (entry + 2 >= width && entry >= 0) frames.refuse("/q is too narrow for the nodes of the model");
    const auto q = moving ? frames.rows("q", rows, width) : std::vector<double>{};
    for (std::size_t row = 0; row < rows.size(); ++row)
        for (std::size_t node = 0; node < model.nodes.size(); ++node) {
            const auto entry = model.node_entry[node];
            const double* at =
                entry < 0 ? model.nodes[node].data() : q.data() + static_cast<std::int64_t>(row) * width + entry;
            system.nodes.insert(system.nodes.end(), at, at + 3);
        }
    for (std::size_t row = 0; row < rows.size(); ++row)
        for (const auto& body : model.reduced)
            place_nodes(
                body, q.data() + static_cast<std::int64_t>(row) * width + body.entry,
                system.nodes.data() + 3 * (row * model.nodes.size() + static_cast<std::size_t>(body.first_node)));
}

/// Contacts of the chosen frames.
void read_contacts(const Group& group, const std::vector<std::int64_t>& rows, std::int64_t frames, std::int64_t most,
                   RecordedSystem& system) {
    const auto ends = group.group("frames").integers("contact_end", frames);
    if (!std::is_sorted(ends.begin(), ends.end()) || (!ends.empty() && ends.front() < 0))
        group.refuse("/frames/contact_end must begin with at least 0 and not descend");
    std::int64_t count = 0;
    for (const auto row : rows) {
        const auto i = static_cast<std::size_t>(row);
        count += ends[i] - (i == 0 ? 0 : ends[i - 1]);
        system.contact_end.push_back(count);
    }
    system.contacts_left_out = count > most;
    if (system.contacts_left_out) {
        std::fill(system.contact_end.begin(), system.contact_end.end(), 0);
        return;
    }
    std::vector<std::int64_t> chosen;
    for (const auto row : rows) {
        const auto i = static_cast<std::size_t>(row);
        for (std::int64_t k = i == 0 ? 0 : ends[i - 1]; k < ends[i]; ++k) chosen.push_back(k);
    }
    system.contacts = group.group("contacts").rows("point", chosen, 3);
}

void read_frames(const Group& group, const RecordingLimits& limits, RecordedSystem& system) {
    const Group frames = group.group("frames");
    std::int64_t count = row_count(frames, "t");
    for (const char* name : {"q", "poses", "contact_end"})
        if (frames.has(name)) count = std::min(count, row_count(frames, name));
    system.frames = count;
    const auto rows = chosen_rows(count, limits.frames);
    system.t = frames.rows("t", rows, 1);
    if (!system.model.bodies.empty())
        system.poses = frames.rows("poses", rows, static_cast<std::int64_t>(7 * system.model.bodies.size()));
    read_nodes(frames, rows, system);
    read_contacts(group, rows, count, limits.contacts, system);
    for (const auto* values : {&system.t, &system.poses, &system.nodes, &system.contacts})
        if (!std::all_of(values->begin(), values->end(), [](double value) { return std::isfinite(value); }))
            frames.refuse(" holds a number that is not finite");
    if (!std::is_sorted(system.t.begin(), system.t.end())) frames.refuse("/t descends");
}

std::vector<RecordedSystem> read_file(const std::filesystem::path& path, const RecordingLimits& limits) {
    const hdf5::Silence silence;
    const std::string name = path.string();
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    require_regular_file(path);
    const Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_file_locking(access.get(), false, true);  // the run may still go on
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()));
    if (error || !file.valid())
        throw InputError(
            fmt::format("{} cannot be opened: {}.", name, error ? error.message() : hdf5::last_complaint()));
    const Group root(Handle(H5Gopen2(file.get(), "/", H5P_DEFAULT)), name, "", bytes);
    if (root.attribute_text("format") != "delassus-trajectory")
        throw InputError(fmt::format("{} is an HDF5 file, but not a trajectory of Delassus.", name));
    const Group group = root.group("systems");
    std::vector<RecordedSystem> systems;
    for (const auto& member : group.members()) {
        const Group one = group.group(member.c_str());
        RecordedSystem system;
        system.name = member;
        system.integrator = one.attribute_text("integrator");
        system.solver = one.attribute_text("solver");
        system.step = one.attribute_number("step");
        system.model = read_model(one);
        read_steps(one.group("steps"), limits.points, system);
        read_frames(one, limits, system);
        systems.push_back(std::move(system));
    }
    return systems;
}

template <class Message>
void transfer(Message& message, Shape& shape) {
    message(shape.kind);
    message(shape.size);
    Mesh mesh = shape.mesh ? *shape.mesh : Mesh{};
    message(mesh.vertices);
    message(mesh.triangles);
    if (is_mesh(shape.kind)) shape.mesh = std::make_shared<const Mesh>(std::move(mesh));
    message(shape.pose);
    message(shape.body);
}

template <class Message>
void transfer(Message& message, RecordedSystem& system) {
    for (auto* text : {&system.name, &system.integrator, &system.solver}) message(*text);
    message(system.step);
    auto& model = system.model;
    message(model.gravity);
    message(model.bodies);
    message(model.fixed);
    message.each(model.shapes, [&](Shape& shape) { transfer(message, shape); });
    message(model.nodes);
    message(model.node_entry);
    message.each(model.reduced, [&](TrajectoryModes& body) {
        message(body.first_node);
        message(body.entry);
        message(body.modes);
        message(body.places);
        message(body.shapes);
    });
    message(model.loose);
    message(model.surface);
    message(model.cables);
    message.each(model.links, [&](TrajectoryLink& link) {
        message(link.name);
        message(link.kind);
        message(link.bodies);
        message(link.points);
    });
    message(system.steps);
    message(system.frames);
    for (auto* values : {&system.t, &system.poses, &system.nodes, &system.contacts}) message(*values);
    message(system.contact_end);
    message(system.contacts_left_out);
    message.each(system.series, [&](RecordedSeries& series) {
        for (auto* text : {&series.name, &series.unit, &series.description}) message(*text);
        message(series.t);
        message(series.values);
    });
}

}  // namespace
}  // namespace delassus::trajectory

extern "C" DELASSUS_API void delassus_trajectory_read(const std::filesystem::path& file,
                                                      const delassus::RecordingLimits& limits,
                                                      std::vector<delassus::RecordedSystem>& systems) {
    using namespace delassus::trajectory;
    const auto each = [&](auto& message) {
        message.each(systems, [&](delassus::RecordedSystem& system) { transfer(message, system); });
    };
    const auto read = [&](delassus::hdf5::Packer& message) {
        systems = read_file(file, limits);
        each(message);
    };
    delassus::hdf5::read_isolated(file, read, each);
}
