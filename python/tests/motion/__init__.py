# SPDX-License-Identifier: BSD-3-Clause
"""The scenes of test_motion.py, by topic."""
