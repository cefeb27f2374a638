// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/sdk/anderson.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace delassus::sdk::anderson_test {
namespace {

// For a linear map of a space of 5 dimensions it ends after 6 points, whatever was pushed before it was cleared.
TEST(Anderson, ForgetsAllThatWasPushed) {
    constexpr int size = 5;
    Eigen::MatrixXd A(size, size);
    for (int i = 0; i < size; ++i)
        for (int j = 0; j < size; ++j) A(i, j) = 0.3 * std::sin(1.0 + 3.0 * i + 7.0 * j + i * j);
    const Vector c = Vector::LinSpaced(size, -1.0, 2.0);
    const Vector wanted = (Eigen::MatrixXd::Identity(size, size) - A).lu().solve(c);
    for (int pushed = 0; pushed < 14; ++pushed) {
        Anderson anderson;
        anderson.reset(size, 10);
        for (int k = 0; k < pushed; ++k) anderson.push(100.0 * Vector::Unit(size, k % size), k * Vector::Ones(size));
        anderson.clear();
        Vector y = Vector::Zero(size);
        for (int k = 0; k <= size; ++k) {
            const Vector F = A * y + c;
            anderson.push(F - y, F);
            if (!anderson.extrapolate(y)) y = F;
        }
        EXPECT_LT((y - wanted).norm(), 1e-6) << pushed;
    }
}

}  // namespace
}  // namespace delassus::sdk::anderson_test
