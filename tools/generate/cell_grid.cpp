// SPDX-License-Identifier: BSD-3-Clause
#include "generate/cell_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace delassus::generating {

std::vector<std::pair<std::int32_t, std::int32_t>> pairs_within(const std::vector<Eigen::Vector3d>& points,
                                                                double reach) {
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
    if (points.empty()) return pairs;
    Eigen::Vector3d low = points.front();
    Eigen::Vector3d high = points.front();
    for (const auto& point : points) {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
    }
    using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
    const auto cell_of = [&](const Eigen::Vector3d& point) -> Cell {
        return ((point - low) / reach).array().floor().matrix().cast<std::int64_t>();
    };
    const Cell size = cell_of(high) + Cell::Ones();
    const auto number_of = [&](const Cell& cell) {
        return static_cast<std::size_t>(cell.x() + size.x() * (cell.y() + size.y() * cell.z()));
    };

    // Counting sort: the points of cell c are sorted[start[c]] up to sorted[start[c + 1] − 1], in ascending order.
    std::vector<std::int32_t> start(static_cast<std::size_t>(size.prod()) + 1, 0);
    for (const auto& point : points) ++start[number_of(cell_of(point)) + 1];
    for (std::size_t c = 1; c < start.size(); ++c) start[c] += start[c - 1];
    std::vector<std::int32_t> sorted(points.size());
    std::vector<std::int32_t> next(start.begin(), start.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
        sorted[static_cast<std::size_t>(next[number_of(cell_of(points[i]))]++)] = static_cast<std::int32_t>(i);
    }

    std::vector<std::int32_t> partners;
    for (std::size_t i = 0; i < points.size(); ++i) {
        partners.clear();
        const Cell centre = cell_of(points[i]);
        const Cell first = (centre - Cell::Ones()).cwiseMax(Cell::Zero());
        const Cell last = (centre + Cell::Ones()).cwiseMin(size - Cell::Ones());
        for (std::int64_t z = first.z(); z <= last.z(); ++z) {
            for (std::int64_t y = first.y(); y <= last.y(); ++y) {
                for (std::int64_t x = first.x(); x <= last.x(); ++x) {
                    const std::size_t c = number_of({x, y, z});
                    for (std::int32_t k = start[c]; k < start[c + 1]; ++k) {
                        const std::int32_t j = sorted[static_cast<std::size_t>(k)];
                        const bool near = (points[static_cast<std::size_t>(j)] - points[i]).norm() <= reach;
                        if (j > static_cast<std::int32_t>(i) && near) partners.push_back(j);
                    }
                }
            }
        }
        std::ranges::sort(partners);
        for (const std::int32_t j : partners) pairs.emplace_back(static_cast<std::int32_t>(i), j);
    }
    return pairs;
}

}  // namespace delassus::generating
