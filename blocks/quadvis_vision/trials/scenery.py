"""The parts of a test picture for a detector: discs, things beside them, and the effects of light and camera.

Discs are drawn by counting sub-pixels, so they are independent of the product's own renderer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Colour = tuple[float, float, float]

CEILING: Colour = (204.0, 208.0, 210.0)

_FINE = 8  # sub-pixels along an edge
_LENS = 0.6  # px, sigma of the optics
_TRIES = 1000  # to find a free place for a thing
_BAR = (1.6, 1.4)  # half the length, and the width, of the bar that hides a disc, in radii of the disc


@dataclass(frozen=True)
class Condition:
    """The differences of a scene from a clear one. Lengths in px are those of the picture, at any size.

    =================== ==============================================================================
    light and camera    meaning
    =================== ==============================================================================
    ``noise``           standard deviation in grey levels
    ``gain``            factor of each channel
    ``vignette``        share of light lost in the corners
    ``gradient``        share of light lost at one edge
    ``lamp``            a bright spot
    ``blur``            length of motion blur in px
    ``quality``         of JPEG; 0 for no JPEG; with ``subsampled`` colours
    =================== ==============================================================================

    =================== ==============================================================================
    things and target   meaning
    =================== ==============================================================================
    ``odd``             number of things in other colours and shapes
    ``decoys``          number of discs in the target's colours
    ``clutter``         number of pieces of photographs or, without photographs, of made-up texture
    ``missing``         number of circles that are missing; 4 for no target at all
    ``cover``           share of one disc's diameter behind a bar
    ``covering``        colour of that bar, if it is not the ceiling's
    ``tilt``            largest tilt in deg
    ``distance``        distance in m
    =================== ==============================================================================
    """

    noise: float = 5.0
    gain: Colour = (1.0, 1.0, 1.0)
    vignette: float = 0.0
    gradient: float = 0.0
    lamp: bool = False
    blur: float = 0.0
    quality: int = 0
    subsampled: bool = False
    odd: int = 0
    decoys: int = 0
    clutter: int = 0
    missing: int = 0
    cover: float = 0.0
    covering: Colour | None = None
    tilt: float = 8.0
    distance: tuple[float, float] = (2.2, 4.5)
    ceiling: Colour = CEILING


def project(h: Array, points: NDArray[Any]) -> Array:
    """Return the images (n, 2) of points (n, 2)."""
    image = np.column_stack((points, np.ones(len(points)))) @ h.T
    return np.asarray(image[:, :2] / image[:, 2:])


class Ellipse:
    """The image of a disc of `middle` (2,) and `radius` in m: `centre` (2,) and radius `size` in px."""

    def __init__(self, h: Array, middle: Array, radius: float) -> None:
        angle = np.linspace(0, 2 * math.pi, 32, endpoint=False)
        edge = project(h, middle + radius * np.column_stack((np.cos(angle), np.sin(angle))))
        self._ends = edge.min(0), edge.max(0)
        self.low = np.floor(edge.min(0)).astype(int) - 1
        self.high = np.ceil(edge.max(0)).astype(int) + 2
        part = (np.arange(_FINE) + 0.5) / _FINE - 0.5
        axes = [(np.arange(a, b)[:, None] + part).ravel() for a, b in zip(self.low, self.high, strict=True)]
        self._u, self._v = np.meshgrid(*axes)
        back: Array = np.asarray(np.linalg.inv(h), dtype=np.float64)
        x, y = project(back, np.column_stack((self._u.ravel(), self._v.ravel()))).T
        self._inside = (np.hypot(x - middle[0], y - middle[1]) < radius).reshape(self._u.shape)
        self.centre = np.array([self._u[self._inside].mean(), self._v[self._inside].mean()])
        self.size = math.sqrt(self._inside.sum() / math.pi) / _FINE

    def is_in(self, size: tuple[int, int]) -> bool:
        """Return whether the whole disc is in a picture of `size` px."""
        return bool((self._ends[0] > -0.5).all() and (self._ends[1] < np.array(size) - 0.5).all())

    def paint(self, picture: Array, colour: Colour) -> None:
        """Paint the disc."""
        self._blend(picture, self._inside, colour)

    def cover(self, picture: Array, share: float, direction: float, colour: Colour) -> None:
        """Hide a share of the disc's diameter by a bar across it, on the side toward `direction`."""
        import cv2

        ahead = np.array((math.cos(direction), math.sin(direction)))
        along = self._u * ahead[0] + self._v * ahead[1]
        first, last = along[self._inside].min(), along[self._inside].max()
        nearest = self.centre + (last - share * (last - first) - self.centre @ ahead) * ahead
        aside = _BAR[0] * self.size * np.array((-ahead[1], ahead[0]))
        depth = _BAR[1] * self.size * ahead
        bar = np.array((nearest - aside, nearest + aside, nearest + aside + depth, nearest - aside + depth))
        cv2.fillPoly(picture, [np.round(16 * bar).astype(np.int32)], colour, cv2.LINE_AA, 4)

    def _blend(self, picture: Array, mask: NDArray[np.bool_], colour: Colour) -> None:
        (left, top), (right, bottom) = self.low, self.high
        share = mask.reshape(bottom - top, _FINE, right - left, _FINE).mean((1, 3))[..., None]
        low, high = np.maximum(self.low, 0), np.minimum(self.high, picture.shape[1::-1])
        if (low < high).all():
            window = picture[low[1] : high[1], low[0] : high[0]]
            window += share[low[1] - top : high[1] - top, low[0] - left : high[0] - left] * (colour - window)


