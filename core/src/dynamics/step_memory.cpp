// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step_memory.hpp"

#include "dynamics/memory.hpp"

namespace delassus {

// The numbers, then each vector after a 1 where it is known and a 0 where it is not, then the impulses.
std::vector<double> flat(const StepMemory& memory) {
    std::vector<double> all = memory.numbers;
    for (const auto* vectors : {&memory.of_columns, &memory.of_rows})
        for (const auto& one : *vectors) {
            all.push_back(one.empty() ? 0.0 : 1.0);
            all.insert(all.end(), one.begin(), one.end());
        }
    memory.impulses.append_to(all);
    return all;
}

StepMemory unflattened(std::span<const double> all, const StepMemory& shape, std::size_t n, std::size_t m,
                       std::string_view owner) {
    const auto take = [&](std::size_t count) {
        const auto taken = take_from(all, count, owner);
        return std::vector<double>(taken.begin(), taken.end());
    };
    StepMemory memory;
    memory.numbers = take(shape.numbers.size());
    const auto take_vectors = [&](std::size_t count, std::size_t size, std::vector<std::vector<double>>& to) {
        for (std::size_t k = 0; k < count; ++k) to.push_back(take(1)[0] != 0.0 ? take(size) : std::vector<double>());
    };
    take_vectors(shape.of_columns.size(), n, memory.of_columns);
    take_vectors(shape.of_rows.size(), m, memory.of_rows);
    memory.impulses.load(all);
    return memory;
}

}  // namespace delassus
