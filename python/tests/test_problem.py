# SPDX-License-Identifier: BSD-3-Clause
"""Problems from arrays: what is taken, what is refused, and what comes back."""
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import delassus
import numpy as np
import scipy.sparse as sparse
from delassus import Cone

EXAMPLES = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "examples" / "problems"


def coupled(**changes):
    """Two masses that a spring couples, one contact with friction; the arguments of Problem."""
    arguments = {
        "H": sparse.csr_matrix([[2.0, -0.5, 0, 0], [-0.5, 3.0, 0, 0], [0, 0, 2.0, 0], [0, 0, 0, 3.0]]),
        "D": sparse.csr_matrix([[1.0, -1.0, 0, 0], [0, 0, 1.0, -1.0], [0, 0, 0.5, 0.5]]),
        "a": np.array([-1.0, 0.5, 0.25, -0.75]), "b": np.array([0.125, 0.0, 0.0]), "cones": [Cone.friction(0.5)]}
    arguments.update(changes)
    return arguments


class Matrices(unittest.TestCase):
    def assert_same(self, problem, other):
        for letter in "HDE":
            one, two = getattr(problem, letter), getattr(other, letter)
            self.assertEqual(one.shape, two.shape)
            np.testing.assert_array_equal(one.toarray(), two.toarray())

    def test_every_form_gives_the_same_problem(self):
        expected = delassus.Problem(**coupled())
        H, D = coupled()["H"], coupled()["D"]
        wide = D.copy()
        wide.indices, wide.indptr = wide.indices.astype(np.int64), wide.indptr.astype(np.int64)
        for form in (H.tocoo(), H.tocsc(), H.toarray(), H.toarray().tolist(), sparse.csr_array(H),
                     H.astype(np.float32)):
            self.assert_same(delassus.Problem(**coupled(H=form)), expected)
        for form in (wide, D.tocsc(), D.toarray(), np.asfortranarray(D.toarray())):
            self.assert_same(delassus.Problem(**coupled(D=form)), expected)

    def test_integers_and_strides_are_taken(self):
        strided = np.repeat(coupled()["a"], 2)[::2]
        problem = delassus.Problem(**coupled(a=strided, b=[0, 1, 2]))
        np.testing.assert_array_equal(problem.a, coupled()["a"])
        np.testing.assert_array_equal(problem.b, [0.0, 1.0, 2.0])

    def test_repeated_and_unsorted_entries_add_up_and_stay_the_users(self):
        D = sparse.csr_matrix((np.array([-1.0, 0.25, 0.75]), np.array([1, 0, 0]), np.array([0, 3])), shape=(1, 4))
        problem = delassus.Problem(**coupled(D=D, b=np.zeros(1), cones=[Cone.nonnegative(1)]))
        np.testing.assert_array_equal(problem.D.toarray(), [[1.0, -1.0, 0.0, 0.0]])
        np.testing.assert_array_equal(D.indices, [1, 0, 0])
        np.testing.assert_array_equal(D.data, [-1.0, 0.25, 0.75])

    def test_columns_that_were_put_out_of_order(self):
        D = coupled()["D"]
        self.assertTrue(D.has_canonical_format)  # SciPy remembers that
        D.indices[:2] = [1, 0]
        np.testing.assert_array_equal(delassus.Problem(**coupled(D=D)).D.toarray(),
                                      [[-1.0, 1.0, 0, 0], [0, 0, 1.0, -1.0], [0, 0, 0.5, 0.5]])

    def test_a_copy_owns_its_data(self):
        arguments = coupled()
        problem = delassus.Problem(**arguments, copy=True)
        arguments["H"].data[:] = 7.0
        arguments["a"][:] = 7.0
        np.testing.assert_array_equal(problem.H.toarray(), coupled()["H"].toarray())
        np.testing.assert_array_equal(problem.a, coupled()["a"])

    def test_matrices_come_back_without_copies(self):
        H = delassus.Problem(**coupled()).H
        problem = delassus.Problem(**coupled())
        self.assertTrue(np.shares_memory(problem.H.data, problem.H.data))
        self.assertFalse(problem.H.data.flags.writeable)
        np.testing.assert_array_equal(H.toarray(), coupled()["H"].toarray())  # its problem is kept alive

    def test_cones(self):
        cones = [Cone.free(2), Cone.nonnegative(), Cone.box([-1.0, -np.inf], [2.0, np.inf]),
                 Cone.friction(0.25, rows=2)]
        problem = delassus.Problem(np.eye(2), np.ones((7, 2)), np.zeros(2), np.zeros(7), cones)
        self.assertEqual([(c.kind, c.rows, c.mu) for c in problem.cones],
                         [("free", 2, None), ("nonnegative", 1, None), ("box", 2, None), ("friction", 2, 0.25)])
        np.testing.assert_array_equal(problem.cones[2].lo, [-1.0, -np.inf])
        np.testing.assert_array_equal(problem.cones[2].hi, [2.0, np.inf])


