"""Draw the target on a real ceiling, by its own mathematics, with the truth.

Every pixel stands for `FINE` x `FINE` rays. Each ray meets the ceiling; the share that a disc or line covers
of a ray's surroundings follows from its distance to the edge. What lies under the circles, what lies over
them, the light, and the sensor are layers: functions that change the stage. Nothing here is shared with the
product's renderer or with the scenes of `quadvis_vision.trials`, but the definition of a pose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from quadvis_vision.trials.scenes import CORNERS, PAINT, homography

FINE = 3  # rays along an edge of a pixel
LENS = 0.6  # px, sigma of the optics
SQUARE, DISC = 1.0, 0.12  # m: side of the square, radius of the circles
WHITE = (204.0, 208.0, 210.0)
FOCAL = 430 / 452  # of the picture's width

Layer = Callable[["Stage"], None]


def ellipse_centres(h: np.ndarray, centres: np.ndarray, radius: float) -> np.ndarray:
    """Return the centres (n, 2) px of the ellipses that circles (n, 2) m become under a homography.

    A circle's conic C becomes the conic of the inverse of H C^-1 H'; the last column of that dual conic is
    the image of the pole of the line at infinity, the ellipse's centre.
    """
    found = []
    for x, y in centres:
        circle = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y], [-x, -y, x * x + y * y - radius * radius]])
        middle = (h @ np.linalg.inv(circle) @ h.T)[:, 2]
        found.append(middle[:2] / middle[2])
    return np.array(found)


@dataclass(frozen=True)
class Kind:
    """One kind of ceiling: layers `under` and `over` the circles, of `light` and `sensor`, in this order.

    `radius` are the least and largest radius of a circle in px in a picture 320 px wide, `tilt` the largest
    tilt in deg, `scale` the size of the target over that of the paper's, `shown` whether there is a target,
    `noise` the sensor's in grey levels.
    """

    under: tuple[Layer, ...] = ()
    over: tuple[Layer, ...] = ()
    light: tuple[Layer, ...] = ()
    sensor: tuple[Layer, ...] = ()
    radius: tuple[float, float] = (5.0, 16.0)
    tilt: float = 8.0
    scale: float = 1.0
    shown: bool = True
    noise: float = 4.0
    ceiling: tuple[float, float, float] = WHITE


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture and its truth: `centres` (4, 2) px of the ellipses, NaN without a target, `radii` (4,) px.

    A circle that is not `clear` (4,) is crossed, or outshone in part: it may be reported or missing.
    """

    pixels: np.ndarray
    centres: np.ndarray
    radii: np.ndarray
    clear: np.ndarray

    def right(self, found: np.ndarray, tolerance: float = 0.5) -> bool:
        """Return whether all clear circles are found, and whatever is found is where a circle is."""
        there = ~np.isnan(found[:, 0])
        if np.isnan(self.centres[:, 0]).all():
            return not there.any()
        return bool(there[self.clear].all() and (self.errors(found)[there] <= tolerance).all())

    def errors(self, found: np.ndarray) -> np.ndarray:
        """Return the distance (px) of each circle from its true place; NaN for a circle not found."""
        return np.hypot(*(found - self.centres).T)


