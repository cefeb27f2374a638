# SPDX-License-Identifier: BSD-3-Clause
"""What of a user's arrays is read where it stands, what is copied, and how long it lives."""
import gc
import mmap
import os
import threading
import unittest
import weakref

import delassus
import numpy as np
import scipy.sparse as sparse
from delassus import Cone


def arrays(n=6):
    """Matrices and vectors of the types that fit; bodies of one velocity on the ground, each with a joint."""
    rng = np.random.default_rng(3)
    return {"H": sparse.diags(rng.uniform(1.0, 2.0, n), format="csr"), "D": sparse.identity(n, format="csr"),
            "a": rng.standard_normal(n), "b": rng.standard_normal(n), "cones": [Cone.free(n)],
            "E": sparse.diags(rng.uniform(0.1, 0.2, n), format="csr")}


def parts(data):
    """The arrays by the names that the plugin shows_addresses gives them."""
    found = {f"{letter}.{part}": getattr(data[letter], part)
             for letter in "HDE" for part in ("indptr", "indices", "data")}
    return {**found, "a": data["a"], "b": data["b"]}


def addresses_in_solver(problem):
    result = delassus.solve(problem, os.environ["DELASSUS_TEST_PLUGIN"])
    words = result.message.split()
    return dict(zip(words[::2], map(int, words[1::2])))


