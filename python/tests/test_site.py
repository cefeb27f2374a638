# SPDX-License-Identifier: BSD-3-Clause
"""scripts/build-site: what becomes of links, and that it sees broken ones. The target `site` itself is a stage of CI."""
import importlib.machinery
import importlib.util
import os
import tempfile
import unittest
from pathlib import Path, PurePosixPath

import delassus

SCRIPT = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "scripts" / "build-site"
LOADER = importlib.machinery.SourceFileLoader("build_site", str(SCRIPT))
site = importlib.util.module_from_spec(importlib.util.spec_from_loader("build_site", LOADER))
LOADER.exec_module(site)


class Site(unittest.TestCase):
    def test_links_of_pages(self):
        with tempfile.TemporaryDirectory() as scratch:
            def adapted(text):
                return site.adapted(text, PurePosixPath("docs/python.md"), [PurePosixPath("docs/files.md")], Path(scratch))

            for same in ("[a](files.md#problems)", "[a](#here)", "[a](https://example.org/x.md)", "`[a](../core)`",
                         "```sh\n[a](../core)\n```\n"):
                self.assertEqual(adapted(same), same)
            self.assertEqual(adapted("see [core](../core) now"), "see core now")
            self.assertEqual(adapted("[a](../examples/notebooks)"), "[a](../examples/notebooks/README.md)")
            self.assertEqual(adapted("[a](../examples/notebooks/pile.ipynb)"), "[a](../examples/notebooks/pile.md)")
            self.assertEqual(adapted("[a](../setup.py#L3)"), "[a](../setup.py)")
            self.assertTrue((Path(scratch) / "setup.py").is_file())

    def test_every_public_name_is_in_the_reference(self):
        with tempfile.TemporaryDirectory() as scratch:
            page = Path(scratch) / "python-reference.rst"
            page.write_text(".. autofunction:: delassus.solve\n")
            site.add_what_is_not_listed(page)
            text = page.read_text()
            for name in delassus.__all__:
                self.assertEqual(text.count(f":: delassus.{name}\n"), 1, name)
            self.assertIn("autoclass:: delassus.Problem\n", text)

    def test_broken_links(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            (folder / "b.html").write_text('<h1 id="part">B</h1>')
            (folder / "a.html").write_text('<a href="b.html#part">1</a><a href="b.html">2</a><a href="https://x.org">3</a>')
            self.assertEqual(site.broken_links(folder), ([], 2))
            (folder / "a.html").write_text('<a href="b.html#other">1</a><img src="none.png">')
            self.assertEqual(site.broken_links(folder)[0], ["a.html: b.html#other names no part of that page",
                                                            "a.html: none.png leads nowhere"])


if __name__ == "__main__":
    unittest.main()
