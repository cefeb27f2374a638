# SPDX-License-Identifier: BSD-3-Clause
"""Solvers that are classes of Python."""
import os
import unittest
from pathlib import Path

import delassus
import numpy as np
from delassus import Cone

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])


@delassus.register
class Thirty:
    """Projected Gauss-Seidel on the Delassus operator."""

    options = {"omega": 1.0}

    def __init__(self, omega):
        self.omega = omega
        self.prepared = 0

    def factorize(self, problem):
        self.prepared += 1
        D = problem.D.toarray()
        self.W = np.linalg.solve(problem.H.toarray(), D.T) if problem.n else np.zeros((0, problem.m))
        self.N = D @ self.W + problem.E.toarray()

    def project(self, cone, lam):
        if cone.kind == "friction":
            normal, tangential = lam[0], np.linalg.norm(lam[1:])
            if cone.mu * tangential <= -normal:
                return np.zeros(len(lam))
            if tangential <= cone.mu * normal:
                return lam
            normal = (normal + cone.mu * tangential) / (1 + cone.mu**2)
            return np.r_[normal, lam[1:] * cone.mu * normal / tangential]
        if cone.kind == "box":
            return np.clip(lam, cone.lo, cone.hi)
        return np.maximum(lam, 0.0) if cone.kind == "nonnegative" else lam

    def solve(self, problem, request):
        free = np.linalg.solve(problem.H.toarray(), problem.a) if problem.n else np.zeros(0)
        r = problem.D @ free + problem.b
        lam = np.zeros(problem.m) if request.start is None else request.start[1].copy()
        ends = np.cumsum([0] + [cone.rows for cone in problem.cones])
        for k in range(request.max_iterations):
            for cone, i, j in zip(problem.cones, ends, ends[1:]):
                u = self.N[i:j] @ lam + r[i:j]
                if problem.law == "coulomb" and cone.kind == "friction":
                    u[0] += cone.mu * np.linalg.norm(u[1:])
                lam[i:j] = self.project(cone, lam[i:j] - self.omega * u / np.trace(self.N[i:j, i:j]))
            x = self.W @ lam + free
            if not request.show(k + 1, lam, x):
                return x, lam
            if problem.errors(x, lam)["natural"] <= request.tolerance:
                return x, lam
        return x, lam, "iteration_limit"


@delassus.register
class Liar:
    def solve(self, problem, request):
        return np.zeros(problem.n), np.zeros(problem.m)


class Raiser:
    name = "raiser"
    capabilities = ["free", "h_diagonal"]

    def solve(self, problem, request):
        raise RuntimeError("no idea")


delassus.register(Raiser)


