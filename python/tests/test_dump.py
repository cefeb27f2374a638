# SPDX-License-Identifier: BSD-3-Clause
"""examples/dump/delassus_dump.py: what it writes has the same bits when it is read, what is wrong is not written."""
import json
import os
import sys
import tempfile
import unittest
from pathlib import Path

import delassus
import numpy as np
import scipy.sparse as sparse

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "examples" / "dump"))
sys.dont_write_bytecode = True

from delassus_dump import dump  # noqa: E402

H = np.array([[2.0, -1 / 3, 0, 0], [-1 / 3, 3.0, 0, 0], [0, 0, 0.1, 0], [0, 0, 0, 1e-300]])
D = np.array([[1.0, -1.0, 0, 0], [0, 0, 1.0, -0.7], [0, 0, 1e21, 5e-324], [0, 1.0, 0, 0], [0.3, 0, 0, 0]])
A, B = np.array([-1 / 7, 1.7e308, -0.0, 1.0]), np.array([0.1, 0.2, 0.3, 0.4, 0.5])
CONES = [{"kind": "friction", "count": np.int64(1), "mu": np.array([0.1])},
         {"kind": "box", "rows": 1, "lo": -np.inf, "hi": np.float64(0.1)}, {"kind": "free", "rows": 1}]


class Dump(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.scratch = Path(scratch.name)

    def assert_same(self, problem):
        for name, matrix in (("H", H), ("D", D)):
            self.assertEqual(getattr(problem, name).toarray().tobytes(), matrix.tobytes(), name)
        self.assertEqual(np.asarray(problem.a).tobytes(), A.tobytes())
        self.assertEqual(np.asarray(problem.b).tobytes(), B.tobytes())

    def test_every_form_gives_the_same_bits(self):
        csr, coo = sparse.csr_matrix(D), sparse.coo_matrix(D)
        half = coo.data / 2
        twice = ("triplets", np.tile(coo.row, 2), np.tile(coo.col, 2), np.concatenate([half, coo.data - half]))
        forms = (D, D.tolist(), csr, csr.tocsc(), coo, ("csr", csr.indptr, csr.indices, csr.data), twice)
        for number, form in enumerate(forms):
            with self.subTest(number):
                folder = self.scratch / f"step_{number}"
                dump(folder, H=H, D=form, a=A, b=B, cones=CONES, source="a \"test\"\t", notes="μ")
                problem = delassus.read(str(folder))
                self.assert_same(problem)
                self.assertEqual(problem.law, "coulomb")
                written = json.loads((folder / "problem.json").read_text(encoding="utf-8"))
                self.assertEqual((written["source"], written["notes"]), ("a \"test\"\t", "μ"))

    def test_a_reduced_problem_is_solved(self):
        dump(self.scratch / "reduced", E=np.diag([2.0, 1.0, 1.0]), b=[-1.0, 0.25, 0.5],
             cones=[{"kind": "friction", "count": 1, "mu": 0.5}])
        self.assertTrue(delassus.solve(delassus.read(str(self.scratch / "reduced"))).solved)

    def test_what_is_wrong_is_not_written(self):
        nan, good = float("nan"), {"H": H, "D": D, "a": A, "b": B, "cones": CONES}
        for words, changes in (
                ("a must have one dimension and finite", {"a": [1, 2, 3, nan]}),
                ("b must have one dimension", {"b": [B]}),
                ("H is (4, 3), but it must be (4, 4)", {"H": H[:, :3]}),
                ("D has an entry that is not finite", {"D": D * nan}),
                ("E has an entry outside (5, 5)", {"E": ("triplets", [5], [0], [1.0])}),
                ("E has 2 rows, 1 columns and 1 values", {"E": ("triplets", [0, 1], [0], [1.0])}),
                ("row_start of D must ascend", {"D": ("csr", [0, 1, 0, 0, 0, 0], [0], [1.0])}),
                ("the cones have 3 rows together, but b has 5", {"cones": CONES[:1]}),
                ("has a number that is none", {"cones": [{"kind": "friction", "count": 1, "mu": nan}] + CONES[1:]}),
                ('law is "coulombs"', {"law": "coulombs"})):
            with self.subTest(words):
                with self.assertRaises(ValueError) as caught:
                    dump(self.scratch / "wrong", **{**good, **changes})
                self.assertIn(words, str(caught.exception))
                self.assertEqual(list(self.scratch.iterdir()), [])

    def test_a_folder_that_is_there_stays(self):
        (self.scratch / "step").mkdir()
        with self.assertRaisesRegex(ValueError, "is there already"):
            dump(self.scratch / "step", H=H, D=D, a=A, b=B, cones=CONES)
        with self.assertRaises(OSError):
            dump(self.scratch / "no" / "such", H=H, D=D, a=A, b=B, cones=CONES)
        self.assertEqual([path.name for path in self.scratch.iterdir()], ["step"])


if __name__ == "__main__":
    unittest.main()
