# SPDX-License-Identifier: BSD-3-Clause
"""What the scenes of test_motion.py are made of: each is written once, in a frame of its own with z up, and placed as a
whole. Units are SI, angles of turns are in degrees."""
from dataclasses import dataclass
from typing import Any, Callable, Optional, Sequence

import delassus
import numpy as np
from delassus import SceneBuilder
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

G = 9.81
STEPS = (1 / 60, 0.0071, 0.002)  #: s

box = SceneBuilder.box
capsule = SceneBuilder.capsule
convex = SceneBuilder.convex
cylinder = SceneBuilder.cylinder
height_field = SceneBuilder.height_field
plane = SceneBuilder.plane
sphere = SceneBuilder.sphere


@dataclass(frozen=True)
class Placement:
    """Where a scene is in the world: turned about its origin, then shifted."""

    name: str
    turn: Rotation
    shift: np.ndarray

    def back(self, points):
        """Points (K, 3) of the world, in the scene's frame."""
        return self.turn.inv().apply(points - self.shift)


PLACEMENTS = (Placement("straight", Rotation.identity(), np.zeros(3)),
              Placement("turned", Rotation.from_rotvec([148.28255, -40.86917, 2.87878], degrees=True),
                        np.array([3.1, -2.2, 7.7])))


class Scene:
    """A scene that is built in its own frame and comes out in that of a placement."""

    def __init__(self, placement: Placement):
        self._placement = placement
        self._builder = SceneBuilder()
        self.set_gravity(G)

    def built(self, step: float, end: float) -> SceneBuilder:
        self._builder.set(step=step, end=end)
        return self._builder

    def set_gravity(self, gravity: float):
        self._builder.set(gravity=self.direction([0, 0, -gravity]))

    def point(self, point):
        return self._placement.turn.apply(point) + self._placement.shift

    def direction(self, direction):
        return self._placement.turn.apply(direction)

    def linear(self, velocity):
        """A translation by this velocity, of a kinematic body."""
        return {"translation": [{"linear": {"rate": rate}} for rate in self.direction(velocity)]}

    def sine(self, amplitude, frequency: float):
        """Three motions, of a force or a translation; amplitude is a vector."""
        return [{"sine": {"amplitude": part, "frequency": frequency}} for part in self.direction(amplitude)]

    def turning(self, axis, rate: float):
        """A rotation by this rate, of a kinematic body."""
        return {"rotation": {"axis": self.direction(axis), "angle": {"linear": {"rate": rate}}}}

    def add_material(self, friction: Optional[float] = None, restitution: Optional[float] = None) -> str:
        """The one material of a scene. Shapes without a material have neither friction nor restitution."""
        return self._builder.add_material("material", friction=friction, restitution=restitution)

    def add_body(self, name: str, position, shapes, turn: Rotation = Rotation.identity(), velocity=None,
                 angular_velocity=None, **keys: Any) -> str:
        """A body of 1000 kg/m³ unless keys have a mass; velocities are in the scene's frame, also the angular one."""
        x, y, z, w = (self._placement.turn * turn).as_quat()
        if not keys.keys() & {"mass", "fixed", "motion"}:
            keys["density"] = 1000
        if velocity is not None:
            keys["velocity"] = self.direction(velocity)
        if angular_velocity is not None:
            keys["angular_velocity"] = turn.inv().apply(angular_velocity)
        return self._builder.add_body(name, position=self.point(position), orientation=[w, x, y, z], shapes=shapes,
                                      **keys)

    def add_fixed(self, name: str, position, shapes, turn: Rotation = Rotation.identity()) -> str:
        return self.add_body(name, position, shapes, turn, fixed=True)

    def add_joint(self, kind: str, first: str, second: str, point, axis=None) -> str:
        return self._builder.add_joint(kind, first, second, point=self.point(point),
                                       axis=None if axis is None else self.direction(axis))

    def add_motor(self, joint: str, motion, **keys: Any):
        self._builder.add_motor(joint, motion, **keys)

    def add_spring(self, first: str, second: str, stiffness: float, rest_length: float):
        """Between the mass centres."""
        self._builder.add_spring(first, second, stiffness=stiffness, rest_length=rest_length)

    def add_load(self, body: str, force=None, torque=None):
        """Constant vectors."""
        self._builder.add_load(body, force=None if force is None else self.direction(force),
                               torque=None if torque is None else self.direction(torque))

    def add_sine_force(self, body: str, amplitude, frequency: float):
        self._builder.add_load(body, force=self.sine(amplitude, frequency))