class Refusals(unittest.TestCase):
    def refuse(self, sentence, **changes):
        with self.assertRaisesRegex(delassus.InputError, sentence) as caught:
            delassus.Problem(**coupled(**changes))
        self.assertIsInstance(caught.exception, ValueError)

    def test_shapes(self):
        self.refuse("H is 3 × 3; it must be n × n = 4 × 4", H=np.eye(3))
        self.refuse("D is 3 × 2; it must be m × n = 3 × 4", D=np.ones((3, 2)))
        self.refuse("D is 0 × 4; it must be m × n = 3 × 4", D=np.zeros((0, 4)))
        self.refuse("E is 2 × 2; it must be m × m = 3 × 3", E=np.eye(2))
        self.refuse("a has 2 dimensions", a=np.ones((4, 1)))
        self.refuse("D has 1 dimensions", D=np.ones(4))
        self.refuse("cones", cones=[Cone.friction(0.5), Cone.free(1)])

    def test_values(self):
        self.refuse("complex128", H=1j * np.eye(4))
        self.refuse("complex128", H=sparse.csr_matrix(1j * np.eye(4)))
        self.refuse("object", a=np.array([1.0, None, 2.0, 3.0]))
        self.refuse("a", a=np.array([np.nan, 0, 0, 0]))
        self.refuse("E", E=np.array([[1.0, 2.0, 0], [0, 1.0, 0], [0, 0, 1.0]]))
        self.refuse("mu", cones=[Cone.friction(-0.5)])
        self.refuse("law", law="coulombic")
        self.refuse("type float", cones=[0.5])

    def test_indices_beyond_32_bits(self):
        D = sparse.csr_matrix((np.ones(1), np.array([2**32]), np.array([0, 1])), shape=(1, 2**33))
        self.refuse("32 bits", D=D, b=np.zeros(1), cones=[Cone.nonnegative()])


class Files(unittest.TestCase):
    def test_a_problem_comes_back_bit_by_bit(self):
        E = sparse.diags([0.1, 0.2, 0.3])
        problem = delassus.Problem(**coupled(E=E, a=np.array([1 / 3, 1e-300, -2.0**0.5, 5.0]), law="coulomb"))
        with tempfile.TemporaryDirectory() as folder:
            problem.write(Path(folder) / "coupled")
            again = delassus.read(Path(folder) / "coupled")
        self.assertEqual((again.name, again.law, again.n, again.m), ("coupled", "coulomb", 4, 3))
        for letter in "HDE":
            np.testing.assert_array_equal(getattr(again, letter).toarray(), getattr(problem, letter).toarray())
        np.testing.assert_array_equal(again.a, problem.a)
        np.testing.assert_array_equal(again.b, problem.b)

    def test_a_missing_file(self):
        with self.assertRaisesRegex(delassus.InputError, "/nowhere/pile"):
            delassus.read("/nowhere/pile")

    def test_inspect_says_what_the_command_says(self):
        for name in ("sphere_pile", "chain"):
            printed = subprocess.run([os.environ["DELASSUS_COMMAND"], "inspect", str(EXAMPLES / name), "--json"],
                                     capture_output=True, check=True, text=True).stdout
            self.assertEqual(delassus.read(EXAMPLES / name).inspect(), json.loads(printed))


class Meaning(unittest.TestCase):
    def test_qualification(self):
        twice = delassus.Problem(np.eye(2), [[1.0, 0.0], [1.0, 0.0]], np.zeros(2), np.zeros(2), [Cone.free(2)])
        found = twice.qualification()
        self.assertEqual((found["licq"], found["rank"], found["free_rank"]), (False, 1, 1))
        squeezed = delassus.Problem(np.eye(1), np.array([[1.0], [-1.0]]), np.zeros(1), np.zeros(2),
                                    [Cone.nonnegative()] * 2)
        found = squeezed.qualification()
        self.assertIs(found["pointed"], False)
        np.testing.assert_allclose(found["cancelling"], [0.5, 0.5], rtol=1e-6)
        self.assertIs(delassus.Problem(**coupled()).qualification()["pointed"], True)

    def test_errors_are_zero_at_the_solution_and_grow_beside_it(self):
        # A mass of 2 that falls with 3 onto the ground, u = x ≥ 0: x = 0, λ = 6.
        problem = delassus.Problem([[2.0]], [[1.0]], [-6.0], [0.0], [Cone.nonnegative()])
        self.assertEqual(problem.errors([0.0], [6.0])["natural"], 0.0)
        self.assertGreater(problem.errors([0.0], [5.0])["balance"], 0.1)
        self.assertGreater(problem.errors([0.0], [-1.0])["cone"], 0.1)
        with self.assertRaises(delassus.InputError):
            problem.errors([0.0, 1.0], [6.0])

    def test_a_new_right_hand_side(self):
        problem = delassus.Problem([[2.0]], [[1.0]], [-6.0], [0.0], [Cone.nonnegative()])
        problem.set_right_hand_side([-8.0], [1])
        np.testing.assert_array_equal(problem.a, [-8.0])
        self.assertEqual(problem.errors([-1.0], [6.0])["natural"], 0.0)
        with self.assertRaisesRegex(delassus.InputError, "n = 1"):
            problem.set_right_hand_side([1.0, 2.0], [0.0])
        with self.assertRaisesRegex(delassus.InputError, "not finite"):
            problem.set_right_hand_side([np.inf], [0.0])
        np.testing.assert_array_equal(problem.a, [-8.0])


if __name__ == "__main__":
    unittest.main()
