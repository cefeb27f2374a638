// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/eigenmodes.hpp"

#include "support/module.hpp"

namespace delassus::mechanics {

Eigenmodes find_eigenmodes(const SparseMatrix& K, const Eigen::VectorXd& mass, const Eigen::MatrixXd& rigid,
                           double shift, const Eigen::MatrixXd& loads, std::int32_t count) {
    const auto find = reinterpret_cast<DelassusEigenmodesFind>(
        module_symbol("delassus_eigenmodes", "delassus_eigenmodes_find", "an elastic body cannot be reduced to modes",
                      "Spectra", "; leave \"modes\" out to simulate the whole mesh"));
    Eigenmodes result;
    find(K, mass, rigid, shift, loads, count, result);
    return result;
}

}  // namespace delassus::mechanics
