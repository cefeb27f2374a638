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
gradients. J, C and, where H is definite of small blocks, diagonal or absent, the factor are those of python/derivatives.hpp: it
eliminates dx and the rows of open contacts, whose J is zero, and factors I − J + ρ J C (D H⁻¹ Dᵀ + E) of the others.
Any other H is factored together with all rows by SuperLU.
"""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from . import _delassus
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
        self._problem = problem
        self._x, self._lam = np.array(result.x), np.array(result.lam)
        tolerance = max(1e-9, 10.0 * result.errors["natural"])
        self._blocks = _delassus._Linearization(problem, result.lam, result.u, result.law == "coulomb", tolerance)
        self.degenerate: List[int] = self._blocks.degenerate
        small = self._blocks.has_small_blocks
        self._factor = self._blocks if small else _Whole(problem.H, problem.D, problem.E, self._blocks)
        self.unique: bool = self._factor.factorize(0.0)
        if not self.unique:
            local = self._blocks.local
            if not self._factor.factorize(1e-10 * (local.mean() if len(local) else 1.0)):
                raise InputError("the derivative does not exist: H is singular where the active constraints leave it free")

    def jvp(self, *, a: Optional[Any] = None, b: Optional[Any] = None, H: Optional[Any] = None,
            D: Optional[Any] = None, E: Optional[Any] = None,
            mu: Optional[Any] = None) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(dx, dlam, du) along changes of the data: a (n), b (m), H, D, E (matrices of their shapes), mu (one entry for
        each block, of which those of friction count). What is not given does not change."""
        n, m = self._problem.n, self._problem.m
        first = np.zeros(n)
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
        second = -self._blocks.moved(change)
        if mu is not None:
            second += self._blocks.by_mu(_vector(mu, len(self._problem.cones), "mu"))
        dx, dlam = self._factor.solve(first, second)
        return dx, dlam, self._blocks.velocities(dx, dlam) + change

    def vjp(self, *, x: Optional[Any] = None, lam: Optional[Any] = None, u: Optional[Any] = None) -> Dict[str, Any]:
        """The gradient of a function of the solution by the data, from its gradient by x (n), lam (m) and u (m).

        Returns a (n), b (m), mu (one entry for each block, 0 but for friction), and sparse H, D, E with the entries of
        the problem's own patterns, each entry taken as a variable of its own (a symmetric change of H counts both)."""
        n, m = self._problem.n, self._problem.m
        to_u = np.zeros(m) if u is None else _vector(u, m, "u")
        to_x = np.zeros(n) if x is None else _vector(x, n, "x")
        to_lam = np.zeros(m) if lam is None else _vector(lam, m, "lam")
        if u is not None:
            to_x, to_lam = self._blocks.gradient_start(to_x, to_lam, to_u)
        p, q = self._factor.solve_transposed(to_x, to_lam)
        w, mu, H, D, E = self._blocks.gradient_parts(p, q, to_u, self._x, self._lam)
        return {"a": p, "b": w, "mu": mu, "H": _like(self._problem._H, H), "D": _like(self._problem._D, D),
                "E": _like(self._problem._E, E)}


class _Whole:
    """The factor of all rows, by SuperLU."""

    def __init__(self, H, D, E, blocks):
        self._H, self._D, self._E = H, D, E
        shape = (D.shape[0],) * 2
        self._J, self._JC = (sparse.csr_matrix(entries, shape=shape) for entries in (blocks.J(), blocks.JC()))

    def factorize(self, compliance: float) -> bool:
        identity = sparse.identity(len(self._D.indptr) - 1, format="csr")
        lower = identity - self._J + self._JC @ (self._E + compliance * identity)
        matrix = sparse.bmat([[self._H, -self._D.T], [self._JC @ self._D, lower]], format="csc")
        # Rows of unlike units: each is divided by its largest entry.
        self._size = np.maximum(abs(matrix).max(axis=1).toarray().ravel(), 1e-300)
        try:
            self._factor = splu((sparse.diags(1.0 / self._size) @ matrix).tocsc())
        except RuntimeError:
            return False
        pivots = np.abs(self._factor.U.diagonal())
        return bool(pivots.min() > 1e-11 * pivots.max())

    def solve(self, first, second):
        return self._halves(self._factor.solve(np.concatenate([first, second]) / self._size))

    def solve_transposed(self, to_x, to_lam):
        return self._halves(self._factor.solve(np.concatenate([to_x, to_lam]), trans="T") / self._size)

    def _halves(self, y):
        n = self._H.shape[0]
        return y[:n], y[n:]


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


def _like(pattern, data):
    """A matrix with the places of another one, which it may not change; pattern: (data, indices, indptr, shape)."""
    _, indices, indptr, shape = pattern
    result = sparse.csr_matrix(shape)
    result.data, result.indices, result.indptr = data, indices, indptr
    result.has_canonical_format = True
    return result
