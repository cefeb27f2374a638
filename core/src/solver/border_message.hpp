// SPDX-License-Identifier: BSD-3-Clause
// What two processes of one machine say to each other where a plugin of one is used by the other: the calls of the
// border (delassus/plugin.h) as bytes. python_process.cpp has one end, python/serving.hpp the other.
//
// Each message begins with a letter.
//   from the host    C number, options                 create: the solver gets this number
//                    D number                          destroy
//                    A, F, Q number, problem           analyze, factorize, accepts
//                    S number, problem, request, x, λ  solve
//                    > answer                          to a P
//   to the host      L text                            loaded: a version, then a sidecar
//                    E text                            not loaded: a sentence
//                    P iteration, x or nothing, λ      progress
//                    R status, sentence, …             what the call returned
// Whoever closes the socket ends both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "delassus/plugin.h"
#include "delassus/problem.hpp"

namespace delassus {

class Message {
public:
    explicit Message(char kind) : bytes_(1, kind) {}
    explicit Message(std::string bytes) : bytes_(std::move(bytes)) {}

    [[nodiscard]] char kind() const { return bytes_.empty() ? '\0' : bytes_[0]; }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }
    [[nodiscard]] std::string text() const { return bytes_.substr(1); }

    template <typename Value>
    requires std::is_arithmetic_v<Value> Message& put(const Value& value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    Message& put(std::string_view text) { return put(text.data(), text.size()); }
    template <typename Value>
    Message& put(const Value* values, std::size_t count) {
        put(static_cast<std::uint64_t>(count));
        if (count > 0) bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(Value));
        return *this;
    }

    template <typename Value>
    requires std::is_arithmetic_v<Value> Value take() {
        Value value;
        std::memcpy(&value, next(sizeof value), sizeof value);
        return value;
    }
    template <typename Value>
    std::vector<Value> take_all() {
        const auto count = static_cast<std::size_t>(take<std::uint64_t>());
        if (count > bytes_.size() / sizeof(Value)) throw Error("a message is too short");
        std::vector<Value> values(count);
        if (count > 0) std::memcpy(values.data(), next(count * sizeof(Value)), count * sizeof(Value));
        return values;
    }
    std::string take_text() {
        const auto characters = take_all<char>();
        return {characters.begin(), characters.end()};
    }

private:
    const char* next(std::size_t size) {
        if (size > bytes_.size() - position_) throw Error("a message is too short");
        position_ += size;
        return bytes_.data() + position_ - size;
    }
    std::string bytes_;
    std::size_t position_ = 1;
};

/// Writes the message to the socket; false if the other end is closed.
DELASSUS_API bool send_message(int socket, const Message& message);
/// The next message, waited for; nothing if the other end is closed.
DELASSUS_API std::optional<Message> receive_message(int socket);

/// A problem on its way: matrices and cones go only where they differ from those sent before.
class DELASSUS_API ProblemSender {
public:
    void put(Message& message, const delassus_problem& problem);

private:
    std::uint64_t pattern_ = 0, values_ = 0;
    std::string cones_;
    bool sent_ = false;
};

/// What ProblemSender has put: a whole problem, or only the right-hand side and the law of the one before.
struct ReceivedProblem {
    bool whole = false;
    Problem problem;
};
DELASSUS_API ReceivedProblem take_problem(Message& message);

}  // namespace delassus
