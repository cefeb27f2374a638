// SPDX-License-Identifier: BSD-3-Clause
#include "check/raw_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace delassus::check {

namespace {

constexpr std::size_t guard_length = 8;
constexpr double guard_value = -7.25e88;

/// A vector of zeros between two guards.
class GuardedVector {
public:
    explicit GuardedVector(std::size_t size) : values_(size + 2 * guard_length, guard_value) {
        std::fill_n(begin(), size, 0.0);
    }
    [[nodiscard]] double* begin() { return values_.data() + guard_length; }
    [[nodiscard]] std::vector<double> content(const char* name) {
        const auto guards = std::count(values_.begin(), values_.begin() + guard_length, guard_value) +
                            std::count(values_.end() - guard_length, values_.end(), guard_value);
        expect(guards == 2 * guard_length, fmt::format("it wrote beyond the ends of {}", name));
        std::vector<double> result(values_.begin() + guard_length, values_.end() - guard_length);
        expect(std::all_of(result.begin(), result.end(), [](double value) { return std::isfinite(value); }),
               fmt::format("it left values in {} that are not finite", name));
        return result;
    }

private:
    std::vector<double> values_;
};

std::int32_t call_listener(void* context, std::int64_t iteration, const double* x, const double* lambda) {
    return (*static_cast<const RawSolver::Listener*>(context))(iteration, x, lambda);
}

}  // namespace

RawSolver::RawSolver(const Subject& subject) : border_(subject.plugin()->descriptor()) {
    const auto resolved = resolve_options(subject.info().name, subject.info().options, {});
    std::vector<delassus_option_value> values;
    for (const auto& value : resolved) {
        const bool textual = value.type == DELASSUS_OPTION_CHOICE || value.type == DELASSUS_OPTION_TEXT;
        values.push_back(
            {value.key.c_str(), value.type, 0, value.integer, value.real, textual ? value.text.c_str() : nullptr});
    }
    const auto status = border_.create(values.data(), static_cast<std::int32_t>(values.size()), &solver_);
    expect(status == DELASSUS_SOLVED && solver_, "it makes no solver with its default options");
}

RawSolver::~RawSolver() {
    border_.destroy(solver_);
}

std::int32_t RawSolver::set_up(const delassus_problem& problem) {
    if (const auto status = border_.analyze(solver_, &problem); status != DELASSUS_SOLVED) return status;
    return border_.factorize(solver_, &problem);
}

RawResult RawSolver::solve(const delassus_problem& problem, const SolveSettings& settings, const Listener& listener) {
    GuardedVector x(static_cast<std::size_t>(problem.n)), lambda(static_cast<std::size_t>(problem.m));
    RawResult result;
    result.outcome.struct_size = sizeof result.outcome;
    result.outcome.residual = NAN;
    const delassus_request request{sizeof request,
                                   0,
                                   settings.tolerance,
                                   settings.max_iterations,
                                   settings.time_limit,
                                   listener ? &call_listener : nullptr,
                                   const_cast<Listener*>(&listener),
                                   0,
                                   0};
    result.status = border_.solve(solver_, &problem, &request, x.begin(), lambda.begin(), &result.outcome);
    result.solution = {x.content("x"), lambda.content("λ")};
    expect(result.status == result.outcome.status,
           fmt::format("solve returned status {} and wrote {} into the outcome", result.status, result.outcome.status));
    expect(result.status >= DELASSUS_SOLVED && result.status <= DELASSUS_ERROR,
           fmt::format("solve returned {}, which is no status", result.status));
    return result;
}

std::string RawSolver::last_error() const {
    const char* text = border_.last_error(solver_);
    expect(text != nullptr, "last_error returned NULL");
    return text;
}

}  // namespace delassus::check
