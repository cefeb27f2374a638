# SPDX-License-Identifier: BSD-3-Clause
"""Solvers side by side in processes of their own, Python's own among them."""
import csv
import os
import tempfile
import time
import unittest
from pathlib import Path

import delassus
import numpy as np

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])
PILE = SOURCE / "examples/problems/sphere_pile"


def problem():
    weight = 0.01 * 2 * 9.81 * np.array([-np.cos(0.6), np.sin(0.6), 0])
    return delassus.Problem(2 * np.eye(3), np.eye(3), weight, np.zeros(3), [delassus.Cone.friction(0.3)], name="block")


@delassus.register
class Boaster:
    """Claims that anything is the solution."""

    def solve(self, problem, request):
        return np.zeros(problem.n), np.zeros(problem.m)


@delassus.register
class Ender:
    """Takes its process with it."""

    def solve(self, problem, request):
        os.abort()


@delassus.register
class Sleeper:
    """Never looks at the time."""

    def solve(self, problem, request):
        time.sleep(60)


@delassus.register
class Stumbler:
    """Has a mistake in it."""

    def solve(self, problem, request):
        return 1 / 0


class Compare(unittest.TestCase):
    def test_rows_curves_and_the_best(self):
        table = delassus.compare([problem(), PILE], ["pgs", "apgd"], tolerance=1e-6, repeats=2)
        self.assertEqual([(row["problem"], row["solver"]) for row in table],
                         [("block", "pgs"), ("block", "apgd"), ("sphere_pile", "pgs"), ("sphere_pile", "apgd")])
        for row in table:
            self.assertTrue(row["solved"], row)
            self.assertLessEqual(row["natural"], 1e-6)
            self.assertGreater(row["seconds"], 0.0)
            self.assertEqual(set(row), set(table.columns) | {"curve"})
        self.assertEqual(table[3]["curve"].shape[1], 3)
        self.assertIn(table.best()["sphere_pile"]["solver"], ("pgs", "apgd"))

    def test_errors_are_those_of_solve(self):
        row = delassus.compare(PILE, "pgs", tolerance=1e-4, repeats=1)[0]
        self.assertEqual(row["natural"], delassus.solve(delassus.read(PILE), "pgs", tolerance=1e-4).errors["natural"])

    def test_what_misbehaves_is_a_row(self):
        begin = time.monotonic()
        table = delassus.compare(problem(), ["boaster", "ender", "sleeper", "stumbler", "minres"], time_limit=0.5,
                                 repeats=1)
        self.assertLess(time.monotonic() - begin, 30)
        self.assertEqual([row["status"] for row in table],
                         ["false_claim", "crashed", "time_limit", "error", "unsupported"])
        self.assertIn("SIGABRT", table[1]["message"])
        self.assertFalse(any(row["solved"] for row in table))
        self.assertIn("division by zero", table[3]["message"])
        self.assertIn("friction", table[4]["message"])

    def test_mistakes_are_said_before_anything_runs(self):
        with self.assertRaisesRegex(delassus.InputError, "pgx"):
            delassus.compare(problem(), ["pgs", "pgx"])
        with self.assertRaisesRegex(delassus.InputError, "repeats is 0; it must be at least 1"):
            delassus.compare(problem(), ["pgs"], repeats=0)

    def test_csv_and_table(self):
        table = delassus.compare(problem(), ["pgs"], repeats=1)
        with tempfile.TemporaryDirectory() as folder:
            table.to_csv(Path(folder) / "table.csv")
            with open(Path(folder) / "table.csv", newline="", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        self.assertEqual(float(rows[0]["natural"]), table[0]["natural"])
        self.assertIn("<td>pgs</td>", table._repr_html_())

    def test_pandas_and_matplotlib_where_they_are(self):
        table = delassus.compare(problem(), ["pgs", "apgd"], repeats=1)
        try:
            import pandas
        except ImportError:
            self.skipTest("pandas is not installed")
        frame = pandas.DataFrame(table)
        self.assertEqual(list(frame["solver"]), ["pgs", "apgd"])


if __name__ == "__main__":
    unittest.main()
