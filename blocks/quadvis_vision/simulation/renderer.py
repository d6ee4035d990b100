"""Render the target as the upward camera sees it: discs on a ceiling, light, lens and sensor.

Every pixel's ray is intersected with the ceiling. The share of the pixel that a disc covers follows from the
pixel's distance to the disc's edge and from the edge's direction; this is exact for a straight edge. For each
picture only the surroundings of the discs are computed: the empty ceiling and the noise are made once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.lens import by_point
from quadvis_vision.camera.projection import camera_pose, plane_homography, target_corners
from quadvis_vision.simulation.edges import edge_coverage, stretch
from quadvis_vision.simulation.noise_bank import NOISE_STARTS, noise_bank
from quadvis_vision.simulation.patch import Patch, meet, overlap

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Picture = NDArray[np.uint8]

_MARGIN = 1.0  # px around a disc: half a pixel's diagonal, and what the grid may miss
_GRID = 17  # points along an edge of the picture at which the lens is looked at
_SUB_POSES = 16
# Rows of the maps of pixels: the ray (x, y, 1), the light and the change of the ray from pixel to pixel where
# they are not the same for all pixels, and in patches the index of the disc.
_RAY, _SHADE, _TURN, _DISC = slice(3), slice(3, 6), slice(-5, -1), -1
_HALF_DIAGONAL = 0.72  # px: of a pixel, and what single precision may lose


@dataclass(frozen=True, eq=False)
class Scene:
    """The scene before the camera and its light.

    `side`, `radius` and `ceiling` (height) in m; `colours` (4, 3) and `background` (3,) blue-green-red grey
    levels under full light; `white_balance` (3,) gain per channel; `vignette` the light lost in the corners
    (0 to 1); `noise` the standard deviation of the sensor's noise in grey levels.
    """

    side: float
    radius: float
    ceiling: float
    colours: Array
    background: Array
    white_balance: Array
    vignette: float
    noise: float


class Renderer:
    """Renders one scene through one camera; every picture depends on the arguments of `render` alone."""

    def __init__(self, calibration: CameraCalibration, scene: Scene) -> None:
        """Follow every pixel's ray once and fill the bank of noise."""
        self.calibration, self.scene = calibration, scene
        self.discs = target_corners(scene.side)
        self._background = scene.background.astype(np.float32)
        self._contrasts = scene.colours.astype(np.float32) - self._background
        # From a ray's (a, b, w) about the middle of the target to (a, b, r w) about the centre of each disc.
        self._shifts = np.tile(np.diag([1.0, 1.0, scene.radius]), (4, 1, 1))
        self._shifts[:, :2, 2] = -self.discs[:, :2]
        width, height = calibration.size
        u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        rays = calibration.normalise(np.column_stack((u.ravel(), v.ravel()))).reshape(height, width, 2)
        # [row, column, ray axis, pixel axis]: the change of the ray from one pixel to the next.
        turn = np.stack([np.gradient(rays, axis=axis) for axis in (1, 0)], axis=-1).astype(np.float32)
        turns = np.moveaxis(turn.reshape(height, width, 4), -1, 0)
        self._steepest = float(np.max(stretch(*turns)))
        # The outermost pixels reach half a pixel beyond their rays.
        low, high = rays.min(axis=(0, 1)) - self._steepest, rays.max(axis=(0, 1)) + self._steepest
        self._field: tuple[list[float], list[float]] = (low.tolist(), high.tolist())
        grid = np.stack(np.meshgrid(*np.linspace(low, high, _GRID).T), axis=-1)
        slopes = calibration.matrix[:2, :2] @ by_point(grid, calibration.distortion)
        self._finest = np.abs(slopes).max(axis=(0, 1)).tolist()
        self._shade = _shade(u, v, scene)
        lights = np.moveaxis(self._shade, -1, 0) if scene.vignette else ()
        alike = bool((turn == turn[0, 0]).all())  # without a lens
        self._turn = turns[:, :1, 0].astype(np.float64) if alike else None
        planes = (rays[..., 0], rays[..., 1], np.ones_like(u), *lights, *(() if alike else turns))
        self._maps = np.stack(planes, dtype=np.float32)
        self._noise = noise_bank(scene.noise, 3 * width * height)
        self._scratch = np.empty((height, width, 3), np.uint8)
        self._empty = lru_cache(maxsize=4)(self._make_empty)

    def render(self, start: Array, end: Array, light: float, noise: float) -> Picture:
        """Return the picture (height, width, 3) BGR of an exposure from one pose to another.

        A pose is (x, y, h, phi, theta, psi) in m and rad; `light` scales the whole picture; `noise`, a number
        from 0 to 1, chooses the sensor's noise.
        """
        import cv2

        empty, roomy = self._empty(light)
        picture = self._scratch
        np.copyto(picture, empty)
        if max(start[2], end[2]) <= self.scene.ceiling - 1e-6:  # the discs cannot be seen from behind
            roomy &= self._draw_discs(picture, start, end, light)
        # The picture is rounded and limited to 0..255 before the whole-numbered noise is added: faster, not
        # exact.
        choice = int(noise * 2 * NOISE_STARTS)
        place, swap = choice >> 1, choice & 1
        part, shape = slice(place, place + picture.size), picture.shape
        if roomy:
            change = np.subtract if swap else np.add
            return np.asarray(change(picture, self._noise.both[part].reshape(shape)))
        more, less = (bank[part].reshape(shape) for bank in (self._noise.more, self._noise.less))
        if swap:
            more, less = less, more
        return np.asarray(cv2.subtract(cv2.add(picture, more, dst=picture), less), dtype=np.uint8)

    def _make_empty(self, light: float) -> tuple[Picture, bool]:
        """Return the ceiling without discs and noise, and whether noise keeps every level within 0..255.

        The second value holds where no pixel is more than a mixture of the ceiling and one disc.
        """
        import cv2

        empty = np.asarray(cv2.convertScaleAbs(self._background * self._shade, alpha=light), dtype=np.uint8)
        palette = np.concatenate((self._background[None], self._background + self._contrasts))
        shades = self._shade.reshape(-1, 3)
        extremes = np.stack([palette * shades.min(axis=0), palette * shades.max(axis=0)])
        levels = cv2.convertScaleAbs(extremes.reshape(-1, 3), alpha=light)
        largest = self._noise.largest + 1  # the mixture may round otherwise
        return empty, largest <= int(levels.min()) and int(levels.max()) <= 255 - largest

    def _draw_discs(self, picture: Picture, start: Array, end: Array, light: float) -> bool:
        """Draw the discs in sight into the picture of the empty ceiling; return whether they are apart."""
        import cv2

        homographies = self._homographies(start, end)
        patches = self._patches(homographies)
        if not patches:
            return True
        maps = np.empty((len(self._maps) + 1, patches[-1].part.stop), np.float32)
        for patch in patches:
            patch.of(maps)[:_DISC] = self._maps[:, *patch.box]
            maps[_DISC, patch.part] = patch.disc
        cover = self._coverage(homographies, patches, maps)
        mixed = np.empty((3, len(cover)), np.float32)
        for patch in patches:
            contrast = self._contrasts[patch.disc][:, None]
            np.multiply(cover[patch.part], contrast, out=mixed[:, patch.part])
        mixed += self._background[:, None]
        apart = True
        for patch, other in permutations(patches, 2):
            if meet(patch.box, other.box):
                apart = False
                here, there = overlap(patch.box, other.box)
                contrast = self._contrasts[other.disc][:, None, None]
                patch.of(mixed)[:, *here] += other.of(cover)[there] * contrast
        mixed *= maps[_SHADE] if self.scene.vignette else self._shade[0, 0, :, None]
        levels = cv2.convertScaleAbs(mixed, alpha=light)
        for patch in patches:
            picture[patch.box] = cv2.merge([*levels[:, patch.part]]).reshape(*patch.shape, 3)
        return apart

    def _homographies(self, start: Array, end: Array) -> list[Array]:
        """Return plane-to-image homographies over the exposure, about one for each pixel of blur."""

        def at(share: float) -> Array:
            pose = start + share * (end - start)
            return plane_homography(*camera_pose(pose[:3], pose[3:], self.scene.ceiling))

        if start.tolist() == end.tolist():
            return [at(0.0)]
        first, last = (_image(self.discs, homography) for homography in (at(0.0), at(1.0)))
        lengths = self.calibration.matrix[1, 1] * np.hypot(*(last - first).T)
        count = min(max(1, math.ceil(np.nan_to_num(lengths).max())), _SUB_POSES)
        return [at((index + 0.5) / count) for index in range(count)]

    def _patches(self, homographies: list[Array]) -> list[Patch]:
        """Return the part of the picture that each disc in sight can touch, at least."""
        width, height = self.calibration.size
        seen: list[tuple[int, float, float]] = []  # disc, and half the size of what it can touch, in rays
        middles: list[tuple[float, float]] = []
        for homography in homographies:
            for disc, left, top, right, bottom in self._in_sight(homography):
                seen.append((disc, (right - left) / 2, (bottom - top) / 2))
                middles.append(((left + right) / 2, (top + bottom) / 2))
        edges = [[width, height, 0, 0] for _ in self.discs]
        (u_by_x, u_by_y), (v_by_x, v_by_y) = self._finest
        pixels = self.calibration.to_pixels(middles).tolist()
        for (disc, across, down), (u, v) in zip(seen, pixels, strict=True):
            by_u = across * u_by_x + down * u_by_y + _MARGIN
            by_v = across * v_by_x + down * v_by_y + _MARGIN
            left, top, right, bottom = edges[disc]
            edges[disc] = [
                min(left, math.floor(u - by_u)),
                min(top, math.floor(v - by_v)),
                max(right, math.ceil(u + by_u) + 1),
                max(bottom, math.ceil(v + by_v) + 1),
            ]
        patches, first = [], 0
        for disc, (left, top, right, bottom) in enumerate(edges):
            left, top, right, bottom = max(0, left), max(0, top), min(width, right), min(height, bottom)
            if left < right and top < bottom:
                last = first + (right - left) * (bottom - top)
                patches.append(Patch(disc, (slice(top, bottom), slice(left, right)), slice(first, last)))
                first = last
        return patches

    def _in_sight(self, homography: Array) -> Iterator[tuple[int, float, float, float, float]]:
        """Yield the index of each disc in sight, and the least and largest rays (x, y) that may meet it."""
        radius, (low, high) = self.scene.radius, self._field
        (a, b, _), (c, d, _), (e, f, _) = homography.tolist()
        rise = radius * math.hypot(e, f)
        middles = self.discs[:, :2] @ homography[:, :2].T + homography[:, 2]
        for disc, (x, y, depth) in enumerate(middles.tolist()):
            across = down = math.inf  # where the disc reaches behind the camera
            if depth - rise > 1e-9:
                x, y, size = x / depth, y / depth, radius / (depth - rise)
                across, down = (
                    size * math.hypot(a - x * e, b - x * f),
                    size * math.hypot(c - y * e, d - y * f),
                )
            left, right = max(x - across, low[0]), min(x + across, high[0])
            top, bottom = max(y - down, low[1]), min(y + down, high[1])
            if depth + rise > 0 and left < right and top < bottom:
                yield disc, left, top, right, bottom

    def _coverage(self, homographies: list[Array], patches: list[Patch], maps: Singles) -> Singles:
        """Return the share of every pixel that the patch's disc covers during the exposure.

        With (a, b, w) = back (x, y, 1)', taken about the disc's centre, the ray meets the ceiling at the
        distance m / w from the centre, m = |(a, b)|; the disc's edge is where m - r w changes sign.
        """
        import cv2

        total = np.zeros(maps.shape[1], np.float32)
        met = np.empty((3, maps.shape[1]), np.float32)
        for homography in homographies:
            back = np.asarray(np.linalg.inv(homography), dtype=np.float64)
            tests = (self._shifts @ (back / self._limit(homography, back))).astype(np.float32)
            for patch in patches:
                np.matmul(tests[patch.disc], maps[_RAY, patch.part], out=met[:, patch.part])
            beyond = cv2.magnitude(met[0], met[1]).ravel() - met[2]
            inside = beyond < 0
            total += inside
            # Edges of all discs together: they have few pixels, so the number of calls takes the time.
            near = np.flatnonzero(np.abs(beyond) < 1)
            edges = maps.take(near, axis=1).astype(np.float64)
            middles = self.discs[:, :2].T.take(edges[_DISC].astype(np.intp), axis=1)
            turn = edges[_TURN] if self._turn is None else self._turn
            shares = edge_coverage(back, self.scene.radius, middles, edges[_RAY], turn)
            total[near] += shares - inside[near]
        return total / np.float32(len(homographies))

    def _limit(self, homography: Array, back: Array) -> float:
        """Return the largest |m - r w| of a pixel that an edge may cut, see `_coverage`.

        The share of a pixel is 0 or 1 if its centre is farther from the edge than half a diagonal and the
        bend of the edge, which `edge_coverage` adds.
        """
        radius, away = self.scene.radius, math.hypot(*self.discs[0, :2].tolist())
        (a, b, _), (c, d, _), (e, f, _) = back.tolist()
        slope = self._steepest * (stretch(a, b, c, d) + (radius + away) * math.hypot(e, f))
        by_x, by_y, depth = homography[2].tolist()
        farthest = max(0.0, depth + (radius + away) * math.hypot(by_x, by_y))
        return float(slope * (_HALF_DIAGONAL + slope * farthest / (24 * radius)))


def _image(points: Array, homography: Array) -> Array:
    """Return the normalised image (..., 2) of points (..., 3) of the ceiling plane; NaN behind the camera."""
    images = points[..., :2] @ homography[:, :2].T + homography[:, 2]
    depth = images[..., 2:]
    return np.asarray(images[..., :2] / np.where(depth > 1e-9, depth, np.nan))


def _shade(u: Array, v: Array, scene: Scene) -> Singles:
    """Return the light by pixel and channel: white balance, and a fall with the square of the radius."""
    centre_u, centre_v = u[0, -1] / 2, v[-1, 0] / 2
    square = ((u - centre_u) ** 2 + (v - centre_v) ** 2) / (centre_u**2 + centre_v**2)
    shade: Singles = ((1 - scene.vignette * square)[..., None] * scene.white_balance).astype(np.float32)
    return shade
