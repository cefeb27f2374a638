# SPDX-License-Identifier: BSD-3-Clause
"""Scenes built by calls."""
import base64
import importlib.util
import json
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import delassus
import numpy as np
from delassus import SceneBuilder

SOURCE = Path(os.environ["DELASSUS_SOURCE_DIR"])
SCHEMA = json.loads((SOURCE / "docs" / "scene.schema.json").read_text(encoding="utf-8"))["definitions"]


def ball():
    scene = SceneBuilder("a ball: at rest", step=0.01, end=0.1)
    wood = scene.add_material("wood", friction=0.4)
    scene.add_ground(material=wood)
    scene.add_body("ball", mass=2.0, position=np.array([0.0, 0.0, 0.1]), shapes=scene.sphere(0.1, material=wood))
    return scene


class AsAFile(unittest.TestCase):
    def test_it_is_the_scene_of_a_dict(self):
        by_hand = {"step": 0.01, "end": 0.1, "materials": {"wood": {"friction": 0.4}},
                   "bodies": [{"name": "ground", "fixed": True, "shapes": [{"plane": {}, "material": "wood"}]},
                              {"name": "ball", "mass": 2.0, "position": [0, 0, 0.1],
                               "shapes": [{"sphere": {"radius": 0.1}, "material": "wood"}]}]}
        runs = [delassus.simulate(scene) for scene in (ball(), by_hand, delassus.Scene(ball()))]
        for run in runs[1:]:
            np.testing.assert_array_equal(run.positions, runs[0].positions)
        self.assertEqual(delassus.Scene(ball()).title, "a ball: at rest")

    def test_written_and_read(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ball.yaml"
            path.write_text("something else")
            ball().write(path)
            self.assertEqual(path.read_text(), ball().to_yaml())
            self.assertEqual(os.listdir(folder), ["ball.yaml"])
            np.testing.assert_array_equal(delassus.simulate(path).positions, delassus.simulate(ball()).positions)
            with self.assertRaises(TypeError):
                SceneBuilder(step=object()).write(path)
            self.assertEqual(path.read_text(), ball().to_yaml())

    def test_values(self):
        scene = SceneBuilder("on\n\"off\": é", step=1e-6, end=np.float64(1e-5), tolerance=None)
        scene.add_body("null", mass=np.float32(2), inertia={"xx": 1, "yy": 1, "zz": 1}, position=(1e-300, 1e20, -0.0),
                       fixed=False)
        read = delassus.Scene(scene)
        self.assertEqual(read.title, "on\n\"off\": é")
        self.assertEqual(read.bodies(), ["null"])
        np.testing.assert_array_equal(delassus.Simulation(read).positions[:3], [1e-300, 1e20, 0.0])
        self.assertIn("step: 1.0e-06\n", scene.to_yaml())

    def test_several_systems(self):
        scene = SceneBuilder("two")
        for name, gravity in (("moon", 1.62), ("earth", 9.81)):
            system = scene.add_system(name, step=0.01, end=1.0, gravity=[0, 0, -gravity])
            system.add_body("stone", mass=1, inertia={"xx": 1, "yy": 1, "zz": 1})
        self.assertEqual(delassus.Scene(scene).systems, ["moon", "earth"])
        fall = delassus.simulate(scene, "moon").body("stone")[-1, 2]
        self.assertAlmostEqual(fall, -0.81, places=9)


class Keys(unittest.TestCase):
    def test_every_list_has_a_method(self):
        singular = {"bodies": "body", "elastic_meshes": "elastic_mesh", "initial_velocities": "initial_velocity"}
        built = SceneBuilder()
        for key, value in SCHEMA["system"]["properties"].items():
            if "array" in value.get("type", ()) and key != "keep_apart":
                method = getattr(built, "add_" + singular.get(key, key[:-1]))
                self.assertTrue(method.__doc__, key)
        for kind in SCHEMA["shape"]["properties"]:
            if kind not in ("material", "position", "orientation", "margin"):
                self.assertTrue(callable(getattr(SceneBuilder, kind)), kind)

    def test_items_go_where_they_belong(self):
        scene = SceneBuilder(step=0.01, end=0.1)
        first, second = scene.add_body(mass=1), scene.add_body(mass=2, velocity=[1, 0, 0])
        self.assertEqual((first, second), ("body1", "body2"))
        hinge = scene.add_joint("revolute", scene.world, first, point=[0, 0, 0], axis=[0, 1, 0], spring={"stiffness": 2})
        scene.add_motor(hinge, {"linear": {"rate": 2}}, speed=False, force_limit=3)
        scene.add_actuator(hinge, kind="servo", gain=1)
        scene.add_spring(first, second, stiffness=10, rest_length=0)
        scene.add_bushing(first, second, name="rubber")
        scene.add_load(first, force=[0, 0, 1])
        scene.add_force(node="n", force=[0, 0, 1])
        scene.add_node("n", mass=1)
        scene.add_material_pair("a", "b", friction=0.0)
        scene.keep_apart(first, second)
        scene.add_initial_velocity(body=first, velocity=[0, 0, 1])
        scene.set(gravity=[0, 0, 0], end=None)
        for add in (scene.add_elastic_block, scene.add_elastic_mesh, scene.add_cable, scene.add_beam,
                    scene.add_attachment):
            add(size=1)
        self.assertEqual(scene["joints"], [{"name": "joint1", "kind": "revolute", "first": "world", "second": "body1",
                                            "point": [0, 0, 0], "axis": [0, 1, 0], "spring": {"stiffness": 2}}])
        self.assertEqual(scene["motors"][0], {"name": "motor1", "joint": "joint1", "motion": {"linear": {"rate": 2}},
                                              "speed": False, "force_limit": 3})
        self.assertEqual(scene["loads"][1], {"name": "load2", "node": "n", "force": [0, 0, 1]})
        self.assertEqual(scene["material_pairs"], [{"first": "a", "second": "b", "friction": 0.0}])
        self.assertEqual(scene["keep_apart"], [["body1", "body2"]])
        self.assertEqual(scene["springs"][0]["rest_length"], 0)
        self.assertNotIn("end", scene)
        self.assertEqual({key for key, value in SCHEMA["system"]["properties"].items()
                          if "array" in value.get("type", ())}, {key for key in scene if isinstance(scene[key], list)
                                                                 and key != "gravity"})

    def test_a_misspelt_key_gets_the_readers_sentence(self):
        for change, sentence in ((lambda s: s.add_body("x", mas=1), 'line 9: a body has no key "mas"; did you mean "mass"'),
                                 (lambda s: s.set(gravitiy=[0, 0, 0]), 'no key "gravitiy"; did you mean "gravity"'),
                                 (lambda s: s.add_joint("revolut", "world", "ball"), '"revolut"'),
                                 (lambda s: s.add_joint("fixed", "world", "bal"), 'did you mean "ball"')):
            scene = ball()
            change(scene)
            with self.assertRaisesRegex(delassus.InputError, sentence):
                delassus.Scene(scene)
        with self.assertRaisesRegex(delassus.InputError, "step"):
            delassus.Scene(SceneBuilder())
        with self.assertRaisesRegex(delassus.InputError, "a material 'wood' already"):
            ball().add_material("wood")


def floats(text):
    return np.frombuffer(base64.b64decode(text), np.float32)


def data_of(page):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1])


