"""Finds the four coloured circles of the target in a picture."""

from __future__ import annotations

import math
import zlib
from typing import Any

import numpy as np

from quadvis.block import Block, Frame, In, Out, Param, ParameterError, State
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.projection import RADIUS, SIDE
from quadvis_vision.detection.circles import CircleTarget
from quadvis_vision.detection.colours import ColourCalibration
from quadvis_vision.detection.detect import (
    STALE,
    TWO_CIRCLES,
    UNUSABLE,
    Detection,
    nothing,
    search,
    usable,
)
from quadvis_vision.detection.follow import follow
from quadvis_vision.detection.measure import NATIVE

STALE_PICTURE = 0  # of the choices of repeats
RECENT = 32  # remembered pictures
FOLLOW_MAX = 0.5  # s; after a longer time between two pictures the target is searched for, not followed


class CircleDetector(Block, numeric=False):
    """The places of the four coloured circles of the target in a picture.

    Corners 1 to 4 are clockwise from the upper left of the picture at zero yaw: red, blue, green and black in
    the paper. A new target is accepted if four circles make a square. Three or two circles are enough (see
    `fewest`) if their sizes and ellipses agree to a few percent with their distances, and if no other circles
    in the picture could be meant. A target that was found before is kept by three or two circles that moved
    together. A circle that is hidden in part, from about a tenth of its diameter on, has no centre, and its
    quality says why. Two circles that one edge cuts are no target, nor are whole circles beside parts of
    others that are not where the whole ones tell: a picture may be torn.

    At steps without a new picture the block repeats the last result, with its stamp and sequence number, and
    `fresh` is false. A picture is not new if it equals one of the last 32 different pictures to the bit,
    whatever its stamp and number: a sensor has noise, so a picture that repeats means that the camera froze,
    or that it repeats a cycle of old pictures. Set `repeats` to `news` for pictures that may repeat: pictures
    without noise (from a renderer or a recording) in which nothing moves, and recordings that begin again.

    ====== ===========================================================================
    status meaning
    ====== ===========================================================================
    0      four circles
    1      three circles
    2      two circles
    3      target not found
    4      circles of all colours that are no square, or do not belong together
    5      no picture yet
    7      the frame is not a picture, or its size is not the size for `calibration`
    8      four circles of the target that are larger than `radius_max`
    ====== ===========================================================================

    With status 7 and 8, too, the target is not found.

    Source: sections 5 (centres of gravity, colour calibration, order of the corners) and 6.
    """

    functions = NATIVE

    frame = In("frame", doc="the newest picture")
    centres = Out("float64[4,2]", unit="px", nan=True, doc="u, v of circles 1 to 4; NaN rows are missing")
    quality = Out(
        "float64[4]", nan=True, doc="1 for a whole circle, below 0.9 for a partly hidden one, NaN for none"
    )
    sigma = Out(
        "float64[4]", unit="px", nan=True, doc="standard deviation of u and of v, NaN for a missing circle"
    )
    status = Out("int64", doc="0, 1, 2: four, three, two circles; 3 and above: no target, see above")
    found = Out("bool", doc="whether all four circles are found")
    lost = Out("bool", doc="whether a new frame has no target")
    stamp = Out(unit="s", nan=True, doc="instant at which the picture was taken")
    sequence = Out("int64", doc="number of the picture; 0 before the first")
    fresh = Out("bool", doc="whether the picture is new at this step")
    frozen = Out("bool", doc="whether the newest frame repeats a recent picture, to the bit")

    colours = Param(type="file", doc="colours of the circles (YAML)")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")
    radius = Param(RADIUS, unit="m", above=0.0, doc="radius of the circles")
    radius_min = Param(2.0, unit="px", min=1.0, doc="smallest radius in the picture")
    radius_max = Param(80.0, unit="px", above=0.0, doc="largest radius in the picture")
    calibration = Param("", type="file", doc="camera calibration file (YAML): pictures must have its size")
    fewest = Param(
        2, type="int64", min=2, max=4, doc="least number of circles that make a new target; 4 is safest"
    )

    repeats = Param(
        "stale", choices=("stale", "news"), doc="whether a picture that repeats to the bit is stale or news"
    )

    last_centres = State("float64[4,2]", math.nan)
    last_quality = State("float64[4]", math.nan)
    last_sigma = State("float64[4]", math.nan)
    last_status = State("int64", STALE)
    last_stamp = State("float64", math.nan)
    last_sequence = State("int64", 0)
    recent = State(f"int64[{RECENT}]", 0)  # checksums of the last pictures, newest first
    newest = State("int64", 0)  # number of the frame that came last, frozen or not
    stuck = State("bool")
    places = State("float64[4,6]")  # places of all four circles, to follow them; see Detection

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
        detector:
          block: vision.circle_detector
          rate: slow
          with: {colours: "quadvis:calib/colours.yaml", calibration: "quadvis:calib/camera.yaml", side: 1 m}
          in: {frame: pictures.frame}
    """

    def check(self) -> None:
        """Read the files, and compare the sizes."""
        self._load()
        self._size()
        if 2 * self.radius >= self.side:
            raise ParameterError(
                "radius", f"radius must be below half of side ({self.side / 2:g} m), or circles overlap"
            )
        if self.radius_max <= self.radius_min:
            raise ParameterError(
                "radius_max", f"radius_max must be above radius_min ({self.radius_min:g} px)"
            )

    def _load(self) -> ColourCalibration:
        return self.read_file("colours", ColourCalibration.load)

    def _size(self) -> tuple[int, int] | None:
        """Return the width and height that pictures must have, None for any."""
        if not self.calibration:
            return None
        return self.read_file("calibration", CameraCalibration.load).size

    def open(self) -> None:
        """Read the files."""
        self._picture = self._size()
        self._target = CircleTarget(self._load(), self.radius / self.side, self.radius_min, self.radius_max)
        # Results of output, for update of the same tick.
        self._new = self._frozen = False
        self._seen = nothing(STALE)
        self._sum = 0

    def output(self, frame: Frame) -> tuple[Any, ...]:
        """Return the circles of a new picture, or the last result again."""
        self._look(frame)
        if not self._new:
            status = self.last_status
            known = self.last_centres, self.last_quality, self.last_sigma, status
            last = self.last_stamp, self.last_sequence
            return *known, status == 0, False, *last, False, self._frozen
        *seen, status, _ = self._seen
        lost = status > TWO_CIRCLES
        return *seen, status, status == 0, lost, frame.stamp, frame.sequence, True, False

    def update(self, frame: Frame) -> None:
        """Keep the result of a new picture."""
        self.stuck = self._frozen
        self.newest = frame.sequence
        if self._new:
            self.last_centres, self.last_quality, self.last_sigma, self.last_status, self.places = self._seen
            self.last_stamp, self.last_sequence = frame.stamp, frame.sequence
            if self._sum != 0:
                self.recent[1:] = self.recent[:-1].copy()
                self.recent[0] = self._sum

    def _look(self, frame: Frame) -> None:
        """Find out whether there is a new picture, what it shows, and whether the camera is frozen."""
        self._new, self._frozen = False, self.stuck
        if frame.sequence in (0, self.newest):
            return
        self._sum = checksum(frame)
        known = self.last_sequence != 0 and self.repeats == STALE_PICTURE and usable(frame.pixels)
        self._frozen = known and bool((self.recent == self._sum).any())
        self._new = not self._frozen
        if self._new:
            self._seen = self._detect(frame)

    def _detect(self, frame: Frame) -> Detection:
        if not usable(frame.pixels, self._picture):
            return nothing(UNUSABLE)
        pixels = np.ascontiguousarray(frame.pixels)
        if self.last_status <= TWO_CIRCLES and 0 < frame.stamp - self.last_stamp <= FOLLOW_MAX:
            return follow(pixels, self._target, self.places, self.fewest)
        return search(pixels, self._target, self.fewest)


def checksum(frame: Frame) -> int:
    """Return a checksum of the pixels of a frame; 0 if the frame is not a picture."""
    if not usable(frame.pixels):
        return 0
    pixels = np.ascontiguousarray(frame.pixels)
    return zlib.crc32(pixels.data, zlib.crc32(repr(pixels.shape).encode()))
