// SPDX-License-Identifier: BSD-3-Clause
// What libdelassus looks up in the module; see partitioned/problem_hdf5_module.hpp and
// problem/problem_hdf5_loader.hpp.
#include <type_traits>

#include "partitioned/problem_hdf5_module.hpp"
#include "problem/problem_hdf5_loader.hpp"
#include "problem_hdf5/problem_hdf5.hpp"
#include "problem_hdf5/whole.hpp"

extern "C" DELASSUS_API void delassus_problem_hdf5(DelassusProblemHdf5& functions) {
    namespace files = delassus::problem_hdf5;
    functions = {&files::read, &files::write, &files::read_solution, &files::write_solution, &files::inspect};
}

extern "C" DELASSUS_API void delassus_whole_problem_hdf5(DelassusWholeProblemHdf5& functions) {
    namespace files = delassus::problem_hdf5;
    functions = {&files::is_problem, &files::read_whole, &files::write_whole};
}

static_assert(std::is_same_v<decltype(&delassus_whole_problem_hdf5), DelassusWholeProblemHdf5Functions>);
static_assert(std::is_same_v<decltype(&delassus_problem_hdf5), DelassusProblemHdf5Functions>);
