# SPDX-License-Identifier: BSD-3-Clause
"""The example of a function of PyTorch; skipped without PyTorch."""
import importlib.util
import os
import unittest
from pathlib import Path


@unittest.skipUnless(importlib.util.find_spec("torch"), "PyTorch is not installed (python3-torch)")
class Layer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        path = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "examples" / "python" / "torch_layer.py"
        spec = importlib.util.spec_from_file_location("torch_layer", path)
        cls.example = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(cls.example)

    def test_gradients_by_differences(self):
        self.assertTrue(self.example.check())

    def test_friction_is_found(self):
        self.assertAlmostEqual(self.example.find_friction(true=0.42, guess=0.2), 0.42, places=6)


if __name__ == "__main__":
    unittest.main()
