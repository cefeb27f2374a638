# SPDX-License-Identifier: BSD-3-Clause
"""What touches and has joints, motors or springs: cars, pendulums that meet a stop, a bead on a rod, orbits, cams."""
import numpy as np

from .scenes import (G, STEPS, Cases, Motion, about_x, about_y, box, capsule, constant_acceleration, cylinder, end_of,
                     inertia, integrate, plane, sphere, state_at)

CASES = Cases()

BODY, WHEEL, WHEEL_INERTIA, RADIUS = 20.0, 1.0, 0.01, 0.15  #: of the car
CAR = BODY + 4 * WHEEL
HEIGHT = 0.3  #: of the mass centre of its body
AXLES = 0.5  #: before and behind the middle


def add_car(scene, mu, speed=0.0):
    """A body on four balls as wheels, which hinges hold: front1, front2, rear1, rear2. Returns the hinges."""
    rough = scene.add_material(friction=mu)
    scene.add_fixed("floor", [0, 0, 0], plane(material=rough))
    scene.add_body("body", [0, 0, HEIGHT], box([1.2, 0.4, 0.1], material=rough), velocity=[speed, 0, 0], mass=BODY,
                   inertia=inertia(1, 2, 2.5))
    hinges = []
    for name, x, y in (("front1", 1, 0.3), ("front2", 1, -0.3), ("rear1", -1, 0.3), ("rear2", -1, -0.3)):
        place = [x * AXLES, y, RADIUS]
        scene.add_body(name, place, sphere(RADIUS, material=rough), velocity=[speed, 0, 0], mass=WHEEL,
                       angular_velocity=[0, speed / RADIUS, 0], inertia=inertia(*[WHEEL_INERTIA] * 3))
        hinges.append(scene.add_joint("revolute", "body", name, place, [0, 1, 0]))
    return hinges


# The sudden stop of the wheels lifts the rear for a moment, by 1 mm, which the formula leaves out.
@CASES.add(allowed=1e-3)
def car_brakes(scene):
    """Motors stop the wheels of a car at 4 m/s at once, and it slides: a = −μ g until it stands."""
    mu, speed = 0.7, 4.0
    for hinge in add_car(scene, mu, speed):
        scene.add_motor(hinge, 0, speed=True, force_limit=1000)
    stands = speed / (mu * G)

    def position(t):
        return [speed * min(t, stands) - mu * G * min(t, stands)**2 / 2, 0, HEIGHT]

    return Motion("body", position, end=0.8)


@CASES.add(allowed=1e-3)
def car_is_pushed(scene):
    """A car rolls under a force F on its body: a = F / (M + 4 J/r²), with the mass M of all."""
    force = 30.0
    add_car(scene, 0.7)
    scene.add_load("body", force=[force, 0, 0])
    acceleration = force / (CAR + 4 * WHEEL_INERTIA / RADIUS**2)
    return Motion("body", constant_acceleration([0, 0, HEIGHT], [acceleration, 0, 0]), end=1.3)


# Not at 2 ms: four wheels on a plane are statically indeterminate, so the thrusts left and right, and the yaw, are not
# determined; the share of the diagonals drifts from rounding, and moves the car aside by up to 4 mm.
@CASES.add(allowed=1e-3, steps=STEPS[:2])
def car_with_rear_drive(scene):
    """Torques T between the body of a car and its rear wheels make these slip; the front ones roll. With the mass M and
    the height h of all and the axles at ±l, for a and the pressures N_r and N_f of the axles: (M + 2 J/r²) a = μ N_r,
    N_r + N_f = M g, and by the angular momentum about the floor (M h + 2 J/r) a + 2 T − μ r N_r = (N_r − N_f) l."""
    mu, torque = 0.4, 30.0
    add_car(scene, mu)
    for wheel in ("rear1", "rear2"):
        scene.add_load(wheel, torque=[0, torque, 0])
    scene.add_load("body", torque=[0, -2 * torque, 0])
    height = (BODY * HEIGHT + 4 * WHEEL * RADIUS) / CAR
    J, r = WHEEL_INERTIA, RADIUS
    matrix = [[CAR + 2 * J / r**2, -mu, 0], [0, 1, 1], [-(CAR * height + 2 * J / r), AXLES + mu * r, -AXLES]]
    acceleration = np.linalg.solve(matrix, [0, CAR * G, 2 * torque])[0]
    return Motion("body", constant_acceleration([0, 0, HEIGHT], [acceleration, 0, 0]), end=0.8)


