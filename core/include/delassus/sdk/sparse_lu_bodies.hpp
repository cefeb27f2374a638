// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/sparse_lu.hpp (sdk/compiled_once.hpp).
#pragma once

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/sparse_lu.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION bool SparseLu::factorize(const SparseColumns& A) {
    factor_.compute(A);
    return factor_.info() == Eigen::Success;
}

DELASSUS_SDK_FUNCTION Vector SparseLu::solve(const Vector& v) const {
    return factor_.solve(v);
}

}  // namespace delassus::sdk
