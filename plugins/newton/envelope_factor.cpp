// SPDX-License-Identifier: BSD-3-Clause
#include "envelope_factor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/sdk/simd.hpp"

namespace delassus::newton {

namespace {

inline double dot(const double* x, const double* y, std::int32_t count) {
    sdk::Quad sum{}, more{}, a, b;
    std::int32_t k = 0;
    for (; k + 8 <= count; k += 8) {
        sdk::load(x + k, a);
        sdk::load(y + k, b);
        sum += a * b;
        sdk::load(x + k + 4, a);
        sdk::load(y + k + 4, b);
        more += a * b;
    }
    sum += more;
    if (k + 4 <= count) {
        sdk::load(x + k, a);
        sdk::load(y + k, b);
        sum += a * b;
        k += 4;
    }
    double result = sdk::sum(sum);
    for (; k < count; ++k) result += x[k] * y[k];
    return result;
}

}  // namespace

double EnvelopeFactor::work(const std::vector<std::int32_t>& first) {
    double sum = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i) {
        const double length = static_cast<double>(i) - first[i] + 1.0;
        sum += 0.5 * length * length;
    }
    return sum;
}

void EnvelopeFactor::analyze(std::vector<std::int32_t> first) {
    first_ = std::move(first);
    offset_.resize(first_.size());
    std::ptrdiff_t used = 0;
    for (std::size_t i = 0; i < first_.size(); ++i) {
        const auto length = static_cast<std::ptrdiff_t>(i) - first_[i] + 1;
        offset_[i] = used - first_[i];
        used += length;
    }
    value_.resize(static_cast<std::size_t>(used));
}

bool EnvelopeFactor::factorize() {
    const auto size = static_cast<std::int32_t>(first_.size());
    bool definite = true;
    sdk::with_best_instructions([&] {
        for (std::int32_t i = 0; i < size && definite; ++i) {
            double* own = row(i);
            const std::int32_t begin = first_[static_cast<std::size_t>(i)];
            for (std::int32_t j = begin; j < i; ++j) {
                const double* other = row(j);
                const std::int32_t from = std::max(begin, first_[static_cast<std::size_t>(j)]);
                own[j] = (own[j] - dot(own + from, other + from, j - from)) / other[j];
            }
            const double pivot = own[i] - dot(own + begin, own + begin, i - begin);
            definite = pivot > 0.0;
            own[i] = std::sqrt(pivot);
        }
    });
    return definite;
}

void EnvelopeFactor::solve(sdk::Vector& v) const {
    const auto size = static_cast<std::int32_t>(first_.size());
    sdk::with_best_instructions([&] {
        for (std::int32_t i = 0; i < size; ++i) {
            const double* own = row(i);
            const std::int32_t begin = first_[static_cast<std::size_t>(i)];
            v[i] = (v[i] - dot(own + begin, v.data() + begin, i - begin)) / own[i];
        }
        for (std::int32_t i = size - 1; i >= 0; --i) {
            const double* own = row(i);
            v[i] /= own[i];
            for (std::int32_t j = first_[static_cast<std::size_t>(i)]; j < i; ++j) v[j] -= own[j] * v[i];
        }
    });
}

}  // namespace delassus::newton
