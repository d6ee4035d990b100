"""Test pictures for a detector, with the truth: the target in all kinds of light, and with disturbances.

They are drawn without the product's own renderer; see `scenery`. The tests and `tools/bench_detector` share
the table of conditions. A random generator with the same seed gives the same pictures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quadvis_vision.trials.scenery import (
    Array,
    Colour,
    Condition,
    Ellipse,
    Picture,
    expose,
    furnish,
    project,
)

Pose = tuple[float, float, float, float, float, float]  # x, y, z (m), roll, pitch, yaw (rad)

CORNERS: Array = np.array([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]])  # x forward, y right
RADIUS = 0.12  # m, of the discs on a square of 1 m
PAINT: tuple[Colour, ...] = (  # blue, green, red
    (42.0, 38.0, 188.0),
    (168.0, 72.0, 30.0),
    (64.0, 138.0, 42.0),
    (30.0, 30.0, 30.0),
)
TOLERANCE = 0.5  # px: a circle that is farther from its true place counts as wrong

_MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])  # equation (38), 452 px wide


def _light(share: float) -> Colour:
    return (share, share, share)


CONDITIONS = {
    "clean": Condition(),
    "noise 10": Condition(noise=10.0),
    "noise 20": Condition(noise=20.0),
    "light x0.15": Condition(gain=_light(0.15), noise=2.0),
    "light x0.3": Condition(gain=_light(0.3), noise=3.0),
    "light x0.5": Condition(gain=_light(0.5)),
    "light x1.3": Condition(gain=_light(1.3)),
    "light x1.7": Condition(gain=_light(1.7)),
    "warm": Condition(gain=(0.6, 0.9, 1.15)),
    "cold": Condition(gain=(1.15, 1.0, 0.65)),
    "vignette": Condition(vignette=0.6),
    "gradient": Condition(gradient=0.7),
    "lamp": Condition(lamp=True),
    "motion 4 px": Condition(blur=4.0),
    "motion 8 px": Condition(blur=8.0),
    "jpeg 50": Condition(quality=50),
    "jpeg 35, 4:2:0": Condition(quality=35, subsampled=True),
    "grey ceiling": Condition(ceiling=(110.0, 112.0, 115.0)),
    "tilt 25 deg": Condition(tilt=25.0),
    "far": Condition(distance=(7.0, 10.0)),
    "near": Condition(distance=(1.9, 2.2)),
    "clutter": Condition(clutter=5),
    "6 distractors": Condition(odd=6),
    "12 decoys": Condition(decoys=12),
    "30 % hidden": Condition(cover=0.3),
    "1 missing": Condition(missing=1),
    "2 missing": Condition(missing=2),
    "combined": Condition(
        gain=(0.25, 0.32, 0.42), noise=3.0, blur=5.0, vignette=0.3, odd=4, quality=60, subsampled=True
    ),
    "empty": Condition(missing=4),
    "empty, 4 odd things": Condition(missing=4, odd=4),
    "empty, clutter": Condition(missing=4, clutter=5),
    "empty, 10 decoys": Condition(missing=4, decoys=10),
}


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture and its truth: `centres` (4, 2) px of the circles, NaN for a circle that is partly hidden."""

    pixels: Picture
    centres: Array

    def right(self, centres: Array, tolerance: float = TOLERANCE) -> bool:
        """Return whether the found centres (4, 2) are those of all visible circles and no others.

        A target with only one visible circle must not be found.
        """
        seen = ~np.isnan(self.centres[:, 0])
        if not (~np.isnan(centres[:, 0]) == (seen & (seen.sum() > 1))).all():
            return False
        return bool((self.errors(centres) <= tolerance).all())

    def errors(self, centres: Array) -> Array:
        """Return the distances (px) of the visible circles that were found from their true places."""
        away = np.hypot(*(centres - self.centres).T)
        return np.asarray(away[~np.isnan(away)])


