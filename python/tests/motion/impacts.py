# SPDX-License-Identifier: BSD-3-Clause
"""What collides: single, repeated and oblique impacts, with and without friction. Restitution is Newton's."""
import numpy as np

from .scenes import (G, Cases, Motion, about_x, about_y, box, capsule, end_of, flight, inertia, integrate, plane,
                     sphere)

CASES = Cases()


@CASES.add(allowed=1e-3)
def rod_hits_knob(scene):
    """A level rod falls 0.3 m on a knob that is d beside its middle, elastically: with J about its middle the impulse
    is 2 v / (1/m + d²/J), and the mass centre then flies."""
    m, J, d, height = 1.0, 0.1, 0.3, 0.3
    elastic = scene.add_material(restitution=1, friction=0)
    scene.add_fixed("knob", [d, 0, 0], sphere(0.1, material=elastic))
    scene.add_body("rod", [0, 0, 0.12 + height], capsule(0.02, 1, material=elastic), about_y(90), mass=m,
                   inertia=inertia(J, J, 0.01))
    meets = np.sqrt(2 * height / G)
    speed = G * meets
    after = -speed + 2 * speed / (1 / m + d**2 / J) / m
    falls, flies = flight([0, 0, 0.12 + height], [0, 0, 0], 0), flight([0, 0, 0.12], [0, 0, after], meets)
    return Motion("rod", lambda t: falls(t) if t < meets else flies(t), end=meets + 0.15)


def last_of_row(masses, places, speed, diameter, end):
    """position(t) of the last of balls in a row, of which the first one moves, after all elastic collisions of two."""
    places, speeds = np.array(places), np.array([speed] + [0.0] * (len(masses) - 1))
    now, pieces = 0.0, []
    while now < end:
        closing = speeds[:-1] - speeds[1:]
        gaps = np.diff(places) - diameter
        waits = [gap / rate if rate > 1e-12 else np.inf for gap, rate in zip(gaps, closing)]
        i = int(np.argmin(waits))
        pieces.append((now + waits[i], now, places[-1], speeds[-1]))
        if waits[i] == np.inf:
            break
        places, now = places + waits[i] * speeds, now + waits[i]
        first, second = masses[i], masses[i + 1]
        common = (first * speeds[i] + second * speeds[i + 1]) / (first + second)
        speeds[i:i + 2] = 2 * common - speeds[i:i + 2]

    def position(t):
        _, begin, place, rate = next(piece for piece in pieces if t <= piece[0])
        return [place + rate * (t - begin), 0, 0]

    return position


@CASES.add(allowed=1e-3)
def elastic_row(scene):
    """Without gravity, a ball meets a row of three others of different masses, with gaps: elastic collisions of two,
    one after another, each of which turns the velocities about their common mean."""
    masses, places, r, speed, end = (1.0, 2.0, 0.5, 3.0), (0.0, 0.5, 1.1, 1.9), 0.05, 3.0, 1.7
    scene.set_gravity(0)
    elastic = scene.add_material(restitution=1)
    for number, (mass, place) in enumerate(zip(masses, places)):
        scene.add_body(f"ball{number}", [place, 0, 0], sphere(r, material=elastic), mass=mass,
                       velocity=[speed if number == 0 else 0, 0, 0], inertia=inertia(0.01, 0.01, 0.01))
    return Motion("ball3", last_of_row(masses, places, speed, 2 * r, end), end)


@CASES.add(allowed=1e-3)
def two_balls_collide_on_floor(scene):
    """A ball that slides on a floor without friction hits an equal one obliquely: along the line of centres n it loses
    (1 + e)/2 of its velocity, across nothing."""
    r, speed, e, start, offset = 0.05, 2.0, 0.9, -0.7, 0.03
    smooth = scene.add_material(friction=0, restitution=e)
    scene.add_fixed("floor", [0, 0, 0], plane())
    keys = {"mass": 1, "inertia": inertia(0.001, 0.001, 0.001)}
    scene.add_body("first", [start, offset, r], sphere(r, material=smooth), velocity=[speed, 0, 0], **keys)
    scene.add_body("second", [0, 0, r], sphere(r, material=smooth), **keys)
    before = np.sqrt((2 * r)**2 - offset**2)
    meets = (-before - start) / speed
    n = np.array([before, -offset, 0]) / (2 * r)
    after = np.array([speed, 0, 0]) - (1 + e) / 2 * speed * n[0] * n

    def position(t):
        return np.array([start + speed * min(t, meets), offset, r]) + after * max(t - meets, 0)

    return Motion("first", position, end=1.2)


