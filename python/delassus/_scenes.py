# SPDX-License-Identifier: BSD-3-Clause
"""Scenes and systems, simulated whole or step by step."""
from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from . import _delassus
from ._builder import SceneBuilder
from ._delassus import InputError, StepFailure, StepRecord
from ._plugins import Path, folders, registry
from ._system import DynamicalSystem, _Asked
from ._view import View
from ._yaml import yaml_of

_NO_END, _MOST_STEPS = 1e300, 1e12  # for the reader of scenes, which wants finite times, and no more steps

Named = Union[str, Mapping[str, Any]]  #: 'name', 'name(key=value, …)', or {'name': …, 'options': {…}, …} as in scenes


class Scene(_delassus.Scene):
    """One or several mechanical systems, with their timesteppers and solvers (docs/scenes.md).

    Parameters
    ----------
    source : a path of a YAML file, a text in YAML (anything with a line break), a dict of the same keys, or a
        SceneBuilder
    set : values by path that replace those of the source, e.g. {"bodies.ball.mass": 2}
    solver, integrator : 'name' or 'name(key=value, …)' for every system
    law : 'associated' or 'coulomb', for every system
    step, end : s, for every system
    tolerance : m or rad, from which steps follow
    accuracy : a share of the size of what moves, a second, to which steps are divided (docs/integrators.md)

    Raises InputError that names file, line, key and the nearest valid key.
    """

    def __init__(self, source: Union[Path, Mapping[str, Any]], *, set: Optional[Mapping[str, Any]] = None,
                 solver: str = "", integrator: str = "", law: Optional[str] = None, step: Optional[float] = None,
                 end: Optional[float] = None, tolerance: Optional[float] = None, accuracy: Optional[float] = None):
        if isinstance(source, SceneBuilder):
            scene, is_file = source.to_yaml() or "{}\n", False
        elif isinstance(source, Mapping):
            scene, is_file = yaml_of(source), False
        else:
            scene = os.fspath(source)
            is_file = "\n" not in scene
        values = [(path, yaml_of(value)) for path, value in (set or {}).items()]
        super().__init__(scene, is_file, values, solver, integrator, law, step, end, tolerance, accuracy)

    def __repr__(self) -> str:
        return f"<delassus.Scene: {self.title or 'without a title'}, systems {', '.join(self.systems)}>"


def _settings(integrator: Named, solver: Named, law: Optional[str], step: Optional[float], end: Optional[float],
              tolerance: Any) -> Scene:
    """A scene with nothing in it but how a system is to be run; its reader checks it all."""
    if end == np.inf:
        end = _NO_END if step is None else _MOST_STEPS * step
    scene: dict = {"bodies": []}
    scene.update({key: value for key, value in (("step", step), ("end", end), ("tolerance", tolerance))
                  if value is not None})
    for key, value in (("integrator", integrator), ("solver", solver)):
        if isinstance(value, Mapping):
            scene[key] = value
        elif not isinstance(value, str):
            raise InputError(f"{key} is of type {type(value).__name__}; it must be a name, or a dict as in scenes")
    names = {key: value for key, value in (("integrator", integrator), ("solver", solver)) if isinstance(value, str)}
    return Scene(scene, law=law, **names)


