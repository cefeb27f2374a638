// SPDX-License-Identifier: BSD-3-Clause
// Solvers written in Python that were installed, within this process of Python (delassus/_plugins.py).
#pragma once

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/registry.hpp"
#include "solver/python_solvers.hpp"

namespace delassus::python {

namespace py = pybind11;

/// May be asked with or without the GIL.
class SolversHere final : public PythonSolvers {
public:
    std::vector<PluginInfo> packaged() override {
        const py::gil_scoped_acquire with_gil;
        std::vector<PluginInfo> result;
        for (const py::handle row : call("packaged")) {
            const auto text = row.cast<std::map<std::string, std::string>>();
            PluginInfo info;
            info.name = text.at("name");
            info.python = text.at("python");
            info.version = text.at("version");
            info.description = text.at("description");
            info.licence = text.at("licence");
            info.installed_from = text.at("package");
            info.origin = PluginOrigin::PythonPackage;
            result.push_back(std::move(info));
        }
        return result;
    }

    std::shared_ptr<const Plugin> load(const PluginInfo& info) override {
        const py::gil_scoped_acquire with_gil;  // one thread at a time
        auto& plugin = loaded_[info.python + '\n' + info.library.string()];
        if (!plugin) {
            const auto made = call("load", info.python, import_folder(info).string()).cast<std::shared_ptr<Plugin>>();
            plugin = Plugin::of(made->descriptor(), info);
        }
        return plugin;
    }

private:
    template <typename... Arguments>
    static py::object call(const char* function, const Arguments&... arguments) {
        try {
            return py::module_::import("delassus._plugins").attr(function)(arguments...);
        } catch (const py::error_already_set& error) {
            throw PluginError(py::str(error.value()).cast<std::string>());
        }
    }
    std::map<std::string, std::shared_ptr<const Plugin>> loaded_;
};

}  // namespace delassus::python
