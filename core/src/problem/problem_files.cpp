// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/problem_files.hpp"

#include <fmt/format.h>

#include <new>
#include <string>

#include "delassus/error.hpp"
#include "problem/fclib_loader.hpp"
#include "problem/problem_folder.hpp"
#include "problem/problem_hdf5_loader.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace fs = std::filesystem;
namespace {

bool names_hdf5_file(const fs::path& path) {
    return path.extension() == ".hdf5" || path.extension() == ".h5";
}

}  // namespace

Problem read_problem(const fs::path& path) {
    std::error_code error;
    if (!fs::exists(path, error)) throw InputError(fmt::format("{}: there is no such file or folder.", path.string()));
    try {
        if (!names_hdf5_file(path) || fs::is_directory(path, error)) return read_problem_folder(path);
        require_regular_file(path);
        return is_problem_hdf5(path) ? read_problem_hdf5(path) : read_fclib(path);
    } catch (const std::bad_alloc&) {
        throw InputError(fmt::format("{} does not fit into memory.", path.string()));
    }
}

void write_problem(const Problem& problem, const fs::path& path) {
    validate(problem);
    if (path.extension() == ".hdf5") {
        write_fclib(problem, path);
    } else if (path.extension() == ".h5") {
        write_problem_hdf5(problem, path);
    } else {
        write_problem_folder(problem, path);
    }
}

}  // namespace delassus
