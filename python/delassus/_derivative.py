# SPDX-License-Identifier: BSD-3-Clause
"""The derivative of a solution by the data of its problem.

A solution is a zero of

    H x − Dᵀ λ − a = 0
    λ − Π(λ − ρ û) = 0,     û = u + (μ ‖u_t‖, 0, 0) under the Coulomb law, else u;     u = D x + E λ + b

with the projection Π onto the cones and any ρ > 0 for each block. Where Π is differentiable at z = λ − ρ û, with J its
derivative there and C that of û by u, the implicit function theorem gives

    H dx − Dᵀ dλ                            = da − dH x + dDᵀ λ
    ρ J C D dx + (I − J + ρ J C E) dλ       = −ρ J C (db + dD x + dE λ) + (∂Π/∂μ − ρ J ∂û/∂μ) dμ

(Facchinei and Pang 2003, sections 4.5 and 5.1, for the method; the projection onto a cone of friction is that of
core/src/sdk, cut into three cases). One factor of this matrix serves derivatives along directions, and its transpose
gradients.
"""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ._delassus import InputError


class Derivative:
    """Derivatives of (x, λ, u) by a, b, H, D, E and the coefficients of friction, at one solution.

    Attributes
    ----------
    degenerate : list of int
        Blocks at which the solution is not differentiable: a contact that is about to open, close, stick or slide, a
        bound that is touched without a force. What is returned is a member of the generalised derivative then.
    unique : bool
        False where reactions are not unique (redundant rows): dx and du are right, dlam is a small one of many.
    """

    def __init__(self, problem, result):
        self._problem, self._H, self._D, self._E = problem, problem.H, problem.D, problem.E
        self._x, self._lam = np.array(result.x), np.array(result.lam)
        n, m = problem.n, problem.m
        self._u = np.array(result.u)
        local = np.zeros(m)
        if n > 0:
            local += self._D.multiply(self._D) @ (1.0 / np.maximum(self._H.diagonal(), 1e-300))
        local += self._E.diagonal()
        tolerance = max(1e-9, 10.0 * result.errors["natural"])
        self.degenerate: List[int] = []
        self._blocks = []  # (rows, ∂Π/∂μ − ρ J ∂û/∂μ)
        jacobian, moved = [], []
        row = 0
        for number, cone in enumerate(problem.cones):
            at = slice(row, row + cone.rows)
            rho = cone.rows / local[at].sum() if local[at].sum() > 0.0 else 1.0
            J, JC, by_mu, degenerate = _block(cone, self._lam[at], self._u[at], rho, result.law == "coulomb", tolerance)
            if degenerate:
                self.degenerate.append(number)
            jacobian.append(J)
            moved.append(rho * JC)
            self._blocks.append((at, by_mu))
            row += cone.rows
        self._J = sparse.block_diag(jacobian, format="csr") if m else sparse.csr_matrix((0, 0))
        self._JC = sparse.block_diag(moved, format="csr") if m else sparse.csr_matrix((0, 0))
        self.unique = True
        self._factor = self._factorize(self._E)
        if self._factor is None:
            self.unique = False
            compliance = 1e-10 * (local.mean() if m else 1.0)
            self._factor = self._factorize(self._E + compliance * sparse.identity(m, format="csr"))
            if self._factor is None:
                raise InputError("the derivative does not exist: H is singular where the active constraints leave it free")

    def _factorize(self, E):
        n, m = self._problem.n, self._problem.m
        identity = sparse.identity(m, format="csr")
        lower = identity - self._J + self._JC @ E
        if n > 0:
            matrix = sparse.bmat([[self._H, -self._D.T], [self._JC @ self._D, lower]], format="csc")
        else:
            matrix = lower.tocsc()
        # Rows of unlike units: each is divided by its largest entry.
        size = np.maximum(abs(matrix).max(axis=1).toarray().ravel(), 1e-300) if n + m else np.ones(0)
        self._size = size
        if n + m == 0:
            return _Nothing()
        try:
            factor = splu((sparse.diags(1.0 / size) @ matrix).tocsc())
        except RuntimeError:
            return None
        pivots = np.abs(factor.U.diagonal())
        return factor if pivots.min() > 1e-11 * pivots.max() else None

    def jvp(self, *, a: Optional[Any] = None, b: Optional[Any] = None, H: Optional[Any] = None,
            D: Optional[Any] = None, E: Optional[Any] = None,
            mu: Optional[Any] = None) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(dx, dlam, du) along changes of the data: a (n), b (m), H, D, E (matrices of their shapes), mu (one entry for
        each block, of which those of friction count). What is not given does not change."""
        n, m = self._problem.n, self._problem.m
        first, second = np.zeros(n), np.zeros(m)
        change = np.zeros(m)  # of u at fixed x and λ
        if a is not None:
            first += _vector(a, n, "a")
        if b is not None:
            change += _vector(b, m, "b")
        if H is not None:
            first -= _matrix(H, (n, n), "H") @ self._x
        if D is not None:
            D = _matrix(D, (m, n), "D")
            first += D.T @ self._lam
            change += D @ self._x
        if E is not None:
            change += _matrix(E, (m, m), "E") @ self._lam
        second -= self._JC @ change
        if mu is not None:
            mu = _vector(mu, len(self._blocks), "mu")
            for (at, by_mu), value in zip(self._blocks, mu):
                second[at] += by_mu * value
        y = self._factor.solve(np.concatenate([first, second]) / self._size)
        dx, dlam = y[:n], y[n:]
        return dx, dlam, self._D @ dx + self._E @ dlam + change

    def vjp(self, *, x: Optional[Any] = None, lam: Optional[Any] = None, u: Optional[Any] = None) -> Dict[str, Any]:
        """The gradient of a function of the solution by the data, from its gradient by x (n), lam (m) and u (m).

        Returns a (n), b (m), mu (one entry for each block, 0 but for friction), and sparse H, D, E with the entries of
        the problem's own patterns, each entry taken as a variable of its own (a symmetric change of H counts both)."""
        n, m = self._problem.n, self._problem.m
        to_u = np.zeros(m) if u is None else _vector(u, m, "u")
        to_x = (np.zeros(n) if x is None else _vector(x, n, "x")) + self._D.T @ to_u
        to_lam = (np.zeros(m) if lam is None else _vector(lam, m, "lam")) + self._E.T @ to_u
        y = self._factor.solve(np.concatenate([to_x, to_lam]), trans="T") / self._size
        p, q = y[:n], y[n:]
        w = to_u - self._JC.T @ q
        mu = np.array([by_mu @ q[at] for at, by_mu in self._blocks])
        return {"a": p, "b": w, "mu": mu,
                "H": _outer(self._H, [(-p, self._x)]),
                "D": _outer(self._D, [(self._lam, p), (w, self._x)]),
                "E": _outer(self._E, [(w, self._lam)])}


