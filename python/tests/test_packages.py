# SPDX-License-Identifier: BSD-3-Clause
"""Solvers of Python that are installed: by `delassus plugins install`, and by packages with entry points."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])
PROBLEM = SOURCE / "examples" / "problems" / "box_stack"

#: The solver of a stranger: damped projected Jacobi-Gauss-Seidel.
SOLVER = '''
import delassus
import numpy as np


{decorator}
class {name}:
    """Sweeps of a stranger"""

    version = "1.2"
    licence = "MIT"
    options = {{"omega": 1.0, "talk": False}}
    capabilities = ["friction", "associated", "coulomb", "h_diagonal", "h_blocks", "h_definite", "redundant",
                    "warm_start"]

    def __init__(self, omega, talk):
        self.omega = omega
        if talk:
            print("a word on standard output")
        if omega > 100:
            raise ValueError("omega is too large")

    def factorize(self, problem):
        self.W = np.linalg.solve(problem.H.toarray(), problem.D.toarray().T)
        self.N = problem.D @ self.W

    def solve(self, problem, request):
        free = np.linalg.solve(problem.H.toarray(), problem.a)
        r = problem.D @ free + problem.b
        lam = np.zeros(problem.m) if request.start is None else request.start[1].copy()
        for k in range(request.max_iterations):
            for j, cone in enumerate(problem.cones):
                i, mu = slice(3 * j, 3 * j + 3), cone.mu
                u = self.N[i] @ lam + r[i]
                u[0] += mu * np.linalg.norm(u[1:]) if problem.law == "coulomb" else 0
                z = lam[i] - self.omega * u / np.trace(self.N[i, i])
                t = np.linalg.norm(z[1:])
                if mu * t <= -z[0]:
                    z = np.zeros(3)
                elif t > mu * z[0]:
                    normal = (z[0] + mu * t) / (1 + mu**2)
                    z = np.r_[normal, z[1:] * mu * normal / t]
                lam[i] = z
            x = self.W @ lam + free
            if not request.show(k + 1, lam, x) or problem.errors(x, lam)["natural"] <= request.tolerance:
                return x, lam
        return x, lam, "iteration_limit"
'''


class Packages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.scratch = Path(folder.name)
        self.site = self.scratch / "site"
        self.site.mkdir()
        self.environment = {**os.environ, "XDG_DATA_HOME": str(self.scratch / "data"),
                            "PYTHONPATH": f"{os.environ['PYTHONPATH']}{os.pathsep}{self.site}",
                            "DELASSUS_PYTHON": sys.executable}
        self.plugins = self.scratch / "data" / "delassus" / "plugins"

    def write(self, name, text):
        file = self.scratch / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return file

    def solver(self, file, name="Sweeps", decorator="@delassus.register"):
        return self.write(file, SOLVER.format(name=name, decorator=decorator))

    def package(self, name="Sweeps", point="sweeps", decorator=""):
        """An installed package with an entry point, as pip leaves it."""
        self.solver("site/stranger/solvers.py", name, decorator)
        self.write("site/stranger/__init__.py", "")
        self.write("site/stranger-0.3.dist-info/METADATA",
                   "Metadata-Version: 2.1\nName: stranger\nVersion: 0.3\nSummary: Solvers of a stranger\nLicense: MIT\n")
        self.write("site/stranger-0.3.dist-info/entry_points.txt",
                   f"[delassus.solvers]\n{point} = stranger.solvers:{name}\n")

    def command(self, *arguments, code=0):
        done = subprocess.run([os.environ["DELASSUS_COMMAND"], *map(str, arguments)], capture_output=True, text=True,
                              env=self.environment, cwd=self.scratch)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout if code == 0 else done.stderr

    def refused(self, words, *arguments):
        sentence = self.command(*arguments, code=2)
        self.assertIn(words, sentence)
        self.assertEqual(sentence.count("\n"), 1, sentence)

    def python(self, text):
        done = subprocess.run([sys.executable, "-c", textwrap.dedent(text)], capture_output=True, text=True,
                              env=self.environment, cwd=self.scratch)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def solve_by_both(self, name):
        report = json.loads(self.command("solve", PROBLEM, "--solver", name, "--tolerance", "0.1", "--json",
                                         "--law", "coulomb"))
        self.assertEqual((report["status"], report["solver"]), ("solved", name))
        iterations = self.python(f"""
            import delassus
            result = delassus.solve(delassus.read({str(PROBLEM)!r}), {name!r}, tolerance=0.1, law="coulomb")
            assert result.solved, result
            print(result.iterations)
        """)
        self.assertEqual(report["iterations"], int(iterations), "the same iterates, wherever the solver runs")

    def listed(self, name):
        (row,) = (row for row in json.loads(self.command("plugins", "list", "--json"))["plugins"]
                  if row["name"] == name)
        return row


class Installed(Packages):
    def test_a_module_is_installed_listed_used_and_removed(self):
        out = self.command("plugins", "install", self.solver("theirs/sweeps_of_a_stranger.py"))
        self.assertIn("installed sweeps 1.2 for this user", out)
        row = self.listed("sweeps")
        self.assertEqual((row["origin"], row["python"], row["licence"], row["plugin_version"]),
                         ("user", "sweeps_of_a_stranger:Sweeps", "MIT", "1.2"))
        self.assertEqual(list(row["checksums"]), ["sweeps_of_a_stranger.py"])
        self.assertIn("Sweeps of a stranger [installed for this user, Python]", self.command("plugins", "list"))
        self.assertIn("omega=1.0", self.command("plugins", "info", "sweeps"))
        self.solve_by_both("sweeps")
        self.assertIn("'user'", self.python("""
            import delassus
            print(repr([row["origin"] for row in delassus.plugins() if row["name"] == "sweeps"][0]))
        """))
        self.command("plugins", "remove", "sweeps")
        self.assertEqual(list(self.plugins.iterdir()), [])
        self.refused('there is no solver "sweeps"', "solve", PROBLEM, "--solver", "sweeps")

    def test_for_all(self):
        """In an installation of its own: libdelassus and the folder of plugins beside it."""
        library = self.scratch / "lib"
        (library / "delassus" / "plugins").mkdir(parents=True)
        (built,) = Path(os.environ["DELASSUS_COMMAND"]).parents[1].rglob("libdelassus.so.[0-9]*.[0-9]*.[0-9]*")
        for name in (built.name, built.name.rsplit(".", 1)[0]):
            shutil.copy(built, library / name)
        self.environment["LD_LIBRARY_PATH"] = str(library)
        out = self.command("plugins", "install", "--system", self.solver("theirs/sweeps.py"))
        self.assertIn(f"installed sweeps 1.2 for all: {library / 'delassus' / 'plugins' / 'sweeps'}", out)
        self.assertEqual(self.listed("sweeps")["origin"], "system")
        self.solve_by_both("sweeps")
        self.command("plugins", "remove", "sweeps")
        self.assertEqual(list((library / "delassus" / "plugins").iterdir()), [])

    def test_a_package_with_folders_is_replaced_whole(self):
        self.solver("theirs/stranger/solvers/sweeps.py")
        self.write("theirs/stranger/solvers/__init__.py", "")
        self.write("theirs/stranger/__init__.py", "from .solvers.sweeps import Sweeps\n")
        folder = self.scratch / "theirs"
        for given in (folder, folder / "stranger"):
            self.command("plugins", "install", given)
            self.solve_by_both("sweeps")
        self.assertEqual(sorted(self.listed("sweeps")["checksums"]),
                         ["stranger/__init__.py", "stranger/solvers/__init__.py", "stranger/solvers/sweeps.py"])
        self.command("plugins", "remove", "sweeps")
        self.assertEqual(list(self.plugins.iterdir()), [])

    def test_options_scenes_and_words_of_the_solver(self):
        self.command("plugins", "install", self.solver("theirs/sweeps.py"))
        out = self.command("solve", PROBLEM, "--solver", "sweeps", "--set", "talk=true", "--set", "omega=1.1",
                           "--tolerance", "0.1", "--json")
        self.assertEqual(json.loads(out)["status"], "solved")  # what the solver prints is no part of the report
        self.refused("omega is too large", "solve", PROBLEM, "--solver", "sweeps", "--set", "omega=1000")
        self.refused("omeg", "solve", PROBLEM, "--solver", "sweeps", "--set", "omeg=1")
        self.refused("is written in Python", "plugins", "check", "sweeps")
        self.write("scene.yaml", "step: 0.01\nend: 0.1\nsolver: sweeps\nmaterials: {m: {friction: 0.3}}\nbodies:\n"
                   "  - {name: slope, fixed: true, shapes: [{plane: {}, material: m}]}\n"
                   "  - {name: box, density: 1000, position: [0, 0, 0.05], velocity: [1, 0, 0],\n"
                   "     shapes: [{box: {size: [0.2, 0.2, 0.1]}, material: m}]}\n")
        self.command("run", "scene.yaml", "-o", "out")

    def test_what_is_wrong_is_said_in_one_sentence(self):
        install = ("plugins", "install")
        self.refused("registers no solver", *install, self.solver("theirs/a.py", decorator=""))
        self.refused("cannot be imported: ZeroDivisionError", *install, self.write("theirs/b.py", "1 / 0\n"))
        self.refused("cannot be imported: SyntaxError", *install, self.write("theirs/c.py", "class\n"))
        self.refused("is no name of a module", *install, self.write("theirs/d-e.py", ""))
        self.refused("code 3", *install, self.write("theirs/f.py", "import os\nos._exit(3)\n"))
        self.refused("is a project of Python", *install, self.write("project/pyproject.toml", "").parent)
        two = self.solver("theirs/two.py").read_text() + SOLVER.format(name="Other", decorator="@delassus.register")
        self.refused("registers several solvers", *install, self.write("theirs/two.py", two))
        self.refused('there is a solver "pgs" already', *install, self.solver("theirs/mine.py", "Pgs"))
        self.assertFalse(self.plugins.exists() and list(self.plugins.iterdir()))
        self.environment["DELASSUS_PYTHON"] = "/nowhere/python3"
        self.refused("/nowhere/python3 cannot be started", *install, self.solver("theirs/sweeps.py"))

    def test_a_file_that_changed_is_not_imported(self):
        self.command("plugins", "install", self.solver("theirs/sweeps.py"))
        with open(self.plugins / "sweeps" / "sweeps.py", "a", encoding="utf-8") as file:
            file.write("open('imported', 'w')\n")
        self.refused("sweeps.py is damaged: its checksum is", "plugins", "install", self.plugins / "sweeps")
        self.refused("sweeps.py is damaged: its checksum is", "solve", PROBLEM, "--solver", "sweeps")
        self.assertIn("is damaged", self.command("plugins", "list").split("Rejected:")[1])
        self.python(f"""
            import delassus
            try:
                delassus.solve(delassus.read({str(PROBLEM)!r}), "sweeps")
            except delassus.PluginError as error:
                assert "is damaged" in str(error), error
            else:
                raise SystemExit("it was imported")
        """)
        self.assertFalse((self.scratch / "imported").exists())

    def test_a_process_that_dies_is_a_sentence(self):
        text = SOLVER.format(name="Sweeps", decorator="@delassus.register")
        text = text.replace("    def factorize(self, problem):\n", "    def factorize(self, problem):\n        import os; os.abort()\n")
        self.command("plugins", "install", self.write("theirs/sweeps.py", text))
        done = subprocess.run([os.environ["DELASSUS_COMMAND"], "solve", str(PROBLEM), "--solver", "sweeps", "--json"],
                              capture_output=True, text=True, env=self.environment)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("its process was ended by the signal", json.loads(done.stdout)["message"])


    def test_limits_hold_and_the_process_ends_with_its_host(self):
        self.command("plugins", "install", self.solver("theirs/sweeps.py"))
        line = [os.environ["DELASSUS_COMMAND"], "solve", str(PROBLEM), "--solver", "sweeps", "--tolerance", "1e-14",
                "--json"]
        limited = subprocess.run([*line, "--time-limit", "0.3"], capture_output=True, text=True, env=self.environment)
        self.assertEqual((limited.returncode, json.loads(limited.stdout)["status"]), (3, "time_limit"))
        interrupted = subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=self.environment)
        time.sleep(2)
        interrupted.send_signal(signal.SIGINT)
        self.assertEqual(json.loads(interrupted.communicate()[0])["status"], "cancelled")

        text = SOLVER.format(name="Hangs", decorator="@delassus.register").replace(
            "        free =", "        import os; open('process', 'w').write(str(os.getpid()))\n        while True: pass\n        free =")
        self.command("plugins", "install", self.write("theirs/hangs.py", text))
        hung = subprocess.run([os.environ["DELASSUS_COMMAND"], "solve", str(PROBLEM), "--solver", "hangs",
                               "--time-limit", "0.3"], capture_output=True, text=True, env=self.environment,
                              cwd=self.scratch)
        self.assertEqual(hung.returncode, 3)
        self.assertIn("the solver hangs did not answer", hung.stderr)
        process = int((self.scratch / "process").read_text())
        end = time.monotonic() + 10.0
        while time.monotonic() < end and Path(f"/proc/{process}").exists():
            time.sleep(0.05)
        self.assertFalse(Path(f"/proc/{process}").exists())


class EntryPoints(Packages):
    def test_are_listed_used_and_not_removed(self):
        for decorator in ("", "@delassus.register"):
            self.package(decorator=decorator)
            row = self.listed("sweeps")
            self.assertEqual((row["origin"], row["python"], row["plugin_version"], row["installed_from"]),
                             ("python package", "stranger.solvers:Sweeps", "0.3", "stranger 0.3"))
            self.assertIn("[Python package stranger 0.3]", self.command("plugins", "list"))
            self.assertIn("omega=1.0", self.command("plugins", "info", "sweeps"))
            self.solve_by_both("sweeps")
        self.refused("comes with the Python package stranger 0.3", "plugins", "remove", "sweeps")
        self.refused('there is no solver "sweepz"; did you mean "sweeps"?', "solve", PROBLEM, "--solver", "sweepz")
        self.command("compare", PROBLEM, "--solvers", "sweeps,pgs", "-o", "out", "--tolerance", "0.1")

    def test_listing_imports_nothing(self):
        self.package()
        with open(self.site / "stranger" / "__init__.py", "w", encoding="utf-8") as file:
            file.write("raise SystemExit('imported')\n")
        self.assertIn("sweeps", self.command("plugins", "list"))
        self.assertIn("sweeps", self.python("""
            import delassus
            print([row["name"] for row in delassus.plugins()])
        """))
        self.refused("imported", "solve", PROBLEM, "--solver", "sweeps")

    def test_what_is_wrong_is_said_in_one_sentence(self):
        self.package(point="swoops")
        self.refused('the entry point "swoops" of stranger 0.3 leads to a solver that is named "sweeps"', "solve",
                     PROBLEM, "--solver", "swoops")
        self.write("site/stranger/solvers.py", "import nothing_of_this_name\n")
        self.refused("No module named 'nothing_of_this_name'", "solve", PROBLEM, "--solver", "swoops")
        self.environment["DELASSUS_PYTHON"] = "/nowhere/python3"
        self.refused('there is no solver "swoops"', "solve", PROBLEM, "--solver", "swoops")
        self.assertIn("/nowhere/python3 cannot be started", self.command("plugins", "list"))


if __name__ == "__main__":
    unittest.main()