class Simulation:
    """A system of a scene, or one of your own, step by step.

    Parameters
    ----------
    scene : a Scene, or what Scene takes; or a DynamicalSystem. Two simulations of one Scene step one at a time
    system : its name; '' where the scene has only one
    integrator, solver : 'name' or 'name(key=value, …)'; for a DynamicalSystem also a dict as in scenes, e.g.
        {'name': 'cholmod', 'tolerance': 1e-12}. Without an integrator a DynamicalSystem gets moreau_jean where it has
        unilateral rows, else dormand_prince(error_limit=1e-5), which needs no derivatives
    law : 'associated' or 'coulomb', of friction
    step, end : s; a simulation of a DynamicalSystem needs a step or a tolerance, and an end (which may be inf)
    tolerance : in units of positions, from which steps follow; for a DynamicalSystem also {'absolute': …, 'relative': …}
    accuracy : of a scene, as Scene has it
    """

    def __init__(self, scene: Union[Scene, DynamicalSystem, Path, Mapping[str, Any]], system: str = "",
                 plugin_path: Sequence[Path] = (), *, integrator: Named = "", solver: Named = "",
                 law: Optional[str] = None, step: Optional[float] = None, end: Optional[float] = None,
                 tolerance: Any = None, accuracy: Optional[float] = None):
        plugins = registry(folders(plugin_path))
        chosen = dict(integrator=integrator, solver=solver, law=law, step=step, end=end, tolerance=tolerance)
        self.bodies: list = []  #: names, in the order of poses and twists; none of a DynamicalSystem
        self.system: str = system
        self._asked: Optional[_Asked] = None
        if isinstance(scene, type) and issubclass(scene, DynamicalSystem):
            raise InputError(f"{scene.__name__} is a class; give an instance, {scene.__name__}()")
        if isinstance(scene, DynamicalSystem):
            if system:
                raise InputError("system is for scenes with several; a DynamicalSystem is one")
            if accuracy is not None:
                raise InputError("accuracy is for scenes, whose bodies have a size; give a DynamicalSystem a tolerance")
            self._asked = _Asked(scene)
            if not integrator:
                chosen["integrator"] = ("moreau_jean" if "unilateral" in self._asked.methods else
                                        "dormand_prince(error_limit=1e-5)")
            self.scene: Union[Scene, DynamicalSystem] = scene
            self.end: Optional[float] = end  #: s; None where the scene knows it
            self._run: Any = self._noting(lambda: _delassus.SystemRun(self._asked, _settings(**chosen), plugins))
            return
        given = {key: value for key, value in {**chosen, "accuracy": accuracy}.items() if value not in ("", None)}
        if not isinstance(scene, Scene):
            scene = Scene(scene, **given)
        elif given:
            raise InputError(f"{', '.join(given)} belong to the Scene: give them where it is made")
        self._run = _delassus.SceneRun(scene, plugins, system)
        self.end = None
        self.scene = scene
        self.bodies = scene.bodies(system)

    def _noting(self, work: Any) -> Any:
        """What work() returns. A failure says which of a user's methods returned what is not finite."""
        if self._asked is not None:
            self._asked.not_finite = ""
        try:
            return work()
        except StepFailure as failure:
            if self._asked is None or not self._asked.not_finite:
                raise
            raise StepFailure(f"{failure} ({self._asked.not_finite} returned a value that is not finite)") from None

    def step(self) -> StepRecord:
        """Take one step and return its StepRecord. Raises StepFailure, Unsupported or InputError with the time in the
        sentence, and whatever a method of a DynamicalSystem raises; everything is then as it was before the step."""
        return self._noting(self._run.step)

    @property
    def finished(self) -> bool:
        """Whether the end is reached."""
        return self._run.finished

    @property
    def time(self) -> float:
        """s"""
        return self._run.time

    @property
    def positions(self) -> np.ndarray:
        """The coordinates q of all that can move, in the system's order (of scenes m, unit quaternions w, x, y, z, and
        angles of joints, rad, at the end)."""
        return self._run.positions

    @property
    def velocities(self) -> np.ndarray:
        """The velocities v of all that can move (of scenes m/s, rad/s)."""
        return self._run.velocities

    @property
    def poses(self) -> np.ndarray:
        """(B, 7): position of the mass centre in the world (m), unit quaternion (w, x, y, z) of each body."""
        return self._run.poses if self._asked is None else np.zeros((0, 7))

    @property
    def twists(self) -> np.ndarray:
        """(B, 6): velocity of the mass centre in the world frame (m/s), angular velocity in the body frame (rad/s)."""
        return self._run.twists if self._asked is None else np.zeros((0, 6))

    @property
    def joints(self) -> list:
        """Names of the revolute, cylindrical and prismatic joints of a scene, in the order of joint_positions."""
        return self._run.joint_names() if self._asked is None else []

    @property
    def joint_positions(self) -> np.ndarray:
        """(J,): the coordinates of these joints, 0 where the bodies are given: m, or rad, with whole turns where
        something acts on the angle."""
        return self._joint_coordinates()[:, 0]

    @property
    def joint_velocities(self) -> np.ndarray:
        """(J,): the rates of these coordinates, m/s or rad/s."""
        return self._joint_coordinates()[:, 1]

    def _joint_coordinates(self) -> np.ndarray:
        return self._run.joint_coordinates() if self._asked is None else np.zeros((0, 2))

    @property
    def inputs(self) -> dict:
        """The inputs of a scene (docs/scenes.md, motions) by name, as they are now."""
        return dict(self._run.inputs()) if self._asked is None else {}

    def set_inputs(self, values: Mapping[str, float]) -> None:
        """Give these inputs new values, which hold from now on. Raises InputError that names the nearest input where one
        of them is not there, or a value is not finite; none is changed then."""
        known = self.inputs
        for name, value in values.items():
            if name in known and not np.isfinite(value):
                raise InputError(f"the input {name!r} is {value}; it must be finite")
            if name not in known and self._asked is not None:
                raise InputError(f"there is no input {name!r}: a DynamicalSystem has none")
        for name in sorted(values, key=lambda one: one in known):  # one that is not there is refused first
            self._run.set_input(name, float(values[name]))

    @property
    def record(self) -> StepRecord:
        """The StepRecord of the last step; of the start before the first."""
        return self._run.record

    @property
    def multipliers(self) -> np.ndarray:
        """λ of the constraints after the last step, forces: of a scene all rows of joints, motors and attachments (N,
        Nm), of a DynamicalSystem (m,). Empty before the first."""
        return self._run.multipliers

    def contacts(self) -> dict:
        """What acted in the last step, found where it began: a dict of arrays with a row for each contact.

        Of a scene 'bodies' × 2 (numbers in bodies, −1 the world), 'point' × 3 (m), 'normal' × 3 (unit, from the first
        to the second), 'gap' (m), 'force' × 3 (mean on the second body, world frame, N). Of a DynamicalSystem 'key' and
        'force' × 3 (mean reaction in the rows of each Unilateral, 0 beyond them)."""
        return self._run.contacts()

    def warnings(self) -> list:
        """What a user should know about the run so far, one sentence each."""
        return self._run.warnings()

    def __repr__(self) -> str:
        if self._asked is not None:
            return (f"<delassus.Simulation: {type(self.scene).__name__} by {self._run.integrator}, t = {self.time}, "
                    f"n = {self._asked.n}, m = {self._asked.m}>")
        return f"<delassus.Simulation: t = {self.time} s, {len(self.bodies)} bodies>"


