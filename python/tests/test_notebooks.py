# SPDX-License-Identifier: BSD-3-Clause
"""The notebooks of examples/notebooks run from their first cell to their last, and draw what they promise."""
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FOLDER = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "examples" / "notebooks"
MISSING = [module for module in ("nbconvert", "ipykernel", "matplotlib") if not importlib.util.find_spec(module)]


class Notebooks(unittest.TestCase):
    @unittest.skipIf(MISSING, f"without {', '.join(MISSING)} (jupyter-nbconvert, python3-ipykernel, python3-matplotlib)")
    def test_run(self):
        for name, pictures in (("first_solve", 2), ("mechanism", 2), ("pile", 3)):
            with self.subTest(name), tempfile.TemporaryDirectory() as scratch:
                done = subprocess.run(
                    [sys.executable, "-m", "nbconvert", "--execute", "--to", "notebook", "--output-dir", scratch,
                     "--ExecutePreprocessor.kernel_name=python3", str(FOLDER / f"{name}.ipynb")],
                    env={**os.environ, "JUPYTER_RUNTIME_DIR": scratch, "IPYTHONDIR": scratch, "MPLCONFIGDIR": scratch},
                    check=False, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr[-3000:])
                cells = json.loads((Path(scratch) / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
                drawn = [output for cell in cells for output in cell.get("outputs", ())
                         if "image/png" in output.get("data", {})]
                self.assertEqual(len(drawn), pictures)

    def test_are_kept_without_outputs(self):
        notebooks = sorted(FOLDER.glob("*.ipynb"))
        self.assertEqual(len(notebooks), 3)
        for notebook in notebooks:
            for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
                self.assertFalse(cell.get("outputs"), notebook.name)
                self.assertIsNone(cell.get("execution_count"), notebook.name)


if __name__ == "__main__":
    unittest.main()