def furnish(
    rng: np.random.Generator,
    picture: Array,
    discs: Sequence[Ellipse],
    condition: Condition,
    paint: Sequence[Colour],
    photographs: Sequence[Picture],
) -> None:
    """Put the things that a condition asks for on the ceiling, clear of the target's discs."""
    things = _Things(rng, picture, discs)
    for _ in range(condition.clutter):
        things.put_piece(photographs)
    for _ in range(condition.odd):
        things.put_odd()
    for index in range(condition.decoys):
        things.put_decoy(paint[index % 4])


class _Things:
    """Puts things on the ceiling, clear of the target's discs."""

    def __init__(self, rng: np.random.Generator, picture: Array, discs: Sequence[Ellipse]) -> None:
        self._rng, self._picture, self._discs = rng, picture, discs
        self._unit = picture.shape[1] / 100  # sizes of things are proportional to the picture's width

    def put_decoy(self, colour: Colour) -> None:
        """Paint a disc."""
        radius = self._rng.uniform(0.9, 3.5) * self._unit
        place = self._place(radius)
        if place is not None:
            self._disc(place, radius, colour)

    def _place(self, reach: float) -> Array | None:
        """Return a place (2,) in the picture, clear of the discs; None if no free place was found."""
        size = np.array(self._picture.shape[1::-1])
        for _ in range(_TRIES):
            place = self._rng.uniform(0, size)
            apart = [np.hypot(*(place - disc.centre)) - 1.25 * disc.size for disc in self._discs]
            if min(apart, default=math.inf) > reach + 4:
                return np.asarray(place)
        return None

    def _disc(self, place: Array, radius: float, colour: Colour) -> None:
        h = np.array([[1.0, 0.0, place[0]], [0.0, 1.0, place[1]], [0.0, 0.0, 1.0]])
        Ellipse(h, np.zeros(2), radius).paint(self._picture, colour)

    def put_odd(self) -> None:
        """Paint a disc, a bar or a polygon of any colour."""
        import cv2

        rng, reach = self._rng, self._rng.uniform(1.5, 6) * self._unit
        place, kind = self._place(reach), int(rng.integers(3))
        colour = tuple(rng.uniform(10, 230, 3).tolist())
        if place is None:
            return
        if kind == 0:
            self._disc(place, reach, colour)
            return
        angles = np.sort(rng.uniform(0, 2 * math.pi, 5)) if kind == 1 else np.array([0.0, 0.3, 3.1, 3.5])
        angles += rng.uniform(0, 2 * math.pi)
        points: Any = place + reach * np.column_stack((np.cos(angles), np.sin(angles)))
        cv2.fillPoly(self._picture, [np.round(16 * points).astype(np.int32)], colour, cv2.LINE_AA, 4)

    def put_piece(self, photographs: Sequence[Picture]) -> None:
        """Put on a piece of a photograph, or of coarse or fine coloured texture."""
        import cv2

        rng = self._rng
        width, height = (max(6, int(part)) for part in rng.uniform(8, 26, 2) * self._unit)
        place = self._place(math.hypot(width, height) / 2)
        if place is None:
            return
        if photographs:
            source = photographs[int(rng.integers(len(photographs)))]
            rows, columns = (int(rng.uniform(0.2, 0.6) * edge) for edge in source.shape[:2])
            top, left = (
                int(rng.uniform(0, edge - part))
                for edge, part in zip(source.shape, (rows, columns), strict=False)
            )
            piece: Any = source[top : top + rows, left : left + columns]
        else:
            cells = rng.integers(2, 12, 2)
            piece = rng.uniform(0, 255, (*cells, 3)).astype(np.float32)
        piece = cv2.resize(piece, (width, height), interpolation=cv2.INTER_LINEAR)
        left, top = int(place[0] - width / 2), int(place[1] - height / 2)
        window = self._picture[max(top, 0) : top + height, max(left, 0) : left + width]
        window[:] = piece[max(-top, 0) :, max(-left, 0) :][: window.shape[0], : window.shape[1]]


