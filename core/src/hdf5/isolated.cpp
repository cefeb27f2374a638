// SPDX-License-Identifier: BSD-3-Clause
#include "hdf5/isolated.hpp"

#include <fmt/format.h>

#include "delassus/error.hpp"
#include "hdf5/hdf5.hpp"
#include "support/call_in_child.hpp"

namespace delassus::hdf5 {
namespace {

/// Processor time for the smallest file, and bytes a second beyond that; some damaged files keep HDF5 busy for ever.
constexpr unsigned least_seconds = 20;
constexpr std::uintmax_t bytes_per_second = 5'000'000;

}  // namespace

void read_isolated(const std::filesystem::path& file, const std::function<void(Packer&)>& read,
                   const std::function<void(Unpacker&)>& take) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto seconds = least_seconds + (error ? 0 : static_cast<unsigned>(bytes / bytes_per_second));
    const std::string message = call_in_child(file, "HDF5", seconds, [&] {
        require_memory();
        Packer packer;
        read(packer);
        return packer.bytes;
    });
    Unpacker content(message);
    take(content);
    if (!content.complete()) throw InputError(fmt::format("{} is damaged: HDF5 fails on it.", file.string()));
}

}  // namespace delassus::hdf5
