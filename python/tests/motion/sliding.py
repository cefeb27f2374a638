# SPDX-License-Identifier: BSD-3-Clause
"""What slides, with and without friction, on planes, boxes, hulls and terrain."""
import numpy as np

from .scenes import (G, Cases, Motion, Turn, about_x, about_y, about_z, box, constant_acceleration, convex, cylinder,
                     end_of, flight, height_field, inertia, integrate, plane, sphere)

CASES = Cases()


@CASES.add(allowed=2e-3)
def sphere_off_sphere(scene):
    """A ball of radius r slides without friction from the top of a fixed one of radius R, 10 degrees off, and leaves
    it: (R + r) θ'' = g sin θ while (R + r) θ'² < g cos θ, then free flight."""
    distance = 1.1
    begin = np.radians(10)

    def place(theta):
        return distance * np.array([np.sin(theta), 0, np.cos(theta)])

    scene.add_fixed("below", [0, 0, 0], sphere(1))
    scene.add_body("ball", place(begin), sphere(0.1))

    def pressure(t, y):
        return G * np.cos(y[0]) - distance * y[1]**2

    slide = integrate(lambda t, y: [y[1], G / distance * np.sin(y[0])], [begin, 0], until=pressure)
    leaves, (theta, rate) = end_of(slide)
    fly = flight(place(theta), distance * rate * np.array([np.cos(theta), 0, -np.sin(theta)]), leaves)
    return Motion("ball", lambda t: place(slide.sol(t)[0]) if t < leaves else fly(t), end=1.7)


@CASES.add(allowed=1e-3)
def wedge_and_block(scene):
    """A block of mass m slides down a wedge of mass M that slides on the floor, all without friction: the wedge moves
    back by m g sin α cos α / (M + m sin² α), the block on it down by (M + m) g sin α / (M + m sin² α)."""
    M, m, alpha, length = 2.0, 1.0, np.radians(30), 3.0
    height = length * np.tan(alpha)
    centre = np.array([length / 3, 0, height / 3])
    corners = [np.array([x, y, z]) for y in (-0.5, 0.5) for x, z in ((0, 0), (length, 0), (0, height))]
    scene.add_fixed("floor", [0, 0, 0], plane())
    scene.add_body("wedge", centre, convex([corner - centre for corner in corners]), mass=M, inertia=inertia(1, 1, 1))
    down = about_y(30)
    start = [0, 0, height] + down.apply([0.5, 0, 0.1])
    scene.add_body("block", start, box([0.3, 0.3, 0.2]), down, mass=m, inertia=inertia(0.01, 0.01, 0.01))
    share = G * np.sin(alpha) / (M + m * np.sin(alpha)**2)
    acceleration = (M + m) * share * down.apply([1, 0, 0]) - [m * share * np.cos(alpha), 0, 0]
    return Motion("block", constant_acceleration(start, acceleration), end=0.71)


@CASES.add(allowed=1e-3)
def block_on_block(scene):
    """A block lies on one of three times its mass, which moves off at 2 m/s on a floor without friction: the upper one
    gains μ g, the lower one loses μ g / 3, until both are equally fast."""
    mu, speed = 0.25, 2.0
    rough = scene.add_material(friction=mu)
    scene.add_fixed("floor", [0, 0, 0], plane())
    scene.add_body("lower", [0, 0, 0.1], box([4, 0.4, 0.2], material=rough), velocity=[speed, 0, 0], mass=3,
                   inertia=inertia(1, 1, 1))
    scene.add_body("upper", [0, 0, 0.25], box([0.2, 0.2, 0.1], material=rough), mass=1,
                   inertia=inertia(0.01, 0.01, 0.01))
    together = speed / (mu * G + mu * G / 3)

    def position(t):
        return [mu * G * min(t, together)**2 / 2 + mu * G * together * max(t - together, 0), 0, 0.25]

    return Motion("upper", position, end=1.1)


@CASES.add(allowed=1e-3)
def groove_box(scene):
    """A box slides down a groove of two planes at right angles, inclined by α: a = g (sin α − √2 μ cos α)."""
    mu, alpha, down = 0.2, np.radians(35), about_y(35)
    rough = scene.add_material(friction=mu)
    for name, side in (("left", 45), ("right", -45)):
        scene.add_fixed(name, [0, 0, 0], plane(material=rough), down * about_x(side))
    start = down.apply([0, 0, 0.1 * np.sqrt(2)])
    scene.add_body("box", start, box([0.4, 0.2, 0.2], material=rough), down * about_x(45))
    acceleration = G * (np.sin(alpha) - np.sqrt(2) * mu * np.cos(alpha))
    return Motion("box", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=1.1)


@CASES.add(allowed=5e-4)
def incline_slip_ball(scene):
    """A ball slips down a plane that is too steep for it to roll: a = g (sin α − μ cos α)."""
    mu, alpha, down = 0.2, np.radians(50), about_y(50)
    rough = scene.add_material(friction=mu)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough), down)
    start = down.apply([0, 0, 0.1])
    scene.add_body("ball", start, sphere(0.1, material=rough))
    acceleration = G * (np.sin(alpha) - mu * np.cos(alpha))
    return Motion("ball", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=0.9)