class Examples(unittest.TestCase):
    def run_example(self, name):
        spec = importlib.util.spec_from_file_location(name, SOURCE / "examples" / "python" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    def test_pendulum(self):
        run = self.run_example("pendulum").main()
        self.assertEqual(run.status, "finished")
        np.testing.assert_allclose(run.energy, run.energy[0], atol=1e-3)
        np.testing.assert_allclose(np.linalg.norm(run.body("bob")[:, :3], axis=1), 1.0, atol=1e-6)

    def test_pile(self):
        run = self.run_example("pile").main()
        self.assertEqual((run.status, run.poses.shape[1]), ("finished", 51))
        self.assertLess(np.abs(run.twists[-1]).max(), np.abs(run.twists[len(run.time) // 2]).max())
        self.assertGreater(run.poses[-1, 1:, 2].min(), 0.04)
        last = run.contacts["state"] == len(run.time) - 1
        self.assertGreater(last.sum(), 50)

    def test_motor_driven_mechanism(self):
        run = self.run_example("slider_crank").main()
        self.assertEqual(run.status, "finished")
        angle = 4.0 * run.time  # the motor's ramp is over in none of it: the speed is constant
        x = 0.1 * np.cos(angle) + np.sqrt(0.3**2 - (0.1 * np.sin(angle)) ** 2)
        np.testing.assert_allclose(run.body("slider")[:, 0], x, atol=2e-5)

    def test_own_system(self):
        orders = self.run_example("own_system").main()
        self.assertAlmostEqual(orders["generalized_alpha"], 2.0, delta=0.2)
        self.assertAlmostEqual(orders["euler_implicit"], 1.0, delta=0.2)


class Views(unittest.TestCase):
    def setUp(self):
        try:
            delassus.simulate(ball()).view()
        except delassus.InputError as error:
            if "npm did not bring" in str(error):
                self.skipTest(str(error))
            raise

    def test_a_run_as_a_page(self):
        run = delassus.simulate(ball())
        view = run.view(frames=5)
        self.assertTrue(view.html.lstrip().lower().startswith("<!doctype html>"))
        self.assertIn("a ball: at rest", view.html)
        shown = view._repr_html_()
        self.assertTrue(shown.startswith("<iframe srcdoc="))
        self.assertIn("&lt;base href=&quot;about:srcdoc&quot;&gt;", shown)
        self.assertNotIn('"', shown[len('<iframe srcdoc="'):shown.index('" style=')])
        with tempfile.TemporaryDirectory() as folder:
            view.write(Path(folder) / "ball.html")
            self.assertEqual((Path(folder) / "ball.html").read_text(encoding="utf-8"), view.html)

    def test_it_is_what_the_command_shows(self):
        scenes = SOURCE / "examples" / "scenes"
        with tempfile.TemporaryDirectory() as folder:
            ball().write(Path(folder) / "ball.yaml")
            for file in (Path(folder) / "ball.yaml", scenes / "elastic_block.yaml", scenes / "modal_arm.yaml",
                         scenes / "hanging_cable.yaml"):
                self.compare_with_command(file, 0.02, Path(folder))

    def compare_with_command(self, file, end, folder):
        command, run = os.environ["DELASSUS_COMMAND"], str(folder / file.stem)
        subprocess.run([command, "run", str(file), "-o", run, "--pictures", "0", "--end", str(end)], check=True,
                       capture_output=True)
        subprocess.run([command, "view", run], check=True, capture_output=True)
        page = (folder / file.stem / "scene.html").read_text(encoding="utf-8")
        theirs = data_of(page)
        for number, name in enumerate(delassus.Scene(file).systems):
            ours = data_of(delassus.simulate(delassus.Scene(file, end=end), name).view().html)
            self.assertEqual((ours["title"], ours["status"]), (theirs["title"], "finished"))
            self.compare_systems(ours["systems"][0], theirs["systems"][number])

    def compare_systems(self, ours, theirs):
        self.assertEqual(set(ours), set(theirs))
        self.assertGreater(ours["frames"], 2)
        for key in theirs:
            if key == "nodes":  # their places are found in two ways, exact to rounding
                np.testing.assert_allclose(floats(ours[key]), floats(theirs[key]), atol=1e-6, err_msg=ours["name"])
            else:
                self.assertEqual(ours[key], theirs[key], (ours["name"], key))

    def test_refusals(self):
        class Free(delassus.DynamicalSystem):
            def initial_state(self):
                return [0.0], [1.0]

            def mass(self, state):
                return [[1.0]]

            def force(self, state):
                return [0.0]

        run = delassus.simulate(Free(), step=0.1, end=1.0)
        self.assertAlmostEqual(run.positions[-1, 0], 1.0, places=12)
        with self.assertRaisesRegex(delassus.InputError, "no shapes"):
            run.view()
        with self.assertRaisesRegex(delassus.InputError, "frames is 1"):
            delassus.simulate(ball()).view(frames=1)


if __name__ == "__main__":
    unittest.main()
