# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of solutions against central differences."""
import unittest

import delassus
import numpy as np
import scipy.sparse as sparse
from delassus import Cone


def random_problem(seed, law, compliant):
    """Contacts that stick, slide and are open, a joint, a bound: between eight bodies of three velocities."""
    rng = np.random.default_rng(seed)
    n, contacts = 24, 5
    cones = [Cone.free(2), Cone.box([-0.3, -0.3], [0.3, 0.3]), Cone.nonnegative(2)]
    cones += [Cone.friction(mu) for mu in rng.uniform(0.2, 0.9, contacts)]
    m = sum(cone.rows for cone in cones)
    blocks = [block @ block.T + np.eye(3) for block in rng.standard_normal((n // 3, 3, 3))]
    H = sparse.block_diag(blocks, format="csr")
    D = sparse.csr_matrix(rng.standard_normal((m, n)) * (rng.random((m, n)) < 0.6))
    E = sparse.diags(rng.uniform(0.05, 0.2, m), format="csr") if compliant else None
    return {"H": H, "D": D, "a": 2.0 * rng.standard_normal(n), "b": rng.standard_normal(m), "cones": cones, "E": E,
            "law": law}


def solved(data):
    result = delassus.solve(delassus.Problem(**data), tolerance=1e-13)
    assert result.errors["natural"] < 1e-11, result
    return result


def differences(data, changed, step=5e-5):
    """Central differences of (x, λ, u); changed(data, s) makes the data at s."""
    ahead, back = solved(changed(data, step)), solved(changed(data, -step))
    return [(getattr(ahead, name) - getattr(back, name)) / (2 * step) for name in ("x", "lam", "u")]


class Derivatives(unittest.TestCase):
    def problems(self):
        for seed in range(20):
            data = random_problem(seed, "coulomb" if seed % 2 else "associated", seed % 3 == 0)
            problem = delassus.Problem(**data)
            result = delassus.solve(problem, tolerance=1e-13)
            yield seed, data, delassus.derivative(problem, result), result

    def test_agree_with_central_differences(self):
        kinds = set()
        for seed, data, derivative, result in self.problems():
            self.assertEqual(derivative.degenerate, [], seed)
            rng = np.random.default_rng(1000 + seed)
            m, n = data["D"].shape
            symmetric = rng.standard_normal((n, n))
            symmetric = 0.1 * (symmetric + symmetric.T) * (data["H"].toarray() != 0)
            D = 0.1 * rng.standard_normal((m, n)) * (data["D"].toarray() != 0)
            directions = {
                "a": (rng.standard_normal(n), lambda old, s, d: {"a": old["a"] + s * d}),
                "b": (rng.standard_normal(m), lambda old, s, d: {"b": old["b"] + s * d}),
                "H": (symmetric, lambda old, s, d: {"H": old["H"] + s * d}),
                "D": (D, lambda old, s, d: {"D": sparse.csr_matrix(old["D"] + s * d)}),
                "mu": (rng.standard_normal(len(data["cones"])), lambda old, s, d: {"cones": [
                    Cone.friction(cone.mu + s * by) if cone.kind == "friction" else cone
                    for cone, by in zip(old["cones"], d)]}),
            }
            if data["E"] is not None:
                directions["E"] = (np.diag(0.1 * rng.standard_normal(m)), lambda old, s, d: {"E": old["E"] + s * d})
            for name, (direction, change) in directions.items():
                expected = differences(data, lambda old, s: {**old, **change(old, s, direction)})
                found = derivative.jvp(**{name: direction})
                for what, value, known in zip(("x", "lam", "u"), found, expected):
                    scale = max(np.abs(known).max(), 1e-3)
                    np.testing.assert_allclose(value, known, atol=1e-6 * scale, err_msg=f"{seed}: {what} by {name}")
            for cone, i in zip(data["cones"], np.cumsum([0] + [cone.rows for cone in data["cones"]])):
                if cone.kind == "friction":
                    lam = result.lam[i:i + 3]
                    slides = np.linalg.norm(lam[1:]) > 0.999 * cone.mu * lam[0]
                    kinds.add("open" if lam[0] < 1e-9 else "slides" if slides else "sticks")
        self.assertEqual(kinds, {"open", "sticks", "slides"})

    def test_gradients_are_the_transpose(self):
        for seed, data, derivative, _ in self.problems():
            rng = np.random.default_rng(2000 + seed)
            m, n = data["D"].shape
            weights = {"x": rng.standard_normal(n), "lam": rng.standard_normal(m), "u": rng.standard_normal(m)}
            gradient = derivative.vjp(**weights)
            changes = {"a": rng.standard_normal(n), "b": rng.standard_normal(m),
                       "mu": rng.standard_normal(len(data["cones"])),
                       "H": data["H"].multiply(rng.standard_normal((n, n))),
                       "D": data["D"].multiply(rng.standard_normal((m, n)))}
            for name, change in changes.items():
                dx, dlam, du = derivative.jvp(**{name: change})
                along = weights["x"] @ dx + weights["lam"] @ dlam + weights["u"] @ du
                by_gradient = (gradient[name].multiply(change).sum() if sparse.issparse(change)
                               else gradient[name] @ change)
                self.assertAlmostEqual(along, by_gradient, delta=1e-9 * max(1.0, abs(along)), msg=f"{seed}, {name}")

    def test_degenerate_blocks_are_named(self):
        # A ball that touches the ground without weight, beside one that rests on it.
        problem = delassus.Problem(np.eye(2), np.eye(2), [0.0, -1.0], np.zeros(2), [Cone.nonnegative()] * 2)
        derivative = delassus.derivative(problem, delassus.solve(problem, tolerance=1e-12))
        self.assertEqual(derivative.degenerate, [0])
        dx, dlam, _ = derivative.jvp(a=[0.0, 1.0])
        np.testing.assert_allclose((dx[1], dlam[1]), (0.0, -1.0), atol=1e-12)

    def test_velocities_where_reactions_are_not_unique(self):
        # Two equal rows hold one velocity: x does not change, and the reactions' sum does.
        problem = delassus.Problem(np.eye(1), np.ones((2, 1)), [1.0], np.zeros(2), [Cone.free(2)])
        derivative = delassus.derivative(problem, delassus.solve(problem, tolerance=1e-12))
        self.assertFalse(derivative.unique)
        dx, dlam, du = derivative.jvp(a=[1.0])
        np.testing.assert_allclose(dx, 0.0, atol=1e-8)
        np.testing.assert_allclose(dlam.sum(), -1.0, atol=1e-8)
        np.testing.assert_allclose(du, 0.0, atol=1e-8)

    def test_wrong_shapes_are_refused(self):
        problem = delassus.Problem(np.eye(2), np.eye(2), [0.0, -1.0], np.zeros(2), [Cone.nonnegative()] * 2)
        derivative = delassus.derivative(problem, delassus.solve(problem))
        with self.assertRaisesRegex(delassus.InputError, r"a has the shape \(3,\); it must be \(2,\)"):
            derivative.jvp(a=np.zeros(3))
        with self.assertRaisesRegex(delassus.InputError, "D has the shape"):
            derivative.jvp(D=np.zeros((2, 3)))


if __name__ == "__main__":
    unittest.main()
