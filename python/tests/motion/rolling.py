# SPDX-License-Identifier: BSD-3-Clause
"""What rolls: balls, cylinders and wheels, on planes, terrain, tiles, each other, and over a bar."""
import numpy as np
from scipy.optimize import brentq

from .scenes import (G, Cases, Motion, about_x, about_y, box, capsule, constant_acceleration, cylinder, end_of, flight,
                     height_field, inertia, integrate, plane, sphere, state_at)

CASES = Cases()


def on_circle(radius, theta):
    """A point at the angle theta from the top."""
    return radius * np.array([np.sin(theta), 0, np.cos(theta)])


def along_circle(theta):
    return np.array([np.cos(theta), 0, -np.sin(theta)])


@CASES.add(allowed=1e-3)
def groove_sphere(scene):
    """A ball rolls down a groove of two planes at right angles, inclined by α. It rolls on circles of radius r/√2, so
    a = g sin α / (1 + 2 J/(m r²)) = g sin α / 1.8."""
    alpha, down, r = np.radians(20), about_y(20), 0.1
    rough = scene.add_material(friction=0.9)
    for name, side in (("left", 45), ("right", -45)):
        scene.add_fixed(name, [0, 0, 0], plane(material=rough), down * about_x(side))
    start = down.apply([0, 0, r * np.sqrt(2)])
    scene.add_body("ball", start, sphere(r, material=rough))
    acceleration = G * np.sin(alpha) / 1.8
    return Motion("ball", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=1.37)


@CASES.add(allowed=1.5e-3)
def plank_on_rollers(scene):
    """A plank of mass M lies on two rollers of mass m, and all roll down a slope: by Lagrange's equations the plank has
    a = g sin α (M + m) / (M + 3 m / 4)."""
    M, m, alpha, down, r, length = 4.0, 1.5, np.radians(8), about_y(8), 0.1, 0.5
    rough = scene.add_material(friction=0.8)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough), down)
    across = m * (r**2 / 4 + length**2 / 12)
    for name, x in (("roller1", -0.5), ("roller2", 0.6)):
        scene.add_body(name, down.apply([x, 0, r]), cylinder(r, length, material=rough), down * about_x(90), mass=m,
                       inertia=inertia(across, across, m * r**2 / 2))
    start = down.apply([0, 0, 2 * r + 0.03])
    scene.add_body("plank", start, box([3, 0.4, 0.06], material=rough), down, mass=M, inertia=inertia(0.1, 3, 3))
    acceleration = G * np.sin(alpha) * (M + m) / (M + 3 * m / 4)
    return Motion("plank", constant_acceleration(start, down.apply([acceleration, 0, 0])), end=1.0)


@CASES.add(allowed=1e-3)
def cylinder_rolls_up_and_back(scene):
    """A cylinder rolls up a slope at 2 m/s, stops, and rolls back: a = −(2/3) g sin α all the way."""
    alpha, up, r, speed = np.radians(15), about_y(-15), 0.12, 2.0
    rough = scene.add_material(friction=0.8)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough), up)
    start, velocity = up.apply([0, 0, r]), up.apply([speed, 0, 0])
    scene.add_body("cylinder", start, cylinder(r, 0.3, material=rough), up * about_x(90), velocity,
                   angular_velocity=[0, speed / r, 0])
    acceleration = up.apply([-2 / 3 * G * np.sin(alpha), 0, 0])
    return Motion("cylinder", constant_acceleration(start, acceleration, velocity), end=2.3)


@CASES.add(allowed=1e-3)
def ball_on_terrain(scene):
    """A ball rolls over the triangles of a flat inclined height field as on a plane, with a start across it:
    a = (5/7) g sin α."""
    alpha, down, r, across = np.radians(18), about_y(18), 0.07, 0.4
    rough = scene.add_material(friction=0.6)
    scene.add_fixed("floor", [0, 0, 0], height_field([8, 6], np.zeros((17, 23)), material=rough), down)
    start, velocity = down.apply([-3.03, 0.37, r]), down.apply([0, across, 0])
    scene.add_body("ball", start, sphere(r, material=rough), velocity=velocity,
                   angular_velocity=down.apply([-across / r, 0, 0]))
    acceleration = down.apply([5 / 7 * G * np.sin(alpha), 0, 0])
    return Motion("ball", constant_acceleration(start, acceleration, velocity), end=1.9)


@CASES.add(allowed=1e-3)
def cylinder_rolls_on_tiles(scene):
    """A cylinder rolls over a slope of tiles that lie flush, as on a plane: a = (2/3) g sin α."""
    alpha, down, r = np.radians(14), about_y(14), 0.11
    rough = scene.add_material(friction=0.7)
    for number in range(-4, 6):
        place = down.apply([0.63 * number, 0, -0.05])
        scene.add_fixed(f"tile{number + 4}", place, box([0.63, 2, 0.1], material=rough), down)
    start = down.apply([-2.2, 0.1, r])
    scene.add_body("cylinder", start, cylinder(r, 0.3, material=rough), down * about_x(90))
    acceleration = down.apply([2 / 3 * G * np.sin(alpha), 0, 0])
    return Motion("cylinder", constant_acceleration(start, acceleration), end=2.0)


