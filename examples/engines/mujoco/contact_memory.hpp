// SPDX-License-Identifier: BSD-3-Clause
// The forces of one step, known by what they were between, as the start of the next solve.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "contact_problem.hpp"
#include "versions.hpp"

/// Contacts are known by what touches and, where that touches in several points, by the nearest one. Their forces are
/// kept as vectors in space, since MuJoCo may turn a contact's frame. Other constraints are known by their kind, object
/// and place among the object's rows.
class ContactMemory {
public:
    void forget() { entries_.clear(); }

    void store(const mjData* d, const ContactProblem& problem, const std::vector<double>& lambda) {
        entries_.clear();
        const auto& blocks = problem.blocks();
        for (std::size_t k = 0; k < blocks.size(); ++k) {
            if (is_part(blocks[k])) continue;
            Entry entry{identity_of(d, blocks, k), {}, {}, {}, false};
            if (blocks[k].kind == ConstraintBlock::Contact) {
                const mjContact& contact = d->contact[blocks[k].contact];
                const std::array<double, 6> force = problem.force_of(k, lambda);
                std::copy_n(contact.pos, 3, entry.place.begin());
                mju_mulMatTVec(entry.force.data(), contact.frame, force.data(), 3, 3);
                mju_mulMatTVec(entry.torque.data(), contact.frame, force.data() + 3, 3, 3);
            } else {
                if (blocks[k].contact >= 0) std::copy_n(d->contact[blocks[k].contact].pos, 3, entry.place.begin());
                entry.force[0] = lambda[static_cast<std::size_t>(blocks[k].row)] / problem.scale();
            }
            entries_.push_back(entry);
        }
        std::stable_sort(entries_.begin(), entries_.end(),
                         [](const Entry& a, const Entry& b) { return a.identity < b.identity; });
    }

    /// λ with what is known, else zero; how many blocks were known.
    int recall(const mjData* d, const ContactProblem& problem, std::vector<double>& lambda) {
        lambda.assign(problem.rows(), 0.0);
        for (Entry& entry : entries_) entry.used = false;
        int known = 0;
        const auto& blocks = problem.blocks();
        const Entry* contact = nullptr;
        for (std::size_t k = 0; k < blocks.size(); ++k) {
            const ConstraintBlock& block = blocks[k];
            if (!is_part(block)) {
                contact = find(identity_of(d, blocks, k), block.contact < 0 ? nullptr : d->contact[block.contact].pos);
                known += contact != nullptr;
            }
            if (!contact) continue;
            double* out = &lambda[static_cast<std::size_t>(block.row)];
            std::array<double, 3> in_frame{};
            if (block.kind == ConstraintBlock::Contact) {
                mju_mulMatVec(in_frame.data(), d->contact[block.contact].frame, contact->force.data(), 3, 3);
                out[0] = in_frame[0];
                out[1] = in_frame[1];
                out[2] = in_frame[2] / block.stretch;
            } else if (is_part(block)) {
                mju_mulMatVec(in_frame.data(), d->contact[block.contact].frame, contact->torque.data(), 3, 3);
                if (block.kind == ConstraintBlock::Spin) {
                    out[0] = in_frame[0];
                } else {
                    out[0] = std::max(0.0, lambda[static_cast<std::size_t>(block.normal)] / problem.scale());
                    out[1] = in_frame[1];
                    out[2] = in_frame[2] / block.stretch;
                }
            } else {
                out[0] = contact->force[0];
            }
            for (int i = 0; i < block.rows; ++i) out[i] *= problem.scale();
        }
        return known;
    }

private:
    using Identity = std::array<int, 9>;  // −1 and what touches, or the kind, the object and the place
    struct Entry {
        Identity identity;
        std::array<double, 3> place, force, torque;  // m, N, N m in space
        bool used;
    };

    static bool is_part(const ConstraintBlock& block) {
        return block.kind == ConstraintBlock::Spin || block.kind == ConstraintBlock::Roll;
    }
    static Identity identity_of(const mjData* d, const std::vector<ConstraintBlock>& blocks, std::size_t k) {
        Identity identity{};
        const ConstraintBlock& block = blocks[k];
        if (block.contact >= 0) {
            const versions::Touching touching = versions::touching(d->contact[block.contact]);
            identity[0] = -1;
            std::copy(touching.begin(), touching.end(), identity.begin() + 1);
            return identity;
        }
        identity[0] = d->efc_type[block.efc];
        identity[1] = d->efc_id[block.efc];
        for (int efc = block.efc - 1; efc >= 0 && d->efc_type[efc] == identity[0] && d->efc_id[efc] == identity[1];
             --efc)
            ++identity[2];
        return identity;
    }
    Entry* find(const Identity& identity, const double* place) {
        Entry* best = nullptr;
        double nearest = std::numeric_limits<double>::infinity();
        for (auto at = std::lower_bound(entries_.begin(), entries_.end(), identity,
                                        [](const Entry&a, const Identity&b) { return a.identity < b; });
             at != entries_.end() && at->identity == identity; ++at) {
            if (at->used) continue;
            const double distance = place ? mju_dist3(at->place.data(), place) : 0.0;
            if (distance >= nearest) continue;
            nearest = distance;
            best = &*at;
        }
        if (best) best->used = true;
        return best;
    }

    std::vector<Entry> entries_;
};