@CASES.add(allowed=2e-3)
def ball_in_box(scene):
    """Without gravity, a ball bounces elastically between six planes: in each coordinate a zigzag between the walls."""
    start, velocity, r = np.array([0.1, 0.05, -0.2]), np.array([2.3, -1.7, 3.1]), 0.07
    scene.set_gravity(0)
    elastic = scene.add_material(restitution=1, friction=0)
    walls = np.array([0.5, 0.6, 0.7])
    turns = ((about_y(-90), about_y(90)), (about_x(90), about_x(-90)), (about_x(180), about_x(0)))  # z inwards
    for axis, both in enumerate(turns):
        for side, turn in zip((1, -1), both):
            scene.add_fixed(f"wall{axis}{side}", side * walls[axis] * np.eye(3)[axis], plane(material=elastic), turn)
    scene.add_body("ball", start, sphere(r, material=elastic), velocity=velocity)
    reach = walls - r

    def position(t):
        way = (start + velocity * t + reach) % (4 * reach)
        return np.minimum(way, 4 * reach - way) - reach

    return Motion("ball", position, end=3.3)


@CASES.add(allowed=2e-3)
def box_drops_on_edge(scene):
    """A box that is tilted by 20 degrees falls 0.2 m on one edge, which sticks: the angular momentum about the edge
    stays, m x v = (J + m r²) θ', then (J + m r²) θ'' = m g r sin θ until the box lies flat."""
    a, b, m, height = 0.1, 0.15, 1.0, 0.2  # half edges
    J, r = m * (a**2 + b**2) / 3, np.hypot(a, b)
    tilt = about_y(20)
    edge = tilt.apply([a, 0, -b])
    start = np.array([0, 0, height - edge[2]])
    rough = scene.add_material(friction=5)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))
    scene.add_body("box", start, box([2 * a, 0.3, 2 * b], material=rough), tilt, mass=m,
                   inertia=inertia(0.015, J, 0.01))
    meets = np.sqrt(2 * height / G)
    rate = -edge[0] * m * G * meets / (J + m * r**2)
    turning = integrate(lambda t, y: [y[1], m * G * r * np.sin(y[0]) / (J + m * r**2)],
                        [np.arctan2(-edge[0], -edge[2]), rate], meets, until=lambda t, y: y[0] + np.arctan2(a, b))
    fall = flight(start, [0, 0, 0], 0)

    def position(t):
        if t < meets:
            return fall(t)
        theta = turning.sol(t)[0]
        return [edge[0] + r * np.sin(theta), 0, r * np.cos(theta)]

    return Motion("box", position, end=0.99 * end_of(turning)[0])


def bouncing_ball(scene, e, mu, speed, spin):
    """A ball of radius r falls 0.7 m on a floor, with the speed v along it and the spin ω: each impact has the normal
    impulse m (1 + e) |v_z|, and along the floor the one that stops the point of contact, (2/7) m (v − r ω), or μ times
    the normal one if that is less."""
    r, m, height, longest = 0.1, 1.0, 0.7, 2.2
    J = 0.4 * m * r**2
    material = scene.add_material(friction=mu, restitution=e)
    scene.add_fixed("floor", [0, 0, 0], plane(material=material))
    scene.add_body("ball", [0, 0, r + height], sphere(r, material=material), velocity=[speed, 0, 0],
                   angular_velocity=[0, spin, 0], mass=m, inertia=inertia(J, J, J))
    now, place, velocity, arcs = 0.0, np.array([0.0, 0.0, r + height]), np.array([speed, 0.0, 0.0]), []
    while now < longest and (not arcs or velocity[2] > 1e-3):
        falling = np.sqrt(velocity[2]**2 + 2 * G * (place[2] - r))
        arc, lasts = flight(place, velocity, now), (velocity[2] + falling) / G
        now += lasts
        arcs.append((now, arc))
        place = np.array([place[0] + velocity[0] * lasts, 0, r])
        slip = velocity[0] - spin * r
        impulse = min(mu * (1 + e) * falling, 2 / 7 * abs(slip)) * np.sign(slip)
        velocity = np.array([velocity[0] - impulse, 0, e * falling])
        spin += impulse * r * m / J
    return Motion("ball", lambda t: next(arc for lands, arc in arcs if t <= lands)(t), end=min(longest, now - 1e-3))


@CASES.add(allowed=2e-3)
def bounces_that_slip(scene):
    """A fast ball without spin bounces on a slippery floor (bouncing_ball has the formulas)."""
    return bouncing_ball(scene, e=0.7, mu=0.1, speed=4.0, spin=0.0)


@CASES.add(allowed=2e-3)
def bounces_that_stick(scene):
    """A ball with topspin bounces on a rough floor (bouncing_ball has the formulas)."""
    return bouncing_ball(scene, e=0.8, mu=0.6, speed=2.0, spin=30.0)


@CASES.add(allowed=2e-3)
def elastic_bounces_with_backspin(scene):
    """A ball with backspin bounces elastically on a rough floor (bouncing_ball has the formulas)."""
    return bouncing_ball(scene, e=1.0, mu=0.5, speed=1.5, spin=-40.0)
