# SPDX-License-Identifier: BSD-3-Clause
"""Systems written in Python: orders of all timesteppers, agreement with the built-in systems, and mistakes."""
import math
import os
import signal
import threading
import time
import traceback
import unittest
import warnings

import delassus
import numpy as np
import scipy.sparse
from delassus import Cone, DynamicalSystem, State, Unilateral

GRAVITY = 9.81
#: Methods of Newton's kind leave the error of their iteration beside that of their order.
EXACT = {name: "(newton_tolerance=1e-12)" for name in
         ("euler_implicit", "trapezoidal", "newmark", "hht", "generalized_alpha", "nonsmooth_generalized_alpha",
          "radau_iia")}
#: Order of those whose options have to be chosen for their asymptotic range.
EXACT.update({name: "(linearization_limit=inf)" for name in ("trapezoidal_linearized", "linearly_implicit_trapezoidal")})


class Duffing(DynamicalSystem):
    """A spring that hardens, with damping that grows with the deflection, and a push: derivatives by differences."""

    def initial_state(self):
        return [1.0, 0.2], [0.0, -0.5]

    def mass(self, state):
        return np.diag([1.0 + 0.2 * state.q[0] ** 2, 2.0])

    def force(self, state):
        (x, y), (vx, vy) = state.q, state.v
        return np.array([-3.0 * x - x**3 - 0.3 * (1.0 + y * y) * vx + 0.5 * math.cos(2.0 * state.t),
                         2.0 * x - 4.0 * y - 0.1 * vy])


class DuffingByHand(Duffing):
    def stiffness(self, state):
        (x, y), (vx, _) = state.q, state.v
        return scipy.sparse.csr_matrix([[3.0 + 3.0 * x * x, 0.6 * y * vx], [-2.0, 4.0]])

    def damping(self, state):
        return np.diag([0.3 * (1.0 + state.q[1] ** 2), 0.1])

    def inertial_stiffness(self, state, acceleration):
        return np.array([[0.4 * state.q[0] * acceleration[0], 0.0], [0.0, 0.0]])


class Pendulum(DynamicalSystem):
    """A body of 1 kg and 0.1 kg m² on a hinge at the origin, in maximal coordinates (x, z, angle about y)."""

    def initial_state(self):
        return np.array([1.0, 0.0, 0.0]), np.zeros(3)

    def mass(self, state):
        return np.diag([1.0, 1.0, 0.1])

    def force(self, state):
        return np.array([0.0, -GRAVITY, 0.0])

    def constraint(self, state):  # the hinge is at (−1, 0) in the body's frame; y turns z to x
        x, z, angle = state.q
        return np.array([x - math.cos(angle), z + math.sin(angle)])

    def constraint_jacobian(self, state):
        angle = state.q[2]
        return np.array([[1.0, 0.0, math.sin(angle)], [0.0, 1.0, math.cos(angle)]])

    def energy(self, state):
        return 0.5 * state.v @ self.mass(state) @ state.v + GRAVITY * state.q[1]


class PendulumByHand(Pendulum):
    has_stiffness = False

    def constraint_rate(self, state):
        return np.zeros(2)

    def constraint_curvature(self, state):
        angle, speed = state.q[2], state.v[2]
        return speed**2 * np.array([math.cos(angle), -math.sin(angle)])

    def constraint_stiffness(self, state, multipliers):
        angle = state.q[2]
        result = np.zeros((3, 3))
        result[2, 2] = multipliers[0] * math.cos(angle) - multipliers[1] * math.sin(angle)
        return result

    def definite_constraint_stiffness(self, state, multipliers):
        return np.zeros((3, 3))


PENDULUM = {"bodies": [{"name": "bob", "mass": 1.0, "position": [1, 0, 0], "inertia": {"xx": 0.1, "yy": 0.1, "zz": 0.1}}],
            "joints": [{"name": "hinge", "kind": "revolute", "second": "bob", "point": [0, 0, 0], "axis": [0, 1, 0]}],
            "step": 0.005, "end": 0.5, "coordinates": "maximal"}


