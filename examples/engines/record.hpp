// SPDX-License-Identifier: BSD-3-Clause
// What the examples of engines write down of a solver: how exact its answers are, by Delassus' measure, and how long
// they took.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "boxed_lcp.hpp"

class Record {
public:
    Record(std::string scene, std::string solver) : scene_(std::move(scene)), solver_(std::move(solver)) {}

    /// Runs solve() on the clock of the process' CPU time.
    template <class Solve>
    auto timed(const Solve& solve) {
        const std::clock_t begin = std::clock();
        auto result = solve();
        seconds_ += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
        return result;
    }

    /// An answer of the engine to the problem that was posed to the judge.
    template <class X>
    void judge(const BoxedLcp& judge, const delassus::PreparedProblem& problem, const X& x) {
        const std::vector<double> lambda = judge.lambda_of(x);
        bool finite = true;
        for (const double entry : lambda) finite = finite && std::isfinite(entry);
        add(finite ? problem.meter().measure({}, lambda).natural : std::numeric_limits<double>::infinity());
    }
    /// The natural error of an answer.
    void add(double error) { errors_.push_back(error); }

    /// A body slides with that velocity at its contacts, and feels that force from them (or impulse, or change of
    /// velocity): by how much the friction differs from μ N against the velocity, relative to μ N. All
    /// three-dimensional.
    template <class Vector>
    void slid(const Vector& velocity, const Vector& force, const Vector& normal, double mu) {
        const double press = force.dot(normal), along = velocity.dot(normal);
        const Vector speed = velocity - normal * along;
        const Vector error = force - normal * press + speed * (mu * press / std::sqrt(speed.dot(speed)));
        friction_ = std::max(friction_, std::sqrt(error.dot(error)) / (mu * press));
    }

    static void print_head() {
        std::printf("%-8s %-28s %7s %12s %12s %12s %12s\n", "scene", "solver", "solves", "CPU ms", "mean error",
                    "worst error", "friction off");
    }
    void print() const {
        std::printf("%-8s %-28s %7zu %12.4f %12.2e %12.2e ", scene_.c_str(), solver_.c_str(), errors_.size(),
                    1e3 * seconds_ / static_cast<double>(errors_.size()), mean(), worst());
        if (friction_ > 0.0)
            std::printf("%12.2e\n", friction_);
        else
            std::printf("%12s\n", "");
    }

    [[nodiscard]] double mean() const {
        double sum = 0.0;
        for (const double error : errors_) sum += error;
        return sum / static_cast<double>(errors_.size());
    }
    [[nodiscard]] double worst() const { return *std::max_element(errors_.begin(), errors_.end()); }
    [[nodiscard]] double friction() const { return friction_; }

private:
    std::string scene_, solver_;
    std::vector<double> errors_;
    double seconds_ = 0.0, friction_ = 0.0;
};
