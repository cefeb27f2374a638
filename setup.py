# SPDX-License-Identifier: BSD-3-Clause
"""The Python package for pip: CMake builds it with the libraries and the solvers, which go into the package's folder.

What CMake needs beside Python is in scripts/install-dependencies (group `python`). The build folder is build/pip.
"""
import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class BuildByCMake(build_ext):
    def run(self):
        prefix, build = Path(self.build_lib).resolve(), ROOT / "build" / "pip"
        environment = {"CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1", **os.environ}

        def call(*command):
            subprocess.run([str(word) for word in command], check=True, cwd=ROOT, env=environment)

        call("cmake", "--preset", "release", "-B", build, "-DDELASSUS_TESTS=OFF", f"-DPython_EXECUTABLE={sys.executable}",
             "-DCMAKE_INSTALL_LIBDIR=delassus/lib", "-DDELASSUS_PYTHON_DIRECTORY=.")
        targets = subprocess.run(["cmake", "--build", build, "--target", "help"], check=True, capture_output=True,
                                 text=True).stdout
        if not re.search(r"^python: phony", targets, re.MULTILINE):
            raise SystemExit("CMake left the Python package out; its summary above says why")
        call("cmake", "--build", build, "--target", "python_with_plugins")
        for component in ("library", "plugins", "python"):
            call("cmake", "--install", build, "--prefix", prefix, "--component", component)
        # Wheels hold no links: the loader asks for the short name of a library.
        for link in (prefix / "delassus" / "lib").glob("*.so*"):
            if link.is_symlink():
                file = link.resolve()
                link.unlink()
                file.rename(link)

    def get_outputs(self):
        return [str(file) for file in Path(self.build_lib).rglob("*") if file.is_file()]


setup(name="delassus", version=re.search(r"project\(delassus VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1],
      description="Saddle-point and cone-complementarity problems with solvers as plugins", license="BSD-3-Clause",
      python_requires=">=3.9", install_requires=["numpy", "scipy"], packages=[], py_modules=[],
      ext_modules=[Extension("delassus._delassus", sources=[])], cmdclass={"build_ext": BuildByCMake})
