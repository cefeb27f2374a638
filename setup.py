# SPDX-License-Identifier: BSD-3-Clause
"""The Python package for pip: CMake builds it in build/release, which scripts/run uses too, and the libraries and the
solvers go into the package's folder. What CMake needs beside Python: `scripts/install-dependencies python`.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
BUILD = ROOT / "build" / "release"


def call(*command):
    environment = {"CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1", **os.environ}
    subprocess.run([str(word) for word in command], check=True, cwd=ROOT, env=environment)


class BuildByCMake(build_ext):
    def run(self):
        if self.inplace or getattr(self, "editable_mode", False):
            raise SystemExit("delassus has no editable installation: put build/release/lib/python3/dist-packages on "
                             "PYTHONPATH (docs/python.md)")
        tests = [] if (BUILD / "CMakeCache.txt").exists() else ["-DDELASSUS_TESTS=OFF"]
        call("cmake", "--preset", "release", f"-DPython_EXECUTABLE={sys.executable}", "-DDELASSUS_PYTHON=ON", *tests)
        targets = subprocess.run(["cmake", "--build", BUILD, "--target", "help"], check=True, capture_output=True,
                                 text=True).stdout
        if not re.search(r"^python_with_plugins: phony", targets, re.MULTILINE):
            raise SystemExit("CMake left the Python package out; its summary above says why")
        call("cmake", "--build", "--preset", "release", "--target", "python_with_plugins", "delassus_command",
             "delassus_documents")
        package = Path(self.build_lib).resolve() / "delassus"
        shutil.rmtree(package, ignore_errors=True)
        with tempfile.TemporaryDirectory() as stage:
            for component in ("library", "plugins", "importers", "command", "python"):
                call("cmake", "--install", BUILD, "--prefix", stage, "--component", component)
            (python,) = (file.parent for file in Path(stage).rglob("delassus/__init__.py"))
            (library,) = {file.parent for file in Path(stage).rglob("libdelassus.so.*")}
            shutil.copytree(python, package)
            shutil.copytree(library / "delassus", package / "lib" / "delassus")
            (package / "bin").mkdir()
            shutil.copy(Path(stage) / "bin" / "delassus", package / "bin" / "delassus")  # for bench()
            # Wheels hold no links: each library gets the name by which the loader asks for it.
            for link in library.glob("libdelassus*.so.*"):
                if link.is_symlink():
                    shutil.copyfile(link.resolve(), package / "lib" / link.name)

    def get_outputs(self):
        return [str(file) for file in Path(self.build_lib).rglob("*") if file.is_file()]


setup(name="delassus", version=re.search(r"project\(delassus VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1],
      description="Saddle-point and cone-complementarity problems with solvers as plugins", license="BSD-3-Clause",
      python_requires=">=3.9", install_requires=["numpy", "scipy"], packages=[], py_modules=[],
      scripts=["python/scripts/delassus"],
      ext_modules=[Extension("delassus._delassus", sources=[])], cmdclass={"build_ext": BuildByCMake})
