# SPDX-License-Identifier: BSD-3-Clause
"""The documentation's Python runs, and the type stubs name what there is."""
import ast
import contextlib
import inspect
import io
import os
import re
import unittest
from pathlib import Path

import delassus
from delassus import _delassus

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])


class Documents(unittest.TestCase):
    def run_blocks(self, page, count):
        blocks = re.findall(r"^```python\n(.*?)^```", (SOURCE / page).read_text(encoding="utf-8"), re.M | re.S)
        self.assertEqual(len(blocks), count)
        names, printed = {}, io.StringIO()
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
        self.assertTrue(self.run_blocks("docs/python.md", 9).startswith("solved"))

    def test_readme(self):
        self.assertTrue(self.run_blocks("README.md", 1).startswith("solved"))

    def test_the_page_names_every_public_name(self):
        page = (SOURCE / "docs" / "python.md").read_text(encoding="utf-8")
        self.assertEqual([name for name in delassus.__all__ if name not in page and name != "StepRecord"], [])


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
