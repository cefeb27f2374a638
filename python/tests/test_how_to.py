# SPDX-License-Identifier: BSD-3-Clause
"""Every line of docs/how-to runs as it stands, prints what its page shows, and finds what is known beforehand."""
import os
import re
import shutil
import unittest
from pathlib import Path

import numpy as np
from test_tutorial import script

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])
PAGES = SOURCE / "docs" / "how-to"


class HowTo(unittest.TestCase):
    def run_page(self, name):
        """What the page's Python defines."""
        names = {}
        _, complaints, folder = script().run_page(PAGES / name, os.environ["DELASSUS_COMMAND"], names)
        shutil.rmtree(folder)
        self.assertEqual("\n".join(complaints), "")
        return names

    def test_gripper(self):
        names = self.run_page("gripper.md")
        np.testing.assert_allclose(np.abs(names["on_box"][[0, 2]]), [20, 0.5 * 0.5 * 9.81], rtol=1e-6)
        excess = np.array(names["curve"]) - names["forces"]  # 2 mu F = F
        self.assertTrue((excess >= 0).all() and (excess < 0.11).all(), excess)  # the pull grows by 0.05 N a step

    def test_biped(self):
        names = self.run_page("biped.md")
        height, slip = names["height"], names["slip"]
        self.assertGreater(height[:, 0].min(), 1.0)
        self.assertTrue((height[:, 1:].max(axis=0) > 0.07).all())
        self.assertLess(slip.max(), 1e-3)
        self.assertLess(abs(names["q"][2]), 0.05)

    @unittest.skipUnless(shutil.which("c++") and Path("/usr/include/eigen3").is_dir(), "c++ and Eigen build the solver")
    def test_my_solver(self):
        names = self.run_page("my-solver.md")
        self.assertTrue(names["result"].solved)

    def test_from_mujoco(self):
        names = self.run_page("from-mujoco.md")
        slope = np.radians(20)
        speed = np.linalg.norm(names["simulation"].twists[-1, :3])
        self.assertAlmostEqual(speed, 0.5 * 9.81 * (np.sin(slope) - 0.2 * np.cos(slope)), places=4)

    def test_from_chrono(self):
        run = self.run_page("from-chrono.md")["run"]
        self.assertAlmostEqual(run.body("box")[-1, 0], 1 / (2 * 0.3 * 9.81), places=4)

    def test_from_siconos(self):
        result = self.run_page("from-siconos.md")["result"]
        np.testing.assert_allclose(result.lam, [1, -0.12, -0.16], atol=1e-7)
        np.testing.assert_allclose(result.u, [0, 0.18, 0.24], atol=1e-7)

    def test_pages(self):
        pages = script().how_to_pages()
        index = (PAGES / "README.md").read_text(encoding="utf-8")
        site = (SOURCE / "docs" / "site" / "index.rst").read_text(encoding="utf-8")
        tests = {name[5:].replace("_", "-") + ".md" for name in dir(self) if name.startswith("test_")} - {"pages.md"}
        self.assertEqual({page.name for page in pages}, tests)
        for page in pages:
            self.assertIn(f"]({page.name})", index)
            self.assertIn(f"docs/how-to/{page.stem}\n", site)
            with self.subTest(page.name):
                self.assertLessEqual(len(re.findall(r"\S+", page.read_text(encoding="utf-8"))), 700)


if __name__ == "__main__":
    unittest.main()