@CASES.add(allowed=1e-3)
def ball_along_wall_and_floor(scene):
    """A ball rolls down inclined terrain and touches a wall without friction all the way: a = (5/7) g sin α."""
    alpha, down, r = np.radians(10), about_y(10), 0.1
    rough = scene.add_material(friction=0.8)
    scene.add_fixed("floor", [0, 0, 0], height_field([10, 2], np.zeros((9, 21)), material=rough), down)
    scene.add_fixed("wall", down.apply([0, -0.15, 0.3]), box([10, 0.1, 0.6]), down)
    start = down.apply([-4, 0, r])
    scene.add_body("ball", start, sphere(r, material=rough), velocity=[0, 0, 0])
    acceleration = down.apply([5 / 7 * G * np.sin(alpha), 0, 0])
    return Motion("ball", constant_acceleration(start, acceleration), end=2.2)


@CASES.add(allowed=1e-5)
def ball_of_a_millimetre(scene):
    """A ball of 1 mm rolls down a plane: a = (5/7) g sin α."""
    alpha, down, r = np.radians(30), about_y(30), 0.0005
    rough = scene.add_material(friction=0.6)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough), down)
    start = down.apply([0, 0, r])
    scene.add_body("ball", start, sphere(r, material=rough))
    acceleration = down.apply([5 / 7 * G * np.sin(alpha), 0, 0])
    return Motion("ball", constant_acceleration(start, acceleration), end=0.1)


@CASES.add(allowed=2e-3)
def cylinder_on_capsule(scene):
    """A cylinder of radius r rolls off the top of a fixed capsule of radius R, parallel to it, 8 degrees off:
    (R + r) θ'' = (2/3) g sin θ. It ends before it slips, where it needs the friction g sin θ / 3 = 1.4 N, with the
    pressure N = g cos θ − (R + r) θ'²."""
    R, r, mu, begin = 0.4, 0.15, 1.5, np.radians(8)
    distance = R + r
    rough = scene.add_material(friction=mu)
    scene.add_fixed("below", [0, 0, 0], capsule(R, 2, material=rough), about_x(90))
    scene.add_body("cylinder", on_circle(distance, begin), cylinder(r, 0.5, material=rough), about_x(90))

    def reserve(t, y):
        return 1.4 * (G * np.cos(y[0]) - distance * y[1]**2) - G * np.sin(y[0]) / 3

    roll = integrate(lambda t, y: [y[1], 2 / 3 * G / distance * np.sin(y[0])], [begin, 0], until=reserve)
    return Motion("cylinder", lambda t: on_circle(distance, roll.sol(t)[0]), end=end_of(roll)[0])


@CASES.add(allowed=3e-3)
def roll_off_sphere(scene):
    """A ball of radius r on the top of a fixed one of radius R, 12 degrees off. With the speed v = (R + r) θ' and the
    pressure N = g cos θ − v²/(R + r): it rolls, v' = (5/7) g sin θ, while that needs less friction, (2/7) g sin θ, than
    μ N; it slips, v' = g sin θ − μ N, while N > 0; then it flies."""
    distance, r, mu, m, begin = 1.1, 0.1, 0.9, 1.0, np.radians(12)
    J = 0.4 * m * r**2
    rough = scene.add_material(friction=mu)
    scene.add_fixed("below", [0, 0, 0], sphere(distance - r, material=rough))
    scene.add_body("ball", on_circle(distance, begin), sphere(r, material=rough), mass=m, inertia=inertia(J, J, J))

    def pressure(t, y):
        return G * np.cos(y[0]) - y[1]**2 / distance

    def reserve(t, y):
        return mu * pressure(t, y) - 2 / 7 * G * np.sin(y[0])

    def rolls(t, y):
        return [y[1] / distance, 5 / 7 * G * np.sin(y[0])]

    def slips(t, y):
        return [y[1] / distance, G * np.sin(y[0]) - mu * max(pressure(t, y), 0)]

    roll = integrate(rolls, [begin, 0], until=reserve)
    slip_begins, state = end_of(roll)
    slip = integrate(slips, state, slip_begins, until=pressure)
    leaves, (theta, speed) = end_of(slip)
    fly = flight(on_circle(distance, theta), speed * along_circle(theta), leaves)

    def position(t):
        return on_circle(distance, state_at([roll, slip], t)[0]) if t < leaves else fly(t)

    return Motion("ball", position, end=leaves + 0.4)


