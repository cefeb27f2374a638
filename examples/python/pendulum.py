# SPDX-License-Identifier: BSD-3-Clause
"""A pendulum, built by calls: a bob on a hinge 1 m away that falls from the horizontal.

    python3 pendulum.py [PAGE.html]      a page plays the motion
"""
import sys

import delassus


def main():
    scene = delassus.SceneBuilder("pendulum", step=0.01, end=3.0)
    bob = scene.add_body("bob", mass=1.0, position=[1.0, 0.0, 0.0], shapes=scene.sphere(0.1))
    scene.add_joint("revolute", scene.world, bob, point=[0.0, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    return delassus.simulate(scene)


if __name__ == "__main__":
    run = main()
    print(f"{run.status}: lowest at {run.body('bob')[:, 2].min():.3f} m, "
          f"energy within {abs(run.energy - run.energy[0]).max():.1e} J")
    if len(sys.argv) > 1:
        run.view().write(sys.argv[1])
