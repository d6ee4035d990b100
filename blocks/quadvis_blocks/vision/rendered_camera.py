"""A simulated camera that looks up at the target."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, Frame, In, Out, Param, ParameterError, Random, State, Work, uniform
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
from quadvis_vision.camera.projection import RADIUS, SIDE
from quadvis_vision.simulation.renderer import Renderer, Scene

# The content of a row: the numbers on which its picture depends.
LIGHT, NOISE = CONTENT, CONTENT + 1
START = slice(CONTENT + 2, CONTENT + 8)  # pose at the beginning and the end of the exposure
END = slice(CONTENT + 8, CONTENT + 14)
WIDTH = CONTENT + 14


class RenderedCamera(DeliveringCamera, Block, numeric=False):
    """The pictures of a camera on the craft, of four coloured discs on a light ceiling.

    The camera looks straight up from the craft: picture right is the craft's front, picture top its right
    side. At zero attitude below the middle of the target, discs 1 to 4 are clockwise from the upper left.
    They leave the picture where real discs would. Colours are blue-green-red, as in a `Frame`, and linear in
    light.

    The exposure of a frame ends at its tick; the stamp is the middle of the exposure. A frame is delivered at
    the first tick at or after stamp + latency + extra; the extra time is drawn from 0 to ``jitter``. Until
    another frame arrives, the last frame stays on the wire with its sequence number. Frames may overtake each
    other, and lost frames leave a gap in the sequence numbers. Motion blur follows the straight way from the
    pose at the tick before.

    Source: pinhole camera of equations (9)-(10) and (38) with OpenCV's lens model; target of sections 5 and
    6.
    """

    position = In("float64[3]", unit="m", doc="position of the craft: x forward, y right, h up")
    attitude = In(
        "float64[3]", unit="rad", doc="phi right side down, theta nose up, psi clockwise from above"
    )
    frame = Out("frame", doc="the newest frame that has arrived")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    ceiling = Param(4.5, unit="m", doc="height of the target; 3 m above a hover at 1.5 m")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring discs")
    radius = Param(RADIUS, unit="m", above=0.0, doc="radius of the discs")
    colours = Param(
        ((45.0, 40.0, 190.0), (165.0, 75.0, 30.0), (65.0, 135.0, 40.0), (35.0, 35.0, 35.0)),
        type="float64[4,3]",
        min=0.0,
        max=255.0,
        doc="blue-green-red grey levels of discs 1 to 4: red, blue, green, black",
    )
    background = Param(
        (200.0, 207.0, 210.0),
        type="float64[3]",
        min=0.0,
        max=255.0,
        doc="blue-green-red grey levels of the ceiling",
    )
    exposure = Param(1.0, min=0.0, tune=True, doc="brightness of the whole picture")
    white_balance = Param((1.0, 1.0, 1.0), type="float64[3]", min=0.0, doc="gain of blue, green and red")
    vignette = Param(
        0.0, min=0.0, max=1.0, doc="share of the light that is lost in the corners of the picture"
    )
    noise = Param(
        2.0, min=0.0, max=60.0, doc="standard deviation of the sensor's noise in grey levels, added last"
    )
    exposure_time = Param(0.0, unit="s", min=0.0, doc="length of the exposure, for motion blur")

    stream = Random()
    grain = State()  # noise of the coming frame, from 0 to 1
    previous = State("float64[6]")  # pose one tick ago
    pending = State(f"float64[{QUEUE},{WIDTH}]")
    shown = State(f"float64[{WIDTH}]")
    taken = Work(f"float64[{WIDTH}]")
    wire = Work(f"float64[{WIDTH}]")

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        camera:
          block: vision.rendered_camera
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", ceiling: 4.5 m, side: 1 m}
          in: {position: place.y, attitude: {value: [0, 0, 0], unit: rad}}
    """

    def check(self) -> None:
        """Read the calibration; refuse discs that overlap, and times that are too long for the period."""
        super().check()
        self._load()
        if 2 * self.radius >= self.side:
            raise ParameterError(
                "radius", f"radius must be below half of side ({self.side / 2:g} m), or discs overlap"
            )
        if self.exposure_time > self.period:
            longest = f"at most the period, {self.period:g} s"
            raise ParameterError(
                "exposure_time", f"exposure_time must be {longest}, got {self.exposure_time:g} s"
            )

    def _load(self) -> CameraCalibration:
        return self.read_file("calibration", CameraCalibration.load)

    def open(self) -> None:
        """Prepare the renderer."""
        scene = Scene(
            side=self.side,
            radius=self.radius,
            ceiling=self.ceiling,
            colours=np.array(self.colours),
            background=np.array(self.background),
            white_balance=np.array(self.white_balance),
            vignette=self.vignette,
            noise=self.noise,
        )
        self._renderer = Renderer(self._load(), scene)
        self._last: tuple[bytes, Frame] = (b"", Frame.none())

    def start(self) -> None:
        """Draw the chances and the noise of the first frame."""
        draw(self)
        self.grain = uniform(self.stream)

    def output(self, position: Any, attitude: Any, time: float) -> Frame:
        """Return the frame that arrived last."""
        if take(self, is_captured(self), time, time - self.exposure_time / 2):
            self.taken[CONTENT:] = self._content(np.concatenate((position, attitude)))
        deliver(self, time)
        return self._picture(self.wire)

    def update(self, position: Any, attitude: Any, time: float) -> None:
        """Keep the frame captured at this tick, and the frame on the wire."""
        captured = is_captured(self)
        if captured:
            self.grain = uniform(self.stream)
        advance(self, captured, time)
        self.ticks += 1
        self.previous[:3], self.previous[3:] = position, attitude

    def _content(self, pose: Any) -> Any:
        """Return the numbers of the frame whose exposure ends at this tick with the craft at a pose (6,)."""
        begin = pose
        if self.ticks and self.exposure_time:
            way = pose - self.previous
            way[3:] -= 2 * math.pi * np.round(way[3:] / (2 * math.pi))  # the short way round
            begin = pose - way * (self.exposure_time / self.period)
        return np.concatenate(([self.exposure, self.grain], begin, pose))

    def _picture(self, row: Any) -> Frame:
        """Return the frame of a row; the last one is kept, since it may stay on the wire."""
        if not row[SEQUENCE]:
            return Frame.none()
        key = row.tobytes()
        if self._last[0] != key:
            pixels = self._renderer.render(row[START], row[END], row[LIGHT], row[NOISE])
            self._last = (key, Frame(pixels, float(row[STAMP]), int(row[SEQUENCE])))
        return self._last[1]
