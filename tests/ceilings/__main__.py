"""Print what the detector sees on each kind of ceiling, beside OpenCV's blob detector.

    python -m tests.ceilings                       # 40 pictures of each kind
    python -m tests.ceilings 100 tiles wood        # 100 of each kind with one of these words in its name

right    all clear circles found within 0.5 px, and nothing else
rms      error of the centres in px; worst: the largest
silent   pictures in which a centre is off by more than 0.3 px and 4 sigma, with quality 0.9 or more
nees     mean of the squared errors over the variances that the detector states; 2 if sigma is right
seen     clear circles that were reported
false    pictures with a circle reported 2 px or more from any of the four, or any where no target is
followed right, with the places of the same picture to begin with, moved by up to a third of a radius
blobs    pictures in which cv2.SimpleBlobDetector finds the circles within 0.5 px
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from quadvis.native.functions import prepare
from quadvis_vision.detection.circles import CircleTarget
from quadvis_vision.detection.colours import ColourCalibration
from quadvis_vision.detection.detect import search
from quadvis_vision.detection.follow import follow
from quadvis_vision.detection.measure import NATIVE
from tests.ceilings.kinds import KINDS
from tests.ceilings.stage import DISC, SQUARE, Kind, Shot, shoot

COLOURS = Path(__file__).parents[2] / "diagrams" / "calib" / "colours.yaml"
TARGET = CircleTarget(ColourCalibration.load(COLOURS), DISC / SQUARE, 2.0, 80.0)
SIZE = (320, 240)
SILENT = 0.3  # px
ANNOUNCED = 4.0  # sigma
FALSE = 2.0  # px


def blobs_right(shot: Shot) -> bool:
    """Return whether OpenCV's blob detector finds all clear circles."""
    parameters = cv2.SimpleBlobDetector_Params()
    parameters.minArea = 10
    found = np.array([point.pt for point in cv2.SimpleBlobDetector_create(parameters).detect(shot.pixels)])
    if not len(found):
        return not shot.clear.any()
    away = np.hypot(*(shot.centres[shot.clear, None] - found).transpose(2, 0, 1))
    return bool((away.min(1, initial=9.0) <= 0.5).all())


def row(name: str, kind: Kind, count: int) -> str:
    """Return the row of one kind."""
    rng = np.random.default_rng(sum(name.encode()))
    right = silent = false = followed = blobs = clear = seen = 0
    errors: list[float] = []
    normed: list[float] = []
    for _ in range(count):
        shot = shoot(rng, SIZE, kind)
        found = search(shot.pixels, TARGET)
        there = ~np.isnan(found.centres[:, 0])
        away = shot.errors(found.centres)
        right += shot.right(found.centres)
        errors += away[there & (away < FALSE)].tolist()
        sure = there & (found.quality >= 0.9)
        silent += bool((away[sure] > np.maximum(SILENT, ANNOUNCED * found.sigma[sure])).any())
        known = there & (away < FALSE)
        normed += ((away[known] / found.sigma[known]) ** 2).tolist()
        false += bool((there & ~(away < FALSE)).any())
        clear += shot.clear.sum()
        seen += (there & shot.clear).sum()
        blobs += blobs_right(shot)
        if kind.shown and found.status < 3:
            places = found.places.copy()
            shift = rng.uniform(-1, 1, 2)
            places[:, :2] += shift / np.hypot(*shift) * rng.uniform(0, 0.33) * places[:, 2].mean()
            followed += shot.right(follow(shot.pixels, TARGET, places).centres)
    figures = [np.sqrt(np.mean(np.square(errors))), max(errors), np.mean(normed)] if errors else []
    rms = "".join(f"{figure:7.{digits}f}" for figure, digits in zip(figures, (3, 2, 1), strict=False))
    rms = rms or f"{'-':>7}" * 3
    share = f"{seen / clear:8.1%}" if clear else f"{'-':>8}"
    parts = "".join(f"{100 * part / count:8.1f}%" for part in (right, silent, false, followed, blobs))
    return f"{name:30}{rms}{share}{parts}"


def main() -> int:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    words = sys.argv[2:]
    cv2.setNumThreads(1)
    prepare(NATIVE)
    print(
        f"{'':30}{'rms':>7}{'worst':>7}{'nees':>7}{'seen':>8}"
        + "".join(f"{w:>9}" for w in ("right", "silent", "false", "followed", "blobs"))
    )
    for name, kind in KINDS.items():
        if not words or any(word in name for word in words):
            print(row(name, kind, count), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
