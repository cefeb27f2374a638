// SPDX-License-Identifier: BSD-3-Clause
// Run when configuring: succeeds if solver_options_delete frees the structure itself, as its documentation says.
// Version 4.4 frees only what it points to.
#include <malloc.h>

#include <Friction_cst.h>
#include <SolverOptions.h>

int main() {
    const auto use_once = [] { solver_options_delete(solver_options_create(SICONOS_FRICTION_3D_NSGS)); };
    use_once();
    const auto before = mallinfo2().uordblks;
    for (int k = 0; k < 100; ++k) use_once();
    return mallinfo2().uordblks < before + 100 * sizeof(SolverOptions) ? 0 : 1;
}
