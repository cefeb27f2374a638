// SPDX-License-Identifier: BSD-3-Clause
#include "generate/sphere_lattice.hpp"

#include <algorithm>
#include <numbers>

namespace delassus::generating {

std::int64_t SphereLattice::spheres_in(const Box& box) const {
    const auto cells = [&](int side, std::int32_t less) {
        const std::int32_t end =
            std::min(box.end[static_cast<std::size_t>(side)], size_[static_cast<std::size_t>(side)] - less);
        return static_cast<std::int64_t>(std::max(0, end - box.begin[static_cast<std::size_t>(side)]));
    };
    const std::int64_t odd_layers = box.end[2] / 2 - box.begin[2] / 2,
                       even_layers = box.end[2] - box.begin[2] - odd_layers;
    return even_layers * cells(0, 0) * cells(1, 0) + odd_layers * cells(0, 1) * cells(1, 1);
}

void SphereLattice::halve(const Box& box, Box& first, Box& second) {
    constexpr std::array<double, 3> spacing = {2.0, 2.0, std::numbers::sqrt2};
    std::size_t side = 3;
    double longest = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t cells = box.end[k] - box.begin[k];
        if (cells < 2 || spacing[k] * cells <= longest) continue;
        side = k;
        longest = spacing[k] * cells;
    }
    first = second = box;
    first.end[side] = second.begin[side] = box.begin[side] + (box.end[side] - box.begin[side]) / 2;
}

std::int64_t SphereLattice::number_of(const Place& place) const {
    Box box{{0, 0, 0}, size_};
    std::int64_t number = 0;
    while (box.end[0] - box.begin[0] > 1 || box.end[1] - box.begin[1] > 1 || box.end[2] - box.begin[2] > 1) {
        Box first, second;
        halve(box, first, second);
        const bool in_first = place[0] < first.end[0] && place[1] < first.end[1] && place[2] < first.end[2];
        if (!in_first) number += spheres_in(first);
        box = in_first ? first : second;
    }
    return number;
}

void SphereLattice::visit(std::int64_t first, std::int64_t last,
                          const std::function<void(std::int64_t, const Place&)>& action) const {
    visit({{0, 0, 0}, size_}, 0, first, last, action);
}

void SphereLattice::visit(const Box& box, std::int64_t number, std::int64_t first, std::int64_t last,
                          const std::function<void(std::int64_t, const Place&)>& action) const {
    const std::int64_t count = spheres_in(box);
    if (count == 0 || number >= last || number + count <= first) return;
    if (box.end[0] - box.begin[0] == 1 && box.end[1] - box.begin[1] == 1 && box.end[2] - box.begin[2] == 1) {
        action(number, box.begin);
        return;
    }
    Box one, other;
    halve(box, one, other);
    visit(one, number, first, last, action);
    visit(other, number + spheres_in(one), first, last, action);
}

std::array<Place, 12> SphereLattice::neighbours_of(const Place& place) {
    const auto [i, j, k] = place;
    // An odd layer's sphere (i, j) lies over the even ones (i … i + 1, j … j + 1).
    const std::int32_t low = (k & 1) != 0 ? 0 : -1;
    std::array<Place, 12> neighbours = {{{i - 1, j, k}, {i + 1, j, k}, {i, j - 1, k}, {i, j + 1, k}}};
    std::size_t next = 4;
    for (const std::int32_t layer : {k - 1, k + 1})
        for (const std::int32_t row : {j + low, j + low + 1})
            for (const std::int32_t column : {i + low, i + low + 1}) neighbours[next++] = {column, row, layer};
    return neighbours;
}

double SphereLattice::contacts(bool walls) const {
    const double columns = size_[0], rows = size_[1];
    double contacts = columns * rows;
    for (std::int32_t k = 0; k < size_[2]; ++k) {
        const double i = columns - (k & 1), j = rows - (k & 1);
        contacts += (i - 1.0) * j + i * (j - 1.0);
        if (k > 0) contacts += 4.0 * (columns - 1.0) * (rows - 1.0);
        if (walls && (k & 1) == 0) contacts += 2.0 * (i + j);
    }
    return contacts;
}

}  // namespace delassus::generating
