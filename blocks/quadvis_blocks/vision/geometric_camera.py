"""A simulated camera and detector without pictures: projected circle centres with noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import In, Out, Param, Random, State, fill_normal
from quadvis_blocks.vision._delayed_camera import CONTENT, QUEUE, SEQUENCE, STAMP, DeliveringCamera, Row
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.projection import (
    RADIUS,
    SIDE,
    camera_pose,
    ellipse_centres,
    plane_homography,
    target_corners,
)
from quadvis_vision.detection.detect import NOT_FOUND, STALE, TWO_CIRCLES

WIDTH = CONTENT + 8  # of a row: u, v of four circles
PICTURE, UNBOUNDED = range(2)


class GeometricCamera(DeliveringCamera, numeric=False):
    """The results of `vision.rendered_camera` with `vision.circle_detector`, without rendering.

    The block projects the centres of the four ellipses and adds white noise; a circle whose outline leaves
    the picture is missing. The block has the outputs of the detector, so both can fill the same slot. It
    takes a tenth of the time, and its noise is a parameter. A measurement is stamped when it is taken.
    Measurements arrive as the frames of the rendered camera do: after latency and jitter, and some are lost.
    The measurement that arrived last stays on the wire until another one arrives, with ``fresh`` false.

    Source: camera of equations (10) and (38); noise and latency of the reference experiment.
    """

    position = In("float64[3]", unit="m", doc="position of the craft: x forward, y right, h up")
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw")
    centres = Out("float64[4,2]", unit="px", nan=True, doc="u, v of circles 1 to 4; NaN rows are missing")
    quality = Out("float64[4]", nan=True, doc="1 for a circle that is seen")
    status = Out("int64", doc="0, 1, 2: four, three, two circles; 3: target not found; 5: nothing yet")
    found = Out("bool", doc="whether all four circles are found")
    lost = Out("bool", doc="whether a new measurement has no target")
    stamp = Out(unit="s", nan=True, doc="instant of the measurement")
    sequence = Out("int64", doc="number of the measurement; 0 before the first")
    fresh = Out("bool", doc="whether the measurement is new at this step")
    frozen = Out("bool", doc="always false: no picture exists that could repeat")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    ceiling = Param(4.5, unit="m", doc="height of the target; 3 m above a hover at 1.5 m")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")
    radius = Param(RADIUS, unit="m", above=0.0, doc="radius of the circles")
    noise = Param(0.3, unit="px", min=0.0, tune=True, doc="white noise of each coordinate, one sigma")
    field_of_view = Param(
        "picture",
        choices=("picture", "unbounded"),
        doc="unbounded: circles are also seen beyond the edges of the picture",
    )

    stream = Random()
    drawn = State("float64[8]")  # noise of the coming measurement
    pending = State(f"float64[{QUEUE},{WIDTH}]")
    shown = State(f"float64[{WIDTH}]")
    last_sequence = State("int64")

    def check(self) -> None:
        """Read the calibration, and refuse a latency that is too long for the period."""
        super().check()
        self._load()

    def _load(self) -> CameraCalibration:
        return self.read_file("calibration", CameraCalibration.load)

    def open(self) -> None:
        """Read the calibration."""
        self._camera = self._load()
        self._corners = target_corners(self.side)

    def start(self) -> None:
        """Draw the chances and the noise of the first measurement."""
        super().start()
        fill_normal(self.stream, self.drawn)

    def output(self, position: Any, attitude: Any, time: float) -> tuple[Any, ...]:
        """Return the measurement that arrived last."""
        row = self._deliver(self._taken(position, attitude, time), time)
        sequence = int(row[SEQUENCE])
        fresh = sequence != self.last_sequence
        if sequence == 0:
            nothing = np.full((4, 2), math.nan), np.full(4, math.nan)
            return *nothing, STALE, False, False, math.nan, 0, False, False
        centres = row[CONTENT:].reshape(4, 2)
        quality = [1.0 if math.isfinite(u) else math.nan for u in row[CONTENT::2].tolist()]
        count = quality.count(1.0)
        status = 4 - count if count >= 2 else NOT_FOUND
        lost = fresh and status > TWO_CIRCLES
        return centres, quality, status, status == 0, lost, row[STAMP], sequence, fresh, False

    def update(self) -> None:
        """Keep the measurement of this tick, and the measurements that have arrived."""
        if self._is_captured():
            fill_normal(self.stream, self.drawn)
        self._advance()
        self.last_sequence = int(self.shown[SEQUENCE])

    def _taken(self, position: Any, attitude: Any, time: float) -> Row | None:
        """Return the measurement of this tick; None if there is none, or if it is lost."""
        if not self._is_captured() or self._is_lost(time):
            return None
        return self._row(time, self._measure(position, attitude))

    def _measure(self, position: Any, attitude: Any) -> Any:
        """Return u, v of the four centres (8,) in px; NaN where a circle is not wholly in the picture."""
        turn, shift = camera_pose(position, attitude, self.ceiling)
        depth = self._corners @ turn[2] + shift[2]
        depths, radius = depth.tolist(), self.radius
        behind = min(depths) <= radius
        corners = self._corners[depth > radius] if behind else self._corners
        pixels = self._camera.to_pixels(ellipse_centres(plane_homography(turn, shift), corners, radius))
        if behind:
            seen, pixels = pixels, np.full((4, 2), math.nan)
            pixels[depth > radius] = seen
        if self.field_of_view == PICTURE:
            width, height = self._camera.size
            size = float(self._camera.matrix[1, 1]) * radius
            for corner, ((u, v), away) in enumerate(zip(pixels.tolist(), depths, strict=True)):
                reach = size / max(away, radius)
                if not (reach <= u <= width - 1 - reach and reach <= v <= height - 1 - reach):
                    pixels[corner] = math.nan
        return pixels.ravel() + self.noise * self.drawn