def expose(rng: np.random.Generator, picture: Array, condition: Condition) -> Picture:
    """Return the camera's picture of a scene, with optics, motion, light, noise and JPEG."""
    import cv2

    height, width = picture.shape[:2]
    seen: Any = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), _LENS)
    if condition.blur:
        seen = cv2.filter2D(seen, -1, _smear(condition.blur, rng.uniform(0, math.pi)))
    v, u = np.mgrid[:height, :width].astype(np.float32)
    u, v = u / (width - 1) * 2 - 1, (v - (height - 1) / 2) / (width - 1) * 2
    light = 1 - condition.vignette * (u * u + v * v) / (1 + (height / width) ** 2)
    turn = rng.uniform(0, 2 * math.pi)
    light *= 1 - condition.gradient * (u * math.cos(turn) + v * math.sin(turn) + 1) / 2
    if condition.lamp:
        at = rng.uniform(-0.8, 0.8, 2)
        light += 0.8 * np.exp(-((u - at[0]) ** 2 + (v - at[1]) ** 2) / (2 * 0.15**2))
    seen = seen * light[..., None] * np.array(condition.gain, np.float32)
    seen += condition.noise * rng.standard_normal(seen.shape, np.float32)
    pixels: Picture = np.clip(np.rint(seen), 0, 255).astype(np.uint8)
    if condition.quality:
        options = [cv2.IMWRITE_JPEG_QUALITY, condition.quality]
        chroma = "420" if condition.subsampled else "444"
        options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, getattr(cv2, f"IMWRITE_JPEG_SAMPLING_FACTOR_{chroma}")]
        decoded: Any = cv2.imdecode(cv2.imencode(".jpg", pixels, options)[1], cv2.IMREAD_COLOR)
        pixels = decoded
    return pixels


def _smear(length: float, direction: float) -> NDArray[np.float32]:
    """Return the kernel of a uniform motion, symmetric about its middle."""
    reach = math.ceil(length / 2) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    for along in np.linspace(-length / 2, length / 2, 65):
        x, y = reach + along * math.cos(direction), reach + along * math.sin(direction)
        i, j = int(x), int(y)
        a, b = x - i, y - j
        kernel[j : j + 2, i : i + 2] += np.outer((1 - b, b), (1 - a, a)).astype(np.float32)
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)
