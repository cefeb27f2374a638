// SPDX-License-Identifier: BSD-3-Clause
// The order in which a sweep visits the blocks.
//
// Two blocks that share a velocity must wait for one another: the second reads what the first has just written, and a
// visit is a chain of some twenty dependent operations, a square root and a division among them. In the order in which
// contacts are found, neighbours usually share a body, and most of a sweep is waiting.
//   given     as in the problem;
//   spaced    as given, but a block that shares a velocity with one of the last few visited waits until others have
//             come in between, so that the visits overlap in the processor;
//   coloured  blocks of one colour share no velocity, and one colour follows another;
//   domains   as spaced, but first the blocks inside of each of a few domains of bodies, then those between two domains
//             (sweep_domains.hpp);
//   auto      domains where there are many blocks, else spaced.
// Coloured blocks and domains may be visited at the same time. The result does not depend on the threads that do so.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <numeric>
#include <span>
#include <vector>

#include "delassus/sdk/block_rows.hpp"
#include "delassus/sdk/team.hpp"
#include "sweep_domains.hpp"

namespace delassus::pgs {

enum class Ordering { Auto, Given, Spaced, Coloured, Domains };

/// Phases follow one another. The pieces of a phase share no velocity, and may be visited at the same time; the blocks
/// of a piece are visited one after another.
struct SweepOrder {
    std::vector<std::int32_t> block;    ///< blocks by the place of their visit
    std::vector<std::size_t> piece{0};  ///< place where each piece starts, then the number of places
    std::vector<std::size_t> phase{0};  ///< piece with which each phase starts, then the number of pieces
    std::vector<std::int32_t> range;    ///< SweepDomains::range, or empty

    /// written_is_covered: a visit writes to all columns that it reads (velocities), else to its own rows of a square
    /// matrix (rows of N). Spaced and domains need the former, and are given otherwise.
    static SweepOrder make(const sdk::BlockRows& rows, Ordering ordering, bool written_is_covered) {
        if (ordering == Ordering::Coloured) return colours(rows, written_is_covered);
        SweepOrder order;
        order.block.reserve(rows.groups().size());
        std::vector<std::int32_t> all(rows.groups().size());
        std::iota(all.begin(), all.end(), 0);
        if (ordering == Ordering::Given || !written_is_covered) {
            order.block = std::move(all);
            order.end_phase();
            return order;
        }
        Spacing spacing(rows);
        if (ordering == Ordering::Domains || (ordering == Ordering::Auto && all.size() >= worth_domains)) {
            SweepDomains domains = SweepDomains::of(rows);
            for (const auto* phase : {&domains.inside, &domains.between}) {
                for (const auto& members : *phase) {
                    spacing.append(members, order.block);
                    order.end_piece();
                }
                order.end_phase();
            }
            all = std::move(domains.rest);
            order.range = std::move(domains.range);
        }
        spacing.append(all, order.block);
        order.end_phase();
        return order;
    }

    [[nodiscard]] std::size_t phases() const { return phase.size() - 1; }

    /// The phases by a member of the team: visit(piece) for its share of each.
    template <class Visit>
    void run(const sdk::Team& team, int member, bool forward, const Visit& visit) const {
        for (std::size_t f = 0; f < phases(); ++f) {
            const std::size_t at = forward ? f : phases() - 1 - f;
            const auto [first, last] = team.share(phase[at + 1] - phase[at], member);
            for (std::size_t k = first; k < last; ++k) visit(phase[at] + k);
            if (f + 1 < phases()) team.barrier();
        }
    }

private:
    static constexpr std::size_t worth_domains = 1000;  // blocks
    static constexpr int most_colours = 64;
    static constexpr std::size_t smallest_colour = 16;  // blocks: fewer are not worth a barrier
    static constexpr std::size_t colour_piece = 8;      // blocks

    void end_piece() {
        if (piece.back() < block.size()) piece.push_back(block.size());
    }
    /// Closes its last piece.
    void end_phase() {
        end_piece();
        if (phase.back() + 1 < piece.size()) phase.push_back(piece.size() - 1);
    }

    static std::size_t columns_of(const sdk::BlockRows& rows) {
        std::size_t columns = 0;
        for (const auto& group : rows.groups())
            for (int k = 0; k < group.chunks; ++k)
                columns = std::max(columns, static_cast<std::size_t>(rows.starts(group)[k] + rows.width()));
        return columns;
    }

    /// Appends blocks in an order that keeps neighbours apart.
    class Spacing {
    public:
        explicit Spacing(const sdk::BlockRows& rows) : rows_(rows), last_(columns_of(rows), -distance - 1) {}

        // The next visit goes to the longest waiting block that may come, else to the next one given that may, else to
        // the longest waiting one.
        void append(std::span<const std::int32_t> blocks, std::vector<std::int32_t>& order) {
            std::deque<std::int32_t> waiting;
            std::size_t next = 0;
            while (next < blocks.size() || !waiting.empty()) {
                const auto may_come = [&](std::int32_t k) { return this->may_come(k, order.size()); };
                auto ready = std::find_if(waiting.begin(), waiting.end(), may_come);
                while (ready == waiting.end() && next < blocks.size() && waiting.size() < most_waiting) {
                    waiting.push_back(blocks[next++]);
                    ready = may_come(waiting.back()) ? waiting.end() - 1 : waiting.end();
                }
                if (ready == waiting.end()) ready = waiting.begin();
                const auto& group = rows_.groups()[static_cast<std::size_t>(*ready)];
                for (int c = 0; c < group.chunks; ++c)
                    std::fill_n(last_.begin() + rows_.starts(group)[c], rows_.width(),
                                static_cast<std::int64_t>(order.size()));
                order.push_back(*ready);
                waiting.erase(ready);
            }
        }

    private:
        static constexpr std::int64_t distance = 3;      // visits that a block waits after one that shares a velocity
        static constexpr std::size_t most_waiting = 32;  // blocks

        // Two chunks of one width overlap if and only if one contains the first or the last column of the other.
        [[nodiscard]] bool may_come(std::int32_t k, std::size_t place) const {
            const auto& group = rows_.groups()[static_cast<std::size_t>(k)];
            const auto now = static_cast<std::int64_t>(place);
            for (int c = 0; c < group.chunks; ++c) {
                const auto start = static_cast<std::size_t>(rows_.starts(group)[c]);
                const std::size_t end = start + static_cast<std::size_t>(rows_.width()) - 1;
                if (now - last_[start] <= distance || now - last_[end] <= distance) return false;
            }
            return true;
        }

        const sdk::BlockRows& rows_;
        std::vector<std::int64_t> last_;  // place of the latest visit, by columns
    };

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
            for (std::size_t k = 0; k < colour.size(); ++k) {
                if (k % colour_piece == 0) order.end_piece();
                order.block.push_back(colour[k]);
            }
            order.end_phase();
        }
        order.block.insert(order.block.end(), rest.begin(), rest.end());
        order.end_phase();
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
