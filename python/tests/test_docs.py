# SPDX-License-Identifier: BSD-3-Clause
"""The documentation's Python runs, and the type stubs name what there is."""
import ast
import contextlib
import inspect
import io
import os
import re
import unittest
import warnings
from pathlib import Path

import delassus
import numpy as np
from delassus import _delassus

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])


class Documents(unittest.TestCase):
    def run_blocks(self, page, count):
        blocks = re.findall(r"^```python\n(.*?)^```", (SOURCE / page).read_text(encoding="utf-8"), re.M | re.S)
        self.assertEqual(len(blocks), count)
        self.names = names = {}
        printed = io.StringIO()
        before = os.getcwd()
        os.chdir(SOURCE)
        try:
            with contextlib.redirect_stdout(printed):
                for block in blocks:
                    exec(compile(block, page, "exec"), names)  # as a reader would: one after the other
        finally:
            os.chdir(before)
        return printed.getvalue()

    def test_python_page(self):
        self.assertTrue(self.run_blocks("docs/python.md", 10).startswith("solved"))
        # The page's solver where a projection may divide by zero: contacts that open straight up, that open sideways, that
        # touch without a load, and that press without a tangential load.
        for a, solution in (((1, 0, 0), (0, 0, 0)), ((1, 0.1, -0.2), (0, 0, 0)), ((0, 0, 0), (0, 0, 0)),
                            ((-1, 0, 0), (1, 0, 0))):
            for mu in (0.0, 0.3):
                for law in ("associated", "coulomb"):
                    problem = delassus.Problem(2 * np.eye(3), np.eye(3), np.array(a, float), np.zeros(3),
                                               [delassus.Cone.friction(mu)], law=law)
                    with warnings.catch_warnings():
                        warnings.simplefilter("error")
                        result = delassus.solve(problem, "sweeps", tolerance=1e-10, max_iterations=1000)
                    self.assertTrue(result.solved, (a, mu, law, result))
                    np.testing.assert_allclose(result.lam, solution, atol=1e-8)

    def test_matrices_of_engines(self):
        self.assertIn(": solved", self.run_blocks("docs/matrices-of-engines.md", 2))
        result, J, M, h, force = (self.names[name] for name in ("result", "J", "M", "h", "force"))
        self.assertLess(abs(result.lam[1]), 0.79 * result.lam[0])  # the foot holds: its two rows are equations
        rows = J[:2]
        expected = -np.linalg.solve(rows @ np.linalg.solve(M, rows.T), rows @ np.linalg.solve(M, force))
        np.testing.assert_allclose(result.lam[:2] / h, expected, rtol=1e-8)
        np.testing.assert_allclose(J @ result.x, 0, atol=1e-10)

    def test_readme(self):
        self.assertTrue(self.run_blocks("README.md", 1).startswith("solved"))

    def test_the_page_names_every_public_name(self):
        page = (SOURCE / "docs" / "python.md").read_text(encoding="utf-8")
        self.assertEqual([name for name in delassus.__all__ if name not in page and name != "StepRecord"], [])

    def test_the_package_shows_what_is_ours(self):
        self.assertEqual(sorted(name for name in dir(delassus) if not name.startswith("_")), sorted(delassus.__all__))
        self.assertLessEqual({"__all__", "__doc__", "__file__", "__version__"}, set(dir(delassus)))
        for name in delassus.__all__:
            self.assertTrue(getattr(delassus, name).__module__.startswith("delassus"), name)


class Stubs(unittest.TestCase):
    def test_classes_and_members(self):
        tree = ast.parse((Path(_delassus.__file__).parent / "_delassus.pyi").read_text(encoding="utf-8"))
        stubs = {node.name: {member.name if isinstance(member, ast.FunctionDef) else member.target.id
                             for member in node.body if isinstance(member, (ast.FunctionDef, ast.AnnAssign))}
                 for node in tree.body if isinstance(node, ast.ClassDef)}
        classes = dict(inspect.getmembers(_delassus, inspect.isclass))
        self.assertEqual(set(stubs), set(classes))
        for name, kind in classes.items():
            if not issubclass(kind, Exception):
                public = {member for member in vars(kind) if not member.startswith("_")}
                self.assertEqual(stubs[name] - {"__init__"}, public, name)

    def test_everything_public_is_documented(self):
        for name in delassus.__all__:
            self.assertTrue(getattr(delassus, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
