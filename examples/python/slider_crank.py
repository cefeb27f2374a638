# SPDX-License-Identifier: BSD-3-Clause
"""A mechanism with a motor, built by calls: a crank of 0.1 m moves a slider through a rod of 0.3 m.

    python3 slider_crank.py [PAGE.html]  a page plays the motion
"""
import sys

import delassus

CRANK, ROD, SPEED = 0.1, 0.3, 4.0  # m, m, rad/s


def main():
    scene = delassus.SceneBuilder("slider-crank", step=0.002, end=2.0, gravity=[0, 0, -9.81])
    crank = scene.add_body("crank", mass=0.5, position=[CRANK / 2, 0, 0], shapes=scene.box([CRANK, 0.02, 0.02]))
    rod = scene.add_body("rod", mass=0.3, position=[CRANK + ROD / 2, 0, 0], shapes=scene.box([ROD, 0.02, 0.02]))
    slider = scene.add_body("slider", mass=1.0, position=[CRANK + ROD, 0, 0], shapes=scene.box([0.08, 0.05, 0.05]))
    scene.keep_apart(crank, rod)
    scene.keep_apart(rod, slider)
    scene.keep_apart(crank, slider)
    bearing = scene.add_joint("revolute", scene.world, crank, point=[0, 0, 0], axis=[0, 0, 1])
    scene.add_joint("spherical", crank, rod, point=[CRANK, 0, 0])
    scene.add_joint("cylindrical", slider, rod, point=[CRANK + ROD, 0, 0], axis=[0, 0, 1])
    scene.add_joint("prismatic", scene.world, slider, point=[CRANK + ROD, 0, 0], axis=[1, 0, 0])
    scene.add_motor(bearing, SPEED, speed=True)
    return delassus.simulate(scene)


if __name__ == "__main__":
    run = main()
    x = run.body("slider")[:, 0]
    print(f"{run.status}: the slider moves between {x.min():.4f} and {x.max():.4f} m")
    if len(sys.argv) > 1:
        run.view().write(sys.argv[1])
