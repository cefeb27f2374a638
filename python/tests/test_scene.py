# SPDX-License-Identifier: BSD-3-Clause
"""Scenes from files, texts and dicts, simulated whole and step by step."""
import os
import signal
import threading
import time
import unittest
import warnings
from pathlib import Path

import delassus
import numpy as np

EXAMPLES = Path(os.environ["DELASSUS_SOURCE_DIR"]) / "examples" / "scenes"


def ball(**changes):
    """A ball of 2 kg that lies on the ground."""
    scene = {"title": "a ball at rest", "step": 0.01, "end": 0.1, "materials": {"wood": {"friction": 0.4}},
             "bodies": [{"name": "ground", "fixed": True, "shapes": [{"plane": {}, "material": "wood"}]},
                        {"name": "ball", "mass": 2.0, "position": np.array([0.0, 0.0, 0.1]),
                         "shapes": [{"sphere": {"radius": 0.1}, "material": "wood"}]}]}
    scene.update(changes)
    return scene


TEXT = """
title: a ball at rest
step: 0.01
end: 0.1
materials: {wood: {friction: 0.4}}
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: wood}]}
  - {name: ball, mass: 2, position: [0, 0, 0.1], shapes: [{sphere: {radius: 0.1}, material: wood}]}
"""


class ClosedForms(unittest.TestCase):
    def test_a_box_slides_and_its_contacts_carry_it(self):
        slope = delassus.Scene(EXAMPLES / "box_on_incline.yaml")
        self.assertEqual(slope.systems, ["sticks", "slides"])
        run = delassus.simulate(slope, "slides", every=100)
        self.assertEqual((run.status, run.steps, len(run.time)), ("finished", 1000, 11))
        acceleration = 9.81 * (np.sin(np.radians(20)) - 0.3 * np.cos(np.radians(20)))
        np.testing.assert_allclose(run.time, np.linspace(0, 1, 11), atol=1e-12)
        np.testing.assert_allclose(run.twist("box")[:, 0], acceleration * run.time, atol=1e-5)
        np.testing.assert_allclose(run.body("box")[:, 0], 0.5 * acceleration * run.time**2, atol=1e-3)  # h = 1 ms
        np.testing.assert_allclose(run.body("box")[:, 3:], [[1, 0, 0, 0]] * 11, atol=1e-6)
        for state in range(1, 11):
            chosen = run.contacts["state"] == state
            force = run.contacts["force"][chosen].sum(axis=0)
            upward = force if run.contacts["bodies"][chosen][0, 1] == run.bodies.index("box") else -force
            normal = 2 * 9.218384635
            np.testing.assert_allclose(upward, [-0.3 * normal, 0.0, normal], atol=1e-4)
        stuck = delassus.simulate(slope, "sticks", every=1000)
        np.testing.assert_allclose(stuck.body("box")[-1, :2], 0.0, atol=1e-6)

    def test_a_free_flight(self):
        run = delassus.simulate(ball(bodies=[{"name": "ball", "mass": 2.0, "position": [0, 0, 5], "velocity": [1, 0, 3],
                                              "inertia": {"xx": 1, "yy": 1, "zz": 1}}]))
        np.testing.assert_allclose(run.twist("ball")[:, 2], 3 - 9.81 * run.time, rtol=1e-12)
        np.testing.assert_allclose(run.body("ball")[:, 0], run.time, rtol=1e-12)
        self.assertEqual(run.poses.shape, (11, 1, 7))
        self.assertEqual(len(run.contacts["gap"]), 0)


class Sources(unittest.TestCase):
    def test_dict_text_and_file_are_the_same_scene(self):
        runs = [delassus.simulate(source, every=2) for source in (ball(), TEXT, delassus.Scene(ball()))]
        for run in runs[1:]:
            np.testing.assert_array_equal(run.positions, runs[0].positions)
            np.testing.assert_array_equal(run.velocities, runs[0].velocities)
        self.assertEqual(delassus.Scene(TEXT).title, "a ball at rest")
        self.assertEqual(delassus.Scene(TEXT).bodies(), ["ground", "ball"])

    def test_overrides(self):
        scene = delassus.Scene(ball(), set={"bodies.ball.mass": 3}, step=0.02, end=0.05, solver="pgs(omega=1.1)",
                               law="coulomb")
        simulation = delassus.Simulation(scene)
        steps = []
        while not simulation.finished:
            steps.append(simulation.step().h)
        np.testing.assert_allclose(steps, [0.02, 0.02, 0.01], rtol=1e-9)
        np.testing.assert_allclose(np.abs(simulation.contacts()["force"][0, 2]), 3 * 9.81, rtol=1e-6)

    def test_settings_by_keyword(self):
        run = delassus.simulate(ball(), solver="pgs", step=0.02, end=0.06)
        np.testing.assert_allclose(run.time, [0.0, 0.02, 0.04, 0.06], atol=1e-12)
        with self.assertRaisesRegex(delassus.InputError, "end belong to the Scene"):
            delassus.simulate(delassus.Scene(ball()), end=1.0)
        with self.assertRaisesRegex(delassus.InputError, "solver belong to the Simulation"):
            delassus.simulate(delassus.Simulation(ball()), solver="pgs")

    def test_steps_follow_from_an_accuracy(self):
        # Half a metre down to the ground, and up again with half the speed, in steps that the impact does not meet.
        g, h, end = 9.81, 0.5, 0.55
        scene = {"materials": {"m": {"restitution": 0.5}},
                 "bodies": [{"name": "ground", "fixed": True, "shapes": [{"plane": {}, "material": "m"}]},
                            {"name": "ball", "mass": 1.0, "position": [0, 0, h + 0.1],
                             "shapes": [{"sphere": {"radius": 0.1}, "material": "m"}]}]}
        run = delassus.simulate(scene, step=0.05, end=end, accuracy=1e-6)
        np.testing.assert_allclose(run.time, 0.05 * np.arange(12), atol=1e-9)
        after = end - np.sqrt(2 * h / g)
        height = 0.5 * np.sqrt(2 * g * h) * after - 0.5 * g * after**2
        self.assertAlmostEqual(run.poses[-1, 1, 2], 0.1 + height, delta=1e-6)
        with self.assertRaisesRegex(delassus.InputError, "tolerance"):
            delassus.simulate(scene, step=0.05, end=end, accuracy=1e-6, tolerance=1e-4)

    def test_refusals(self):
        for sentence, scene in (('did you mean "bodies"', {"bodys": []}), ("/nowhere.yaml", "/nowhere.yaml"),
                                ("sticks, slides", EXAMPLES / "box_on_incline.yaml"),
                                ("mass", ball(bodies=[{"name": "ball", "mass": -1.0}]))):
            with self.assertRaisesRegex(delassus.InputError, sentence):
                delassus.simulate(scene)
        with self.assertRaisesRegex(delassus.InputError, 'no system "rolls"'):
            delassus.Simulation(EXAMPLES / "box_on_incline.yaml", "rolls")
        with self.assertRaisesRegex(TypeError, "a value of type object"):
            delassus.Scene(ball(step=object()))
        with self.assertRaisesRegex(delassus.InputError, "every"):
            delassus.simulate(ball(), every=0)