@CASES.add(allowed=2e-3)
def bead_on_turning_rod(scene):
    """A bead slides without friction on an arm that a motor turns by ω, and bounces off the arm's end once: r'' = ω² r,
    so r = r₀ cosh ωt, and from r₁ and the speed v₁ there r = r₁ cosh ωs − (e v₁/ω) sinh ωs, which is r₁ again where
    tanh(ωs/2) = e v₁/(r₁ ω)."""
    omega, e, begin, meets_at = 3.0, 0.5, 0.2, 0.9
    bouncy = scene.add_material(restitution=e)
    small = {"mass": 0.5, "inertia": inertia(0.001, 0.001, 0.001), "angular_velocity": [0, 0, omega]}
    scene.add_body("arm", [0, 0, 0], box([0.02, 0.02, 0.02]), mass=1, inertia=inertia(1, 1, 1))
    scene.add_body("bead", [begin, 0, 0], sphere(0.05, material=bouncy), velocity=[0, omega * begin, 0], **small)
    scene.add_body("end", [1, 0, 0], sphere(0.05, material=bouncy), velocity=[0, omega, 0], **small)
    hinge = scene.add_joint("revolute", "world", "arm", [0, 0, 0], [0, 0, 1])
    scene.add_joint("prismatic", "arm", "bead", [begin, 0, 0], [1, 0, 0])
    scene.add_joint("fixed", "arm", "end", [1, 0, 0])
    scene.add_motor(hinge, {"linear": {"rate": omega}})
    meets = np.arccosh(meets_at / begin) / omega
    after = e * begin * omega * np.sinh(omega * meets)
    again = 2 / omega * np.arctanh(after / (meets_at * omega))

    def position(t):
        since = omega * (t - meets)
        r = begin * np.cosh(omega * t) if t < meets else meets_at * np.cosh(since) - after / omega * np.sinh(since)
        return [r * np.cos(omega * t), r * np.sin(omega * t), 0]

    return Motion("bead", position, end=0.95 * again + meets)


def swings(rates, start, stop, e, direction, count):
    """So many swings of a pendulum that begins at rest, and whose rate is turned by −e where its angle reaches `stop`,
    in this direction."""
    paths = [integrate(rates, [start, 0], until=lambda t, y: y[0] - stop, direction=direction)]
    while len(paths) < count:
        meets, (_, rate) = end_of(paths[-1])
        paths.append(integrate(rates, [stop, -e * rate], meets, direction=direction,
                               until=lambda t, y: y[0] - stop if t > meets else -direction))
    return paths


@CASES.add(allowed=2e-3)
def door_slams(scene):
    """A rod on a hinge falls from level on a fixed ball at θ = 50 degrees below, twice: (J + m d²) θ'' = m g d cos θ,
    and θ' becomes −e θ' there."""
    m, J, d, e, stop = 3.0, 0.2, 0.4, 0.6, np.radians(50)
    bouncy = scene.add_material(restitution=e, friction=0)
    scene.add_body("door", [d, 0, 0], capsule(0.02, 0.7, material=bouncy), about_y(90), mass=m,
                   inertia=inertia(J, J, 0.01))
    scene.add_joint("revolute", "world", "door", [0, 0, 0], [0, 1, 0])
    scene.add_fixed("stop", about_y(50).apply([0.6, 0, -0.07]), sphere(0.05, material=bouncy))
    paths = swings(lambda t, y: [y[1], m * G * d * np.cos(y[0]) / (J + m * d**2)], 0, stop, e, direction=1, count=3)

    def position(t):
        theta = state_at(paths, t)[0]
        return [d * np.cos(theta), 0, -d * np.sin(theta)]

    return Motion("door", position, end=end_of(paths[1])[0] + 0.1)


def pendulum_at_wall(scene, e):
    """A pendulum of length l begins at 50 degrees and meets a wall where it hangs: (J + m l²) θ'' = −m g l sin θ, and
    θ' becomes −e θ' at θ = 0."""
    m, J, length, begin = 1.0, 0.001, 0.8, np.radians(50)
    bouncy = scene.add_material(restitution=e)

    def place(theta):
        return [length * np.sin(theta), 0, -length * np.cos(theta)]

    scene.add_fixed("wall", [-1.05, 0, -0.8], box([2, 1, 1], material=bouncy))
    scene.add_body("bob", place(begin), sphere(0.05, material=bouncy), about_y(-50), mass=m, inertia=inertia(J, J, J))
    scene.add_joint("revolute", "world", "bob", [0, 0, 0], [0, 1, 0])
    factor = -m * G * length / (J + m * length**2)
    paths = swings(lambda t, y: [y[1], factor * np.sin(y[0])], begin, 0, e, direction=-1, count=6)
    return Motion("bob", lambda t: place(state_at(paths, t)[0]), end=3.7)


