// SPDX-License-Identifier: BSD-3-Clause
// HDF5 through the module delassus_problem_hdf5, which the first problem in one file loads.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "delassus/partitioned_files.hpp"

// The module is built together with the library, so C++ types may cross here.
struct DelassusProblemHdf5 {
    void (*read)(const delassus::Communicator&, const std::filesystem::path&, delassus::PartitionedProblem&,
                 delassus::FileTraffic&);
    void (*write)(const delassus::Communicator&, const delassus::PartitionedProblem&, const std::filesystem::path&,
                  delassus::FileTraffic&);
    void (*read_solution)(const delassus::Communicator&, const std::filesystem::path&,
                          const delassus::PartitionedProblem&, delassus::Solution&, delassus::FileTraffic&);
    void (*write_solution)(const delassus::Communicator&, const std::filesystem::path&,
                           const delassus::PartitionedProblem&, const std::vector<double>& x,
                           const std::vector<double>& lambda, const std::string& report_json, delassus::FileTraffic&);
    void (*inspect)(const delassus::Communicator&, const std::filesystem::path&, delassus::PartitionedFileSummary&);
};
extern "C" {
using DelassusProblemHdf5Functions = void (*)(DelassusProblemHdf5& functions);
}
