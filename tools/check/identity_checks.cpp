// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "check/checks.hpp"
#include "check/raw_solver.hpp"
#include "delassus/sdk/cones.hpp"

namespace delassus::check {

namespace {

// The handshake itself (symbol, magic, version, size, name, operations, option table) is the host's: Plugin::load has
// refused the library before these run.

std::string check_descriptor(const Subject& subject) {
    const auto& info = subject.info();
    expect(!info.version.empty(), "its version is empty");
    expect(!info.description.empty() && info.description.find('\n') == std::string::npos,
           "its description is not one line");
    expect(!info.licence.empty(), "its licence is empty; it must be an SPDX expression");
    return fmt::format("{} {}, {}", info.name, info.version, info.licence);
}

std::string check_capability_bits(const Subject& subject) {
    constexpr std::uint64_t laws = DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB;
    constexpr std::uint64_t structures = DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
                                         DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_H_INDEFINITE |
                                         DELASSUS_CAN_H_UNSYMMETRIC | DELASSUS_CAN_REDUCED;
    constexpr std::uint64_t others = DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START |
                                     DELASSUS_CAN_DISTRIBUTED | DELASSUS_CAN_PARTITIONED;
    const auto bits = subject.info().capabilities;
    expect((bits & ~(sdk::all_cones | laws | structures | others)) == 0,
           "it sets capability bits that have no meaning");
    expect((bits & sdk::all_cones) != 0, "it declares no kind of cone");
    expect((bits & structures) != 0, "it declares no structure of H");
    expect(((bits & sdk::cones_with_law) != 0) == ((bits & laws) != 0),
           "friction cones and a friction law are declared together or not at all");
    return fmt::format("{}", fmt::join(capability_names(bits), " "));
}

std::string check_last_error(const Subject& subject) {
    expect(subject.plugin()->descriptor().last_error(nullptr) != nullptr, "last_error(NULL) returned NULL");
    static_cast<void>(RawSolver(subject).last_error());
    return {};
}

std::string check_build(const Subject& subject) {
    switch (subject.info().build) {
        case DELASSUS_BUILD_OPTIMIZED:
            return "with optimisation";
        case DELASSUS_BUILD_UNOPTIMIZED:
            throw Warning(std::string(unoptimized_build));
        default:
            throw Skip("its descriptor does not say whether the compiler optimised: set .build = DELASSUS_BUILD");
    }
}

std::string check_sidecar(const Subject& subject) {
    auto path = subject.info().library;
    path.replace_extension(".json");
    if (!std::filesystem::exists(path))
        throw Skip("there is none; `delassus plugins describe FILE --sidecar` writes it");
    expect(descriptor_text(read_sidecar(path)) == descriptor_text(subject.info()),
           fmt::format("{} does not match the library; `delassus plugins describe FILE --sidecar` renews it",
                       path.filename().string()));
    return {};
}

}  // namespace

std::vector<Check> identity_checks() {
    return {{"identity/descriptor", check_descriptor},
            {"identity/capabilities", check_capability_bits},
            {"identity/last_error", check_last_error},
            {"identity/sidecar", check_sidecar},
            {"identity/build", check_build}};
}

}  // namespace delassus::check