class Registered(unittest.TestCase):
    def test_is_listed_with_its_options(self):
        found = {plugin["name"]: plugin for plugin in delassus.plugins()}
        self.assertIn("thirty", found)
        self.assertEqual(found["thirty"]["description"], "Projected Gauss-Seidel on the Delassus operator.")
        self.assertEqual(list(found["thirty"]["options"]), ["omega"])

    def test_solves_the_examples_as_pgs_does(self):
        for name, tolerance in (("box_stack", 1e-3), ("sphere_pile", 1e-2)):
            for law in ("associated", "coulomb"):
                folder = SOURCE / "examples" / "problems" / name
                problem = delassus.read(folder)
                mine = delassus.solve(problem, "thirty", tolerance=tolerance, law=law, max_iterations=20000)
                self.assertEqual(mine.status, "solved", (name, law, mine))
                if name == "box_stack":
                    theirs = delassus.solve(problem, "pgs", tolerance=1e-8, law=law)
                    np.testing.assert_allclose(mine.x, theirs.x, atol=5e-3, err_msg=law)  # the weight gives 0.05 m/s
                self.assertGreater(mine.iterations, 0)
                self.assertLessEqual(mine.errors["natural"], tolerance)

    def test_takes_options_keeps_its_factors_and_starts_warm(self):
        problem = delassus.Problem(2 * np.eye(3), np.eye(3), [-1.0, 0.5, 0.0], np.zeros(3), [Cone.friction(0.3)])
        solver = delassus.Solver("thirty", omega=1.5)
        cold = solver.solve(problem, tolerance=1e-10)
        self.assertTrue(cold.solved)
        warm = solver.solve(problem, tolerance=1e-10, start=cold)
        self.assertLessEqual(warm.iterations, 1)
        with self.assertRaisesRegex(delassus.InputError, "omeg"):
            delassus.Solver("thirty", omeg=1.5)

    def test_draws_a_curve_and_obeys_limits(self):
        problem = delassus.read(SOURCE / "examples" / "problems" / "sphere_pile")
        result = delassus.solve(problem, "thirty", tolerance=1e-300, max_iterations=7, curve=True)
        self.assertEqual(result.status, "iteration_limit")
        self.assertGreaterEqual(len(result.curve), 2)  # as many as their measuring takes time for
        self.assertLess(result.curve[-1, 2], result.curve[0, 2])
        limited = delassus.solve(problem, "thirty", tolerance=1e-300, time_limit=0.05)
        self.assertEqual(limited.status, "time_limit")

    def test_a_lie_is_caught(self):
        problem = delassus.read(SOURCE / "examples" / "problems" / "sphere_pile")
        result = delassus.solve(problem, "liar", tolerance=1e-6)
        self.assertEqual(result.status, "false_claim")
        self.assertGreater(result.errors["balance"], 1e-3)

    def test_an_exception_is_the_message(self):
        problem = delassus.Problem(np.eye(1), np.eye(1), [1.0], [0.0], [Cone.free()])
        result = delassus.solve(problem, "raiser")
        self.assertEqual(result.status, "error")
        self.assertIn("no idea", result.message)
        contact = delassus.Problem(np.eye(1), np.eye(1), [1.0], [0.0], [Cone.nonnegative()])
        with self.assertRaises(delassus.Unsupported):
            delassus.solve(contact, "raiser")

    def test_a_contact_that_opens_straight_up(self):
        for mu in (0.0, 0.3):
            problem = delassus.Problem(2 * np.eye(3), np.eye(3), [1.0, 0.0, 0.0], np.zeros(3), [Cone.friction(mu)])
            result = delassus.solve(problem, "thirty", max_iterations=100)
            self.assertTrue(result.solved, result)
            np.testing.assert_array_equal(result.lam, 0.0)

    def test_a_failed_solve_shows_no_error(self):
        nan = type("Nan", (), {"solve": lambda self, problem, request: (np.full(3, np.nan), np.full(3, np.nan))})
        delassus.register(nan)
        problem = delassus.Problem(2 * np.eye(3), np.eye(3), [1.0, 0.0, 0.0], np.zeros(3), [Cone.friction(0.3)])
        for name, status in (("nan", "numerical_failure"), ("raiser_of_contacts", "error")):
            if name != "nan":
                delassus.register(type("Raiser_of_contacts", (), {"solve": Raiser.solve}))
            result = delassus.solve(problem, name)
            self.assertEqual(result.status, status)
            self.assertNotIn("natural error", repr(result))
            self.assertIn("no answer", repr(result))
        liar = delassus.solve(problem, "liar")  # x = 0: u = 0, and only the momentum is not balanced
        self.assertIn("balance error", repr(liar))

    def test_a_scene_says_why_a_solver_failed(self):
        delassus.register(type("Raiser_in_scenes", (), {"solve": Raiser.solve}))
        scene = ("step: 0.01\nend: 0.1\nmaterials: {m: {friction: 0.3}}\nbodies:\n"
                 "  - {name: floor, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                 "  - {name: box, density: 1000, position: [0, 0, 0.05], shapes: [{box: {size: [0.2, 0.2, 0.1]}, "
                 "material: m}]}\n")
        for name, reason in (("raiser_in_scenes", "no idea"), ("liar", "claim")):
            simulation = delassus.Simulation(delassus.Scene(scene, solver=name))
            while not simulation.finished:
                simulation.step()
            found = [one for one in simulation.warnings() if f"solver {name} failed in" in one]
            self.assertEqual(len(found), 1, simulation.warnings())
            self.assertIn(reason, found[0])

    def test_works_in_a_scene(self):
        scene = ("step: 0.01\nend: 0.5\nmaterials: {m: {friction: 0.3}}\nbodies:\n"
                 "  - {name: slope, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                 "  - {name: box, density: 1000, position: [0, 0, 0.05], velocity: [1, 0, 0],\n"
                 "     shapes: [{box: {size: [0.2, 0.2, 0.1]}, material: m}]}\n")
        mine = delassus.simulate(delassus.Scene(scene, solver="thirty"))
        theirs = delassus.simulate(delassus.Scene(scene))
        self.assertEqual(mine.status, "finished", mine.message)
        np.testing.assert_allclose(mine.body("box")[-1, 0], theirs.body("box")[-1, 0], atol=1e-3)
        self.assertAlmostEqual(mine.body("box")[-1, 0], 1 / (2 * 0.3 * 9.81), delta=5e-3)

    def test_what_is_no_solver_is_refused(self):
        with self.assertRaisesRegex(delassus.InputError, "solve"):
            delassus.register(object)
        with self.assertRaisesRegex(delassus.InputError, "already"):
            delassus.register(Raiser)
        with self.assertRaises(delassus.PluginError):
            delassus.register(type("Bad name", (Liar,), {}))
        bad = type("Wrong", (), {"solve": lambda self, problem, request: problem.n})
        delassus.register(bad)
        problem = delassus.Problem(np.eye(1), np.eye(1), [1.0], [0.0], [Cone.free()])
        result = delassus.solve(problem, "wrong")
        self.assertEqual(result.status, "error")
        self.assertIn("must return (x, lam)", result.message)


if __name__ == "__main__":
    unittest.main()
