// SPDX-License-Identifier: BSD-3-Clause
// The order in which a sweep visits the blocks.
//
// Two blocks that share a velocity must wait for one another: the second reads what the first has just written, and a
// visit is a chain of some twenty dependent operations, a square root and a division among them. In the order in which
// contacts are found, neighbours usually share a body, and most of a sweep is waiting.
//   given     as in the problem;
//   spaced    as given, but a block that shares a velocity with one of the last few visited waits until others have
//             come in between, so that the visits overlap in the processor;
//   coloured  blocks of one colour share no velocity, and one colour follows another: the blocks of a colour may be
//             visited at the same time, and the result does not depend on the thread that visits them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <vector>

#include "delassus/sdk/block_rows.hpp"

namespace delassus::pgs {

enum class Ordering { Given, Spaced, Coloured };

struct SweepOrder {
    std::vector<std::int32_t> block;  ///< blocks by the place of their visit
    std::vector<std::size_t> colour;  ///< coloured: place where each colour starts; the last ends at `coloured`
    std::size_t coloured = 0;         ///< places from here on are visited one after another

    /// written_is_covered: a visit writes to all columns that it reads (velocities), else to its own rows of a square
    /// matrix (rows of N). Spaced needs the former, and is given otherwise.
    static SweepOrder make(const sdk::BlockRows& rows, Ordering ordering, bool written_is_covered) {
        if (ordering == Ordering::Coloured) return colours(rows, written_is_covered);
        SweepOrder order;
        order.block.reserve(rows.groups().size());
        if (ordering == Ordering::Spaced && written_is_covered) {
            order.space_out(rows);
        } else {
            for (std::size_t k = 0; k < rows.groups().size(); ++k) order.block.push_back(static_cast<std::int32_t>(k));
        }
        return order;
    }

private:
    static constexpr std::int64_t distance = 3;      // visits that a block waits after one that shares a velocity
    static constexpr std::size_t most_waiting = 32;  // blocks
    static constexpr int most_colours = 64;
    static constexpr std::size_t smallest_colour = 16;  // blocks: fewer are not worth a barrier

    static std::size_t columns_of(const sdk::BlockRows& rows) {
        std::size_t columns = 0;
        for (const auto& group : rows.groups())
            for (int k = 0; k < group.chunks; ++k)
                columns = std::max(columns, static_cast<std::size_t>(rows.starts(group)[k] + rows.width()));
        return columns;
    }

    // The next visit goes to the longest waiting block that may come, else to the next block of the problem that may,
    // else to the longest waiting one.
    // Two chunks of one width overlap if and only if one contains the first or the last column of the other.
    void space_out(const sdk::BlockRows& rows) {
        const int width = rows.width();
        std::vector<std::int64_t> last(columns_of(rows), -distance - 1);
        const auto may_come = [&](std::int32_t k) {
            const auto& group = rows.groups()[static_cast<std::size_t>(k)];
            const auto now = static_cast<std::int64_t>(block.size());
            for (int c = 0; c < group.chunks; ++c) {
                const auto start = static_cast<std::size_t>(rows.starts(group)[c]);
                const std::size_t end = start + static_cast<std::size_t>(width) - 1;
                if (now - last[start] <= distance || now - last[end] <= distance) return false;
            }
            return true;
        };
        const auto visit = [&](std::int32_t k) {
            const auto& group = rows.groups()[static_cast<std::size_t>(k)];
            for (int c = 0; c < group.chunks; ++c)
                std::fill_n(last.begin() + rows.starts(group)[c], width, static_cast<std::int64_t>(block.size()));
            block.push_back(k);
        };
        std::deque<std::int32_t> waiting;
        const auto count = static_cast<std::int32_t>(rows.groups().size());
        std::int32_t next = 0;
        while (next < count || !waiting.empty()) {
            auto ready = std::find_if(waiting.begin(), waiting.end(), may_come);
            while (ready == waiting.end() && next < count && waiting.size() < most_waiting) {
                waiting.push_back(next++);
                ready = may_come(waiting.back()) ? waiting.end() - 1 : waiting.end();
            }
            if (ready == waiting.end()) ready = waiting.begin();
            visit(*ready);
            waiting.erase(ready);
        }
    }

    // Each block takes the first colour that no neighbour has, in the order of the problem. Blocks that find no free
    // colour, and those of a rare colour, come last, one after another.
    static SweepOrder colours(const sdk::BlockRows& rows, bool written_is_covered) {
        const auto width = static_cast<std::size_t>(rows.width());
        // Colours of the blocks that write to an entry, and of those that read it (or multiply it by a zero).
        std::vector<std::uint64_t> written(std::max(columns_of(rows), rows_of(rows)), 0);
        std::vector<std::uint64_t> read(written_is_covered ? 0 : written.size(), 0);
        std::vector<std::vector<std::int32_t>> members(most_colours);
        std::vector<std::int32_t> rest;
        for (std::size_t k = 0; k < rows.groups().size(); ++k) {
            const auto& group = rows.groups()[k];
            const auto first = static_cast<std::size_t>(group.first), count = static_cast<std::size_t>(group.rows);
            std::uint64_t taken = 0;
            for (int c = 0; c < group.chunks; ++c)
                for (std::size_t j = 0; j < width; ++j)
                    taken |= written[static_cast<std::size_t>(rows.starts(group)[c]) + j];
            if (!written_is_covered)
                for (std::size_t i = first; i < first + count; ++i) taken |= read[i];
            if (~taken == 0) {
                rest.push_back(static_cast<std::int32_t>(k));
                continue;
            }
            const int colour = __builtin_ctzll(~taken);
            members[static_cast<std::size_t>(colour)].push_back(static_cast<std::int32_t>(k));
            auto& covered = written_is_covered ? written : read;
            for (int c = 0; c < group.chunks; ++c)
                for (std::size_t j = 0; j < width; ++j)
                    covered[static_cast<std::size_t>(rows.starts(group)[c]) + j] |= std::uint64_t{1} << colour;
            if (!written_is_covered)
                for (std::size_t i = first; i < first + count; ++i) written[i] |= std::uint64_t{1} << colour;
        }
        SweepOrder order;
        for (const auto& colour : members) {
            if (colour.size() < smallest_colour) {
                rest.insert(rest.end(), colour.begin(), colour.end());
                continue;
            }
            order.colour.push_back(order.block.size());
            order.block.insert(order.block.end(), colour.begin(), colour.end());
        }
        order.coloured = order.block.size();
        order.block.insert(order.block.end(), rest.begin(), rest.end());
        return order;
    }

    static std::size_t rows_of(const sdk::BlockRows& rows) {
        std::size_t result = 0;
        for (const auto& group : rows.groups())
            result = std::max(result, static_cast<std::size_t>(group.first + group.rows));
        return result;
    }
};

}  // namespace delassus::pgs
