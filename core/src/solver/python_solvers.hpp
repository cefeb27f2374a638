// SPDX-License-Identifier: BSD-3-Clause
// Solvers that are written in Python: how they are found and run. The Python package does it within its own process.
// Elsewhere a python3 runs them as a process of its own (python_process.cpp).
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "delassus/registry.hpp"

namespace delassus {

class PythonSolvers {
public:
    PythonSolvers() = default;
    PythonSolvers(const PythonSolvers&) = delete;
    PythonSolvers& operator=(const PythonSolvers&) = delete;
    virtual ~PythonSolvers() = default;

    /// The entry points of installed packages in the group delassus.solvers; nothing is imported. Throws PluginError if
    /// Python cannot be asked.
    [[nodiscard]] virtual std::vector<PluginInfo> packaged() = 0;

    /// The solver info.python, of the module info.library or of an installed package; of "module:" the one that the
    /// module registers. Throws PluginError.
    [[nodiscard]] virtual std::shared_ptr<const Plugin> load(const PluginInfo& info) = 0;
};

/// Those of this process, and another choice of them.
DELASSUS_API PythonSolvers& python_solvers();
DELASSUS_API void use_python_solvers(std::unique_ptr<PythonSolvers> solvers);

/// The folder that the module of info.library is imported from; empty where Python finds it.
DELASSUS_API std::filesystem::path import_folder(const PluginInfo& info);

}  // namespace delassus
