# SPDX-License-Identifier: BSD-3-Clause
"""A solve as a function of PyTorch, and friction that is found from measured speeds.

    python3 torch_layer.py

Needs PyTorch (Debian's python3-torch). Copy ContactSolve into a program of your own.
"""
import delassus
import numpy as np
import scipy.sparse as sparse
import torch


class ContactSolve(torch.autograd.Function):
    """(x, λ) of contacts with friction, from the values of H and D at their places, a, b and the coefficients μ.

    ContactSolve.apply(H, D, a, b, mu, H_places, D_places, tolerance) with tensors in double precision: H and D (one
    value for each entry), a (n), b (m) and mu (one for each contact of 3 rows); H_places and D_places are SciPy's CSR
    matrices whose places are meant. H is symmetric: its gradient takes each entry as a variable of its own.
    """

    @staticmethod
    def forward(ctx, H, D, a, b, mu, H_places, D_places, tolerance):
        def matrix(values, places):
            return sparse.csr_matrix((values.detach().numpy(), places.indices, places.indptr), shape=places.shape)

        # The memory of tensors may change, so the problem copies it.
        ctx.problem = delassus.Problem(matrix(H, H_places), matrix(D, D_places), a.detach().numpy(), b.detach().numpy(),
                                       [delassus.Cone.friction(float(value)) for value in mu], law="coulomb", copy=True)
        ctx.result = delassus.solve(ctx.problem, tolerance=tolerance)
        if not ctx.result.solved:
            raise RuntimeError(f"the contacts were not solved: {ctx.result}")
        return torch.from_numpy(np.array(ctx.result.x)), torch.from_numpy(np.array(ctx.result.lam))

    @staticmethod
    def backward(ctx, to_x, to_lam):
        derivative = delassus.derivative(ctx.problem, ctx.result)
        gradient = derivative.vjp(x=to_x.numpy(), lam=to_lam.numpy())
        values = (gradient["H"].data, gradient["D"].data, gradient["a"], gradient["b"], gradient["mu"])
        return (*(torch.from_numpy(np.array(value)) for value in values), None, None, None)


def blocks_on_slope(count, angle, mass=2.0, step=0.01):
    """(H, D, a, b): blocks that rest on one slope, each with a push across it that grows with its number; SI units."""
    weight = step * mass * 9.81 * np.array([-np.cos(angle), np.sin(angle), 0.0])
    push = step * mass * np.outer(np.arange(count), [0.0, 0.0, 1.0])
    H, D = mass * sparse.identity(3 * count, format="csr"), sparse.identity(3 * count, format="csr")
    return H, D, (weight + push).ravel(), np.zeros(3 * count)


def check():
    """Whether PyTorch's own check by differences agrees, in every argument."""
    H, D, a, b = blocks_on_slope(3, 0.6)
    tensors = [torch.tensor(values, dtype=torch.double, requires_grad=True)
               for values in (H.data, D.data, 10.0 * a, b, [0.3, 0.5, 0.9])]
    return torch.autograd.gradcheck(lambda *values: ContactSolve.apply(*values, H, D, 1e-13), tensors, eps=1e-6,
                                    atol=1e-6, rtol=1e-5)


def find_friction(true=0.35, guess=0.1, rounds=60):
    """The coefficient of friction that explains the speeds of sliding blocks, by gradient descent."""
    H, D, a, b = blocks_on_slope(4, 0.6)
    fixed = [torch.tensor(values, dtype=torch.double) for values in (H.data, D.data, a, b)]

    def speeds(mu):
        return ContactSolve.apply(*fixed, mu.expand(4), H, D, 1e-12)[0]

    seen = speeds(torch.tensor(true, dtype=torch.double))
    mu = torch.tensor(guess, dtype=torch.double, requires_grad=True)
    optimizer = torch.optim.LBFGS([mu], max_iter=rounds, line_search_fn="strong_wolfe", tolerance_grad=1e-14,
                                  tolerance_change=1e-16)

    def loss():
        optimizer.zero_grad()
        value = 1e4 * ((speeds(mu) - seen) ** 2).sum()
        value.backward()
        return value

    optimizer.step(loss)
    return mu.item()


if __name__ == "__main__":
    assert check()
    print("gradients agree with differences (torch.autograd.gradcheck)")
    print(f"friction found: {find_friction():.6f}, true: 0.35")