class Ball(DynamicalSystem):
    """A ball of 2 kg and radius 0.1 m over the ground, with friction; orientation as unit quaternion."""

    radius, restitution, friction = 0.1, 0.6, 0.0
    recovery_speed = 0.01 * math.sqrt(10 * GRAVITY * 0.1)
    has_stiffness = False

    def __init__(self, height=0.5, velocity=(0.3, 0.0, 0.0)):
        self.start = np.array([0.0, 0.0, height]), np.array(velocity)

    def initial_state(self):
        return State(0.0, *self.start)

    def mass(self, state):
        return 2.0 * scipy.sparse.identity(3)

    def force(self, state):
        return np.array([0.0, 0.0, -2.0 * GRAVITY])

    def unilateral(self, state, h):
        gap = state.q[2] - self.radius
        if gap > 0.05:
            return []
        normal = np.array([[0.0, 0.0, 1.0]])
        return [Unilateral(Cone.nonnegative(), normal, gap=gap, key=7, restitution=self.restitution)]


class Orders(unittest.TestCase):
    def measure(self, system, method, end, counts, reference):
        errors = []
        for count in counts:
            run = delassus.simulate(system, integrator=method + EXACT.get(method, ""), step=end / count, end=end,
                                    solver={"name": "auto", "tolerance": 1e-12})
            self.assertEqual(run.status, "finished", (method, run.message))
            errors.append(np.abs(run.positions[-1] - reference.positions[-1]).max()
                          + np.abs(run.velocities[-1] - reference.velocities[-1]).max())
        if max(errors) < 1e-8:
            return None  # of a method that takes shorter steps than those it is given
        return np.log2(np.array(errors[:-1]) / errors[1:])

    def expect(self, order, found, method):
        if method == "switching":
            self.assertIsNone(found)
            return
        self.assertGreater(found[-1], order - (0.35 if order > 2 else 0.2), (method, found))
        self.assertLess(found[-1], order + (1.1 if order > 2 else 0.3), (method, found))

    def test_every_timestepper_on_an_oscillator(self):
        reference = delassus.simulate(DuffingByHand(), integrator="dormand_prince", step=0.01, end=2.0)
        seen = set()
        for row in delassus.timesteppers():
            method, order = row["name"], row["order"]
            counts = (10, 20, 40) if order > 2 else (80, 160, 320)
            self.expect(order, self.measure(DuffingByHand(), method, 2.0, counts, reference), method)
            seen.add(method)
        self.assertGreaterEqual(len(seen), 15)

    def test_differences_serve_where_there_are_no_derivatives(self):
        reference = delassus.simulate(DuffingByHand(), integrator="dormand_prince", step=0.01, end=2.0)
        for method, order in (("euler_implicit_linearized", 1), ("trapezoidal_linearized", 2), ("hht", 2),
                              ("radau_iia", 5)):
            counts = (10, 20, 40) if order > 2 else (80, 160, 320)
            self.expect(order, self.measure(Duffing(), method, 2.0, counts, reference), method)

    def test_every_timestepper_with_a_constraint(self):
        reference = delassus.simulate(PendulumByHand(), integrator="rk4", step=0.0005, end=1.0)
        for row in delassus.timesteppers():
            method, order = row["name"], row["order"]
            if not row["constraints"]:
                with self.assertRaisesRegex(delassus.Unsupported, "takes no constraints"):
                    delassus.simulate(PendulumByHand(), integrator=method, step=0.01, end=1.0)
                continue
            counts = (20, 40, 80) if order > 2 else (200, 400, 800)
            self.expect(order, self.measure(PendulumByHand(), method, 1.0, counts, reference), method)