class Addresses(unittest.TestCase):
    def test_a_solver_reads_the_users_memory(self):
        data = arrays()
        problem = delassus.Problem(**data)
        expected = {name: array.ctypes.data for name, array in parts(data).items()}
        self.assertEqual(addresses_in_solver(problem), expected)
        problem.law = "coulomb"
        self.assertEqual(addresses_in_solver(problem), expected)

    def test_a_solver_written_in_python_does_too(self):
        seen = []

        @delassus.register
        class Witness:
            def solve(self, problem, request):
                seen.append(problem)
                return np.zeros(problem.n), np.zeros(problem.m), "stalled"

        data = arrays()
        problem = delassus.Problem(**data)
        delassus.solve(problem, "witness", law="coulomb")
        self.assertEqual((seen[0].law, problem.law), ("coulomb", "associated"))
        for letter in "HDE":
            for part in ("indptr", "indices", "data"):
                here, there = getattr(getattr(seen[0], letter), part), getattr(data[letter], part)
                self.assertEqual(here.ctypes.data, there.ctypes.data, (letter, part))
        del data, problem, here, there
        gc.collect()
        np.testing.assert_array_equal(seen[0].H.toarray(), arrays()["H"].toarray())
        self.assertEqual(seen[0].errors(np.zeros(6), np.zeros(6))["cone"], 0.0)

    def test_what_a_python_solver_keeps_of_a_scene_stays_whole(self):
        kept = []

        @delassus.register
        class Keeper:
            def solve(self, problem, request):
                kept.append((problem, problem.D.toarray(), np.array(problem.b)))
                result = delassus.solve(problem, "pgs", tolerance=request.tolerance)
                return result.x, result.lam

        scene = ("step: 0.01\nend: 0.1\nmaterials: {m: {friction: 0.3}}\nbodies:\n"
                 "  - {name: slope, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                 "  - {name: box, density: 1000, position: [0, 0, 0.05], velocity: [1, 0, 0],\n"
                 "     shapes: [{box: {size: [0.2, 0.2, 0.1]}, material: m}]}\n")
        delassus.simulate(delassus.Scene(scene, solver="keeper"))
        self.assertGreater(len(kept), 3)
        gc.collect()
        for problem, D, b in kept:
            np.testing.assert_array_equal(problem.D.toarray(), D)
            np.testing.assert_array_equal(problem.b, b)

    def test_conversions_copy_once(self):
        data = arrays()
        D = data["D"].tocsc()
        problem = delassus.Problem(**{**data, "D": D, "a": list(data["a"])})
        found = addresses_in_solver(problem)
        self.assertEqual(found["H.data"], data["H"].data.ctypes.data)
        self.assertEqual(found["D.data"], problem.D.data.ctypes.data)
        D.data[0] = 7.0
        self.assertEqual(problem.D[0, 0], 1.0)

    def test_wide_indices_are_copied(self):
        data = arrays()
        D = data["D"]
        D.indices, D.indptr = D.indices.astype(np.int64), D.indptr.astype(np.int64)
        found = addresses_in_solver(delassus.Problem(**data))
        self.assertNotEqual(found["D.indices"], D.indices.ctypes.data)
        self.assertEqual(found["D.data"], D.data.ctypes.data)
        D.indices[0] = 3


class ReadOnly(unittest.TestCase):
    def test_nothing_that_was_lent_can_be_written(self):
        data = arrays()
        problem = delassus.Problem(**data)
        for name, array in parts(data).items():
            with self.assertRaisesRegex(ValueError, "read-only", msg=name):
                array[0] = 1
        for change in ("H[0, 0] = 5.0", "H *= 2.0", "H.data += 1.0"):
            with self.assertRaisesRegex(ValueError, "read-only", msg=change):
                exec(change, {"H": data["H"]})
        np.testing.assert_array_equal(problem.H.toarray(), arrays()["H"].toarray())

    def test_copies_leave_the_arrays_alone(self):
        data = arrays()
        problem = delassus.Problem(**data, copy=True)
        for array in parts(data).values():
            array[0] = 3
        np.testing.assert_array_equal(problem.H.toarray(), arrays()["H"].toarray())
        np.testing.assert_array_equal(problem.a, arrays()["a"])

    def test_views_of_arrays_in_use_are_copied(self):
        data, square = arrays(), np.arange(6.0).reshape(2, 3)
        problem = delassus.Problem(**{**data, "a": square.reshape(-1)})
        square[0, 0] = 7.0
        self.assertEqual(problem.a[0], 0.0)
        other = arrays()
        values = other["H"].data[:]
        again = delassus.Problem(**other)
        values[:] = 7.0
        np.testing.assert_array_equal(again.H.toarray(), arrays()["H"].toarray())

    def test_a_matrix_with_spare_memory(self):
        data, D = arrays(), arrays()["D"]
        D.data, D.indices = np.r_[D.data, 9.0, 9.0], np.r_[D.indices, 9, 9].astype(np.int32)
        problem = delassus.Problem(**{**data, "D": D})
        D.data[0] = 5.0
        np.testing.assert_array_equal(problem.D.toarray(), np.eye(6))

    def test_parts_of_arrays_in_use_are_copied(self):
        data, state = arrays(), np.arange(12.0)
        problem = delassus.Problem(**{**data, "a": state[:6]})
        state[0] = 7.0
        self.assertEqual(problem.a[0], 0.0)
        np.testing.assert_array_equal(problem.a[1:], state[1:6])

    def test_parts_of_arrays_that_nobody_has_are_read_in_place(self):
        part = np.arange(12.0)[2:8]
        problem = delassus.Problem(**{**arrays(), "a": part})
        self.assertEqual(addresses_in_solver(problem)["a"], part.ctypes.data)
        self.assertFalse(part.base.flags.writeable)

    def test_a_read_only_view_of_a_buffer_that_changes_is_copied(self):
        state = np.arange(12.0)
        view = state[:6]
        view.flags.writeable = False
        problem = delassus.Problem(**{**arrays(), "a": view})
        state[0] = 7.0
        self.assertEqual(problem.a[0], 0.0)

    def test_memory_of_others_is_copied(self):
        with mmap.mmap(-1, 48) as memory:
            view = np.frombuffer(memory, dtype=float)
            problem = delassus.Problem(**{**arrays(), "a": view})
            view[0] = 7.0
            view.flags.writeable = False
            again = delassus.Problem(**{**arrays(), "b": view})
            self.assertEqual((problem.a[0], again.b[0]), (0.0, 7.0))
            self.assertNotEqual(addresses_in_solver(again)["b"], view.ctypes.data)
            del view

    def test_the_matrices_of_a_problem_are_lent_again(self):
        first = delassus.Problem(**arrays())
        second = delassus.Problem(first.H, first.D, first.a, first.b, first.cones, E=first.E)
        found = addresses_in_solver(second)
        self.assertEqual(found["D.data"], first.D.data.ctypes.data)
        del first
        gc.collect()
        np.testing.assert_array_equal(second.D.toarray(), np.eye(6))

    def test_what_is_refused_stays_the_users(self):
        data, square = arrays(), np.arange(6.0).reshape(2, 3)
        with self.assertRaises(delassus.InputError):
            delassus.Problem(**{**data, "a": square.reshape(-1), "cones": [Cone.free(5)]})
        square[0, 0] = 5.0
        for array in parts(data).values():
            array[0] = array[0]
        one_nan = arrays()
        one_nan["H"].data[2] = np.nan
        with self.assertRaisesRegex(delassus.InputError, "finite"):
            delassus.Problem(**one_nan)
        one_nan["H"].data[2] = 1.0
        delassus.Problem(**one_nan)

    def test_right_hand_sides_are_copied(self):
        problem = delassus.Problem(**arrays())
        a, b = np.zeros(6), np.ones(6)
        for k in range(3):
            a[:] = k
            problem.set_right_hand_side(a, b)
            self.assertEqual(problem.a[5], k)
        a[:] = 9.0
        self.assertEqual(problem.a[5], 2.0)

    def test_unaligned_memory_is_copied(self):
        memory = np.zeros(49, dtype=np.uint8)
        view = memory[1:].view(float)
        problem = delassus.Problem(**{**arrays(), "a": view})
        view[:] = 7.0
        np.testing.assert_array_equal(problem.a, 0.0)


class Lifetimes(unittest.TestCase):
    def lent(self):
        """A problem, and weak references to arrays that it borrows and nobody else has."""
        data = arrays()
        a, values = data["a"].copy(), data["H"].data.copy()
        data["a"], data["H"].data = a, values
        problem = delassus.Problem(**data)
        self.assertEqual(addresses_in_solver(problem)["H.data"], values.ctypes.data)
        return problem, [weakref.ref(a), weakref.ref(values)]

    def test_arrays_live_as_long_as_their_problem(self):
        problem, references = self.lent()
        expected = delassus.solve(delassus.Problem(**arrays()), tolerance=1e-12)
        gc.collect()
        self.assertTrue(all(reference() is not None for reference in references))
        result = delassus.solve(problem, tolerance=1e-12)
        np.testing.assert_allclose(result.x, expected.x, rtol=1e-10)
        solver = delassus.Solver("cholmod")
        solver.solve(problem)
        H = problem.H
        del problem
        gc.collect()
        np.testing.assert_array_equal(H.toarray(), arrays()["H"].toarray())
        del H
        gc.collect()
        self.assertEqual([reference() for reference in references], [None, None])
        other = solver.solve(delassus.Problem(**arrays()), tolerance=1e-10)
        np.testing.assert_allclose(other.x, expected.x, rtol=1e-7)

    def test_a_new_right_hand_side_lets_the_old_one_go(self):
        problem, (a, values) = self.lent()
        problem.set_right_hand_side(np.zeros(6), np.zeros(6))
        gc.collect()
        self.assertIsNone(a())
        self.assertIsNotNone(values())

    def test_problems_end_in_other_threads(self):
        references, problems = [], []
        for _ in range(200):
            problem, watching = self.lent()
            problems.append(problem)
            references += watching
        del problem
        solver = delassus.Solver("cholmod")

        def work():
            while True:
                try:
                    own = problems.pop()
                except IndexError:
                    return
                solver.solve(own)
                own.set_right_hand_side(np.zeros(6), np.zeros(6))
                del own
                gc.collect(0)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        gc.collect()
        self.assertEqual([reference() for reference in references], [None] * len(references))


if __name__ == "__main__":
    unittest.main()
