// SPDX-License-Identifier: BSD-3-Clause
// The page that plays the motion of a run, from the arrays of the run.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "output/recorded.hpp"
#include "output/system_model.hpp"
#include "output/view_page.hpp"
#include "scenes.hpp"
#include "simulation/step_columns.hpp"

namespace delassus::python {

/// What is plotted of the steps, by the table of the columns of a step.
inline std::vector<RecordedSeries> series_of(const std::vector<StepRecord>& records) {
    std::vector<RecordedSeries> result;
    for (const StepColumn& column : step_columns) {
        if (!column.plot) continue;
        RecordedSeries& series = result.emplace_back(RecordedSeries{column.name, column.unit, column.plot, {}, {}});
        for (const StepRecord& record : records) {
            series.t.push_back(record.t);
            std::visit(
                [&](auto member) {
                    if constexpr (!std::is_same_v<decltype(member), Vector3 StepRecord::*>)
                        series.values.push_back(static_cast<double>(record.*member));
                },
                column.value);
        }
    }
    return result;
}

/// The page of F frames: times (F), positions (F × ·), velocities (F × ·), poses (F × bodies × 7), points of contacts
/// (× 3) and where those of each frame end (F); records of the states, of which the frames are chosen.
inline std::string view_page_of(SharedScene& scene, const std::string& name, const Reals& times, const Reals& positions,
                                const Reals& velocities, const Reals& poses, const Reals& points, const Integers& ends,
                                const std::vector<StepRecord>& records, const std::string& status,
                                const std::string& message, std::int64_t steps, std::int64_t frames) {
    const SceneSystem& chosen = scene.system(name);
    RecordedRun run;
    run.title = scene.scene.title;
    run.status = status;
    run.message = message;
    RecordedSystem& system = run.systems.emplace_back();
    system.name = chosen.name;
    system.integrator = chosen.integrator;
    system.solver = chosen.solver.name;
    system.step = chosen.step;
    system.steps = steps;
    system.frames = frames;
    const auto values = [](const Reals& array) {
        return std::vector<double>(array.data(), array.data() + array.size());
    };
    system.t = values(times);
    system.poses = values(poses);
    system.contacts = values(points);
    system.contact_end.assign(ends.data(), ends.data() + ends.size());
    const std::vector<double> q = values(positions), v = values(velocities);
    const py::gil_scoped_release without_gil;
    const std::scoped_lock lock(scene.turn);
    system.model = trajectory_model(chosen);
    if (!system.model.nodes.empty()) {
        const std::size_t q_size = q.size() / system.t.size(), v_size = v.size() / system.t.size();
        const auto row = [](const std::vector<double>& all, std::size_t frame, std::size_t size) {
            const auto begin = all.begin() + static_cast<std::ptrdiff_t>(frame * size);
            return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(size));
        };
        for (std::size_t frame = 0; frame < system.t.size(); ++frame) {
            const State state{system.t[frame], row(q, frame, q_size), row(v, frame, v_size)};
            for (std::int32_t node = 0; node < chosen.system->node_count(); ++node) {
                const Vector3 position = chosen.system->node_position(state, node);
                system.nodes.insert(system.nodes.end(), position.begin(), position.end());
            }
        }
    }
    system.series = series_of(records);
    return view_page(run);
}

inline void bind_views(py::module_& module) {
    module.def("_view_page", &view_page_of);
}

}  // namespace delassus::python
