// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <array>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"
#include "problem/cone_kinds.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

std::string_view name_of(ConeKind kind) {
    if (is_known(kind)) return operations_of(kind).name;
    throw InputError(fmt::format("There is no cone kind number {}.", static_cast<int>(kind)));
}

std::string_view name_of(Law law) {
    switch (law) {
        case Law::Associated:
            return "associated";
        case Law::Coulomb:
            return "coulomb";
    }
    throw InputError(fmt::format("There is no friction law number {}.", static_cast<int>(law)));
}

Law law_of(std::string_view name) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        if (name == name_of(law)) return law;
    }
    constexpr std::array<std::string_view, 2> names = {"associated", "coulomb"};
    const std::string_view nearest = nearest_name(name, names);
    throw InputError(fmt::format("There is no friction law \"{}\"; choose associated or coulomb{}.", name.substr(0, 80),
                                 nearest.empty() ? "" : fmt::format(" (did you mean {}?)", nearest)));
}

}  // namespace delassus
