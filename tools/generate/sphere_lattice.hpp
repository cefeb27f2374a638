// SPDX-License-Identifier: BSD-3-Clause
// The closest packing in square layers in a box, and a numbering of its spheres by recursive bisection.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

namespace delassus::generating {

/// The place of a sphere: column, row and layer. An even layer has columns × rows spheres with their centres at
/// (2 i, 2 j) radii; an odd one is one narrower both ways, at (2 i + 1, 2 j + 1): in the hollows between four. Layers
/// are √2 radii apart, so that spheres touch.
using Place = std::array<std::int32_t, 3>;

class SphereLattice {
public:
    SphereLattice(std::int32_t columns, std::int32_t rows, std::int32_t layers)
        : size_{columns, rows, layers}, count_(spheres_in({{0, 0, 0}, size_})) {}

    [[nodiscard]] std::int64_t count() const { return count_; }
    [[nodiscard]] bool has(const Place& place) const {
        const std::int32_t less = place[2] & 1;
        return place[0] >= 0 && place[1] >= 0 && place[2] >= 0 && place[2] < size_[2] && place[0] < size_[0] - less &&
               place[1] < size_[1] - less;
    }
    /// Contacts of touching spheres with one another, with the floor, and with four walls.
    [[nodiscard]] double contacts(bool walls) const;

    /// The number of a sphere: those of the first half of each box come before those of the second.
    [[nodiscard]] std::int64_t number_of(const Place& place) const;
    /// Calls visit(number, place) for the numbers first … last − 1, ascending.
    void visit(std::int64_t first, std::int64_t last,
               const std::function<void(std::int64_t, const Place&)>& visit) const;
    /// The places that a sphere touches; those that has() are spheres.
    static std::array<Place, 12> neighbours_of(const Place& place);

private:
    struct Box {
        Place begin, end;
    };
    [[nodiscard]] std::int64_t spheres_in(const Box& box) const;
    /// Halves the longest side, in cells; the box has more than one cell.
    static void halve(const Box& box, Box& first, Box& second);
    void visit(const Box& box, std::int64_t number, std::int64_t first, std::int64_t last,
               const std::function<void(std::int64_t, const Place&)>& visit) const;

    Place size_;
    std::int64_t count_;
};

}  // namespace delassus::generating
