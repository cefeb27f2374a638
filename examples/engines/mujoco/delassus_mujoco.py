# SPDX-License-Identifier: BSD-3-Clause
"""Contact forces of Delassus in a Python program of MuJoCo.

    contact = delassus_mujoco.Contact()
    ...
    contact.step(model, data)          # was: mujoco.mj_step(model, data)

model and data are those of the package `mujoco`, or addresses of an mjModel and an mjData (as ctypes has them). The
library, built by CMakeLists.txt beside this file against the MuJoCo that the program uses, is found beside this file,
in build/ there, or by DELASSUS_MUJOCO_LIBRARY.
"""
import ctypes
import os
from pathlib import Path

__all__ = ["Contact", "StepError"]


class StepError(RuntimeError):
    """A step that could not be done; qpos, qvel, act and time are those from before."""


class _Options(ctypes.Structure):
    _fields_ = [("solver", ctypes.c_char_p), ("contacts", ctypes.c_char_p), ("law", ctypes.c_char_p),
                ("tolerance", ctypes.c_double), ("loosest", ctypes.c_double)]


class _Report(ctypes.Structure):
    _fields_ = [("rows", ctypes.c_int), ("contacts", ctypes.c_int), ("solves", ctypes.c_int),
                ("remembered", ctypes.c_int), ("iterations", ctypes.c_longlong), ("natural_error", ctypes.c_double),
                ("seconds", ctypes.c_double)]


def _load():
    here = Path(__file__).resolve().parent
    name = "libdelassus_mujoco.so"
    places = [os.environ.get("DELASSUS_MUJOCO_LIBRARY", ""), here / name, here / "build" / name]
    for place in places:
        if place and Path(place).exists():
            library = ctypes.CDLL(str(place))
            break
    else:
        raise ImportError(f"{name} was not found in {here} or {here / 'build'}; build it, or name it by "
                          "DELASSUS_MUJOCO_LIBRARY.")
    pointer = ctypes.c_void_p
    for function, result, arguments in (
            ("create", pointer, [ctypes.POINTER(_Options), ctypes.c_char_p, ctypes.c_size_t]),
            ("free", None, [pointer]), ("message", ctypes.c_char_p, [pointer]), ("last", _Report, [pointer]),
            ("forget", None, [pointer])):
        found = getattr(library, "delassus_mujoco_" + function)
        found.restype, found.argtypes = result, arguments
    for function in (library.delassus_step, library.delassus_forward):
        function.restype, function.argtypes = ctypes.c_int, [pointer, pointer, pointer]
    return library


_library = _load()


def _address(thing):
    return getattr(thing, "_address", thing)


class Contact:
    """A solver, and what it remembers of the last step of one simulation.

    solver: as --solver of the command has it; "ssn", then "auto" if that fails, where none is named.
    contacts: "hard", or "mujoco" for MuJoCo's compliance. law: "coulomb" or "associated".
    tolerance: natural error that is asked for. loosest: natural error above which a step fails.
    Raises ValueError with one sentence.
    """

    def __init__(self, solver=None, contacts="hard", law="coulomb", tolerance=1e-9, loosest=1e-6):
        self._pointer = None
        options = _Options(solver.encode() if solver else None, contacts.encode(), law.encode(), tolerance, loosest)
        message = ctypes.create_string_buffer(1000)
        self._pointer = _library.delassus_mujoco_create(ctypes.byref(options), message, len(message))
        if not self._pointer:
            raise ValueError(message.value.decode())

    def __del__(self):
        if self._pointer:
            _library.delassus_mujoco_free(self._pointer)

    def step(self, model, data):
        """In place of mujoco.mj_step. Raises StepError."""
        self._done(_library.delassus_step(_address(model), _address(data), self._pointer))

    def forward(self, model, data):
        """In place of mujoco.mj_forward. Raises StepError."""
        self._done(_library.delassus_forward(_address(model), _address(data), self._pointer))

    def forget(self):
        """Forgets the forces of the last step, as after mj_resetData."""
        _library.delassus_mujoco_forget(self._pointer)

    @property
    def report(self):
        """Of the last step: rows, contacts, solves, remembered, iterations, natural_error, seconds."""
        last = _library.delassus_mujoco_last(self._pointer)
        return {name: getattr(last, name) for name, _ in _Report._fields_}

    def _done(self, result):
        if result != 0:
            raise StepError(_library.delassus_mujoco_message(self._pointer).decode())
