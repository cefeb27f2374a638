// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace delassus::generating {

/// Random numbers by counters: each is a function of the seed, of what it belongs to and of its place there, so that
/// any process can make any of them. The function is SplitMix64's finaliser (Steele, Lea and Flood, 2014), applied once
/// for each of the three.
class CountedRandom {
public:
    explicit CountedRandom(std::uint64_t seed) : seed_(mixed(seed + step)) {}

    /// Uniform in [0, 1).
    [[nodiscard]] double share(std::uint64_t thing, std::uint64_t place) const {
        const std::uint64_t bits = mixed(mixed(seed_ ^ mixed(thing + step)) + (place + 1) * step);
        return static_cast<double>(bits >> 11) * 0x1.0p-53;
    }
    /// Uniform in [−1, 1).
    [[nodiscard]] double symmetric(std::uint64_t thing, std::uint64_t place) const {
        return 2.0 * share(thing, place) - 1.0;
    }

private:
    static constexpr std::uint64_t step = 0x9e3779b97f4a7c15u;  // 2⁶⁴ over the golden ratio
    static std::uint64_t mixed(std::uint64_t bits) {
        bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
        bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
        return bits ^ (bits >> 31);
    }
    std::uint64_t seed_;
};

}  // namespace delassus::generating
