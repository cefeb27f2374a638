# SPDX-License-Identifier: BSD-3-Clause
"""Every line of the tutorial runs as it stands, and prints what its page shows."""
import importlib.machinery
import importlib.util
import os
import shutil
import unittest
from pathlib import Path

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])


def script():
    loader = importlib.machinery.SourceFileLoader("update_tutorial", str(SOURCE / "scripts" / "update-tutorial"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("update_tutorial", loader))
    loader.exec_module(module)
    return module


class Tutorial(unittest.TestCase):
    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib draws its pictures (python3-matplotlib)")
    def test_pages(self):
        tutorial = script()
        pages = tutorial.pages()
        self.assertEqual(len(pages), 5)
        for page in pages:
            with self.subTest(page.name):
                text, complaints, folder = tutorial.run_page(page, os.environ["DELASSUS_COMMAND"])
                shutil.rmtree(folder)
                self.assertEqual("\n".join(complaints), "")
                self.assertGreater(text.count("```text\n"), 1)

    def test_what_counts_as_the_same(self):
        shown = script().shown
        self.assertTrue(shown("solved after 13 sweeps, 1.2e-3 s\n", "solved after 270 sweeps,  0.04 s\n"))
        self.assertFalse(shown("solved after 13 sweeps\n", "stalled after 13 sweeps\n"))
        self.assertFalse(shown("one\n", "one\ntwo\n"))
        self.assertTrue(shown("one\n…\nthree\n", "one\ntwo\nthree\n"))
        self.assertFalse(shown("three\n…\none\n", "one\ntwo\nthree\n"))


if __name__ == "__main__":
    unittest.main()
