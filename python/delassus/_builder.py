# SPDX-License-Identifier: BSD-3-Clause
"""Scenes built by calls: each call adds one item of a scene file."""
from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Dict, Iterator, List, Optional, Sequence, Union

from ._delassus import InputError
from ._files import write_whole
from ._yaml import key_of, yaml_of

Shape = Dict[str, Any]
Motion = Any  #: a number, or {'linear': …}, {'sine': …}, {'polynomial': …}, {'ramp': …}, {'table': …}, {'input': …}


class SceneBuilder(Mapping):
    """A scene that is built by calls and given to Scene, Simulation or simulate like a file.

    Each add_… makes one entry of the list of that name in a scene file (docs/scenes.md) and returns its name, by which
    other calls refer to it. What a method does not name is passed on by keyword, so every key of a scene file can be
    given; values are those of the file, with sequences or arrays for vectors. What is None is left out. The reader of
    scenes checks all of it when the scene is used, and names line, key and the nearest valid key; lines are those of
    to_yaml(). Units are SI.

    >>> scene = delassus.SceneBuilder("a ball falls", step=0.01, end=1)
    >>> rubber = scene.add_material("rubber", friction=0.5, restitution=0.7)
    >>> scene.add_ground(material=rubber)
    >>> ball = scene.add_body("ball", mass=2, position=[0, 0, 1], shapes=scene.sphere(0.1, material=rubber))
    >>> run = delassus.simulate(scene)

    title : of the scene
    settings : what set() takes
    """

    world = "world"  #: names the world where a body is asked for

    def __init__(self, title: str = "", **settings: Any):
        self._scene: Dict[str, Any] = {}
        self._names: Dict[str, int] = {}
        if title:
            self._scene["title"] = title
        self.set(**settings)

    def set(self, **settings: Any) -> None:
        """Settings of the system by their names in a scene file: step, end, tolerance, gravity, integrator, solver,
        coordinates, envelope, sleeping, start, limits, leave_out. A value replaces the one before; None removes it."""
        for key, value in settings.items():
            if value is None:
                self._scene.pop(key, None)
            else:
                self._scene[key] = value

    def add_system(self, name: str, **settings: Any) -> "SceneBuilder":
        """One of several systems, to be built as this one, which has nothing but a title and systems then."""
        system = SceneBuilder(**settings)
        self._scene.setdefault("systems", {})[name] = system
        return system

    # ---- Shapes; each takes material, position, orientation and margin by keyword ----

    @staticmethod
    def sphere(radius: float, **keys: Any) -> Shape:
        """radius: m"""
        return {"sphere": {"radius": radius}, **keys}

    @staticmethod
    def box(size: Sequence[float], **keys: Any) -> Shape:
        """size: (3,), full edges, m"""
        return {"box": {"size": size}, **keys}

    @staticmethod
    def capsule(radius: float, length: float, **keys: Any) -> Shape:
        """Along z; length: of the straight part; m"""
        return {"capsule": {"radius": radius, "length": length}, **keys}

    @staticmethod
    def cylinder(radius: float, length: float, **keys: Any) -> Shape:
        """Along z; m"""
        return {"cylinder": {"radius": radius, "length": length}, **keys}

    @staticmethod
    def plane(**keys: Any) -> Shape:
        """The half space z ≤ 0 of its frame; of fixed bodies."""
        return {"plane": {}, **keys}

    @staticmethod
    def convex(points: Any, **keys: Any) -> Shape:
        """The convex hull of points, (4 or more, 3), m"""
        return {"convex": {"points": points}, **keys}

    @staticmethod
    def mesh(file: Union[str, "os.PathLike[str]"], scale: Optional[float] = None, centered: Optional[bool] = None,
             **keys: Any) -> Shape:
        """A closed surface from a file."""
        return {"mesh": _given(file=os.fspath(file), scale=scale, centered=centered), **keys}

    @staticmethod
    def terrain(file: Union[str, "os.PathLike[str]"], scale: Optional[float] = None, **keys: Any) -> Shape:
        """Triangles from a file as they are; of fixed bodies."""
        return {"terrain": _given(file=os.fspath(file), scale=scale), **keys}

    @staticmethod
    def height_field(size: Sequence[float], heights: Any = None, file: Optional[str] = None,
                     scale: Optional[float] = None, **keys: Any) -> Shape:
        """Heights over a rectangle of size (2,), m: an array whose first row is at the largest y, or a file."""
        return {"height_field": _given(size=size, heights=heights, file=file, scale=scale), **keys}

    # ---- Items ----

    def add_material(self, name: str, friction: Optional[float] = None, restitution: Optional[float] = None,
                     **keys: Any) -> str:
        """A material of contacts: friction ≥ 0, restitution in [0, 1]."""
        materials = self._scene.setdefault("materials", {})
        if name in materials:
            raise InputError(f"there is a material {name!r} already")
        materials[name] = _given(friction=friction, restitution=restitution, **keys)
        return name

    def add_material_pair(self, first: str, second: str, friction: Optional[float] = None,
                          restitution: Optional[float] = None, **keys: Any) -> None:
        """Values of their own for contacts of two materials; touch=False: their shapes pass through each other."""
        self._add("material_pairs", first=first, second=second, friction=friction, restitution=restitution, **keys)

    def add_body(self, name: Optional[str] = None, *, mass: Optional[float] = None, density: Optional[float] = None,
                 inertia: Optional[Mapping] = None, position: Any = None, orientation: Any = None,
                 velocity: Any = None, angular_velocity: Any = None, fixed: Optional[bool] = None,
                 shapes: Union[Shape, Sequence[Shape], None] = None, **keys: Any) -> str:
        """A body. name: 'body1', 'body2', … where it is None. mass (kg) or density (kg/m³), inertia {'xx': …} (kg m²)
        unless it follows from the shapes; position of the mass centre (m), orientation [w, x, y, z] or {'axis', 'angle'
        (degrees)}; velocity (m/s), angular_velocity in the body's frame (rad/s); shapes: one or several; by keyword
        massless, motion, repeat."""
        if isinstance(shapes, Mapping):
            shapes = [shapes]
        return self._add("bodies", self._name(name, "body"), mass=mass, density=density, inertia=inertia,
                         position=position, orientation=orientation, velocity=velocity,
                         angular_velocity=angular_velocity, fixed=fixed, shapes=shapes, **keys)

    def add_ground(self, name: str = "ground", material: Optional[str] = None, **keys: Any) -> str:
        """A fixed body with a plane through its position; the plane looks along its z axis."""
        return self.add_body(name, fixed=True, shapes=self.plane(**_given(material=material)), **keys)

    def add_node(self, name: Optional[str] = None, **keys: Any) -> str:
        """A point mass; keys: mass (kg), position (m), velocity (m/s), fixed, repeat."""
        return self._add("nodes", self._name(name, "node"), **keys)

    def add_elastic_block(self, name: Optional[str] = None, **keys: Any) -> str:
        """A block of tetrahedra; keys as in docs/scenes.md: size, cells, young, poisson, density, …"""
        return self._add("elastic_blocks", self._name(name, "elastic_block"), **keys)

    def add_elastic_mesh(self, name: Optional[str] = None, **keys: Any) -> str:
        """An elastic body inside a surface from a file; keys as in docs/scenes.md."""
        return self._add("elastic_meshes", self._name(name, "elastic_mesh"), **keys)

    def add_cable(self, name: Optional[str] = None, **keys: Any) -> str:
        """A cable; keys as in docs/scenes.md."""
        return self._add("cables", self._name(name, "cable"), **keys)

    def add_beam(self, name: Optional[str] = None, **keys: Any) -> str:
        """An elastic beam; keys as in docs/scenes.md."""
        return self._add("beams", self._name(name, "beam"), **keys)

    def add_joint(self, kind: str, first: Optional[str] = None, second: Optional[str] = None, *,
                  name: Optional[str] = None, point: Any = None, axis: Any = None, lower: Optional[float] = None,
                  upper: Optional[float] = None, damping: Optional[float] = None, friction: Optional[float] = None,
                  **keys: Any) -> str:
        """A joint of two bodies, by their names. kind: 'spherical', 'revolute', 'prismatic', 'cylindrical', 'universal',
        'fixed', 'planar', 'point_on_plane', 'distance' or 'gear'; point (m) and axis in the world frame at t = 0; stops
        lower and upper (rad or m); damping and friction of its coordinate; by keyword second_point, second_axis, spring,
        armature, start, start_rate, slide, turn, …"""
        return self._add("joints", self._name(name, "joint"), kind=kind, first=first, second=second, point=point,
                         axis=axis, lower=lower, upper=upper, damping=damping, friction=friction, **keys)

    def add_motor(self, joint: str, motion: Motion, *, name: Optional[str] = None, speed: Optional[bool] = None,
                  force_limit: Optional[float] = None, **keys: Any) -> str:
        """Moves a revolute or prismatic joint: motion is its position (rad, m), or with speed=True its speed;
        force_limit: Nm or N."""
        return self._add("motors", self._name(name, "motor"), joint=joint, motion=motion, speed=speed,
                         force_limit=force_limit, **keys)

    def add_actuator(self, joint: str, *, name: Optional[str] = None, **keys: Any) -> str:
        """Drives a joint by a force or as a servo; keys as in docs/scenes.md."""
        return self._add("actuators", self._name(name, "actuator"), joint=joint, **keys)

    def add_spring(self, first: Optional[str] = None, second: Optional[str] = None, *, name: Optional[str] = None,
                   first_point: Any = None, second_point: Any = None, stiffness: Optional[float] = None,
                   damping: Optional[float] = None, rest_length: Optional[float] = None, **keys: Any) -> str:
        """A spring with a damper between points of two bodies (world frame at t = 0, m); N/m, N s/m, m."""
        return self._add("springs", self._name(name, "spring"), first=first, second=second, first_point=first_point,
                         second_point=second_point, stiffness=stiffness, damping=damping, rest_length=rest_length,
                         **keys)

    def add_bushing(self, first: Optional[str] = None, second: Optional[str] = None, *, name: Optional[str] = None,
                    **keys: Any) -> str:
        """An elastic joint of two bodies; keys as in docs/scenes.md."""
        return self._add("bushings", self._name(name, "bushing"), first=first, second=second, **keys)

    def add_load(self, body: Optional[str] = None, *, name: Optional[str] = None, force: Any = None, torque: Any = None,
                 point: Any = None, follower: Optional[bool] = None, **keys: Any) -> str:
        """A force (N) and a torque (Nm) on a body, three motions each, world frame (with follower=True the body's); point
        (m) in the world frame at t = 0. By keyword node or elastic in place of the body."""
        return self._add("loads", self._name(name, "load"), body=body, force=force, torque=torque, point=point,
                         follower=follower, **keys)

    add_force = add_load

    def add_attachment(self, name: Optional[str] = None, **keys: Any) -> str:
        """Holds nodes of an elastic body to a rigid one; keys as in docs/scenes.md."""
        return self._add("attachments", self._name(name, "attachment"), **keys)

    def add_initial_velocity(self, **keys: Any) -> None:
        """Velocities at the start of what lies in a region or belongs to a body; keys as in docs/scenes.md."""
        self._add("initial_velocities", **keys)

    def keep_apart(self, first: str, second: str) -> None:
        """Two bodies that never touch."""
        self._scene.setdefault("keep_apart", []).append([first, second])

    # ---- As a map, and as YAML ----

    def __getitem__(self, key: str) -> Any:
        return self._scene[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._scene)

    def __len__(self) -> int:
        return len(self._scene)

    def to_yaml(self) -> str:
        """The scene as a scene file, a line for each item. Raises TypeError for a value that no scene can hold."""
        return "".join(line + "\n" for line in _lines(self, ""))

    def write(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Write to_yaml() to a file; one that is there is replaced whole or stays as it was. Names of files in the scene
        count from the folder of that file; those of a scene that is not written, from the working directory."""
        write_whole(path, self.to_yaml())

    def __repr__(self) -> str:
        counts = [f"{len(value)} {key}" for key, value in self._scene.items() if isinstance(value, (list, dict))
                  and key not in ("integrator", "solver", "limits")]
        return f"<delassus.SceneBuilder: {self._scene.get('title', 'without a title')}, {', '.join(counts) or 'empty'}>"

    def _name(self, name: Optional[str], kind: str) -> str:
        if name is None:
            self._names[kind] = self._names.get(kind, 0) + 1
            name = f"{kind}{self._names[kind]}"
        return name

    def _add(self, key: str, name: Optional[str] = None, **item: Any) -> Any:
        entry = {} if name is None else {"name": name}
        entry.update(_given(**item))
        self._scene.setdefault(key, []).append(entry)
        return name


def _given(**items: Any) -> Dict[str, Any]:
    return {key: value for key, value in items.items() if value is not None}


def _lines(scene: Mapping, indent: str) -> List[str]:
    lines = []
    for key, value in scene.items():
        head = indent + key_of(key) + ":"
        if key in ("systems", "materials") and isinstance(value, Mapping) and value:
            lines.append(head)
            for name, entry in value.items():
                if isinstance(entry, SceneBuilder):
                    lines += [f"{indent}  {key_of(name)}:", *_lines(entry, indent + "    ")]
                else:
                    lines.append(f"{indent}  {key_of(name)}: {yaml_of(entry)}")
        elif isinstance(value, list) and value and all(isinstance(entry, Mapping) for entry in value):
            lines += [head, *(f"{indent}  - {yaml_of(entry)}" for entry in value)]
        else:
            lines.append(f"{head} {yaml_of(value)}")
    return lines