@CASES.add(allowed=1e-4)
def corner_spin(scene):
    """A cylinder spins in the corner of a floor and a wall, and friction presses it against the wall: with J = m r²/2
    and the pressures m g/(1 + μ²) and μ m g/(1 + μ²) it slows down by 2 μ g (1 + μ) / (r (1 + μ²)) until it stands."""
    mu, r, rate = 0.3, 0.1, 60.0
    rough = scene.add_material(friction=mu)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))
    scene.add_fixed("wall", [0, 0, 0], plane(material=rough), about_y(90))
    scene.add_body("cylinder", [r, 0, r], cylinder(r, 0.3, material=rough), about_x(90), angular_velocity=[0, -rate, 0])
    slowing = 2 * mu * G * (1 + mu) / (r * (1 + mu**2))
    stands = rate / slowing

    def angle(t):
        return rate * min(t, stands) - slowing * min(t, stands)**2 / 2

    return Motion("cylinder", lambda t: [r, 0, r], end=1.2 * stands, turn=Turn([0, -1, 0], angle, allowed=5e-3))


def level_terrain(columns, rows, size, **keys):
    return height_field(size, np.zeros((rows, columns)), **keys)


@CASES.add(allowed=1e-3)
def box_slides_on_terrain(scene):
    """A box, turned by 33 degrees about the normal, slides over the triangles of a flat inclined height field as on a
    plane: a = g (sin α − μ cos α)."""
    mu, alpha, down = 0.25, np.radians(25), about_y(25)
    rough = scene.add_material(friction=mu)
    scene.add_fixed("floor", [0, 0, 0], level_terrain(31, 11, [8, 6], material=rough), down)
    start = down.apply([-3.03, 0.37, 0.1])
    scene.add_body("box", start, box([0.3, 0.24, 0.2], material=rough), down * about_z(33))
    acceleration = G * (np.sin(alpha) - mu * np.cos(alpha))
    return Motion("box", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=1.9)


@CASES.add(allowed=1e-3)
def hull_slides_on_hull(scene):
    """A prism of nine sides slides down an inclined slab, both convex hulls of points: a = g (sin α − μ cos α)."""
    mu, alpha, down = 0.3, np.radians(27), about_y(27)
    rough = scene.add_material(friction=mu)
    slab = [[x, y, z] for x in (-5, 5) for y in (-1, 1) for z in (-0.1, 0.1)]
    scene.add_fixed("slab", down.apply([0, 0, -0.1]), convex(slab, material=rough), down)
    around = 2 * np.pi * np.arange(9) / 9
    prism = [[0.15 * np.cos(angle), 0.15 * np.sin(angle), z] for angle in around for z in (-0.1, 0.1)]
    start = down.apply([-3.5, 0, 0.1])
    scene.add_body("prism", start, convex(prism, material=rough), down)
    acceleration = G * (np.sin(alpha) - mu * np.cos(alpha))
    return Motion("prism", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=2.0)


@CASES.add(allowed=2e-3)
def compound_slides_over_seams(scene):
    """A body of two boxes slides over a slope of tiles that lie flush, as on a plane: a = g (sin α − μ cos α)."""
    mu, alpha, down = 0.2, np.radians(20), about_y(20)
    rough = scene.add_material(friction=mu)
    for number in range(-4, 8):
        place = down.apply([0.5 * number, 0, -0.05])
        scene.add_fixed(f"tile{number + 4}", place, box([0.5, 2, 0.1], material=rough), down)
    start = down.apply([-1.7, 0, 0.1])
    shapes = [box([0.2, 0.2, 0.2], position=[0.15, 0, 0], material=rough),
              box([0.1, 0.3, 0.2], position=[-0.1, 0, 0], material=rough)]
    scene.add_body("body", start, shapes, down * about_z(20), mass=2, inertia=inertia(0.02, 0.02, 0.02))
    acceleration = G * (np.sin(alpha) - mu * np.cos(alpha))
    return Motion("body", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=1.7)


@CASES.add(allowed=1e-2)
def bowl_of_terrain(scene):
    """A ball slides without friction in a spherical bowl of fine triangles, as a pendulum of the length l = R − r:
    l θ'' = −g sin θ. The triangles alone make some 2 mm of the error."""
    radius, r, size, count = 1.5, 0.05, 2.0, 161
    along = np.linspace(-size / 2, size / 2, count)
    heights = radius - np.sqrt(radius**2 - np.minimum(along**2 + along[::-1, None]**2, 1.9))
    scene.add_fixed("bowl", [0, 0, 0], height_field([size, size], heights))
    length = radius - r

    def place(theta):
        return [length * np.sin(theta), 0, radius - length * np.cos(theta)]

    scene.add_body("ball", place(0.3), sphere(r))
    swing = integrate(lambda t, y: [y[1], -G / length * np.sin(y[0])], [0.3, 0], longest=3.5)
    return Motion("ball", lambda t: place(swing.sol(t)[0]), end=3.0)
