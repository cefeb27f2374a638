// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "generate/family.hpp"
#include "support/nearest_name.hpp"

namespace delassus {
namespace {

using generating::Family;

const std::vector<Family>& families() {
    using namespace generating;
    static const std::vector<Family> table = {
        chain_family(),      net_family(),           sphere_pile_family(), pile_family(),   box_stack_family(),
        brick_wall_family(), elastic_block_family(), gyroscopic_family(),  motors_family(),
    };
    return table;
}

std::vector<Generator> public_table() {
    std::vector<Generator> table;
    for (const Family& family : families()) table.push_back({family.name, family.doc, family.parameters});
    return table;
}

}  // namespace

std::span<const Generator> generators() {
    static const std::vector<Generator> table = public_table();
    return table;
}

Problem generate(std::string_view kind, const std::map<std::string, double>& values) {
    const auto& table = families();
    const auto family = std::ranges::find(table, kind, &Family::name);
    if (family == table.end()) {
        std::vector<std::string_view> names;
        for (const Family& other : table) names.push_back(other.name);
        throw InputError(fmt::format("there is no generator \"{}\"{}", kind, nearest_name_hint(kind, names)));
    }
    std::vector<std::string_view> keys;
    for (const GeneratorParameter& parameter : family->parameters) keys.push_back(parameter.key);
    for (const auto& [key, value] : values) {
        if (std::ranges::find(keys, key) == keys.end()) {
            throw InputError(
                fmt::format("{} has no parameter \"{}\"{}", family->name, key, nearest_name_hint(key, keys)));
        }
    }
    Problem problem = family->make(values);
    // Where it came from: the command that makes it again, with what differs from the defaults.
    problem.source = fmt::format("delassus generate {}", family->name);
    for (const auto& [key, value] : values) problem.source += fmt::format(" --set {}={}", key, value);
    return problem;
}

}  // namespace delassus
