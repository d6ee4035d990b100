"""A simulated camera and detector without pictures: projected circle centres with noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, Random, State, read_parameter_file
from quadvis_blocks._random import normal, uniform
from quadvis_blocks.vision._calibration import CameraCalibration
from quadvis_blocks.vision._detect import NOT_FOUND, STALE, TWO_CIRCLES
from quadvis_blocks.vision._projection import RADIUS, SIDE, camera_pose, target_corners

QUEUE = 16  # measurements that can be on their way at once
STAMP, SEQUENCE, PIXELS = 0, 1, slice(2, 10)


class GeometricCamera(Block, numeric=False):
    """What `vision.rendered_camera` and `vision.circle_detector` would give, without rendering.

    The centres of the four circles are projected, white noise is added, and a circle whose outline leaves
    the picture is missing. It has the outputs of the detector, so either can fill the same slot; it takes a
    tenth of the time, and its noise is a parameter. Measurements are stamped when they are taken and
    delivered at the first tick at or after stamp + latency; until the next one comes, the last stays, with
    ``fresh`` false.

    Source: camera of equations (10) and (38); noise and latency of the reference experiment.
    """

    position = In("float64[3]", unit="m", doc="position of the craft: x forward, y right, h up")
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw")
    centres = Out("float64[4,2]", unit="px", nan=True, doc="u, v of circles 1 to 4; NaN rows are missing")
    quality = Out("float64[4]", nan=True, doc="1 for a circle that is seen")
    status = Out("int64", doc="0, 1, 2: four, three, two circles; 3: target not found; 5: nothing yet")
    found = Out("bool", doc="all four circles")
    lost = Out("bool", doc="a new measurement in which there is no target")
    stamp = Out(unit="s", nan=True, doc="instant of the measurement")
    sequence = Out("int64", doc="number of the measurement; 0 before the first")
    fresh = Out("bool", doc="a measurement that was not there at the step before")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    ceiling = Param(4.5, unit="m", doc="height of the target; 3 m above a hover at 1.5 m")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")
    radius = Param(RADIUS, unit="m", above=0.0, doc="radius of the circles")
    noise = Param(0.3, unit="px", min=0.0, tune=True, doc="white noise of each coordinate, one sigma")
    latency = Param(0.1, unit="s", min=0.0, doc="time from the measurement to its delivery")
    drop_rate = Param(0.0, min=0.0, max=1.0, tune=True, doc="probability that a measurement is lost")

    stream = Random()
    drawn = State("float64[9]")  # of the coming measurement: noise of the coordinates, lost or not
    taken = State("int64")
    pending = State(f"float64[{QUEUE},10]")  # measurements on their way, oldest first
    waiting = State("int64")
    shown = State("float64[10]", math.nan)
    last_sequence = State("int64")

    def check(self) -> None:
        """Read the calibration."""
        self._load()

    def _load(self) -> CameraCalibration:
        return read_parameter_file("calibration", self.calibration, CameraCalibration.load)

    def open(self) -> None:
        """Read the calibration; ParameterError if the latency is too long for the period."""
        if self.latency > QUEUE * self.period:
            longest = f"at most {QUEUE} periods, {QUEUE * self.period:g} s"
            raise ParameterError("latency", f"latency must be {longest}, got {self.latency:g} s")
        self._camera = self._load()
        self._corners = target_corners(self.side)

    def start(self) -> None:
        """Draw the chances of the first measurement."""
        self.shown[SEQUENCE] = 0.0
        self._draw()

    def output(self, position: Any, attitude: Any, time: float) -> tuple[Any, ...]:
        """Return the newest measurement that has arrived."""
        row = self._arrived(self._queue(position, attitude, time), time)[0]
        sequence = int(row[SEQUENCE])
        fresh = sequence != self.last_sequence
        centres = row[PIXELS].reshape(4, 2)
        count = int(np.isfinite(centres[:, 0]).sum())
        status = 4 - count if count >= 2 else NOT_FOUND
        if sequence == 0:
            status = STALE
        quality = np.where(np.isfinite(centres[:, 0]), 1.0, math.nan)
        return (
            centres,
            quality,
            status,
            status == 0,
            fresh and status > TWO_CIRCLES,
            row[STAMP],
            sequence,
            fresh,
        )

    def update(self, position: Any, attitude: Any, time: float) -> None:
        """Keep what was measured at this tick, and what has arrived."""
        shown, rest = self._arrived(self._queue(position, attitude, time), time)
        self.last_sequence = int(shown[SEQUENCE])
        self.shown[:] = shown
        self.pending[: len(rest)] = np.reshape(rest, (-1, 10))
        self.waiting = len(rest)
        self.taken += 1
        self._draw()

    def _draw(self) -> None:
        for index in range(8):
            self.drawn[index] = normal(self.stream)
        self.drawn[8] = uniform(self.stream)

    def _queue(self, position: Any, attitude: Any, time: float) -> list[Any]:
        """Return the measurements on their way, with the one that is taken now unless it gets lost."""
        queue = [row.copy() for row in self.pending[: self.waiting]]
        if self.drawn[8] >= self.drop_rate:
            queue.append(np.concatenate(([time, self.taken + 1], self._measure(position, attitude).ravel())))
        return queue

    def _measure(self, position: Any, attitude: Any) -> Any:
        """Return the four centres (4, 2) in px; NaN where a circle is not wholly in the picture."""
        turn, shift = camera_pose(position, attitude, self.ceiling)
        points = self._corners @ turn.T + shift
        pixels = np.full((4, 2), math.nan)
        ahead = points[:, 2] > self.radius
        if ahead.any():
            pixels[ahead] = self._camera.project(points[ahead])
        width, height = self._camera.size
        reach = self._camera.matrix[1, 1] * self.radius / np.maximum(points[:, 2], self.radius)
        inside = (pixels >= reach[:, None]).all(axis=1) & (
            pixels <= np.array([width - 1, height - 1]) - reach[:, None]
        ).all(axis=1)
        pixels[~inside] = math.nan
        return pixels + self.noise * np.asarray(self.drawn[:8]).reshape(4, 2)

    def _arrived(self, queue: list[Any], time: float) -> tuple[Any, list[Any]]:
        """Return the measurement that is there at this time, and those that are still on their way."""
        now = time + 1e-6 * self.period  # a sum of decimal times must not miss its tick by a rounding error
        due = [row for row in queue if row[STAMP] + self.latency <= now]
        return (due[-1] if due else self.shown.copy()), queue[len(due) :]
