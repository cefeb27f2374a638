// SPDX-License-Identifier: BSD-3-Clause
// The names of needs and capabilities, and how a refusal says them.
#include "delassus/needs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/need_of.hpp"

namespace delassus {

Prepared::~Prepared() = default;

bool Prepared::is_definite() const {
    switch (structure()) {
        case Structure::Reduced:
        case Structure::Diagonal:
        case Structure::Blocks:
        case Structure::Definite:
            return true;
        default:
            return false;
    }
}

namespace {

struct Capability {
    std::uint64_t bit = 0;
    std::string_view name = {};    // in sidecars
    std::string_view phrase = {};  // in refusals
};

constexpr std::array other_capabilities = {
    Capability{DELASSUS_CAN_ASSOCIATED, "associated", "the associated friction law"},
    Capability{DELASSUS_CAN_COULOMB, "coulomb", "the exact Coulomb law"},
    Capability{DELASSUS_CAN_H_DIAGONAL, "h_diagonal", "a diagonal H"},
    Capability{DELASSUS_CAN_H_BLOCKS, "h_blocks", "a block-diagonal H"},
    Capability{DELASSUS_CAN_H_DEFINITE, "h_definite", "a sparse definite H"},
    Capability{DELASSUS_CAN_H_SEMIDEFINITE, "h_semidefinite", "a semidefinite H"},
    Capability{DELASSUS_CAN_H_INDEFINITE, "h_indefinite", "an indefinite H"},
    Capability{DELASSUS_CAN_H_UNSYMMETRIC, "h_unsymmetric", "an unsymmetric H"},
    Capability{DELASSUS_CAN_REDUCED, "reduced", "the reduced form (n = 0)"},
    Capability{DELASSUS_CAN_COMPLIANCE, "compliance", "a compliance E"},
    Capability{DELASSUS_CAN_REDUNDANT, "redundant", "redundant rows"},
    Capability{DELASSUS_CAN_WARM_START, "warm_start", "a warm start"},
    Capability{DELASSUS_CAN_DISTRIBUTED, "distributed", "a distributed run"},
    Capability{DELASSUS_CAN_PARTITIONED, "partitioned", "a partitioned problem"},
};

/// The kinds of cones, then the others.
constexpr auto capability_table = [] {
    std::array<Capability, sdk::cone_table.size() + other_capabilities.size()> table{};
    auto* end = table.begin();
    for (const sdk::ConeOperations& kind : sdk::cone_table) *end++ = {kind.capability(), kind.name, kind.plural};
    for (const Capability& other : other_capabilities) *end++ = other;
    return table;
}();

}  // namespace

std::string_view name_of(Structure structure) {
    switch (structure) {
        case Structure::Reduced:
            return "reduced";
        case Structure::Diagonal:
            return "diagonal";
        case Structure::Blocks:
            return "block-diagonal";
        case Structure::Definite:
            return "sparse definite";
        case Structure::Semidefinite:
            return "semidefinite";
        case Structure::Indefinite:
            return "indefinite";
        case Structure::Unsymmetric:
            return "unsymmetric";
    }
    return "unknown";
}

std::vector<std::string> capability_names(std::uint64_t bits) {
    std::vector<std::string> names;
    for (const auto& capability : capability_table)
        if (bits & capability.bit) names.emplace_back(capability.name);
    return names;
}

std::uint64_t capabilities_of(const std::vector<std::string>& names) {
    std::uint64_t bits = 0;
    for (const auto& name : names) {
        const auto* row = std::find_if(capability_table.begin(), capability_table.end(),
                                       [&](const Capability& capability) { return capability.name == name; });
        if (row == capability_table.end())
            throw InputError(fmt::format("\"{}\" is not a capability; they are {}", name,
                                         fmt::join(capability_names(~std::uint64_t{0}), ", ")));
        bits |= row->bit;
    }
    return bits;
}

std::string describe_needs(std::uint64_t missing, std::span<const std::int64_t> counts) {
    std::vector<std::string> phrases;
    for (const auto& capability : capability_table) {
        if (!(missing & capability.bit)) continue;
        std::int64_t count = 0;
        for (const auto& kind : sdk::cone_table)
            if (kind.capability() == capability.bit) count = counts[static_cast<std::size_t>(kind.kind)];
        std::string phrase(capability.phrase);
        if (count == 1) phrase.pop_back();  // "1 friction cone"
        phrases.push_back(count > 0 ? fmt::format("{} {}", count, phrase) : phrase);
    }
    return fmt::format("{}", fmt::join(phrases, ", "));
}

std::vector<std::int64_t> counts_of(const std::vector<Cone>& cones) {
    std::vector<std::int64_t> counts(sdk::cone_table.size(), 0);
    for (const Cone& cone : cones)
        counts[static_cast<std::size_t>(cone.kind)] += operations_of(cone).is_separable() ? cone.rows : 1;
    return counts;
}

std::string PreparedProblem::describe(std::uint64_t missing) const {
    return describe_needs(missing, counts_of(problem().cones));
}

}  // namespace delassus
