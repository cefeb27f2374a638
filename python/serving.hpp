// SPDX-License-Identifier: BSD-3-Clause
// A solver that is a class of Python, used by another process: the end of the calls that solver/python_process.cpp
// makes.
#pragma once

#include <poll.h>
#include <pybind11/pybind11.h>
#include <unistd.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "delassus/version.hpp"
#include "problems.hpp"
#include "solver/border_message.hpp"

namespace delassus::python {

/// Answers the calls of one host, without the GIL: the plugin takes it where it needs it.
class Server {
public:
    Server(const Plugin& plugin, int socket) : border_(plugin.descriptor()), socket_(socket) {}

    void run() {
        while (auto message = receive_message(socket_)) {
            try {
                answer(*message);
            } catch (const std::exception& error) {
                reply(DELASSUS_ERROR, error.what());
            }
        }
        for (const auto& [number, solver] : solvers_) border_.destroy(solver);
    }

private:
    void answer(Message& message) {
        const auto number = message.take<std::uint64_t>();
        if (message.kind() == 'C') {
            create(number, message);
            return;
        }
        void* const solver = solvers_.at(number);
        if (message.kind() == 'D') {
            border_.destroy(solver);
            solvers_.erase(number);
            return;
        }
        take(message);
        const ProblemInUse in_use(*problem_->prepared);
        const delassus_problem& raw = problem_->prepared->raw();
        if (message.kind() == 'S') {
            solve(solver, raw, message);
        } else if (message.kind() == 'Q') {
            std::array<char, 1024> reason{};
            const bool taken = border_.accepts(solver, &raw, reason.data(), static_cast<std::int32_t>(reason.size()));
            reply(taken ? DELASSUS_SOLVED : DELASSUS_ERROR, reason.data());
        } else {
            const auto status = (message.kind() == 'A' ? border_.analyze : border_.factorize)(solver, &raw);
            reply(status, status == DELASSUS_SOLVED ? "" : border_.last_error(solver));
        }
    }

    void create(std::uint64_t number, Message& message) {
        struct Value {
            std::string key, text;
        };
        std::vector<Value> texts(static_cast<std::size_t>(message.take<std::int32_t>()));
        std::vector<delassus_option_value> values;
        for (auto& [key, text] : texts) {
            delassus_option_value value{};
            key = message.take_text();
            value.key = key.c_str();
            value.type = message.take<std::int32_t>();
            value.integer = message.take<std::int64_t>();
            value.real = message.take<double>();
            text = message.take_text();
            value.text = text.c_str();
            values.push_back(value);
        }
        void* solver = nullptr;
        const auto status = border_.create(values.data(), static_cast<std::int32_t>(values.size()), &solver);
        if (status == DELASSUS_SOLVED) solvers_[number] = solver;
        reply(status, status == DELASSUS_SOLVED ? "" : border_.last_error(nullptr));
    }

    void take(Message& message) {
        auto [whole, problem] = take_problem(message);
        if (whole) {
            problem_.reset();
            problem_ = std::make_unique<SharedProblem>(prepared_from(std::move(problem)));
        } else if (!problem_) {
            throw Error("its problem was refused before");
        } else {
            problem_->prepared->set_right_hand_side(std::move(problem.a), std::move(problem.b));
            if (problem_->data().law != problem.law) problem_->prepared->set_law(problem.law);
        }
    }

    /// Its arrays can be shared with the objects of Python that look at them.
    static PreparedProblem prepared_from(Problem&& problem) {
        for (SparseMatrix* matrix : {&problem.H, &problem.D, &problem.E}) {
            matrix->row_start.share();
            matrix->column.share();
            matrix->value.share();
        }
        return PreparedProblem(std::move(problem));
    }

    void solve(void* solver, const delassus_problem& raw, Message& message) {
        delassus_request request{};
        request.struct_size = sizeof request;
        request.warm_start = message.take<std::int32_t>();
        request.tolerance = message.take<double>();
        request.max_iterations = message.take<std::int64_t>();
        request.time_limit = message.take<double>();
        request.progress_context = this;
        if (message.take<std::int32_t>() != 0)
            request.progress = [](void* self, std::int64_t iteration, const double* x, const double* lambda) {
                return static_cast<Server*>(self)->show(iteration, x, lambda);
            };
        auto x = message.take_all<double>(), lambda = message.take_all<double>();
        x.resize(static_cast<std::size_t>(raw.n));
        lambda.resize(static_cast<std::size_t>(raw.m));
        delassus_outcome outcome{};
        outcome.struct_size = sizeof outcome;
        const auto status = border_.solve(solver, &raw, &request, x.data(), lambda.data(), &outcome);
        const bool failed = status == DELASSUS_ERROR || status == DELASSUS_NUMERICAL_FAILURE;
        Message answer('R');
        answer.put(status).put(std::string_view(one_line(failed ? border_.last_error(solver) : "")));
        answer.put(outcome.iterations).put(x.data(), x.size()).put(lambda.data(), lambda.size());
        send_message(socket_, answer);
    }

    std::int32_t show(std::int64_t iteration, const double* x, const double* lambda) {
        const delassus_problem& raw = problem_->prepared->raw();
        Message message('P');
        message.put(iteration).put(x, static_cast<std::size_t>(x ? raw.n : 0));
        message.put(lambda, static_cast<std::size_t>(raw.m));
        send_message(socket_, message);
        auto answer = receive_message(socket_);
        return answer && answer->kind() == '>' ? answer->take<std::int32_t>() : DELASSUS_STOP_CANCEL;
    }

    /// What Python says has lines, and more of them for where it happened.
    static std::string one_line(const std::string& text) {
        std::istringstream words(text);
        std::string line;
        for (std::string word; words >> word;) line += line.empty() ? word : " " + word;
        return line;
    }

    void reply(std::int32_t status, const std::string& sentence) const {
        Message answer('R');
        answer.put(status).put(std::string_view(one_line(sentence)));
        // What follows the answer of a solve that was not begun.
        answer.put(std::int64_t{0})
            .put(static_cast<const double*>(nullptr), 0)
            .put(static_cast<const double*>(nullptr), 0);
        send_message(socket_, answer);
    }

    const delassus_plugin_descriptor& border_;
    int socket_;
    std::map<std::uint64_t, void*> solvers_;
    std::unique_ptr<SharedProblem> problem_;
};

/// Ends this process when the host has ended, whatever the solver is doing.
inline void end_with_host(int socket) {
    std::thread([socket] {
        pollfd host{socket, POLLRDHUP, 0};
        while (poll(&host, 1, -1) <= 0) {
        }
        _exit(0);
    }).detach();
}

inline void bind_serving(py::module_& module) {
    module.def("_serve", [](const std::shared_ptr<Plugin>& plugin, const std::string& target, int socket) {
        const py::gil_scoped_release without_gil;
        PluginInfo info = plugin->info();
        info.python = target;
        send_message(socket, Message('L').put(std::string_view(DELASSUS_VERSION)).put(sidecar_text(info)));
        end_with_host(socket);
        Server(*plugin, socket).run();
    });
    module.def("_refuse",
               [](int socket, const std::string& sentence) { send_message(socket, Message("E" + sentence)); });
}

}  // namespace delassus::python
