"""Draw the detector's and the pose's results into a picture: circles, square, axes and a caption."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis_vision.camera.projection import circle_outline, target_corners
from quadvis_vision.pictures.drawing import (
    PLATE,
    SHIFT,
    Colour,
    Picture,
    is_picture,
    sixteenths,
    width_of,
    write,
    write_on_plate,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadvis_vision.camera.calibration import CameraCalibration

    Floats = NDArray[np.float64]

# Words for the statuses of the detector, by number.
STATUS = (
    "four circles",
    "three circles",
    "two circles",
    "no target",
    "four circles that are no square",
    "no picture yet",
    "no calibration",
    "not a picture",
    "circles larger than radius_max",
)
_PARTIAL, _LOST = 1, 3  # the first status with missing circles, and the first without any circle

# Blue-green-red. Axes in the usual order red, green, blue.
_GOOD, _WARNING, _BAD, _PLAIN = (120, 230, 120), (60, 190, 255), (90, 90, 255), (235, 235, 235)
_SQUARE = (255, 210, 60)
_AXES = (("x", (60, 60, 255)), ("y", (60, 220, 60)), ("z", (255, 120, 60)))
_GROUND = 96  # grey level in place of a frame that is not a picture

_SCALE = 0.65  # of the letters in the caption; they become smaller if a line like the following would not fit
_LONG = "t 100.00 s   picture 1000   four circles that are no square"
_SQUARE_CORNERS = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])  # u + iv
_STEPS = 12  # straight pieces of an edge, as a lens bends edges
_REDUCED = 0.9  # of the expected radius: a smaller circle is partly hidden


@dataclass(frozen=True)
class Finding:
    """The results for one picture: circles (4, 2) px, their quality (4,), and the pose; NaN is unknown.

    `status` is the detector's, -1 if unknown. `position` (3,) in m is the camera's position in target axes,
    `rotation` (3, 3) goes from target to camera axes; `has_pose` says whether both are valid.
    """

    centres: Floats
    quality: Floats
    status: int
    position: Floats
    rotation: Floats
    yaw: float
    has_pose: bool


class Overlay:
    """Draws findings into pictures of one camera; sizes in m, pictures `zoom` times enlarged."""

    def __init__(self, camera: CameraCalibration, side: float, radius: float, zoom: int) -> None:
        self.camera, self.zoom, self.side = camera, zoom, side
        self._ratio = radius / side
        corners = target_corners(side)
        self._edges = _polygon(corners)
        self._outlines = [circle_outline(corner[:2].tolist(), radius) for corner in corners]

    def draw(self, pixels: object, found: Finding, title: str) -> Picture:
        """Return the enlarged picture with marks, and a caption of two lines below it.

        A frame that is not a picture becomes a grey picture of the camera's size. The caption begins with the
        title.
        """
        canvas = self._canvas(pixels)
        with np.errstate(all="ignore"):  # a pose may be anything
            if _has_view(found):
                self._draw_target(canvas, found, found.rotation, -found.rotation @ found.position)
            else:
                self._draw_missing(canvas, found)
            self._draw_circles(canvas, found)
        return np.vstack((canvas, _caption(canvas.shape[1], found, title)))

    def _canvas(self, pixels: object) -> Any:
        import cv2

        if not is_picture(pixels):
            width, height = self.camera.size
            return np.full((height * self.zoom, width * self.zoom, 3), _GROUND, dtype=np.uint8)
        whole: Any = np.ascontiguousarray(pixels)
        if self.zoom == 1:
            return whole.copy()
        return cv2.resize(whole, None, fx=self.zoom, fy=self.zoom, interpolation=cv2.INTER_LINEAR)

    def _draw_target(self, canvas: Any, found: Finding, turn: Floats, shift: Floats) -> None:
        """Draw the target according to the pose: the square, its axes, and the circles that were not seen."""
        self._line(canvas, self._edges, turn, shift, _SQUARE, 1)
        reach = 0.4 * self.side
        for axis, (name, colour) in enumerate(_AXES):
            way = np.zeros((_STEPS + 1, 3))
            way[:, axis] = np.linspace(0, reach, _STEPS + 1)
            end = self._line(canvas, way, turn, shift, colour, 2)
            if end is not None:
                self._word(canvas, name, end, (6, -6), colour)
        for number, (outline, centre) in enumerate(zip(self._outlines, found.centres, strict=True), 1):
            missing = not np.isfinite(centre).all()
            closed = np.vstack((outline, outline[:1]))
            colour = _WARNING if missing else _GOOD
            self._line(canvas, closed, turn, shift, colour, 1)
            if missing:
                (pixel,) = self.camera.project(outline.mean(axis=0) @ turn.T + shift)
                edge = self.camera.project(outline @ turn.T + shift)
                if np.isfinite(pixel).all():
                    reach = np.abs(edge - pixel).max(axis=0)
                    self._name_missing(canvas, number, found, pixel, reach)

    def _draw_missing(self, canvas: Any, found: Finding) -> None:
        """Name the missing circles where the others let one expect them, without a pose."""
        places = expected_places(found.centres)
        if places is None:
            return
        reach = np.full(2, self._ratio * abs(places[2] - places[0]) / math.sqrt(2))
        for number, (place, centre) in enumerate(zip(places, found.centres, strict=True), 1):
            if not np.isfinite(centre).all():
                self._name_missing(canvas, number, found, np.array((place.real, place.imag)), reach)

    def _name_missing(self, canvas: Any, number: int, found: Finding, pixel: Floats, reach: Floats) -> None:
        """Write why a circle is missing: it is partly hidden, cut by the edge of the picture, or not seen."""
        quality = found.quality[number - 1]
        size = np.array(canvas.shape[1::-1]) / self.zoom
        if np.isfinite(quality):
            why = f"hidden ({quality:.2f})"
        elif (pixel - reach < -0.5).any() or (pixel + reach > size - 0.5).any():
            why = "cut"
        else:
            why = "not seen"
        inside = np.clip(pixel, 0, size - 1)
        self._word(canvas, f"{number} {why}", inside, (-30, 5), _WARNING)

    def _draw_circles(self, canvas: Any, found: Finding) -> None:
        """Mark each circle that was seen by a cross and its number, and write its hidden share beside it."""
        import cv2

        for number, (centre, quality) in enumerate(zip(found.centres, found.quality, strict=True), 1):
            if not np.isfinite(centre).all():
                continue
            arm = 4.0 / self.zoom + 1.0
            for step in (np.array([arm, 0.0]), np.array([0.0, arm])):
                first, last = sixteenths(np.stack((centre - step, centre + step)), self.zoom).tolist()
                for colour, width in (((20, 20, 20), 3), (_PLAIN, 1)):
                    cv2.line(canvas, first, last, colour, width, cv2.LINE_AA, SHIFT)
            text = f"{number} ({quality:.2f})" if quality < _REDUCED else str(number)
            self._word(canvas, text, centre, (9, -9), _PLAIN)

    def _line(
        self, canvas: Any, points: Floats, turn: Floats, shift: Floats, colour: Colour, width: int
    ) -> Floats | None:
        """Draw a line through points (n, 3) of the target; return its last pixel, or None if it has none."""
        import cv2

        pixels = self.camera.project(points @ turn.T + shift)
        if not np.isfinite(pixels).all():
            return None
        path = sixteenths(pixels, self.zoom).reshape(-1, 1, 2)
        cv2.polylines(canvas, [path], False, colour, max(1, width * self.zoom // 2), cv2.LINE_AA, SHIFT)
        return np.asarray(pixels[-1])

    def _word(self, canvas: Any, text: str, pixel: Floats, offset: tuple[int, int], colour: Colour) -> None:
        x, y = (sixteenths(pixel[None], self.zoom)[0] >> SHIFT).tolist()
        write_on_plate(canvas, text, (x + offset[0], y + offset[1]), colour, 0.5)


def expected_places(centres: Floats) -> list[complex] | None:
    """Return the places (px) of all four circles from three or two known `centres` (4, 2), None without."""
    points = centres[:, 0] + 1j * centres[:, 1]
    known = np.flatnonzero(np.isfinite(points)).tolist()
    if len(known) == 3:
        missing = 6 - sum(known)
        points[missing] = points[missing - 1] + points[(missing + 1) % 4] - points[missing - 2]
    elif len(known) == 2:
        i, j = known
        points = points[i] + (points[j] - points[i]) * (_SQUARE_CORNERS - _SQUARE_CORNERS[i]) / (
            _SQUARE_CORNERS[j] - _SQUARE_CORNERS[i]
        )
    else:
        return None
    return [complex(point) for point in points]


def pose_text(found: Finding) -> str:
    """Return position (cm) and yaw (deg) in words, as far as they are known."""
    if not _has_position(found):
        return "no pose"
    x, y, z = (100 * found.position).tolist()
    text = f"x {x:+.1f}  y {y:+.1f}  z {z:.1f} cm"
    return f"{text}   yaw {math.degrees(found.yaw):+.1f} deg" if math.isfinite(found.yaw) else text


def _status(status: int) -> tuple[str, Colour]:
    if not 0 <= status < len(STATUS):
        return "", _PLAIN
    return STATUS[status], _GOOD if status < _PARTIAL else _WARNING if status < _LOST else _BAD


def _polygon(corners: Floats) -> Floats:
    """Return the closed outline (n, 3) of corners (m, 3), each edge divided into pieces."""
    share = np.linspace(0, 1, _STEPS, endpoint=False)[:, None]
    edges = [a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    return np.vstack((*edges, corners[:1]))


def _caption(width: int, found: Finding, title: str) -> Picture:
    """Return the bar below the picture; its height depends on the width alone."""
    said, colour = _status(found.status)
    pose = pose_text(found)
    first = f"{title}   "
    usual = min(_SCALE, max(1, width - 16) / width_of(_LONG))
    line = max(8, round(36 * usual))
    bar = np.full((2 * line + 8, width, 3), PLATE, dtype=np.uint8)
    scale = min(usual, max(1, width - 16) / max(width_of(first + said), width_of(pose)))
    write(bar, first, (8, line), _PLAIN, scale)
    write(bar, said, (8 + round(scale * width_of(first)), line), colour, scale)
    write(bar, pose, (8, 2 * line), _PLAIN if _has_position(found) else _WARNING, scale)
    return bar


def _has_position(found: Finding) -> bool:
    return found.has_pose and bool(np.isfinite(found.position).all())


def _has_view(found: Finding) -> bool:
    return _has_position(found) and bool(np.isfinite(found.rotation).all())
