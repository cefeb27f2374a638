// SPDX-License-Identifier: BSD-3-Clause
// Arrays as bytes, for Communicator::exchange (internal).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "delassus/error.hpp"

namespace delassus {

using Bytes = std::vector<std::byte>;

template <class Value>
requires std::is_trivially_copyable_v<Value>
void put(Bytes& bytes, std::span<const Value> values) {
    const auto count = static_cast<std::int64_t>(values.size());
    const auto* head = reinterpret_cast<const std::byte*>(&count);
    bytes.insert(bytes.end(), head, head + sizeof count);
    const auto* begin = reinterpret_cast<const std::byte*>(values.data());
    bytes.insert(bytes.end(), begin, begin + values.size_bytes());
}

template <class Value>
void put(Bytes& bytes, const std::vector<Value>& values) {
    put(bytes, std::span<const Value>(values));
}

/// Reads back what put() wrote, in its order.
class ByteReader {
public:
    explicit ByteReader(const Bytes& bytes) : bytes_(bytes) {}

    /// Appends the next array to values, a std::vector or an Array.
    template <class Values, class Value = typename Values::value_type>
    requires std::is_trivially_copyable_v<Value>
    void append(Values& values) {
        std::int64_t count = 0;
        take(&count, sizeof count);
        const auto before = values.size();
        values.resize(before + static_cast<std::size_t>(count));
        take(values.data() + before, static_cast<std::size_t>(count) * sizeof(Value));
    }
    template <class Value>
    [[nodiscard]] std::vector<Value> next() {
        std::vector<Value> values;
        append(values);
        return values;
    }
    [[nodiscard]] bool at_end() const { return place_ == bytes_.size(); }

private:
    void take(void* target, std::size_t size) {
        if (bytes_.size() - place_ < size) throw InputError("a message between processes is too short");
        if (size > 0) std::memcpy(target, bytes_.data() + place_, size);
        place_ += size;
    }
    const Bytes& bytes_;
    std::size_t place_ = 0;
};

}  // namespace delassus
