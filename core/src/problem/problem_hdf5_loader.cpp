// SPDX-License-Identifier: BSD-3-Clause
#include "problem/problem_hdf5_loader.hpp"

#include <array>
#include <fstream>
#include <mutex>

#include "problem/fclib_loader.hpp"
#include "support/module.hpp"

namespace delassus {
namespace {

const DelassusWholeProblemHdf5& whole_files() {
    static const DelassusWholeProblemHdf5 functions = [] {
        DelassusWholeProblemHdf5 found{};
        reinterpret_cast<DelassusWholeProblemHdf5Functions>(
            module_symbol("delassus_problem_hdf5", "delassus_whole_problem_hdf5",
                          "problems in one file cannot be read or written", "HDF5", "; use problem folders"))(found);
        return found;
    }();
    return functions;
}

bool begins_as_hdf5(const std::filesystem::path& file) {
    constexpr std::array<char, 8> signature = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
    std::array<char, 8> begin{};
    std::ifstream stream(file, std::ios::binary);
    return stream.read(begin.data(), begin.size()) && begin == signature;
}

}  // namespace

bool is_problem_hdf5(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error) || !begins_as_hdf5(file) || !has_module("delassus_problem_hdf5"))
        return false;
    const std::lock_guard lock(hdf5_mutex());
    return whole_files().is_problem(file);
}

Problem read_problem_hdf5(const std::filesystem::path& file) {
    const std::lock_guard lock(hdf5_mutex());
    Problem problem;
    whole_files().read(file, problem);
    return problem;
}

void write_problem_hdf5(const Problem& problem, const std::filesystem::path& file) {
    const std::lock_guard lock(hdf5_mutex());
    whole_files().write(problem, file);
}

}  // namespace delassus