class Steps(unittest.TestCase):
    def test_step_by_step_is_the_same_as_whole_and_again(self):
        scene = delassus.Scene(EXAMPLES / "sphere_pile.yaml", end=0.1)
        whole, again = delassus.simulate(scene), delassus.simulate(scene)
        np.testing.assert_array_equal(whole.positions, again.positions)
        simulation = delassus.Simulation(scene)
        while not simulation.finished:
            record = simulation.step()
        self.assertEqual((record.step, simulation.time), (whole.steps, whole.time[-1]))
        np.testing.assert_array_equal(simulation.positions, whole.positions[-1])
        np.testing.assert_array_equal(simulation.velocities, whole.velocities[-1])
        np.testing.assert_array_equal(simulation.poses, whole.poses[-1])
        self.assertEqual(record.energy, whole.energy[-1])
        with self.assertRaisesRegex(delassus.InputError, "there is no further step"):
            simulation.step()

    def test_a_simulation_goes_on(self):
        whole = delassus.simulate(ball(end=0.2))
        simulation = delassus.Simulation(ball(end=0.2))
        for _ in range(7):
            simulation.step()
        rest = delassus.simulate(simulation)
        np.testing.assert_array_equal(rest.positions, whole.positions[7:])

    def test_inputs_act_from_when_they_are_set(self):
        scene = {"step": 0.01, "end": 1, "gravity": [0, 0, 0],
                 "bodies": [{"name": "cart", "mass": 2, "inertia": {"xx": 1, "yy": 1, "zz": 1}}],
                 "joints": [{"name": "rail", "kind": "prismatic", "second": "cart", "point": [0, 0, 0], "axis": [1, 0, 0]}],
                 "loads": [{"name": "push", "body": "cart", "force": [{"input": {"name": "push", "start": 4}}, 0, 0]}]}
        simulation = delassus.Simulation(scene)
        self.assertEqual((simulation.joints, simulation.inputs), (["rail"], {"push": 4.0}))
        for _ in range(50):
            simulation.step()
        np.testing.assert_allclose(simulation.joint_velocities, [1.0], atol=1e-9)
        simulation.set_inputs({"push": -8})
        for _ in range(50):
            simulation.step()
        np.testing.assert_allclose(simulation.joint_velocities, [-1.0], atol=1e-9)
        np.testing.assert_allclose(simulation.joint_positions, [0.25 + 0.5 - 0.5], atol=1e-6)
        with self.assertRaisesRegex(delassus.InputError, 'no input "pull"'):
            simulation.set_inputs({"push": 1, "pull": 1})
        with self.assertRaisesRegex(delassus.InputError, "must be finite"):
            simulation.set_inputs({"push": np.nan})
        self.assertEqual(simulation.inputs, {"push": -8.0})

    def test_a_step_that_fails_leaves_what_was(self):
        pendulum = {"step": 0.01, "end": 1.0, "limits": {"drift": 1e-9}, "integrator": "euler_implicit_linearized",
                    "bodies": [{"name": "bob", "mass": 1.0, "position": [1, 0, 0],
                                "inertia": {"xx": 0.1, "yy": 0.1, "zz": 0.1}}],
                    "joints": [{"name": "hinge", "kind": "revolute", "second": "bob", "point": [0, 0, 0],
                                "axis": [0, 1, 0]}]}
        simulation = delassus.Simulation(pendulum)
        with self.assertRaisesRegex(delassus.StepFailure, "drift"):
            while True:
                simulation.step()
        t, q = simulation.time, simulation.positions
        with self.assertRaises(delassus.StepFailure):
            simulation.step()
        self.assertEqual(simulation.time, t)
        np.testing.assert_array_equal(simulation.positions, q)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            run = delassus.simulate(pendulum)
        self.assertEqual((run.status, run.time[-1]), ("failed", t))
        self.assertIn("drift", run.message)
        self.assertEqual([w.category for w in said], [RuntimeWarning])

    def test_ctrl_c_ends_a_run(self):
        scene = delassus.Scene(EXAMPLES / "sphere_pile.yaml", end=1000.0)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            delassus.simulate(scene, every=1000)
        self.assertLess(time.monotonic() - begin, 60.0)


if __name__ == "__main__":
    unittest.main()