@CASES.add(allowed=3e-3)
def pendulum_bounces(scene):
    """A pendulum bounces off a wall with e = 0.8 (pendulum_at_wall has the equations)."""
    return pendulum_at_wall(scene, 0.8)


@CASES.add(allowed=3e-3)
def pendulum_bounces_elastically(scene):
    """A pendulum bounces off a wall with e = 1 (pendulum_at_wall has the equations)."""
    return pendulum_at_wall(scene, 1.0)


def orbit(scene, shape, radius, stiffness, speed):
    """Without gravity and friction, a ball goes round a fixed shape, on which a spring between the centres presses it:
    a circle at constant speed as long as k (r − l₀) > m v²/r."""
    r, rest, m = radius + 0.1, 0.2, 1.3
    assert stiffness * (r - rest) > m * speed**2 / r
    scene.set_gravity(0)
    scene.add_fixed("centre", [0, 0, 0], shape, about_x(90))
    J = 0.4 * m * 0.1**2
    scene.add_body("ball", [r, 0, 0], sphere(0.1), velocity=[0, 0, speed], mass=m, inertia=inertia(J, J, J))
    scene.add_spring("centre", "ball", stiffness, rest)
    rate = speed / r
    return Motion("ball", lambda t: [r * np.cos(rate * t), 0, r * np.sin(rate * t)], end=2.3)


@CASES.add(allowed=3e-3)
def orbit_of_sphere(scene):
    """A ball is pressed on a fixed one by a spring, and goes round it (orbit says how)."""
    return orbit(scene, sphere(0.9), 0.9, stiffness=400, speed=2.0)


@CASES.add(allowed=3e-3)
def orbit_of_cylinder(scene):
    """A ball is pressed on a fixed cylinder by a spring, and goes round it (orbit says how)."""
    return orbit(scene, cylinder(0.9, 1), 0.9, stiffness=400, speed=2.0)


@CASES.add(allowed=3e-3)
def fast_orbit(scene):
    """A fast ball goes round a smaller one, 10 rad/s (orbit says how)."""
    return orbit(scene, sphere(0.5), 0.5, stiffness=2000, speed=6.0)


def cam(scene, gravity, rate):
    """A ball on a hub, e beside its middle, lifts a flat follower that a spring presses on it: the lower face is at
    R + e sin(ω t) as long as k (l₀ − l) + m g > m e ω²."""
    e, R, half, m, stiffness, rest, top = 0.03, 0.1, 0.05, 0.5, 500.0, 1.5, 1.0
    start = R + half
    assert stiffness * (rest - top + start - e) + m * gravity > m * e * rate**2
    scene.set_gravity(gravity)
    scene.add_fixed("frame", [0, 0, top], box([0.1, 0.1, 0.02]))
    scene.add_body("cam", [e, 0, 0], sphere(R), velocity=[0, 0, e * rate], angular_velocity=[0, -rate, 0], mass=2,
                   inertia=inertia(0.02, 0.02, 0.02))
    scene.add_body("follower", [0, 0, start], box([0.4, 0.2, 2 * half]), velocity=[0, 0, e * rate], mass=m,
                   inertia=inertia(0.01, 0.01, 0.01))
    scene.add_motor(scene.add_joint("revolute", "frame", "cam", [0, 0, 0], [0, -1, 0]), {"linear": {"rate": rate}})
    scene.add_joint("prismatic", "frame", "follower", [0, 0, top], [0, 0, 1])
    scene.add_spring("frame", "follower", stiffness, rest)
    return Motion("follower", lambda t: [0, 0, start + e * np.sin(rate * t)], end=1.5)


@CASES.add(allowed=1e-4)
def cam_with_weight(scene):
    """A cam lifts a follower with weight and a spring (cam says how)."""
    return cam(scene, G, rate=12.0)


@CASES.add(allowed=1e-4)
def cam_without_weight(scene):
    """A cam moves a follower that a spring alone presses on it (cam says how)."""
    return cam(scene, 0.0, rate=12.0)


@CASES.add(allowed=1e-4)
def slow_cam_without_weight(scene):
    """The same at 5 rad/s."""
    return cam(scene, 0.0, rate=5.0)