@dataclass
class Turn:
    """How a body turns about an axis that stays."""

    axis: Sequence[float]
    angle: Callable[[float], float]  #: rad, by time
    allowed: float  #: rad


@dataclass
class Motion:
    """How a body moves: the reference of a case, in the scene's frame."""

    body: str
    position: Callable[[float], Sequence[float]]  #: of the mass centre, m, by time
    end: float  #: s
    turn: Optional[Turn] = None


@dataclass
class Case:
    name: str
    build: Callable[[Scene], Motion]
    allowed: float  #: the largest distance from the reference at any step, m
    steps: Sequence[float]


class Cases(list):
    """The cases of one topic."""

    def add(self, allowed: float, steps: Sequence[float] = STEPS):
        """Decorates a function that builds the scene and returns the Motion of the reference."""

        def added(build: Callable[[Scene], Motion]):
            self.append(Case(build.__name__, build, allowed, steps))
            return build

        return added


def errors(case: Case, placement: Placement, step: float):
    """The run, and a list of (error, allowed, unit): the largest distance from the reference over all steps, and the
    largest error of the angle where the case has a Turn."""
    scene = Scene(placement)
    motion = case.build(scene)
    run = delassus.simulate(scene.built(step, motion.end))
    poses = run.body(motion.body)
    expected = np.array([motion.position(t) for t in run.time])
    distances = np.linalg.norm(placement.back(poses[:, :3]) - expected, axis=1)
    found = [(float(distances.max()), case.allowed, "m")]
    if motion.turn is not None:
        turns = Rotation.from_quat(poses[:, [4, 5, 6, 3]])
        angles = np.cumsum((turns[1:] * turns[:-1].inv()).as_rotvec() @ scene.direction(motion.turn.axis))
        expected = [motion.turn.angle(t) for t in run.time[1:]]
        found.append((float(np.abs(angles - expected).max()), motion.turn.allowed, "rad"))
    return run, found


# ---- For scenes and references ----


def about_x(degrees: float) -> Rotation:
    return Rotation.from_euler("x", degrees, degrees=True)


def about_y(degrees: float) -> Rotation:
    """Of a plane or a box: a slope that falls along its x axis."""
    return Rotation.from_euler("y", degrees, degrees=True)


def about_z(degrees: float) -> Rotation:
    return Rotation.from_euler("z", degrees, degrees=True)


def inertia(xx: float, yy: float, zz: float):
    return {"xx": xx, "yy": yy, "zz": zz}


def constant_acceleration(start, acceleration, velocity=(0, 0, 0)):
    """position(t) = start + velocity t + acceleration t²/2"""
    start, velocity, acceleration = (np.asarray(vector, float) for vector in (start, velocity, acceleration))
    return lambda t: start + velocity * t + acceleration * t**2 / 2


def flight(start, velocity, begin: float):
    """position(t) of a free flight that begins there at the time `begin`"""
    path = constant_acceleration(start, [0, 0, -G], velocity)
    return lambda t: path(t - begin)


def integrate(rates, state, begin: float = 0.0, longest: float = 10.0, until=None, direction: float = 0.0):
    """y' = rates(t, y) from y(begin) = state, up to where until(t, y) passes 0 in this direction (any one by default),
    but at most `longest` seconds."""
    events = None
    if until is not None:
        def events(t, y):
            return until(t, y)
        events.terminal = True
        events.direction = direction
    return solve_ivp(rates, (begin, begin + longest), state, method="DOP853", events=events, rtol=1e-11, atol=1e-12,
                     max_step=0.02, dense_output=True)


def end_of(path):
    """Time and state where integrate() ended."""
    return path.t[-1], path.y[:, -1]


def state_at(paths, t: float):
    """The state of several integrate(), each of which begins where the one before ends."""
    for path in paths[:-1]:
        if t <= path.t[-1]:
            return path.sol(t)
    return paths[-1].sol(t)
