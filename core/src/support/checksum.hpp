// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/crc.hpp>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace delassus {

/// CRC-32 of a text, as in zlib. It differs if the texts differ in up to 32 neighbouring bits.
inline std::uint32_t checksum(std::string_view text) {
    boost::crc_32_type crc;
    crc.process_bytes(text.data(), text.size());
    return crc.checksum();
}

}  // namespace delassus
