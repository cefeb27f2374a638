// SPDX-License-Identifier: BSD-3-Clause
#include "solver/border_message.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace delassus {

namespace {

bool send_all(int socket, const char* data, std::size_t size) {
    while (size > 0) {
        const ssize_t sent = send(socket, data, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        data += sent;
        size -= static_cast<std::size_t>(sent);
    }
    return true;
}

bool receive_all(int socket, char* data, std::size_t size) {
    while (size > 0) {
        const ssize_t got = recv(socket, data, size, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        data += got;
        size -= static_cast<std::size_t>(got);
    }
    return true;
}

void put_matrix(Message& message, const delassus_matrix& matrix) {
    message.put(matrix.rows).put(matrix.columns);
    message.put(matrix.row_start, static_cast<std::size_t>(matrix.rows) + 1);
    message.put(matrix.column, static_cast<std::size_t>(matrix.entries));
    message.put(matrix.value, static_cast<std::size_t>(matrix.entries));
}

SparseMatrix take_matrix(Message& message) {
    SparseMatrix matrix;
    matrix.rows = message.take<std::int32_t>();
    matrix.columns = message.take<std::int32_t>();
    matrix.row_start = message.take_all<std::int32_t>();
    matrix.column = message.take_all<std::int32_t>();
    matrix.value = message.take_all<double>();
    return matrix;
}

void put_cones(Message& message, const delassus_problem& problem) {
    message.put(problem.cone_count);
    for (std::int32_t k = 0; k < problem.cone_count; ++k) {
        const delassus_cone& cone = *delassus_cone_at(&problem, k);
        message.put(cone.kind).put(cone.rows);
        message.put(cone.parameters, static_cast<std::size_t>(cone.parameters ? cone.parameter_count : 0));
        message.put(cone.lo, static_cast<std::size_t>(cone.lo ? cone.rows : 0));
        message.put(cone.hi, static_cast<std::size_t>(cone.hi ? cone.rows : 0));
    }
}

std::vector<Cone> take_cones(Message& message) {
    std::vector<Cone> cones;
    for (auto count = message.take<std::int32_t>(); count > 0; --count) {
        const auto kind = message.take<std::int32_t>();
        Cone cone = Cone::free(message.take<std::int32_t>());
        cone.kind = static_cast<ConeKind>(kind);
        const auto parameters = message.take_all<double>();
        std::copy_n(parameters.begin(), std::min(parameters.size(), cone.parameters.size()), cone.parameters.begin());
        cone.lo = message.take_all<double>();
        cone.hi = message.take_all<double>();
        cones.push_back(std::move(cone));
    }
    return cones;
}

}  // namespace

bool send_message(int socket, const Message& message) {
    const std::uint64_t size = message.bytes().size();
    return send_all(socket, reinterpret_cast<const char*>(&size), sizeof size) &&
           send_all(socket, message.bytes().data(), message.bytes().size());
}

std::optional<Message> receive_message(int socket) {
    std::uint64_t size = 0;
    if (!receive_all(socket, reinterpret_cast<char*>(&size), sizeof size)) return std::nullopt;
    std::string bytes(static_cast<std::size_t>(size), '\0');
    if (!receive_all(socket, bytes.data(), bytes.size())) return std::nullopt;
    return Message(std::move(bytes));
}

void ProblemSender::put(Message& message, const delassus_problem& problem) {
    Message cones('c');
    put_cones(cones, problem);
    const bool whole =
        !sent_ || pattern_ != problem.pattern_id || values_ != problem.values_id || cones_ != cones.bytes();
    message.put(static_cast<std::int32_t>(whole)).put(problem.law);
    message.put(problem.a, static_cast<std::size_t>(problem.n)).put(problem.b, static_cast<std::size_t>(problem.m));
    if (!whole) return;
    for (const delassus_matrix* matrix : {&problem.H, &problem.D, &problem.E}) put_matrix(message, *matrix);
    put_cones(message, problem);
    pattern_ = problem.pattern_id;
    values_ = problem.values_id;
    cones_ = cones.bytes();
    sent_ = true;
}

ReceivedProblem take_problem(Message& message) {
    ReceivedProblem received;
    received.whole = message.take<std::int32_t>() != 0;
    received.problem.law = static_cast<Law>(message.take<std::int32_t>());
    received.problem.a = message.take_all<double>();
    received.problem.b = message.take_all<double>();
    if (!received.whole) return received;
    for (SparseMatrix* matrix : {&received.problem.H, &received.problem.D, &received.problem.E})
        *matrix = take_matrix(message);
    received.problem.cones = take_cones(message);
    return received;
}

}  // namespace delassus