@dataclass
class Trajectory:
    """What simulate() recorded: K states, of B bodies. Units are those of the scene, SI as a rule."""

    bodies: list  #: names of the B bodies; none of a DynamicalSystem
    time: np.ndarray  #: (K,), s
    positions: np.ndarray  #: (K, ·) coordinates q of all that can move
    velocities: np.ndarray  #: (K, ·) v of all that can move
    poses: np.ndarray  #: (K, B, 7): mass centre in the world (m), unit quaternion (w, x, y, z)
    twists: np.ndarray  #: (K, B, 6): velocity in the world frame (m/s), angular velocity in the body frame (rad/s)
    energy: np.ndarray  #: (K,), J
    penetration: np.ndarray  #: (K,), m
    drift: np.ndarray  #: (K,), largest |C| of joints and motors, m or rad
    natural: np.ndarray  #: (K,), largest natural error of the solves of the step that ends there
    contacts: dict = field(repr=False)  #: a row for each contact of each state: Simulation.contacts() with 'state' (k)
    status: str = "finished"  #: or 'unsolved' (a solve missed its tolerance), 'failed'
    message: str = ""  #: what a person should know; '' where the run finished
    steps: int = 0  #: steps taken
    records: list = field(default_factory=list, repr=False)  #: K StepRecords
    scene: Any = field(default=None, repr=False)  #: what was simulated: a Scene or a DynamicalSystem
    system: str = ""  #: its name in the scene

    def body(self, name: str) -> np.ndarray:
        """(K, 7): the poses of one body."""
        return self.poses[:, self._number(name)]

    def twist(self, name: str) -> np.ndarray:
        """(K, 6): the velocities of one body."""
        return self.twists[:, self._number(name)]

    def view(self, frames: int = 600) -> View:
        """The motion in 3D beside its plots, as `delassus view` has it (docs/viewing.md): shown in a notebook, and
        written to a page by .write(path). frames: the largest number of states in it, evenly chosen.

        Raises InputError for a DynamicalSystem, whose shapes nobody knows, and where the build has no three.js."""
        if not isinstance(self.scene, _delassus.Scene):
            raise InputError("only the motion of a scene can be shown: a DynamicalSystem has no shapes")
        if frames < 2:
            raise InputError(f"frames is {frames}; it must be at least 2: the start and the end")
        count = len(self.time)
        chosen = np.unique(np.round(np.linspace(0, count - 1, min(frames, count))).astype(int))
        keep = np.isin(self.contacts["state"], chosen)
        ends = np.cumsum(np.bincount(self.contacts["state"][keep], minlength=count)[chosen])
        page = _delassus._view_page(self.scene, self.system, self.time[chosen], self.positions[chosen],
                                    self.velocities[chosen], self.poses[chosen], self.contacts["point"][keep], ends,
                                    self.records, self.status, self.message, self.steps, count)
        return View(page)

    def _number(self, name: str) -> int:
        if name not in self.bodies:
            raise InputError(f"there is no body {name!r}, but {', '.join(self.bodies)}")
        return self.bodies.index(name)