class Agreement(unittest.TestCase):
    def test_a_pendulum_is_that_of_the_scene(self):
        for method in ("euler_implicit_linearized", "euler_implicit(newton_tolerance=1e-13)",
                       "generalized_alpha(newton_tolerance=1e-13)", "moreau_jean", "rk4", "dormand_prince",
                       "radau_iia(newton_tolerance=1e-13)"):
            settings = {"integrator": method, "solver": {"name": "cholmod", "tolerance": 1e-13}}
            scene = delassus.simulate(delassus.Scene({**PENDULUM, "solver": settings["solver"]}, integrator=method))
            own = delassus.simulate(PendulumByHand(), step=0.005, end=0.5, **settings)
            self.assertEqual((scene.status, own.status), ("finished", "finished"), method)
            np.testing.assert_array_equal(own.time, scene.time)
            np.testing.assert_allclose(own.positions[:, :2], scene.body("bob")[:, [0, 2]], rtol=0, atol=1e-12,
                                       err_msg=method)
            np.testing.assert_allclose(own.velocities, scene.twist("bob")[:, [0, 2, 4]], rtol=0, atol=1e-12,
                                       err_msg=method)
            np.testing.assert_allclose(own.energy, scene.energy, rtol=0, atol=1e-11, err_msg=method)

    def test_a_bouncing_ball_is_that_of_the_scene(self):
        ball = {"name": "ball", "mass": 2.0, "position": [0, 0, 0.5], "velocity": [0.3, 0, 0],
                "shapes": [{"sphere": {"radius": 0.1}, "material": "rubber"}]}
        scene = {"materials": {"rubber": {"restitution": 0.6}}, "step": 0.005, "end": 1.0, "envelope": 0.05,
                 "bodies": [{"name": "ground", "fixed": True, "shapes": [{"plane": {}, "material": "rubber"}]}, ball]}
        solver = {"name": "ssn", "tolerance": 1e-13}
        for method in ("euler_implicit_linearized", "moreau_jean", "nonsmooth_generalized_alpha",
                       "linearly_implicit_trapezoidal"):
            built_in = delassus.simulate({**scene, "integrator": method, "solver": solver})
            own = delassus.simulate(Ball(), integrator=method, solver=solver, step=0.005, end=1.0)
            self.assertEqual((built_in.status, own.status), ("finished", "finished"), method)
            np.testing.assert_allclose(own.positions, built_in.body("ball")[:, :3], rtol=0, atol=1e-12, err_msg=method)
            np.testing.assert_allclose(own.velocities, built_in.twist("ball")[:, :3], rtol=0, atol=1e-12,
                                       err_msg=method)
            self.assertGreater(np.sum(np.diff(np.sign(own.velocities[:, 2])) > 0), 1, "it does not bounce")
            self.assertGreater(len(own.contacts["key"]), 0)
            self.assertEqual(set(own.contacts["key"].tolist()), {7})

    def test_friction_holds_and_slides(self):
        class Block(DynamicalSystem):
            has_stiffness = False

            def __init__(self, push):
                self.push = push

            def initial_state(self):
                return np.zeros(3), np.zeros(3)

            def mass(self, state):
                return np.eye(3)

            def force(self, state):
                return np.array([-GRAVITY, self.push, 0.0])

            def unilateral(self, state, h):
                return [Unilateral(Cone.friction(0.5), np.eye(3), gap=state.q[0])]

        for push, speed in ((4.0, 0.0), (6.0, 6.0 - 0.5 * GRAVITY)):
            run = delassus.simulate(Block(push), step=0.01, end=1.0)
            np.testing.assert_allclose(run.velocities[-1], [0.0, speed, 0.0], atol=1e-7)
            np.testing.assert_allclose(run.contacts["force"][-1], [GRAVITY, -min(push, 0.5 * GRAVITY), 0.0], atol=1e-5)


class Turning(unittest.TestCase):
    def test_a_group_of_ones_own(self):
        """A free top in unit quaternions keeps its energy and its spatial angular momentum."""
        inertia = np.array([1.0, 2.0, 3.0])

        def product(p, q):
            return np.concatenate([[p[0] * q[0] - p[1:] @ q[1:]],
                                   p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])

        class Top(DynamicalSystem):
            def initial_state(self):
                return [1.0, 0.0, 0.0, 0.0], [1.0, 4.0, 0.5]

            def increment(self, q, delta):
                angle = np.linalg.norm(delta)
                return product(q, np.concatenate([[np.cos(angle / 2)], 0.5 * np.sinc(angle / 2 / np.pi) * delta]))

            def difference(self, q_from, q_to):
                turn = product(q_from * [1, -1, -1, -1], q_to)
                size = np.linalg.norm(turn[1:])
                return 2.0 * np.arctan2(size, turn[0]) * turn[1:] / size if size > 0 else np.zeros(3)

            def inverse_tangent(self, delta):
                angle = np.linalg.norm(delta)
                cross = np.cross(delta, np.eye(3)).T
                half = 0.5 * angle
                factor = 1 / 12 if angle < 1e-4 else (1.0 - half / np.tan(half)) / angle**2
                return [(0, np.eye(3) + 0.5 * cross + factor * cross @ cross)]

            def mass(self, state):
                return np.diag(inertia)

            def force(self, state):
                return -np.cross(state.v, inertia * state.v)

            def energy(self, state):
                return 0.5 * inertia @ state.v**2

        def momentum(q, v):
            turned = product(product(q, np.concatenate([[0.0], inertia * v])), q * [1, -1, -1, -1])
            return turned[1:]

        for method in ("rk4", "radau_iia(newton_tolerance=1e-12)"):
            run = delassus.simulate(Top(), integrator=method, step=0.01, end=2.0)
            self.assertEqual(run.positions.shape, (201, 4))
            np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-6)
            np.testing.assert_allclose(momentum(run.positions[-1], run.velocities[-1]),
                                       momentum(run.positions[0], run.velocities[0]), atol=1e-5)


