"""A simulated camera and detector without pictures: projected circle centres with noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, Random, State, Work, fill_normal
from quadvis_blocks.vision._delivery import (
    CONTENT,
    QUEUE,
    SEQUENCE,
    STAMP,
    DeliveringCamera,
    advance,
    deliver,
    draw,
    is_captured,
    take,
)
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.pinhole import NUMBERS, pinhole, pixel
from quadvis_vision.camera.projection import (
    CORNERS,
    RADIUS,
    SIDE,
    camera_point,
    camera_rotation,
    ellipse_centre,
)
from quadvis_vision.detection.detect import NOT_FOUND, STALE, TWO_CIRCLES

WIDTH = CONTENT + 8  # of a row: u, v of four circles
PICTURE, UNBOUNDED = range(2)


class GeometricCamera(DeliveringCamera, Block):
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
    sigma = Out("float64[4]", unit="px", nan=True, doc="noise of u and of v, NaN for a missing circle")
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

    optics = Derived(f"float64[{NUMBERS}]", doc="the camera as `pinhole` takes it")
    size = Derived("float64[2]", unit="px", doc="width and height of the picture")

    stream = Random()
    drawn = State("float64[8]")  # noise of the coming measurement
    pending = State(f"float64[{QUEUE},{WIDTH}]")
    shown = State(f"float64[{WIDTH}]")
    taken = Work(f"float64[{WIDTH}]")
    wire = Work(f"float64[{WIDTH}]")
    last_sequence = State("int64")

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        camera:
          block: vision.geometric_camera
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", ceiling: 4.5 m, side: 1 m, noise: 0.3 px}
          in: {position: place.y, attitude: {value: [0, 0, 0], unit: rad}}
    """

    def check(self) -> None:
        """Read the calibration, and refuse a latency that is too long for the period."""
        super().check()
        calibration = self.read_file("calibration", CameraCalibration.load)
        self.optics, self.size = calibration.numbers, calibration.size

    def start(self) -> None:
        """Draw the chances and the noise of the first measurement."""
        draw(self)
        fill_normal(self.stream, self.drawn)

    def output(self, position: Any, attitude: Any, time: float) -> tuple[Any, ...]:
        """Return the measurement that arrived last."""
        if take(self, is_captured(self), time, time):
            _measure(self, position, attitude)
        deliver(self, time)
        sequence = int(self.wire[SEQUENCE])
        fresh = sequence != self.last_sequence
        centres, quality, sigma = np.full((4, 2), math.nan), np.full(4, math.nan), np.full(4, math.nan)
        if sequence == 0:
            return centres, quality, sigma, STALE, False, False, math.nan, 0, False, False
        count = 0
        for corner in range(4):
            u, v = float(self.wire[CONTENT + 2 * corner]), float(self.wire[CONTENT + 2 * corner + 1])
            if math.isfinite(u):
                centres[corner, 0], centres[corner, 1] = u, v
                quality[corner], sigma[corner] = 1.0, self.noise
                count += 1
        status = 4 - count if count >= 2 else NOT_FOUND
        lost, stamp = fresh and status > TWO_CIRCLES, float(self.wire[STAMP])
        return centres, quality, sigma, status, status == 0, lost, stamp, sequence, fresh, False

    def update(self, time: float) -> None:
        """Keep the measurement of this tick, and the measurements that have arrived."""
        captured = is_captured(self)
        if captured:
            fill_normal(self.stream, self.drawn)
        advance(self, captured, time)
        self.ticks += 1
        self.last_sequence = int(self.shown[SEQUENCE])


def _measure(camera: Any, position: Any, attitude: Any) -> None:
    """Write u, v of the four centres (px) into ``taken``; NaN where a circle is not wholly in the picture."""
    turn = camera_rotation(float(attitude[0]), float(attitude[1]), float(attitude[2]))
    place = (float(position[0]), float(position[1]), camera.ceiling - float(position[2]))
    normal = (turn[0][2], turn[1][2], turn[2][2])
    optics = pinhole(camera.optics)
    across, down = float(camera.size[0]), float(camera.size[1])
    for corner in range(4):
        forward, right = CORNERS[corner]
        point = camera_point(turn, place, camera.side * forward, camera.side * right)
        u, v = math.nan, math.nan
        if point[2] > camera.radius:
            x, y = ellipse_centre(point, normal, camera.radius)
            u, v = pixel(optics, x, y)
            reach = optics.fy * camera.radius / point[2]
            inside = reach <= u <= across - 1 - reach and reach <= v <= down - 1 - reach
            if camera.field_of_view == PICTURE and not inside:
                u, v = math.nan, math.nan
        camera.taken[CONTENT + 2 * corner] = u + camera.noise * camera.drawn[2 * corner]
        camera.taken[CONTENT + 2 * corner + 1] = v + camera.noise * camera.drawn[2 * corner + 1]
