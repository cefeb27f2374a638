// SPDX-License-Identifier: BSD-3-Clause
// What the last steps show of the error of a step, whatever their sizes.
#include "dynamics/velocity_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace delassus::velocity_error_test {
namespace {

/// After steps of these sizes along v(t), before one of the size `next`.
VelocityError after(int order, const std::vector<double>& sizes, double next, const std::function<double(double)>& v,
                    double left = 0.0) {
    VelocityError error(order);
    const std::vector<double> of_solve = {left};
    double t = 0.0, last = 0.0;
    for (std::size_t k = 0; k <= sizes.size(); ++k) {
        error.note({v(t)}, of_solve, last, k < sizes.size() ? sizes[k] : next);
        if (k < sizes.size()) t += last = sizes[k];
    }
    return error;
}

double cubic(double t) {
    return t * t * t;
}

TEST(VelocityError, OfStepsOfOneSizeIsThatOfTheMethod) {
    const std::vector<double> sizes(7, 0.1);
    EXPECT_NEAR(after(2, sizes, 0.1, cubic).known()[0], 6.0 * 1e-3 / 12.0, 1e-12);
    EXPECT_NEAR(after(1, sizes, 0.1, [](double t) { return t * t; }).known()[0], 0.5 * 2.0 * 1e-2, 1e-12);
}

TEST(VelocityError, StepsOfOtherSizesShowTheSameDerivative) {
    // h³ v‴/12 of steps of their mean size; v‴ = 6 everywhere. The least of the last four counts.
    const std::vector<double> sizes = {0.1, 0.03, 0.1, 0.1, 0.07, 0.1, 0.02, 0.1};
    double least = HUGE_VAL, product = 0.0;
    for (std::size_t last = sizes.size() - 4; last < sizes.size(); ++last) {
        product = sizes[last] * (sizes[last] + sizes[last - 1]) * (sizes[last] + sizes[last - 1] + sizes[last - 2]);
        least = std::min(least, product / 12.0);
    }
    EXPECT_NEAR(after(2, sizes, 1.0, cubic).known()[0], least, 1e-12);
    const double mean = std::cbrt(product / 6.0);
    EXPECT_NEAR(after(2, sizes, 0.01, cubic).known()[0], least * 0.01 / mean, 1e-12);
}

TEST(VelocityError, PartsOfAStepErrTogetherByNoMoreThanIt) {
    std::vector<double> sizes(7, 0.1);
    const double whole = after(2, sizes, 0.1, cubic).known()[0];
    double parts = 0.0;
    for (const double part : {0.02, 0.05, 0.03}) {
        parts += after(2, sizes, part, cubic).known()[0];
        sizes.push_back(part);
    }
    EXPECT_GT(parts, 0.0);
    EXPECT_LE(parts, whole * (1.0 + 1e-12));
}

TEST(VelocityError, OneImpactIsNoErrorWhateverTheSteps) {
    const std::vector<double> sizes = {0.1, 0.1, 0.04, 0.06, 0.1, 0.02, 0.08, 0.1, 0.1, 0.1};
    const auto bounces = [](double t) { return t < 0.31 ? -t : 5.0 - t; };
    for (std::size_t known = 7; known <= sizes.size(); ++known)
        EXPECT_LT(
            after(2, {sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(known)}, 0.1, bounces).known()[0],
            1e-12)
            << known;
}

TEST(VelocityError, WhatSolvesLeaveIsKnownApart) {
    const double left = 1e-3;
    EXPECT_NEAR(after(2, std::vector<double>(7, 0.1), 0.1, cubic, left).of_solver()[0], std::sqrt(20.0) * left / 12.0,
                1e-12);
    // The difference of steps of 0.1, 0.05 and 0.1 has the weights 1, −5, 5, −1.
    EXPECT_NEAR(after(2, {0.1, 0.1, 0.1, 0.05, 0.1}, 1.0, cubic, left).of_solver()[0], std::sqrt(52.0) * left / 12.0,
                1e-12);
}

TEST(VelocityError, GoesOnFromWhatItSaved) {
    std::vector<double> sizes = {0.1, 0.03, 0.1, 0.1, 0.07, 0.1, 0.02};
    const VelocityError before = after(2, sizes, 0.1, cubic, 1e-4);
    VelocityError loaded(2);
    auto memory = before.save();
    loaded.load(memory, before.sizes());
    const double t = 0.52;
    const std::vector<double> left = {1e-4};
    loaded.note({cubic(t + 0.1)}, left, 0.1, 0.1);
    sizes.push_back(0.1);
    const VelocityError straight = after(2, sizes, 0.1, cubic, 1e-4);
    EXPECT_DOUBLE_EQ(loaded.known()[0], straight.known()[0]);
    EXPECT_DOUBLE_EQ(loaded.of_solver()[0], straight.of_solver()[0]);
}

}  // namespace
}  // namespace delassus::velocity_error_test