def shoot(
    rng: np.random.Generator,
    size: tuple[int, int],
    condition: Condition | None = None,
    pose: Pose | None = None,
    *,
    hidden: Sequence[int] = (),
    paint: Sequence[Colour] = PAINT,
    radius: float = RADIUS,
    photographs: Sequence[Picture] = (),
) -> Shot:
    """Take a picture of `size` (width, height) px.

    Without `pose` a random pose is drawn from which all discs are in the picture. `hidden` circles (0..3) are
    left out; if none is given, `condition` says how many are missing. Clutter is cut from `photographs`.
    """
    condition = condition or Condition()
    h = homography(size, pose or draw_pose(rng, size, condition))
    if not hidden:
        hidden = rng.permutation(4)[: condition.missing].tolist()
    picture = np.empty((size[1], size[0], 3))
    picture[:] = condition.ceiling
    discs = {k: Ellipse(h, CORNERS[k], radius) for k in range(4) if k not in hidden}
    furnish(rng, picture, list(discs.values()), condition, paint, photographs)
    centres = np.full((4, 2), np.nan)
    for corner, disc in discs.items():
        disc.paint(picture, paint[corner])
        if disc.is_in(size):
            centres[corner] = disc.centre
    if condition.cover:
        corner = int(rng.choice(list(discs)))
        colour = condition.covering or condition.ceiling
        discs[corner].cover(picture, condition.cover, rng.uniform(0, 2 * math.pi), colour)
        centres[corner] = np.nan
    return Shot(expose(rng, picture, condition), centres)


def homography(size: tuple[int, int], pose: Pose) -> Array:
    """Return H (3, 3) from target (x, y, 1) in m to pixels."""
    import cv2

    x, y, z, roll, pitch, yaw = pose
    rx, ry, rz = (
        np.asarray(cv2.Rodrigues(np.array(turn))[0])
        for turn in ((roll, 0.0, 0.0), (0.0, pitch, 0.0), (0.0, 0.0, yaw))
    )
    turn = np.diag([1.0, -1.0, -1.0]) @ (rz @ ry @ rx).T
    return np.asarray(camera_matrix(size) @ np.column_stack((turn[:, 0], turn[:, 1], -turn @ (x, y, z))))


def camera_matrix(size: tuple[int, int]) -> Array:
    """Return K (3, 3) of the paper for pictures of `size` px: scaled to the width, and centred."""
    k = np.diag([size[0] / 452, size[0] / 452, 1.0]) @ _MATRIX
    k[:2, 2] = (size[0] - 1) / 2, (size[1] - 1) / 2
    return np.asarray(k)


def draw_pose(rng: np.random.Generator, size: tuple[int, int], condition: Condition) -> Pose:
    """Return a random pose from which all four discs are wholly in the picture."""
    lean = math.radians(condition.tilt)
    while True:
        z = rng.uniform(*condition.distance)
        x, y = rng.uniform(-0.15, 0.15, 2) * z
        roll, pitch, yaw = rng.uniform(-1, 1, 3) * (lean, lean, math.pi)
        if _in_view(size, (x, y, z, roll, pitch, yaw)):
            return (x, y, z, roll, pitch, yaw)


def draw_flight(
    rng: np.random.Generator, size: tuple[int, int], condition: Condition, count: int
) -> list[Pose]:
    """Return `count` poses a tenth of a second apart; from every one all discs are in the picture."""
    reach, time = np.array([0.06, 0.06, 0.06, 0.04, 0.04, 0.15]), 0.1 * np.arange(count)
    while True:
        phase, speed = rng.uniform(0, 2 * math.pi, 6), rng.uniform(0.5, 2.5, 6)
        swing = reach * (np.sin(phase + np.outer(time, speed)) - np.sin(phase))
        rows = (np.array(draw_pose(rng, size, condition)) + swing).tolist()
        poses = [(x, y, z, roll, pitch, yaw) for x, y, z, roll, pitch, yaw in rows]
        if all(_in_view(size, pose) for pose in poses):
            return poses


def _in_view(size: tuple[int, int], pose: Pose) -> bool:
    """Return whether all four discs are wholly in the picture."""
    angle = np.linspace(0, 2 * math.pi, 16)
    ring = 1.05 * RADIUS * np.column_stack((np.cos(angle), np.sin(angle)))
    image = project(homography(size, pose), (CORNERS[:, None] + ring).reshape(-1, 2))
    return bool((image > 1).all() and (image < np.array(size) - 2).all())
