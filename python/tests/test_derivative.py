# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of solutions against central differences."""
import os
import unittest
from pathlib import Path

import delassus
import numpy as np
import scipy.sparse as sparse
from delassus import Cone


SHARED = Path(os.environ.get("DELASSUS_SHARED_PROBLEMS") or
              Path(os.environ["DELASSUS_SOURCE_DIR"]).parent / "shared" / "problems")

#: Shared problems of other engines where no contact is near an edge of its cone.
NONDEGENERATE = (
    "problems/Confeti-ex13-4contact-Fc3D-SBM", "problems/CubeH8", "problems/GFC3D_OneContact", "problems/GFC3D_TwoRods1",
    "problems/NESpheres_10_1", "problems/Rover1039", "problems/Rover9770", "problems-robotics/adroit-hammer-t200-m41",
    "problems-robotics/b2-t300-m34", "problems-robotics/chain30-t400-m93", "problems-robotics/cloth-t100-m64",
    "problems-robotics/dog-t300-m24", "problems-robotics/go1-t400-m27", "problems-robotics/go2-t100-m26",
    "problems-robotics/h1-t600-m26", "problems-robotics/hammock-t150-m187", "problems-robotics/hand-pen-t300-m34",
    "problems-robotics/humanoid-t200-m16", "problems-robotics/humanoidCMU-t600-m25",
    "problems-robotics/humanoids8-t200-m132", "problems-robotics/quadruped-t200-m11",
    "problems-robotics/shadowhand-t400-m23", "problems-robotics/softbox-t200-m672",
    "problems-robotics/stack10-t200-m120", "problems-robotics/stacker-t300-m31")


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

    def test_problems_of_other_engines(self):
        checked = 0
        for name in NONDEGENERATE:
            folder = SHARED.parent / name
            if not folder.exists():
                continue
            problem = delassus.read(folder)
            result = delassus.solve(problem, tolerance=1e-13)
            derivative = delassus.derivative(problem, result)
            self.assertEqual((derivative.degenerate, derivative.unique), ([], True), name)
            rng = np.random.default_rng(1)
            a, b = problem.a, problem.b
            da = rng.standard_normal(problem.n) * np.abs(a).max(initial=0.0)
            db = rng.standard_normal(problem.m) * np.abs(result.u).max()
            found = derivative.jvp(a=da, b=db)
            least = {}  # error by the step, of which the best is taken: between rounding and curvature
            for step in (1e-4, 1e-5, 1e-6):
                ends = []
                for s in (step, -step):
                    problem.set_right_hand_side(a + s * da, b + s * db)
                    ends.append(delassus.solve(problem, tolerance=1e-13))
                for what, value in zip(("x", "lam", "u"), found):
                    known = (getattr(ends[0], what) - getattr(ends[1], what)) / (2 * step)
                    scale = np.abs(known).max(initial=0.0)
                    if scale > 1e-9:
                        error = np.abs(value - known).max() / scale
                        least[what] = min(least.get(what, np.inf), error)
                if max(least.values()) < 1e-6:
                    break
            self.assertIn("lam", least, name)
            self.assertLess(max(least.values()), 1e-6, (name, least))
            checked += 1
        if checked == 0:
            self.skipTest(f"there are no shared problems in {SHARED}")
        self.assertGreaterEqual(checked, 20 if (SHARED.parent / "problems-robotics").exists() else 5)

    def test_a_sparse_H_and_its_blocks_agree(self):
        # The same bodies with coupled masses: a rotation of the velocities fills H and changes nothing else.
        for seed in range(4):
            data = random_problem(seed, "coulomb" if seed % 2 else "associated", seed % 3 == 0)
            n = data["H"].shape[0]
            rng = np.random.default_rng(3000 + seed)
            turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
            turned = {**data, "H": turn @ data["H"].toarray() @ turn.T, "D": data["D"].toarray() @ turn.T,
                      "a": turn @ data["a"]}
            turned["H"] = 0.5 * (turned["H"] + turned["H"].T)
            weights = rng.standard_normal(data["D"].shape[0])
            found = []
            for arguments in (data, turned):
                problem = delassus.Problem(**arguments)
                found.append((problem, delassus.derivative(problem, delassus.solve(problem, tolerance=1e-13))))
            self.assertEqual([problem.structure for problem, _ in found], ["block-diagonal", "sparse definite"])
            blocks, whole = (derivative.vjp(lam=weights, u=weights) for _, derivative in found)
            np.testing.assert_allclose(turn.T @ whole["a"], blocks["a"], atol=1e-8)
            np.testing.assert_allclose(whole["b"], blocks["b"], atol=1e-8)
            np.testing.assert_allclose(whole["mu"], blocks["mu"], atol=1e-8)

    def test_open_contacts_alone(self):
        # Nothing acts: the reduced system is empty.
        problem = delassus.Problem(2 * np.eye(3), np.eye(3), [1.0, 0.5, 0.0], np.ones(3), [Cone.friction(0.3)])
        derivative = delassus.derivative(problem, delassus.solve(problem, tolerance=1e-12))
        dx, dlam, du = derivative.jvp(a=[1.0, 2.0, 3.0])
        np.testing.assert_allclose(dx, [0.5, 1.0, 1.5])
        np.testing.assert_array_equal(dlam, 0.0)
        gradient = derivative.vjp(x=[1.0, 0.0, 0.0], u=[0.0, 1.0, 0.0])
        np.testing.assert_allclose(gradient["a"], [0.5, 0.5, 0.0])
        np.testing.assert_array_equal(gradient["b"], [0.0, 1.0, 0.0])

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
