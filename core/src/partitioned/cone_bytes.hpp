// SPDX-License-Identifier: BSD-3-Clause
// Cones as bytes, for Communicator::exchange (internal).
#pragma once

#include <cstdint>
#include <vector>

#include "delassus/problem.hpp"
#include "partitioned/bytes.hpp"

namespace delassus {

/// The cones with these numbers, in their order.
template <class Numbers>
void put_cones(Bytes& bytes, const std::vector<Cone>& cones, const Numbers& chosen) {
    std::vector<std::int32_t> shapes;
    std::vector<double> numbers;
    for (const auto k : chosen) {
        const Cone& cone = cones[static_cast<std::size_t>(k)];
        shapes.insert(shapes.end(),
                      {static_cast<std::int32_t>(cone.kind), cone.rows, static_cast<std::int32_t>(cone.lo.size())});
        numbers.insert(numbers.end(), cone.parameters.begin(), cone.parameters.end());
        numbers.insert(numbers.end(), cone.lo.begin(), cone.lo.end());
        numbers.insert(numbers.end(), cone.hi.begin(), cone.hi.end());
    }
    put(bytes, shapes);
    put(bytes, numbers);
}

/// Appends what put_cones() wrote.
inline void append_cones(ByteReader& reader, std::vector<Cone>& cones) {
    const auto shapes = reader.next<std::int32_t>();
    const auto numbers = reader.next<double>();
    auto next = numbers.begin();
    for (std::size_t k = 0; k < shapes.size(); k += 3) {
        Cone cone{static_cast<ConeKind>(shapes[k]), shapes[k + 1], {}, {}, {}};
        for (double& parameter : cone.parameters) parameter = *next++;
        cone.lo.assign(next, next + shapes[k + 2]);
        next += shapes[k + 2];
        cone.hi.assign(next, next + shapes[k + 2]);
        next += shapes[k + 2];
        cones.push_back(std::move(cone));
    }
}

}  // namespace delassus