class Derivatives(unittest.TestCase):
    def test_they_are_judged(self):
        for system in (DuffingByHand(), PendulumByHand()):
            errors = system.derivative_errors(State(0.3, system.initial_state()[0], np.array(
                [0.7, -0.4, 1.3][:len(system.initial_state()[1])])))
            self.assertGreater(len(errors), 2)
            self.assertLess(max(errors.values()), 1e-7, errors)

        class Wrong(DuffingByHand):
            def damping(self, state):
                return -super().damping(state)

        self.assertGreater(Wrong().derivative_errors()["damping"], 1.0)


class Mistakes(unittest.TestCase):
    def expect(self, sentence, error=delassus.InputError, **methods):
        with self.assertRaisesRegex(error, sentence):
            delassus.simulate(type("Own", (Duffing,), methods)(), step=0.1, end=0.2, integrator="euler_implicit_linearized")

    def test_wrong_shapes_name_the_method(self):
        self.expect(r"Own.force\(\) returned an array of shape \(3,\); it must be \(2,\), \(n,\)",
                    force=lambda self, state: np.zeros(3))
        self.expect(r"Own.mass\(\) returned a matrix of shape \(2,\); it must be \(2, 2\)",
                    mass=lambda self, state: np.ones(2))
        self.expect(r"Own.stiffness\(\) returned a matrix of shape \(3, 2\)",
                    stiffness=lambda self, state: scipy.sparse.csr_matrix((3, 2)))
        self.expect(r"Own.force\(\) returned None", force=lambda self, state: None)
        self.expect(r"Own.force\(\) returned values of type", force=lambda self, state: ["a", "b"])
        self.expect("has a method constraint; it must have constraint_jacobian",
                    constraint=lambda self, state: np.zeros(1))
        self.expect(r"Own.initial_state\(\) has 3 positions and 2 velocities",
                    initial_state=lambda self: (np.zeros(3), np.zeros(2)))
        self.expect("must have both or none", increment=lambda self, q, delta: q + delta)
        self.expect(r"Own.unilateral\(\)\[0\] is of type tuple", unilateral=lambda self, state, h: [(1, 2)])
        self.expect(r"Own.unilateral\(\)\[0\].jacobian is of shape \(1, 2\); it must be \(3, 2\)",
                    unilateral=lambda self, state, h: [Unilateral(Cone.friction(0.1), np.zeros((1, 2)))])
        self.expect(r"Own.unilateral\(\) returned a NoneType; it must be a list", unilateral=lambda self, state, h: None)
        self.expect("restitution is 2; it must be in", unilateral=lambda self, state, h: [
            Unilateral(Cone.nonnegative(), [1.0, 0.0], restitution=2)])
        self.expect("belongs into constraint", unilateral=lambda self, state, h: [Unilateral(Cone.free(), [1.0, 0.0])])
        self.expect("not symmetric", mass=lambda self, state: np.array([[1.0, 0.5], [0.0, 1.0]]))
        self.expect("not positive definite: it has the eigenvalue -2", mass=lambda self, state: np.diag([1.0, -2.0]))
        self.expect("has no method force", NotImplementedError, force=DynamicalSystem.force)

    def test_wrong_settings(self):
        for sentence, settings in (("end", {"step": 0.1}), ("step", {"end": 1.0}),
                                   ('no timestepper "rk5"', {"step": 0.1, "end": 1.0, "integrator": "rk5"}),
                                   ('no solver "cholmud"', {"step": 0.1, "end": 1.0, "solver": "cholmud"}),
                                   ("theta", {"step": 0.1, "end": 1.0, "integrator": "moreau_jean(theta=7)"})):
            with self.assertRaisesRegex(delassus.InputError, sentence):
                delassus.Simulation(Duffing(), **settings)
        with self.assertRaisesRegex(delassus.InputError, "integrator is of type int"):
            delassus.Simulation(Duffing(), integrator=7, step=0.1, end=1.0)
        with self.assertRaisesRegex(delassus.InputError, "give an instance"):
            delassus.Simulation(Duffing, step=0.1, end=1.0)
        with self.assertRaisesRegex(delassus.InputError, "step belong to the Scene"):
            delassus.Simulation(delassus.Scene(PENDULUM), step=0.1)
        with self.assertRaisesRegex(delassus.Unsupported, "takes no contacts"):
            delassus.Simulation(Ball(), integrator="rk4", step=0.1, end=1.0)

    def test_what_is_not_finite_is_named(self):
        class Leaves(Duffing):
            def force(self, state):
                return super().force(state) if state.t < 0.55 else np.full(2, np.nan)

        for method in ("rk4", "euler_implicit", "radau_iia", "generalized_alpha"):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                run = delassus.simulate(Leaves(), integrator=method, step=0.1, end=1.0)
            self.assertEqual(run.status, "failed", method)
            self.assertRegex(run.message, r"Leaves\.force\(\) at t = 0\.[56]\d* returned a value that is not finite")
            self.assertLess(run.time[-1], 0.6)
            self.assertTrue(np.isfinite(run.positions).all())
        with self.assertRaisesRegex(delassus.InputError, r"Own.force\(\) at t = 0: a value is not finite"):
            delassus.Simulation(type("Own", (Duffing,), {"force": lambda self, state: np.full(2, np.inf)})(), step=0.1,
                                end=1.0)

    def test_an_exception_ends_the_step_with_its_traceback(self):
        class Breaks(Duffing):
            broken = True

            def force(self, state):
                if state.t > 0.25 and self.broken:
                    raise KeyError("no such table")
                return super().force(state)

        for settings in ({"step": 0.1}, {"tolerance": 1e-4}):
            for method in ("rk4", "generalized_alpha", "dormand_prince"):
                system = Breaks()
                simulation = delassus.Simulation(system, integrator=method, end=1.0, **settings)
                try:
                    while True:
                        simulation.step()
                except KeyError:
                    said = traceback.format_exc()
                self.assertIn('raise KeyError("no such table")', said)
                before = simulation.time, simulation.positions
                with self.assertRaises(KeyError):
                    simulation.step()
                self.assertEqual(simulation.time, before[0])
                np.testing.assert_array_equal(simulation.positions, before[1])
                system.broken = False  # a run goes on as if nothing had been
                whole = delassus.simulate(Duffing(), integrator=method, end=1.0, **settings)
                np.testing.assert_array_equal(delassus.simulate(simulation).positions[-1], whole.positions[-1])


