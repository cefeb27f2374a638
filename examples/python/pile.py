# SPDX-License-Identifier: BSD-3-Clause
"""A pile, built in a loop: 50 balls, boxes and capsules fall into a heap.

    python3 pile.py [PAGE.html]          a page plays the motion
"""
import sys

import delassus
import numpy as np


def main():
    scene = delassus.SceneBuilder("a pile of 50 bodies", step=0.005, end=1.5)
    wood = scene.add_material("wood", friction=0.5)
    scene.add_ground(material=wood)
    kinds = (scene.sphere(0.1, material=wood), scene.box([0.2, 0.15, 0.1], material=wood),
             scene.capsule(0.06, 0.15, material=wood))
    random = np.random.default_rng(1)
    for number in range(50):
        layer, place = divmod(number, 5)
        angle = 2.0 * np.pi * place / 5
        scene.add_body(density=600.0, shapes=kinds[number % 3],
                       position=[0.18 * np.cos(angle), 0.18 * np.sin(angle), 0.15 + 0.22 * layer],
                       orientation={"axis": random.normal(size=3), "angle": random.uniform(0.0, 90.0)})
    return delassus.simulate(scene, every=10)


if __name__ == "__main__":
    run = main()
    heights = run.poses[-1, 1:, 2]
    print(f"{run.status}: the heap is {heights.max():.2f} m high, with {(run.contacts['state'] == len(run.time) - 1).sum()}"
          f" contacts")
    if len(sys.argv) > 1:
        run.view().write(sys.argv[1])
