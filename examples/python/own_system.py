# SPDX-License-Identifier: BSD-3-Clause
"""A system of one's own, and the order of each timestepper on it: two masses in the plane, the first on a spring that
hardens, joined by a rod (the system of examples/system, which is in C++).

    python3 own_system.py
"""
import delassus
import numpy as np

LENGTH, STIFFNESS, GRAVITY = 0.5, 200.0, 9.81  # m, N/m, m/s²
MASS = np.array([1.0, 1.0, 0.5, 0.5])  # kg, of x₁, y₁, x₂, y₂


class TwoMasses(delassus.DynamicalSystem):
    def initial_state(self):
        return np.array([0.3, 0.0, 0.3 + LENGTH, 0.0]), np.zeros(4)

    def mass(self, state):
        return np.diag(MASS)

    def force(self, state):
        p = state.q[:2]
        force = -MASS * [0.0, GRAVITY, 0.0, GRAVITY]
        force[:2] -= STIFFNESS * (1.0 + p @ p) * p
        return force

    # (|p₂ − p₁|² − L²)/(2L) = 0; the derivatives that are not given are differences
    def constraint(self, state):
        rod = state.q[2:] - state.q[:2]
        return np.array([(rod @ rod - LENGTH**2) / (2.0 * LENGTH)])

    def constraint_jacobian(self, state):
        slope = (state.q[2:] - state.q[:2]) / LENGTH
        return np.concatenate([-slope, slope])[np.newaxis]

    def energy(self, state):
        square = state.q[:2] @ state.q[:2]
        return (0.5 * MASS @ state.v**2 + STIFFNESS * (0.5 * square + 0.25 * square**2)
                + GRAVITY * (MASS[1] * state.q[1] + MASS[3] * state.q[3]))


def order(system, method, reference, end=0.2, steps=100):
    """From the errors with steps of two sizes."""
    errors = []
    for count in (steps, 2 * steps):
        run = delassus.simulate(system, integrator=method, step=end / count, end=end)
        errors.append(np.abs(run.positions[-1] - reference).max())
    return np.log2(errors[0] / errors[1])


def main():
    system = TwoMasses()
    reference = delassus.simulate(system, integrator="rk4", step=1e-4, end=0.2).positions[-1]
    methods = ("euler_implicit_linearized", "euler_implicit", "trapezoidal", "hht", "generalized_alpha", "moreau_jean")
    return {method: order(system, method, reference) for method in methods}


if __name__ == "__main__":
    for name, found in main().items():
        print(f"{name:28} {found:5.2f}")
