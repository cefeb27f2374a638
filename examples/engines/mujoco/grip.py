# SPDX-License-Identifier: BSD-3-Clause
"""How far a held object creeps through a grip in a second, with MuJoCo's solver and with Delassus.

    python3 grip.py

Runs with Debian's libmujoco by ctypes; with the package `mujoco` it would be mujoco.mj_step and the same Contact."""
import ctypes
from pathlib import Path

import delassus_mujoco

library = ctypes.CDLL("libmujoco.so", mode=ctypes.RTLD_GLOBAL)
pointer = ctypes.c_void_p
for name, result, arguments in (
        ("mj_loadXML", pointer, [ctypes.c_char_p, pointer, ctypes.c_char_p, ctypes.c_int]),
        ("mj_makeData", pointer, [pointer]), ("mj_step", None, [pointer, pointer]),
        ("mj_name2id", ctypes.c_int, [pointer, ctypes.c_int, ctypes.c_char_p]),
        ("mj_local2Global", None, [pointer] * 5 + [ctypes.c_int, ctypes.c_ubyte]),
        ("mj_resetDataKeyframe", None, [pointer, pointer, ctypes.c_int]),
        ("mj_deleteData", None, [pointer]),
        ("mj_deleteModel", None, [pointer])):
    function = getattr(library, name)
    function.restype, function.argtypes = result, arguments

error = ctypes.create_string_buffer(1000)
model = library.mj_loadXML(str(Path(__file__).parent / "models" / "grip.xml").encode(), None, error, len(error))
if not model:
    raise SystemExit(error.value.decode())
data = library.mj_makeData(model)
BODY = 1  # mjOBJ_BODY
rod = library.mj_name2id(model, BODY, b"rod")


def height():
    place, frame = (ctypes.c_double * 3)(), (ctypes.c_double * 9)()
    origin, unit = (ctypes.c_double * 3)(), (ctypes.c_double * 4)(1.0)
    library.mj_local2Global(data, place, frame, origin, unit, rod, 0)
    return place[2]


contact = delassus_mujoco.Contact()
for label, step in (("MuJoCo", library.mj_step), ("Delassus", contact.step)):
    library.mj_resetDataKeyframe(model, data, 0)
    for n in range(1000):
        if n == 500:
            start = height()
        step(model, data)
    print(f"{label}: {start - height():.3e} m in a second")
library.mj_deleteData(data)
library.mj_deleteModel(model)
