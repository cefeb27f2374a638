# SPDX-License-Identifier: BSD-3-Clause
"""Suites of benchmarks from Python."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

import delassus
import numpy as np
from delassus import _command

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])


def problem(name="weight"):
    return delassus.Problem(np.eye(3), np.eye(3), [0, 0, -1.0], np.zeros(3), [delassus.Cone.nonnegative(3)], name=name)


def suite(**changes):
    falling = delassus.SceneBuilder("falling", step=0.01, end=0.1)
    falling.add_body(mass=1, inertia={"xx": 1, "yy": 1, "zz": 1})
    result = {"title": "Mine", "problems": [problem(), str(SOURCE / "examples" / "problems" / "glued_pile"),
                                            {"generate": "sphere_pile", "set": {"contacts": 20}}],
              "solvers": ["pgs", "minres"], "tolerances": [1e-3, 1e-6], "repeats": 1, "references": "none",
              "scenes": [falling, {"path": SOURCE / "examples" / "scenes" / "pendulum.yaml", "end": 0.1}],
              "timesteppers": ["rk4"]}
    result.update(changes)
    return result


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.results = delassus.bench(suite())

    def test_rows(self):
        self.assertEqual(len(self.results), 3 * 2 * 2)
        for row in self.results:
            self.assertEqual(set(row), set(self.results.columns) | {"curve"})
        sweeps = [row for row in self.results if row["solver"] == "pgs" and row["problem"] == "sphere_pile(contacts=20)"]
        self.assertEqual([row["tolerance"] for row in sweeps], [1e-3, 1e-6])
        for row in sweeps:
            self.assertTrue(row["solved"])
            self.assertLessEqual(row["natural"], row["tolerance"])
            self.assertGreater(row["seconds"], 0.0)
            self.assertGreater(row["peak_memory"], 10**6)
            self.assertEqual(row["curve"].shape[1], 3)
        refused = [row for row in self.results if row["solver"] == "minres" and row["problem"] == "weight"]
        self.assertEqual({row["cause"] for row in refused}, {"unsupported"})
        self.assertIn("minres", refused[0]["message"])

    def test_the_best_is_of_the_tightest_tolerance(self):
        best = self.results.best()
        self.assertEqual(set(best), {"weight", "glued_pile", "sphere_pile(contacts=20)"})
        self.assertEqual({row["tolerance"] for row in best.values()}, {1e-6})

    def test_scenes(self):
        rows = {row["scene"]: row for row in self.results.simulations}
        self.assertEqual(set(rows), {"falling", "pendulum"})
        self.assertEqual((rows["falling"]["steps"], rows["falling"]["status"]), (10, "finished"))
        self.assertEqual(self.results.cells, [])

    def test_report(self):
        self.assertIn("| solver", self.results.summary)
        if self.results.report is None:
            self.assertTrue(self.results._repr_html_().startswith("<table>"))
            self.skipTest("the build has no chart library")
        self.assertIn("Mine", self.results.report.html)
        self.assertTrue(self.results._repr_html_().startswith("<iframe srcdoc="))
        with tempfile.TemporaryDirectory() as folder:
            self.results.report.write(Path(folder) / "report.html")
            self.results.to_csv(Path(folder) / "rows.csv")
            head = (Path(folder) / "rows.csv").read_text().splitlines()[0]
            self.assertEqual(head, ",".join(self.results.columns))

    def test_plot(self):
        try:
            import matplotlib
        except ImportError:
            self.skipTest("matplotlib is not there")
        matplotlib.use("Agg")
        labels = [text.get_text() for text in self.results.plot().get_legend().get_texts()]
        self.assertIn("pgs, weight, 0.001", labels)


class Runs(unittest.TestCase):
    def test_a_folder_is_kept_and_goes_on(self):
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "new" / "results"
            given = dict(solvers=["pgs"], scenes=[], timesteppers=[], problems=[problem()])
            first = delassus.bench(suite(**given), output=output)
            lines = (output / "results.jsonl").read_text().count('"kind":"solve"')
            again = delassus.bench(suite(**given, tolerances=[1e-3]), output=output)
            self.assertEqual((len(first), len(again), lines), (2, 1, 2))
            self.assertEqual((output / "results.jsonl").read_text().count('"kind":"solve"'), 2)

    def test_a_folder_of_the_users_is_left_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            mine = Path(folder) / "suite.yaml"
            mine.write_text("mine")
            given = dict(solvers=["pgs"], scenes=[], timesteppers=[], problems=[problem()])
            with self.assertRaisesRegex(delassus.InputError, "holds suite.yaml, which delassus did not write"):
                delassus.bench(suite(**given), output=folder)
            with self.assertRaisesRegex(delassus.InputError, "did not write it"):
                problem().write(mine)
            self.assertEqual([path.name for path in Path(folder).iterdir()], ["suite.yaml"])
            self.assertEqual(mine.read_text(), "mine")

    def test_files_and_relative_paths(self):
        before = os.getcwd()
        os.chdir(SOURCE / "examples")
        try:
            given = suite(problems=["problems/glued_pile"], solvers=["pgs"], scenes=[{"path": "scenes/pendulum.yaml",
                                                                                      "end": 0.05}])
            self.assertEqual([row["problem"] for row in delassus.bench(given)], ["glued_pile"] * 2)
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "mine.yaml"
                file.write_text(json.dumps({"problems": [str(SOURCE / "examples/problems/glued_pile")],
                                            "solvers": ["pgs"], "tolerances": [1e-3], "repeats": 1}))
                self.assertEqual(len(delassus.bench(file)), 1)
        finally:
            os.chdir(before)

    def test_mistakes(self):
        for wrong, sentence in ((suite(solver=[]), 'no key "solver"; did you mean "solvers"'),
                                ("nowhere", "there is no suite nowhere"),
                                (suite(solvers=["pgx"]), 'no solver "pgx"; did you mean "pgs"'),
                                (suite(problems=["nowhere"]), "nowhere")):
            with self.assertRaisesRegex(delassus.InputError, sentence):
                delassus.bench(wrong)
        with self.assertRaisesRegex(delassus.InputError, 'no axis|axis'):
            delassus.bench(suite(), only="nothing")

    def test_without_the_command(self):
        with mock.patch.dict(os.environ, {"PATH": ""}), mock.patch.object(_command, "__file__", "/nowhere/delassus/x.py"):
            del os.environ["DELASSUS_COMMAND"]
            with self.assertRaisesRegex(delassus.InputError, "the command delassus was not found"):
                _command.find_command()

    def test_ctrl_c_ends_all_processes(self):
        with tempfile.TemporaryDirectory() as folder:
            script = ("import delassus\n"
                      "try:\n"
                      "    delassus.bench({'problems': [{'generate': 'sphere_pile', 'set': {'contacts': [3000, 3100]}}],\n"
                      "                    'solvers': ['pgs'], 'tolerances': [1e-12], 'time_limit': 100,\n"
                      "                    'references': 'none'}, output='out')\n"
                      "except KeyboardInterrupt:\n"
                      "    print('interrupted')\n")
            run = subprocess.Popen([sys.executable, "-c", script], cwd=folder, stdout=subprocess.PIPE, text=True)
            results = Path(folder) / "out" / "results.jsonl"
            begin = time.monotonic()
            while not (results.exists() and '"kind":"problem"' in results.read_text()):
                self.assertIsNone(run.poll())
                self.assertLess(time.monotonic() - begin, 120.0)
                time.sleep(0.05)
            run.send_signal(signal.SIGINT)
            self.assertEqual(run.communicate(timeout=60)[0], "interrupted\n")
            deadline = time.monotonic() + 10.0
            while processes_in(folder) and time.monotonic() < deadline:
                time.sleep(0.05)
            self.assertEqual(processes_in(folder), [])


def processes_in(folder):
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and os.readlink(entry / "cwd") == os.path.realpath(folder):
                found.append(entry.name)
        except OSError:
            pass
    return found


if __name__ == "__main__":
    unittest.main()