class _Nothing:
    def solve(self, y, trans="N"):
        return y


def _vector(values, size: int, name: str) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.shape != (size,):
        raise InputError(f"{name} has the shape {values.shape}; it must be ({size},)")
    return values


def _matrix(values, shape: Tuple[int, int], name: str):
    values = sparse.csr_matrix(values)
    if values.shape != shape:
        raise InputError(f"{name} has the shape {values.shape}; it must be {shape}")
    return values


def _outer(pattern, factors):
    """Σ left rightᵀ at the entries of the pattern."""
    result = pattern.copy()
    rows = np.repeat(np.arange(pattern.shape[0]), np.diff(pattern.indptr))
    result.data = sum((left[rows] * right[pattern.indices] for left, right in factors), np.zeros(len(pattern.indices)))
    return result


def _block(cone, lam, u, rho: float, coulomb: bool, tolerance: float):
    """J, J C, ∂Π/∂μ − ρ J ∂û/∂μ, and whether the solution is not differentiable there."""
    rows = cone.rows
    none = np.zeros(rows)
    if cone.kind == "free":
        return np.eye(rows), np.eye(rows), none, False
    size = max(np.linalg.norm(lam), rho * np.linalg.norm(u), 1e-300)
    if cone.kind != "friction":
        lo = cone.lo if cone.kind == "box" else np.zeros(rows)
        hi = cone.hi if cone.kind == "box" else np.full(rows, np.inf)
        z = lam - rho * u
        inner = (z > lo) & (z < hi)
        near = np.minimum(np.abs(z - lo), np.abs(z - hi)) <= tolerance * size
        J = np.diag(inner.astype(float))
        return J, J, none, bool(near.any())
    mu = cone.mu
    C, by_mu_of_u = np.eye(rows), np.zeros(rows)
    speed = np.linalg.norm(u[1:])
    u_hat = u.copy()
    if coulomb:
        u_hat[0] += mu * speed
        by_mu_of_u[0] = speed
        if rho * speed > tolerance * size:
            C[0, 1:] += mu * u[1:] / speed
    z = lam - rho * u_hat
    normal, tangential = z[0], np.linalg.norm(z[1:])
    sticks, opens = tangential - mu * normal, normal + mu * tangential
    degenerate = min(abs(sticks), abs(opens)) <= tolerance * size
    if sticks <= 0.0:
        J, by_mu = np.eye(rows), np.zeros(rows)
    elif opens <= 0.0:
        J, by_mu = np.zeros((rows, rows)), np.zeros(rows)
    else:
        t = z[1:] / tangential
        along = np.concatenate([[1.0], mu * t])
        alpha = opens / (1.0 + mu * mu)
        J = np.outer(along, along) / (1.0 + mu * mu)
        J[1:, 1:] += mu * alpha / tangential * (np.eye(rows - 1) - np.outer(t, t))
        alpha_by_mu = (tangential - 2.0 * mu * alpha) / (1.0 + mu * mu)
        by_mu = np.concatenate([[alpha_by_mu], (alpha + mu * alpha_by_mu) * t])
    return J, J @ C, by_mu - rho * J @ by_mu_of_u, degenerate