class Stage:
    """A ceiling while it is drawn: rays at (x, y) m, at pixels (u, v), with `albedo` and `light`."""

    def __init__(self, rng: np.random.Generator, size: tuple[int, int], kind: Kind) -> None:
        self.rng, self.size, self.kind = rng, size, kind
        self.side, self.radius = SQUARE * kind.scale, DISC * kind.scale
        self.h, self.centres = self._pose()
        width, height = size
        part = (np.arange(FINE) + 0.5) / FINE - 0.5
        u, v = ((np.arange(count)[:, None] + part).ravel().astype(np.float32) for count in (width, height))
        self.u, self.v = u[None, :], v[:, None]
        (a, b, c), (d, e, f), (g, i, j) = np.linalg.inv(self.h).astype(np.float32)
        depth = 1 / (g * self.u + i * self.v + j)
        self.x = (a * self.u + b * self.v + c) * depth
        self.y = (d * self.u + e * self.v + f) * depth
        self.step = 1 / (FINE * self.scale_at(np.zeros(2)))  # m between rays, about
        self.albedo = np.empty((*self.x.shape, 3), np.float32)
        self.albedo[:] = kind.ceiling
        self.light = np.ones_like(self.x)
        self.picture = np.empty(0)
        self.clear = np.ones(4, bool)

    def _pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return a random homography with all four discs in the picture, and the centres of their images."""
        rng, (width, height), lean = self.rng, self.size, math.radians(self.kind.tilt)
        while True:
            wanted = math.exp(rng.uniform(*np.log(self.kind.radius))) * width / 320
            z = FOCAL * width * self.radius / wanted
            tilts = rng.uniform(-1, 1, 2)
            tilts *= lean * rng.uniform(0, 1) / max(np.hypot(*tilts), 1e-9)
            reach = np.array((width, height)) / (FOCAL * width) * z / 2
            away = rng.uniform(-1, 1, 2) * reach + z * np.array((tilts[1], -tilts[0]))
            pose = (*away.tolist(), z, *tilts.tolist(), rng.uniform(-math.pi, math.pi))
            h = homography(self.size, pose)
            centres = ellipse_centres(h, self.side * CORNERS, self.radius)
            margin = 1.5 * wanted + 3
            if (centres > margin).all() and (centres < np.array(self.size) - 1 - margin).all():
                return h, centres

    def scale_at(self, place: np.ndarray) -> float:
        """Return the scale (px/m) of the picture around a place (2,) m of the ceiling."""
        w = self.h[2, :2] @ place + self.h[2, 2]
        return math.sqrt(abs(np.linalg.det(self.h) / w**3))

    def discs(self, colours: Sequence[Sequence[float]], radius: float, corners: np.ndarray) -> None:
        """Paint discs on corners (n, 2) m."""
        for corner, colour in zip(corners, colours, strict=True):
            away = np.hypot(self.x - corner[0], self.y - corner[1])
            rows, columns = (np.flatnonzero((away < 1.4 * radius).any(axis)) for axis in (1, 0))
            if not len(rows):
                continue
            box = slice(max(rows[0] - 3, 0), rows[-1] + 4), slice(max(columns[0] - 3, 0), columns[-1] + 4)
            near = away[box]
            rise = np.hypot(*np.gradient(near))
            cover = np.clip(0.5 + (radius - near) / np.maximum(rise, 1e-9), 0, 1)[..., None]
            self.albedo[box] += cover * (np.array(colour, np.float32) - self.albedo[box])

    def band(self, away: np.ndarray, width: float) -> np.ndarray:
        """Return the share of each ray's surroundings within half a width of `away` = 0 (m)."""
        return np.clip(0.5 + (width / 2 - np.abs(away)) / self.step, 0, 1)

    def line(self, point: np.ndarray, angle: float) -> np.ndarray:
        """Return the distance (m) of rays from a line through a point (2,), in a direction."""
        return (self.x - point[0]) * math.sin(angle) - (self.y - point[1]) * math.cos(angle)

    def spread(self, low: float, high: float) -> float:
        """Return a random number, evenly spread."""
        return float(self.rng.uniform(low, high))


def shoot(rng: np.random.Generator, size: tuple[int, int], kind: Kind) -> Shot:
    """Take a picture of a kind of ceiling from a random pose."""
    stage = Stage(rng, size, kind)
    for layer in kind.under:
        layer(stage)
    if kind.shown:
        stage.discs(PAINT, stage.radius, stage.side * CORNERS)
    for layer in (*kind.over, *kind.light):
        layer(stage)
    seen = stage.albedo * stage.light[..., None]
    stage.picture = cv2.GaussianBlur(cv2.resize(seen, size, interpolation=cv2.INTER_AREA), (0, 0), LENS)
    for layer in kind.sensor:
        layer(stage)
    noisy = stage.picture + kind.noise * rng.standard_normal(stage.picture.shape, np.float32)
    pixels = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    radii = np.array([stage.radius * stage.scale_at(stage.side * corner) for corner in CORNERS])
    centres = stage.centres if kind.shown else np.full((4, 2), np.nan)
    return Shot(pixels, centres, radii, stage.clear & kind.shown)
