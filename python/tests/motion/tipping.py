# SPDX-License-Identifier: BSD-3-Clause
"""What tips, falls over, or stands."""
import numpy as np

from .scenes import (G, Cases, Motion, about_x, about_y, box, capsule, cylinder, end_of, inertia, integrate, plane,
                     state_at)

CASES = Cases()


def standing_rod(scene, place, theta, r, a, m, J):
    """A capsule of half length a with its lower end on a floor without friction, at the angle theta above it."""
    scene.add_fixed("floor", [0, 0, 0], plane())
    scene.add_body("rod", place(theta), capsule(r, 2 * a), about_y(np.degrees(theta) - 90), mass=m,
                   inertia=inertia(J, J, 0.01))


def rates_of_rod_on_floor(a, m, J):
    """Of θ and θ', with the pressure N = m (g + z'') of the floor at the lower end, z = a sin θ:
    (J + m a² cos² θ) θ'' = −m a cos θ (g − a sin θ θ'²)."""

    def rates(t, y):
        theta, rate = y
        lever = a * np.cos(theta)
        return [rate, -m * lever * (G - a * np.sin(theta) * rate**2) / (J + m * lever**2)]

    return rates


@CASES.add(allowed=2e-3)
def ladder(scene):
    """A rod slides down between a wall and a floor without friction, begins at 70 degrees, and leaves the wall:
    (J + m a²) θ'' = −m g a cos θ while the wall pushes, x'' > 0 with x = a cos θ; then as falling_rod, x' constant."""
    r, a, m, J = 0.02, 0.5, 2.0, 0.3

    def place(theta):
        return np.array([r + a * np.cos(theta), 0, r + a * np.sin(theta)])

    standing_rod(scene, place, np.radians(70), r, a, m, J)
    scene.add_fixed("wall", [0, 0, 0], plane(), about_y(90))

    def acceleration(theta):
        return -m * G * a * np.cos(theta) / (J + m * a**2)

    def push(t, y):
        theta, rate = y
        return -np.cos(theta) * rate**2 - np.sin(theta) * acceleration(theta)

    at_wall = integrate(lambda t, y: [y[1], acceleration(y[0])], [np.radians(70), 0], until=push, direction=-1)
    leaves, state = end_of(at_wall)
    free = integrate(rates_of_rod_on_floor(a, m, J), state, leaves, until=lambda t, y: y[0] - 0.02)
    corner, speed = place(state[0])[0], -a * np.sin(state[0]) * state[1]

    def position(t):
        x, _, z = place(state_at([at_wall, free], t)[0])
        return [x if t < leaves else corner + speed * (t - leaves), 0, z]

    return Motion("rod", position, end=0.98 * end_of(free)[0])


@CASES.add(allowed=2e-3)
def falling_rod(scene):
    """A rod falls from 80 degrees with its lower end on a floor without friction; its mass centre falls straight down
    by (J + m a² cos² θ) θ'' = −m a cos θ (g − a sin θ θ'²)."""
    r, a, m, J = 0.02, 0.5, 2.0, 0.3

    def place(theta):
        return np.array([0, 0, r + a * np.sin(theta)])

    standing_rod(scene, place, np.radians(80), r, a, m, J)
    fall = integrate(rates_of_rod_on_floor(a, m, J), [np.radians(80), 0], until=lambda t, y: y[0] - 0.03)
    return Motion("rod", lambda t: place(fall.sol(t)[0]), end=0.97 * end_of(fall)[0])


@CASES.add(allowed=1e-3)
def plank_tips_over_edge(scene):
    """A plank on a rough table, of which only the last 0.2 m lie on it, tips over the table's edge, from which its mass
    centre is d away and b above: (J + m (d² + b²)) θ'' = m g (d cos θ + b sin θ)."""
    m, J, d, b = 2.0, 0.3, 0.3, 0.02
    rough = scene.add_material(friction=5)
    scene.add_fixed("table", [-d - 1, 0, -0.1], box([2, 1, 0.2], material=rough))
    scene.add_body("plank", [0, 0, b], box([1, 0.3, 2 * b], material=rough), mass=m, inertia=inertia(0.1, J, 0.3))

    def rates(t, y):
        return [y[1], m * G * (d * np.cos(y[0]) + b * np.sin(y[0])) / (J + m * (d**2 + b**2))]

    tip = integrate(rates, [0, 0], longest=1.0)

    def position(t):
        theta = tip.sol(t)[0]
        return [-d + d * np.cos(theta) + b * np.sin(theta), 0, -d * np.sin(theta) + b * np.cos(theta)]

    return Motion("plank", position, end=0.28)


@CASES.add(allowed=1e-4)
def pyramid_stands(scene):
    """Three equal cylinders in a pyramid stand where μ is at least 2 − √3 = 0.268 between all."""
    r, top = 0.1, 0.1 * (1 + np.sqrt(3))
    rough = scene.add_material(friction=0.29)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))
    for name, x, z in (("left", -r, r), ("right", r, r), ("top", 0, top)):
        scene.add_body(name, [x, 0, z], cylinder(r, 0.4, material=rough), about_x(90))
    return Motion("top", lambda t: [0, 0, top], end=3.0)
