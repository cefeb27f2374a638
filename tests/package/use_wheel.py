# SPDX-License-Identifier: BSD-3-Clause
"""Uses what a wheel or an archive brought as its reader would, and looks at which libraries that maps: those that came with it, and
the system's C and C++ libraries. Needs no more than a system with Python, NumPy and SciPy has.

usage: use_wheel.py PREFIX [package]      PREFIX has bin and lib; with `package` Python's package is used too, which is in PREFIX
"""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

OF_THE_SYSTEM = re.compile(r"(/usr)?/lib(64)?/([a-z0-9_]+-linux-gnu/)?"
                           r"(ld-linux-x86-64|libc|libm|libdl|libpthread|librt|libresolv|libutil|libstdc\+\+|libgcc_s)[.]so")
PREFIX = Path(sys.argv[1]).resolve()
COMMAND = PREFIX / "bin" / "delassus"
EXAMPLES = PREFIX / "lib" / "delassus" / "examples"
MODELS = {
    "mjcf": """<mujoco><worldbody><body pos="0 0 1"><joint type="hinge" axis="0 1 0"/>
               <geom type="sphere" size="0.1" pos="0.3 0 0"/></body></worldbody></mujoco>""",
    "urdf": """<robot name="pendulum"><link name="base"/><link name="bob"><inertial><origin xyz="0.3 0 0"/><mass value="1"/>
               <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
               <joint name="hinge" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>""",
    "sdf": """<sdf version="1.7"><model name="ball"><link name="bob"><inertial><mass>1</mass></inertial>
              <collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model></sdf>""",
}


def run(*command, code=0, logged=None, **settings):
    """What it printed, with errors. The environment has nothing that helps to find libraries; the loader writes down what it maps."""
    environment = {key: os.environ[key] for key in ("PATH", "HOME", "PYTHONPATH") if key in os.environ}
    if logged:
        environment |= {"LD_DEBUG": "libs", "LD_DEBUG_OUTPUT": str(logged)}
    done = subprocess.run([str(word) for word in command], env=environment, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, **settings)
    assert done.returncode == code, f"{command} ended with {done.returncode}: {done.stdout}"
    return done.stdout


def mapped(logs, python=True):
    """Every library that processes initialised, but the system's; their logs are LOGS.PID. python: those of Python count,
    which the command asks for solvers of packages."""
    found = set()
    for log in logs.parent.glob(logs.name + ".*"):
        text = log.read_text(errors="replace")
        if python or not re.search(r"initialize program: .*python", text):
            found |= set(re.findall(r"calling init: (.+)", text))
    return {path for path in found if not OF_THE_SYSTEM.match(path)}


def check(libraries):
    ours = {path for path in libraries if Path(path).resolve().is_relative_to(PREFIX)}
    assert any("/libdelassus.so" in path for path in ours), sorted(libraries)
    assert libraries == ours, f"mapped from elsewhere: {sorted(libraries - ours)}"


def use_command():
    logs = Path("command")
    def delassus(*words, code=0):
        return run(COMMAND, *words, code=code, logged=logs.resolve())
    listed = delassus("plugins", "list")
    assert "Rejected" not in listed and re.search(r"^ *cholmod", listed, re.M) and "MPI" in listed, listed
    refusal = delassus("solve", EXAMPLES / "problems/chain", "--solver", "petsc", code=2)
    assert "petsc" in refusal and "MPI" in refusal, refusal
    for library in (PREFIX / "lib/delassus/plugins").glob("*.so"):
        delassus("plugins", "describe", library)
    delassus("generate", "pile", "pile.h5", "--set", "contacts=60")
    delassus("solve", "pile.h5", "--tolerance", "1e-6")
    delassus("solve", EXAMPLES / "problems/chain", "--solver", "cholmod")
    delassus("inspect", EXAMPLES / "problems/sphere_pile")
    delassus("convert", EXAMPLES / "problems/sphere_pile", "pile.hdf5", "--law", "coulomb")
    delassus("compare", "pile.hdf5", "--solvers", "pgs,ssn,ipm", "--tolerance", "1e-4", "-o", "compared")
    assert Path("compared/report.html").stat().st_size > 100_000
    assert re.search(r"^quick: ", delassus("bench", "list"), re.M)
    for scene in ("box_on_incline", "mesh_die", "modal_arm"):  # collisions, meshes and hulls, modes
        delassus("run", EXAMPLES / f"scenes/{scene}.yaml", "--end", "0.02", "-o", scene)
    delassus("view", "mesh_die")
    assert list(Path("mesh_die").glob("*.html"))
    for name, text in MODELS.items():
        if (PREFIX / f"lib/delassus/delassus_import_{name}.so").exists():
            Path(name).write_text(text)
            delassus("import", name, "-o", f"{name}.yaml")
    check(mapped(logs.resolve(), python=False))


SESSION = """
import json, sys
import delassus
for row in delassus.plugins(): assert row["library"].startswith(PREFIX), row
assert "MPI" in delassus.unbuilt()["petsc"]
try: delassus.Solver("mumps")
except delassus.InputError as refusal: assert "MPI" in str(refusal)
else: raise AssertionError("mumps is not in a wheel")
pile = delassus.read(EXAMPLES + "/problems/sphere_pile")
result = delassus.solve(pile, tolerance=1e-8)
assert result.solved and delassus.__file__.startswith(PREFIX), result
table = delassus.compare(pile, ["pgs", "apgd", "ssn", "ipm"], tolerance=1e-4, repeats=1)
assert table.best()["sphere_pile"]["solved"]
run = delassus.simulate(EXAMPLES + "/scenes/box_on_incline.yaml", system="slides", every=100)
assert run.status == "finished", run
run.view().write("run.html")
derivative = delassus.derivative(pile, delassus.solve(pile, "ipm", tolerance=1e-10))
bench = delassus.bench({"problems": [pile], "solvers": ["apgd"], "tolerances": [1e-3], "repeats": 1, "references": "none"})
assert bench.best()["sphere_pile"]["solved"] and bench.report is not None
json.dump([name for name in sys.modules if not name.startswith(("delassus", "__main__"))], open("modules.json", "w"))
"""
BASELINE = """
import importlib, json
for name in json.load(open("modules.json")):
    try: importlib.import_module(name)
    except Exception: pass
"""


def use_package():
    names = f"PREFIX = {str(PREFIX)!r}; EXAMPLES = {str(EXAMPLES)!r}"
    run(sys.executable, "-c", names + SESSION, logged=Path("session").resolve())
    run(sys.executable, "-c", BASELINE, logged=Path("baseline").resolve())
    check(mapped(Path("session").resolve()) - mapped(Path("baseline").resolve()))


with tempfile.TemporaryDirectory(prefix="a folder ") as scratch:
    os.chdir(scratch)
    use_command()
    if "package" in sys.argv[2:]:
        use_package()
print(f"{PREFIX}: used")
