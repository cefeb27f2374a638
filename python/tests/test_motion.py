# SPDX-License-Identifier: BSD-3-Clause
"""Scenes of contact mechanics with a closed form or an equation of their own, as anybody might write them: no options,
three steps, straight and turned. motion/ has the scenes, and what is allowed of each."""
import unittest

from motion import driven, impacts, joints, rolling, sliding, tipping
from motion.scenes import PLACEMENTS, errors


def test_of(case):
    def test(self):
        for placement in PLACEMENTS:
            for step in case.steps:
                with self.subTest(case=case.name, placement=placement.name, step=step):
                    self.follow(case, placement, step)

    return test


class Follows(unittest.TestCase):
    """Has a test for each case of a module."""

    def __init_subclass__(cls, cases):
        super().__init_subclass__()
        for case in cases:
            setattr(cls, "test_" + case.name, test_of(case))

    def follow(self, case, placement, step):
        run, found = errors(case, placement, step)
        where = f"{case.name}, {placement.name}, step {step:.4g} s"
        self.assertEqual(run.status, "finished", f"{where}: {run.message}")
        for error, allowed, unit in found:
            self.assertLessEqual(error, allowed, f"{where}: error {error:.3g} {unit}, allowed {allowed:.2g} {unit}")


class Sliding(Follows, cases=sliding.CASES):
    pass


class Rolling(Follows, cases=rolling.CASES):
    pass


class Tipping(Follows, cases=tipping.CASES):
    pass


class Impacts(Follows, cases=impacts.CASES):
    pass


class Driven(Follows, cases=driven.CASES):
    pass


class Joints(Follows, cases=joints.CASES):
    pass


if __name__ == "__main__":
    unittest.main()