def simulate(scene: Union[Scene, DynamicalSystem, Simulation, Path, Mapping[str, Any]], system: str = "", every: int = 1,
             plugin_path: Sequence[Path] = (), *, integrator: Named = "", solver: Named = "", law: Optional[str] = None,
             step: Optional[float] = None, end: Optional[float] = None, tolerance: Any = None,
             accuracy: Optional[float] = None) -> Trajectory:
    """Simulate a system to its end, and record every so many steps, the start and the end.

    scene : a Scene, what Scene takes, a DynamicalSystem, or a Simulation, which goes on from where it is
    system : its name; '' where the scene has only one
    integrator, solver, law, step, end, tolerance, accuracy : as Simulation has them; not for a Scene or a Simulation

    A step that fails ends the run: what was recorded comes back with status 'failed' and the sentence. Whatever is not
    'finished' is also a RuntimeWarning. Raises Unsupported where a solver or timestepper cannot take the system, and
    whatever a method of a DynamicalSystem raises.
    """
    if every < 1:
        raise InputError(f"every is {every}; it must be 1 or more")
    chosen = dict(integrator=integrator, solver=solver, law=law, step=step, end=end, tolerance=tolerance, accuracy=accuracy)
    if not isinstance(scene, Simulation):
        simulation = Simulation(scene, system, plugin_path, **chosen)
    else:
        given = [key for key, value in chosen.items() if value not in ("", None)]
        if given:
            raise InputError(f"{', '.join(given)} belong to the Simulation: give them where it is made")
        simulation = scene
    if simulation.end == np.inf:
        raise InputError("a simulation without an end cannot be simulated whole: give an end, or take steps")
    frames, contacts, records = [], [], []

    def record() -> None:
        now = simulation.record
        frames.append((simulation.time, simulation.positions, simulation.velocities, simulation.poses,
                       simulation.twists, now.energy, now.penetration, now.drift, now.natural))
        contacts.append(simulation.contacts())
        records.append(now)

    status, message, steps, recorded, solved = "finished", "", 0, True, True
    record()
    try:
        while not simulation.finished:
            solved = simulation.step().solved and solved
            steps += 1
            recorded = steps % every == 0
            if recorded:
                record()
    except StepFailure as failure:
        status, message = "failed", str(failure)
    if not recorded:
        record()
    if status == "finished" and not solved:
        status, message = "unsolved", "; ".join(simulation.warnings()) or "a solve missed its tolerance"
    if status != "finished":
        warnings.warn(f"the simulation ended as {status}: {message}", RuntimeWarning, stacklevel=2)
    arrays = [np.array(column) for column in zip(*frames)]
    table = {key: np.concatenate([frame[key] for frame in contacts]) for key in contacts[0]}
    table["state"] = np.repeat(np.arange(len(contacts)), [len(frame["force"]) for frame in contacts])
    return Trajectory(simulation.bodies, *arrays, contacts=table, status=status, message=message, steps=steps,
                      records=records, scene=simulation.scene, system=simulation.system)