WHEEL, BAR = 0.3, 0.03  #: radii
WHEEL_INERTIA = WHEEL**2 / 2  #: of 1 kg
DISTANCE = WHEEL + BAR  #: of the centres where they touch


def roll_against_bar(scene, speed):
    """A wheel of 1 kg rolls against a bar that is sunk by half into the floor. Returns the time when it meets the bar,
    and the angle θ of the wheel's centre from above the bar there."""
    start = -1.0
    rough = scene.add_material(friction=2)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))
    scene.add_fixed("bar", [0, 0, 0], capsule(BAR, 1, material=rough), about_x(90))
    across = WHEEL**2 / 4 + 0.2**2 / 12
    scene.add_body("wheel", [start, 0, WHEEL], cylinder(WHEEL, 0.2, material=rough), about_x(90), mass=1,
                   velocity=[speed, 0, 0], angular_velocity=[0, speed / WHEEL, 0],
                   inertia=inertia(across, across, WHEEL_INERTIA))
    half_width = np.sqrt(DISTANCE**2 - WHEEL**2)
    return (-half_width - start) / speed, -np.arcsin(half_width / DISTANCE)


def spin_after(theta, velocity, spin):
    """The spin of the wheel when it begins to roll about the bar: the collision keeps the angular momentum about the
    point of contact, m R v_t + J ω."""
    return (WHEEL * velocity @ along_circle(theta) + WHEEL_INERTIA * spin) / (WHEEL_INERTIA + WHEEL**2)


@CASES.add(allowed=2e-3)
def wheel_over_bar(scene):
    """A wheel rolls at 2 m/s against a low bar. The collision keeps the angular momentum about the point of contact;
    the wheel is then too fast to stay on the bar, (R + r) θ'² > g cos θ: it flies, touches the bar once more, likewise,
    and flies on."""
    speed = 2.0
    meets, theta = roll_against_bar(scene, speed)
    spin = spin_after(theta, np.array([speed, 0, 0]), speed / WHEEL)
    first = flight(on_circle(DISTANCE, theta), WHEEL * spin * along_circle(theta), meets)
    again = brentq(lambda t: np.linalg.norm(first(t)) - DISTANCE, meets + 0.1, meets + 0.15)
    place, velocity = first(again), WHEEL * spin * along_circle(theta) + [0, 0, -G * (again - meets)]
    theta = np.arctan2(place[0], place[2])
    velocity = WHEEL * spin_after(theta, velocity, spin) * along_circle(theta)
    second = flight(place, velocity, again)
    falls = (velocity[2] + np.sqrt(velocity[2]**2 + 2 * G * (place[2] - WHEEL))) / G

    def position(t):
        if t < meets:
            return [speed * t - 1, 0, WHEEL]
        return first(t) if t < again else second(t)

    return Motion("wheel", position, end=again + 0.97 * falls)


@CASES.add(allowed=2e-3)
def slow_wheel_over_bar(scene):
    """A wheel rolls at 1.6 m/s against a low bar. The collision keeps the angular momentum about the point of contact;
    the wheel then rolls over the bar, (R + r) (1 + J/(m R²)) θ'' = g sin θ, until it is as far behind it."""
    speed = 1.6
    meets, theta = roll_against_bar(scene, speed)
    rate = WHEEL * spin_after(theta, np.array([speed, 0, 0]), speed / WHEEL) / DISTANCE
    roll = integrate(lambda t, y: [y[1], G * np.sin(y[0]) / DISTANCE / (1 + WHEEL_INERTIA / WHEEL**2)], [theta, rate],
                     meets, until=lambda t, y: y[0] + theta)

    def position(t):
        return [speed * t - 1, 0, WHEEL] if t < meets else on_circle(DISTANCE, roll.sol(t)[0])

    return Motion("wheel", position, end=0.995 * end_of(roll)[0])


@CASES.add(allowed=2e-3)
def roly_poly(scene):
    """A ball of radius r whose mass centre is d below its middle rolls to and fro from 25 degrees; by Lagrange's
    equation (J + m (r² + d² − 2 r d cos θ)) θ'' = −m g d sin θ − m r d sin θ θ'²."""
    r, d, m, J, begin = 0.3, 0.08, 2.0, 0.05, np.radians(25)
    rough = scene.add_material(friction=1)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))

    def place(theta):
        return np.array([r * (theta - begin) - d * np.sin(theta), 0, r - d * np.cos(theta)])

    scene.add_body("ball", place(begin), sphere(r, position=[0, 0, d], material=rough), about_y(25), mass=m,
                   inertia=inertia(J, J, J))

    def rates(t, y):
        theta, rate = y
        turned = J + m * (r**2 + d**2 - 2 * r * d * np.cos(theta))
        return [rate, -m * d * np.sin(theta) * (G + r * rate**2) / turned]

    swing = integrate(rates, [begin, 0], longest=4.5)
    return Motion("ball", lambda t: place(swing.sol(t)[0]), end=4.0)
