# SPDX-License-Identifier: BSD-3-Clause
"""Solves against closed forms, solvers that are kept, threads, and Ctrl-C."""
import json
import os
import signal
import tempfile
import threading
import time
import unittest
from pathlib import Path

import delassus
import numpy as np
import scipy.sparse as sparse
from delassus import Cone

EXAMPLES = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "examples" / "problems"


def block_on_slope(angle, mu, law="coulomb"):
    """A step h = 0.01 s from rest of a block of 2 kg on a slope; rows: normal, down the slope, across. It sticks if
    tan θ ≤ μ; else it slides with a = g (sin θ − μ cos θ), under the exact law."""
    mass, weight = 2.0, 2.0 * 9.81
    return delassus.Problem(mass * sparse.identity(3), sparse.identity(3),
                            0.01 * weight * np.array([-np.cos(angle), np.sin(angle), 0.0]), np.zeros(3),
                            [Cone.friction(mu)], law=law)


def endless(seconds):
    """Settings with which pgs works on the pile for as long as that, whatever it reaches."""
    return {"tolerance": 1e-300, "max_iterations": 10**12, "time_limit": seconds}


class ClosedForms(unittest.TestCase):
    def test_a_block_slides_by_coulombs_law(self):
        result = delassus.solve(block_on_slope(0.6, 0.3), "pgs", tolerance=1e-12)
        self.assertTrue(result.solved)
        speed = 0.01 * 9.81 * (np.sin(0.6) - 0.3 * np.cos(0.6))
        np.testing.assert_allclose(result.x, [0.0, speed, 0.0], atol=1e-12)
        normal = 0.01 * 2 * 9.81 * np.cos(0.6)
        np.testing.assert_allclose(result.lam, [normal, -0.3 * normal, 0.0], atol=1e-12)
        np.testing.assert_array_equal(result.u, result.x)
        self.assertIs(result.lambda_, result.lam)

    def test_a_block_sticks(self):
        result = delassus.solve(block_on_slope(0.2, 0.3), tolerance=1e-12)
        self.assertTrue(result.solved)
        np.testing.assert_allclose(result.x, 0.0, atol=1e-12)

    def test_the_law_of_one_solve(self):
        # The associated law opens the contact by u_n = μ s; with λ on the cone, s = (a_t + μ a_n)/(m (1 + μ²)).
        problem = block_on_slope(0.6, 0.3)
        result = delassus.solve(problem, "pgs", tolerance=1e-12, law="associated")
        slip = 0.01 * 9.81 * (np.sin(0.6) - 0.3 * np.cos(0.6)) / (1 + 0.3**2)
        np.testing.assert_allclose(result.x, [0.3 * slip, slip, 0.0], atol=1e-12)
        self.assertEqual((result.law, problem.law), ("associated", "coulomb"))

    def test_joints_as_by_a_dense_solve(self):
        rng = np.random.default_rng(1)
        G = rng.standard_normal((6, 6))
        H, D, E = G @ G.T + np.eye(6), rng.standard_normal((3, 6)), np.diag([0.1, 0.0, 0.2])
        a, b = rng.standard_normal(6), rng.standard_normal(3)
        exact = np.linalg.solve(np.block([[H, -D.T], [D, E]]), np.concatenate([a, -b]))
        result = delassus.solve(delassus.Problem(H, D, a, b, [Cone.free(3)], E=E), tolerance=1e-12)
        self.assertTrue(result.solved)
        np.testing.assert_allclose(np.concatenate([result.x, result.lam]), exact, rtol=1e-9)
        np.testing.assert_allclose(result.u, 0.0, atol=1e-11)

    def test_a_reduced_problem(self):
        # E λ + b = u: λ₁ = 1 at rest, the second contact opens with u₂ = ½ + 2.
        E = np.array([[2.0, 0.5], [0.5, 1.0]])
        problem = delassus.Problem(None, None, [], [-2.0, 2.0], [Cone.nonnegative()] * 2, E=E)
        result = delassus.solve(problem, tolerance=1e-12)
        np.testing.assert_allclose(result.lam, [1.0, 0.0], atol=1e-11)
        np.testing.assert_allclose(result.u, [0.0, 2.5], atol=1e-11)
        self.assertEqual(result.x.shape, (0,))


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pile = delassus.read(EXAMPLES / "sphere_pile")

    def test_what_is_reported(self):
        result = delassus.solve(self.pile, curve=True)
        self.assertEqual(result.status, "solved")
        self.assertLessEqual(result.errors["natural"], 1e-8)
        measured = self.pile.errors(result.x, result.lam)
        self.assertEqual(measured["natural"], result.errors["natural"])
        np.testing.assert_allclose(result.u, self.pile.D @ result.x + self.pile.b, atol=1e-14)
        self.assertEqual(result.curve.shape[1], 3)
        self.assertTrue((np.diff(result.curve[:, 1]) >= 0).all())
        self.assertLess(result.curve[-1, 2], result.curve[0, 2])
        self.assertEqual(sum(stage["iterations"] for stage in result.stages), result.iterations)
        report = json.loads(result.to_json())
        self.assertEqual((report["status"], report["iterations"]), ("solved", result.iterations))

    def test_not_converging_is_a_status(self):
        result = delassus.solve(self.pile, "apgd", max_iterations=3)
        self.assertEqual((result.status, result.iterations, result.solved), ("iteration_limit", 3, False))
        self.assertGreater(result.errors["natural"], 1e-8)
        self.assertEqual(result.curve.shape, (0, 3))

    def test_a_start(self):
        first = delassus.solve(self.pile, "apgd", tolerance=1e-6)
        again = delassus.solve(self.pile, "apgd", tolerance=1e-6, start=first)
        self.assertLess(again.iterations, first.iterations / 10)
        same = delassus.solve(self.pile, "apgd", tolerance=1e-6, start=(first.x, first.lam))
        np.testing.assert_array_equal(same.lam, again.lam)
        with self.assertRaisesRegex(delassus.InputError, "n = 546"):
            delassus.solve(self.pile, "apgd", start=([1.0], [1.0]))

    def test_options(self):
        one = delassus.solve(self.pile, "pgs", omega=1.2, tolerance=1e-3)
        two = delassus.solve(self.pile, "pgs(omega=1.2)", tolerance=1e-3)
        np.testing.assert_array_equal(one.lam, two.lam)
        self.assertEqual(one.options, {"omega": "1.2"})

    def test_a_path_in_place_of_a_problem(self):
        with tempfile.TemporaryDirectory() as folder:
            self.pile.write(folder + "/pile")
            by_path = delassus.solve(folder + "/pile", "pgs", tolerance=1e-3)
            np.testing.assert_array_equal(by_path.lam, delassus.solve(self.pile, "pgs", tolerance=1e-3).lam)
            with self.assertRaisesRegex(delassus.InputError, "there is no such file or folder"):
                delassus.solve(folder + "/none")
        with self.assertRaisesRegex(delassus.InputError, "takes a Problem, not a str"):
            delassus.Solver("pgs").solve("pile")

    def test_exceptions_have_the_librarys_sentences(self):
        for kind, sentence, arguments in (
                (delassus.Unsupported, 'apgd cannot solve "sphere_pile": the exact Coulomb law',
                 {"solver": "apgd", "law": "coulomb"}),
                (delassus.InputError, 'did you mean "apgd"', {"solver": "apdg"}),
                (delassus.InputError, 'did you mean "omega"', {"solver": "pgs", "omgea": 1}),
                (delassus.InputError, "list", {"solver": "pgs", "omega": [1]}),
                (delassus.InputError, "tolerance", {"tolerance": -1.0}),
                (delassus.InputError, "coulombic", {"law": "coulombic"}),
                (delassus.InputError, "belong to the Solver", {"solver": delassus.Solver("pgs"), "omega": 1.0}),
                (delassus.PluginError, "nothing.so", {"solver": "/nowhere/nothing.so"})):
            with self.assertRaisesRegex(kind, sentence) as caught:
                delassus.solve(self.pile, **arguments)
            self.assertIsInstance(caught.exception, delassus.Error)
        self.assertEqual(self.pile.law, "associated")

    def test_plugins(self):
        found = {plugin["name"]: plugin for plugin in delassus.plugins()}
        self.assertTrue({"apgd", "ipm", "pgs"} <= set(found))
        self.assertEqual(found["pgs"]["options"]["omega"]["type"], "real")
        self.assertIn("friction", found["pgs"]["capabilities"])
        self.assertFalse(set(found) & set(delassus.unbuilt()))
        self.assertTrue(all(plugin["optimized"] in (True, False, None) for plugin in found.values()))

    def test_a_rejected_plugin_is_listed_and_explained(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "mine.so").write_bytes(b"no library")
            self.assertEqual([(row["name"], Path(row["path"]).name) for row in delassus.rejected([folder])],
                             [("mine", "mine.so")])
            for attempt in (lambda: delassus.solve(self.pile, "mine", plugin_path=[folder]),
                            lambda: delassus.Solver("mine", plugin_path=[folder]),
                            lambda: delassus.compare(self.pile, ["mine"], plugin_path=[folder])):
                with self.assertRaisesRegex(delassus.InputError, "mine.so: it has no sidecar"):
                    attempt()

    def test_a_start_is_a_result_or_a_pair(self):
        x, lam = np.zeros(self.pile.n), np.zeros(self.pile.m)
        for start in (np.zeros(5), x, 3.0, "x", [], (x,), (x, lam, lam), {"x": x, "lam": lam}, iter((x, lam))):
            with self.assertRaisesRegex(delassus.InputError, "a Result or"):
                delassus.solve(self.pile, "apgd", start=start)
        with self.assertRaisesRegex(delassus.InputError, "the problem has n"):
            delassus.solve(self.pile, "apgd", start=(np.zeros(5), lam))
        for start in ((x, lam), [x, lam], (list(x), list(lam))):
            self.assertTrue(delassus.solve(self.pile, "apgd", tolerance=1e-2, start=start).solved)


