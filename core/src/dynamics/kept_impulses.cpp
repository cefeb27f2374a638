// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/kept_impulses.hpp"

#include <algorithm>

#include "delassus/error.hpp"
#include "support/frames.hpp"

namespace delassus {

void KeptImpulses::clear() {
    entries_.clear();
    impulses_.clear();
    next_ = 0;
}

KeptImpulses::Start KeptImpulses::start(const UnilateralRows::Block& block, const ContactPoint* contact,
                                        std::span<double> lambda) {
    const auto before = [](const Entry& entry, std::uint64_t key) { return entry.key < key; };
    if (next_ == entries_.size() || entries_[next_].key > block.key)
        next_ = static_cast<std::size_t>(std::lower_bound(entries_.begin(), entries_.end(), block.key, before) -
                                         entries_.begin());
    while (next_ < entries_.size() && entries_[next_].key < block.key) ++next_;
    const auto rows = static_cast<std::int32_t>(lambda.size());
    if (next_ == entries_.size() || entries_[next_].key != block.key || entries_[next_].rows != rows) {
        std::fill(lambda.begin(), lambda.end(), 0.0);
        return {};
    }
    const double* impulse = impulses_.data() + entries_[next_].first;
    const Vector3& normal = entries_[next_].normal;
    if (contact && rows == 3 && contact->normal != normal) {
        Eigen::Map<Eigen::Vector3d>(lambda.data()) =
            contact_frame(Eigen::Vector3d(contact->normal.data())).transpose() *
            (contact_frame(Eigen::Vector3d(normal.data())) * Eigen::Map<const Eigen::Vector3d>(impulse));
    } else {
        std::copy_n(impulse, rows, lambda.data());
    }
    return {.pushed = lambda[0] > 0.0, .impulsive = entries_[next_].impulsive};
}

void KeptImpulses::keep(std::span<const UnilateralRows::Block> blocks, std::span<const ContactPoint> contacts,
                        std::span<const double> lambda, std::span<const char> impulsive) {
    impulses_.assign(lambda.begin(), lambda.end());
    entries_.clear();
    const std::size_t first_contact = blocks.size() - contacts.size();
    std::int32_t row = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const std::int32_t rows = blocks[k].cone.rows;
        const bool turns = k >= first_contact && rows == 3;
        entries_.push_back({blocks[k].key, row, rows, !impulsive.empty() && impulsive[k] != 0,
                            turns ? contacts[k - first_contact].normal : Vector3{}});
        row += rows;
    }
    sort();
}

void KeptImpulses::sort() {
    const auto before = [](const Entry& a, const Entry& b) {
        return a.key != b.key ? a.key < b.key : a.first < b.first;
    };
    if (!std::is_sorted(entries_.begin(), entries_.end(), before)) std::sort(entries_.begin(), entries_.end(), before);
}

void KeptImpulses::drop_zeros() {
    std::erase_if(entries_, [this](const Entry& entry) {
        const auto first = impulses_.begin() + entry.first;
        return std::all_of(first, first + entry.rows, [](double value) { return value == 0.0; });
    });
    next_ = 0;
}

void KeptImpulses::append_to(std::vector<double>& memory) const {
    for (const auto& [key, first, rows, impulsive, normal] : entries_) {
        memory.insert(memory.end(),
                      {static_cast<double>(key >> 32U), static_cast<double>(key & 0xffffffffU), impulsive ? 1.0 : 0.0,
                       normal[0], normal[1], normal[2], static_cast<double>(rows)});
        memory.insert(memory.end(), impulses_.begin() + first, impulses_.begin() + first + rows);
    }
}

void KeptImpulses::load(std::span<const double> memory) {
    clear();
    while (!memory.empty()) {
        constexpr std::size_t head = 7;
        const auto rows = memory.size() < head ? -1.0 : memory[head - 1];
        if (!(rows >= 0.0) || static_cast<double>(memory.size() - head) < rows)
            throw InputError("the impulses kept from step to step end within a block");
        const auto key = (static_cast<std::uint64_t>(memory[0]) << 32U) | static_cast<std::uint64_t>(memory[1]);
        const auto count = static_cast<std::size_t>(rows);
        entries_.push_back({key,
                            static_cast<std::int32_t>(impulses_.size()),
                            static_cast<std::int32_t>(count),
                            memory[2] != 0.0,
                            {memory[3], memory[4], memory[5]}});
        memory = memory.subspan(head);
        impulses_.insert(impulses_.end(), memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(count));
        memory = memory.subspan(count);
    }
    sort();
}

}  // namespace delassus
