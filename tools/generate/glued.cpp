// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"

namespace delassus {

Problem glued(const Problem& problem) {
    if (problem.n() == 0) {
        throw InputError("the problem \"" + problem.name +
                         "\" is reduced (n = 0): its b holds the loads, so that its contacts cannot be glued");
    }
    Problem result = problem;
    std::size_t row = 0;
    for (Cone& cone : result.cones) {
        const std::size_t end = row + static_cast<std::size_t>(cone.rows);
        if (cone.kind != ConeKind::Free) {
            for (std::size_t i = row; i < end; ++i) result.b.at(i) = 0.0;
            cone = Cone::free(cone.rows);
        }
        row = end;
    }
    result.law = Law::Associated;
    result.name = problem.name + "-glued";
    return result;
}

}  // namespace delassus
