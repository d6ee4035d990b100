"""What may be a circle: how far a picture is searched for it."""

from pathlib import Path

import numpy as np

from quadvis_vision.detection.blobs import looks
from quadvis_vision.detection.circles import Ceiling, CircleTarget
from quadvis_vision.detection.colours import ColourCalibration

COLOURS = Path(__file__).parents[3] / "diagrams" / "calib" / "colours.yaml"
TARGET = CircleTarget(ColourCalibration.load(COLOURS), 0.12, 2.0, 80.0)


def test_a_picture_of_noise_has_few_looks():
    rng = np.random.default_rng(2)
    noise = rng.integers(0, 256, (240, 320, 3)).astype(np.uint8)
    calm = np.clip(rng.normal(200, 4, (240, 320, 3)), 0, 255).astype(np.uint8)
    few, all_of_them = (len(list(looks(each, Ceiling(each), TARGET))) for each in (noise, calm))
    assert few < all_of_them == 4