class KeptSolvers(unittest.TestCase):
    def test_analysis_and_factorisation_are_used_again(self):
        chain = delassus.read(EXAMPLES / "chain")
        solver = delassus.Solver("cholmod")
        first = solver.solve(chain)
        self.assertEqual((first.analyses, first.factorizations), (1, 1))
        chain.set_right_hand_side(2 * chain.a, 2 * chain.b)
        second = solver.solve(chain)
        self.assertEqual((second.analyses, second.factorizations), (1, 1))
        np.testing.assert_allclose(second.x, 2 * first.x, rtol=1e-9, atol=1e-12)
        stiffer = delassus.Problem(4 * chain.H, chain.D, chain.a, chain.b, chain.cones)
        third = solver.solve(stiffer)
        self.assertEqual((third.analyses, third.factorizations), (1, 2))
        self.assertTrue(third.solved)

    def test_refusals(self):
        pile = delassus.read(EXAMPLES / "sphere_pile")
        self.assertEqual(delassus.Solver("pgs").refusal(pile), "")
        self.assertIn("friction", delassus.Solver("cholmod").refusal(pile))


class Threads(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pile = delassus.read(EXAMPLES / "sphere_pile")

    def test_python_runs_while_a_solver_works(self):
        working, counted = threading.Event(), [0]

        def count():
            while not working.is_set():
                counted[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        before = counted[0]
        result = delassus.solve(self.pile, "pgs", **endless(0.5))
        during = counted[0] - before
        working.set()
        thread.join()
        self.assertEqual(result.status, "time_limit")
        self.assertGreater(during, 10)

    def test_threads_that_share_a_problem_take_turns(self):
        expected = delassus.solve(self.pile, "apgd", tolerance=1e-4).lam
        solver, found = delassus.Solver("apgd"), []

        def work(own):
            found.append((own or solver).solve(self.pile, tolerance=1e-4).lam)

        threads = [threading.Thread(target=work, args=(own,)) for own in (None, None, delassus.Solver("apgd"))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(found), 3)
        for lam in found:
            np.testing.assert_array_equal(lam, expected)

    def test_ctrl_c_ends_a_solve(self):
        solver = delassus.Solver("pgs")
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        begin = time.monotonic()
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            solver.solve(self.pile, **endless(100.0))
        self.assertLess(time.monotonic() - begin, 50.0)
        self.assertTrue(solver.solve(self.pile, tolerance=1e-2).solved)

    def test_a_handler_that_comes_again_is_refused(self):
        solver = delassus.Solver("pgs")

        def again(number, frame):
            solver.solve(self.pile)

        before = signal.signal(signal.SIGUSR1, again)
        try:
            threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGUSR1)).start()
            with self.assertRaisesRegex(delassus.Error, "at work in the same thread"):
                solver.solve(self.pile, **endless(100.0))
        finally:
            signal.signal(signal.SIGUSR1, before)


if __name__ == "__main__":
    unittest.main()