class Running(unittest.TestCase):
    def test_steps_by_tolerance(self):
        exact = delassus.simulate(DuffingByHand(), integrator="dormand_prince", step=0.01, end=2.0)
        for method in ("euler_implicit", "generalized_alpha", "radau_iia"):
            run = delassus.simulate(DuffingByHand(), integrator=method, end=2.0, tolerance=1e-5)
            self.assertEqual(run.time[-1], 2.0)
            self.assertLess(np.abs(run.positions[-1] - exact.positions[-1]).max(), 2e-4, method)
        with self.assertRaisesRegex(delassus.InputError, "accuracy is for scenes"):
            delassus.simulate(DuffingByHand(), end=2.0, accuracy=1e-3)

    def test_without_an_end_step_by_step(self):
        simulation = delassus.Simulation(Duffing(), step=0.01, end=math.inf)
        for _ in range(5):
            record = simulation.step()
        self.assertFalse(simulation.finished)
        self.assertEqual((record.step, round(record.time, 9)), (5, 0.05))
        self.assertTrue(math.isnan(record.energy))
        self.assertIn("Duffing by dormand_prince", repr(simulation))
        with self.assertRaisesRegex(delassus.InputError, "without an end"):
            delassus.simulate(simulation)

    def test_states_may_be_kept(self):
        kept = []

        class Keeps(Duffing):
            def force(self, state):
                kept.append(state)
                return super().force(state)

        delassus.simulate(Keeps(), integrator="rk4", step=0.1, end=0.2)
        self.assertEqual(kept[0].q.tolist(), [1.0, 0.2])

    def test_multipliers(self):
        simulation = delassus.Simulation(PendulumByHand(), integrator="generalized_alpha", step=0.001, end=0.1)
        self.assertEqual(simulation.multipliers.shape, (0,))
        simulation.step()
        scene = delassus.Simulation({**PENDULUM, "integrator": "generalized_alpha"})
        scene.step()
        self.assertEqual((simulation.multipliers.shape, scene.multipliers.shape), ((2,), (5,)))

    def test_two_threads_with_two_systems(self):
        runs = {}

        def work(name):
            runs[name] = delassus.simulate(DuffingByHand(), integrator="hht", step=0.01, end=1.0)

        threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        np.testing.assert_array_equal(runs[0].positions, runs[1].positions)

    def test_ctrl_c(self):
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            delassus.simulate(Duffing(), step=1e-3, end=1e6, every=10**6)
        self.assertLess(time.monotonic() - begin, 60.0)


if __name__ == "__main__":
    unittest.main()
