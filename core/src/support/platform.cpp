// SPDX-License-Identifier: BSD-3-Clause
#include "support/platform.hpp"

#include <dlfcn.h>
#include <elf.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "support/text_file.hpp"

namespace delassus {

namespace {

struct Machine {
    unsigned char bits;    ///< ELFCLASS*
    std::uint16_t number;  ///< EM_*
    const char* name;
};
constexpr std::array<Machine, 8> machines = {{{ELFCLASS64, EM_X86_64, "x86_64"},
                                              {ELFCLASS64, EM_AARCH64, "aarch64"},
                                              {ELFCLASS64, EM_RISCV, "riscv64"},
                                              {ELFCLASS64, EM_PPC64, "ppc64"},
                                              {ELFCLASS64, EM_S390, "s390x"},
                                              {ELFCLASS32, EM_386, "i686"},
                                              {ELFCLASS32, EM_ARM, "arm"},
                                              {ELFCLASS32, EM_X86_64, "x32"}}};

/// In the head of a file of 32 bits, what is asked here has the same place.
std::string platform_of_head(const Elf64_Ehdr& head) {
    for (const Machine& machine : machines)
        if (machine.bits == head.e_ident[EI_CLASS] && machine.number == head.e_machine)
            return std::string("linux_") + machine.name;
    return {};
}

}  // namespace

std::string this_platform() {
    Dl_info own{};
    if (dladdr(reinterpret_cast<const void*>(&this_platform), &own) == 0) return {};
    Elf64_Ehdr head{};  // at the beginning of every library that is mapped
    std::memcpy(&head, own.dli_fbase, sizeof(Elf32_Ehdr));
    return platform_of_head(head);
}

std::string platform_of_library(const std::filesystem::path& library) {
    require_regular_file(library);
    Elf64_Ehdr head{};
    std::ifstream file(library, std::ios::binary);
    file.read(reinterpret_cast<char*>(&head), sizeof(Elf32_Ehdr));
    if (file.gcount() < static_cast<std::streamsize>(sizeof(Elf32_Ehdr)) ||
        std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0)
        return {};
    return platform_of_head(head);
}

}  // namespace delassus
