"""Render the target as the upward camera sees it: discs on a ceiling, light, lens and sensor.

Every pixel's ray is intersected with the ceiling. The share of the pixel that a disc covers follows from the
pixel's distance to the disc's edge and from the edge's direction; this is exact for a straight edge. For each
picture only the surroundings of the discs are computed: the empty ceiling and the noise are made once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.projection import camera_pose, circle_outline, plane_homography, target_corners

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Picture = NDArray[np.uint8]
Box = tuple[slice, slice]  # rows, columns

NOISE_STARTS = 1 << 20  # positions in the bank at which a frame's noise can begin
_OUTLINE = 24
_MARGIN = 1.5  # px around a disc: half a pixel's diagonal, plus the bend of a polygon's side by the lens
_SUB_POSES = 16


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
        self._outlines = np.stack([circle_outline(disc, scene.radius, _OUTLINE) for disc in self.discs])
        width, height = calibration.size
        u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        rays = calibration.normalise(np.column_stack((u.ravel(), v.ravel()))).reshape(height, width, 2)
        self._x, self._y = rays[..., 0].astype(np.float32), rays[..., 1].astype(np.float32)
        # [row, column, ray axis, pixel axis]: the change of the ray from one pixel to the next.
        turn = np.stack([np.gradient(rays, axis=axis) for axis in (1, 0)], axis=-1).astype(np.float32)
        self._rays: tuple[Singles, Singles, Singles] = (self._x, self._y, turn)
        self._steepest = float(np.linalg.norm(turn, axis=(2, 3)).max())
        self._widest = 1.1 * float(np.hypot(rays[..., 0], rays[..., 1]).max())
        self._shade = _shade(u, v, scene)
        self._more, self._less = _noise_bank(scene.noise, 3 * width * height)
        self._scratch = np.empty((height, width, 3), np.uint8)
        self._empty = lru_cache(maxsize=4)(self._make_empty)

    def render(self, start: Array, end: Array, light: float, noise: float) -> Picture:
        """Return the picture (height, width, 3) BGR of an exposure from one pose to another.

        A pose is (x, y, h, phi, theta, psi) in m and rad; `light` scales the whole picture; `noise`, a number
        from 0 to 1, chooses the sensor's noise.
        """
        import cv2

        more, less = self._noise_of(noise)
        empty = self._empty(light)
        # The picture is rounded and limited to 0..255 before the whole-numbered noise is added: faster, not
        # exact.
        picture = np.asarray(cv2.subtract(cv2.add(empty, more, dst=self._scratch), less), dtype=np.uint8)
        if max(start[2], end[2]) > self.scene.ceiling - 1e-6:
            return picture  # the discs cannot be seen from behind
        homographies = self._homographies(start, end)
        boxes = self._boxes(homographies)
        covers = self._coverages(homographies, boxes)
        for disc, box in boxes.items():
            mixed = self._background + covers[disc][..., None] * self._contrasts[disc]
            for other, theirs in boxes.items():
                if other != disc and _meet(box, theirs):
                    here, there = _overlap(box, theirs)
                    mixed[here] += covers[other][there][..., None] * self._contrasts[other]
            patch = cv2.convertScaleAbs(mixed * self._shade[box], alpha=light)
            picture[box] = cv2.subtract(cv2.add(patch, more[box]), less[box])
        return picture

    def _make_empty(self, light: float) -> Picture:
        """Return the ceiling without the discs and without noise."""
        import cv2

        return np.asarray(cv2.convertScaleAbs(self._background * self._shade, alpha=light), dtype=np.uint8)

    def _noise_of(self, noise: float) -> tuple[Picture, Picture]:
        """Return the noise to add to a picture and to subtract from it: the bank from a position on."""
        choice = int(noise * 2 * NOISE_STARTS)
        place, swap = choice >> 1, choice & 1
        shape = self._shade.shape
        last = place + self._shade.size
        more, less = (bank[place:last].reshape(shape) for bank in (self._more, self._less))
        return (less, more) if swap else (more, less)

    def _homographies(self, start: Array, end: Array) -> list[Array]:
        """Return plane-to-image homographies over the exposure, about one for each pixel of blur."""

        def at(share: float) -> Array:
            pose = start + share * (end - start)
            return plane_homography(*camera_pose(pose[:3], pose[3:], self.scene.ceiling))

        if (start == end).all():
            return [at(0.0)]
        first, last = (_image(self.discs, homography)[0] for homography in (at(0.0), at(1.0)))
        lengths = self.calibration.matrix[1, 1] * np.hypot(*(last - first).T)
        count = min(max(1, math.ceil(np.nan_to_num(lengths).max())), _SUB_POSES)
        return [at((index + 0.5) / count) for index in range(count)]

    def _boxes(self, homographies: list[Array]) -> dict[int, Box]:
        """Return the part of the picture that each disc in sight can touch, by the disc's index."""
        width, height = self.calibration.size
        images = [_image(self._outlines, homography) for homography in homographies]
        rays = np.stack([ray for ray, _ in images], axis=1)  # disc, pose, point, axis
        hidden = np.isnan(rays[..., 0])
        # Far outside the picture the distortion polynomial folds back, so only the ray's length is limited.
        length = np.maximum(np.hypot(rays[..., 0], rays[..., 1]), 1e-12)
        rays = rays * np.minimum(1.0, self._widest / length)[..., None]
        pixels = self.calibration.to_pixels(rays.reshape(-1, 2)).reshape(*rays.shape[:1], -1, 2)
        lows, highs = pixels.min(axis=1) - _MARGIN, pixels.max(axis=1) + _MARGIN
        boxes = {}
        for disc, (low, high) in enumerate(zip(lows.tolist(), highs.tolist(), strict=True)):
            if hidden[disc].all():
                continue
            if hidden[disc].any():  # the disc reaches behind the camera: its image is unbounded
                low, high = (0.0, 0.0), (width, height)
            left, top = max(0, math.floor(low[0])), max(0, math.floor(low[1]))
            right, bottom = min(width, math.ceil(high[0]) + 1), min(height, math.ceil(high[1]) + 1)
            if left < right and top < bottom:
                boxes[disc] = (slice(top, bottom), slice(left, right))
        return boxes

    def _coverages(self, homographies: list[Array], boxes: dict[int, Box]) -> dict[int, Singles]:
        """Return, for each disc in sight, the share of every pixel that it covers during the exposure."""
        total = {disc: np.zeros(self._x[box].shape, np.float32) for disc, box in boxes.items()}
        if not boxes:
            return total
        for homography in homographies:
            back = np.asarray(np.linalg.inv(homography), dtype=np.float64)
            edges = []
            for disc, box in boxes.items():
                inside, near = self._inside(back, self.discs[disc], box)
                total[disc] += inside
                edges.append((disc, near, inside[near]))
            # All discs together: edges have few pixels, so the number of calls takes the time.
            index = np.repeat([disc for disc, _, _ in edges], [len(inside) for _, _, inside in edges])
            rays = (np.concatenate([source[boxes[d]][near] for d, near, _ in edges]) for source in self._rays)
            shares = _edge_coverage(back, self.scene.radius, self.discs[index], *rays)
            first = 0
            for disc, near, inside in edges:
                last = first + len(inside)
                total[disc][near] += shares[first:last] - inside
                first = last
        return {disc: cover / np.float32(len(homographies)) for disc, cover in total.items()}

    def _inside(self, back: Array, disc: Array, box: Box) -> tuple[Singles, tuple[NDArray[np.intp], ...]]:
        """Return 1 where a pixel's centre is in the disc, and the indices of pixels that may touch its edge.

        With (a, b, w) = back (x, y, 1)', taken about the disc's centre, the ray meets the ceiling at the
        distance m / w from the centre, m = |(a, b)|; the disc's edge is where m - r w changes sign.
        """
        x, y = self._x[box], self._y[box]
        radius = self.scene.radius
        centred = back.copy()
        centred[:2] -= disc[:2, None] * back[2]
        g = centred.astype(np.float32)
        a = g[0, 0] * x + g[0, 1] * y + g[0, 2]
        b = g[1, 0] * x + g[1, 1] * y + g[1, 2]
        w = g[2, 0] * x + g[2, 1] * y + g[2, 2]
        beyond = np.sqrt(a * a + b * b) - np.float32(radius) * w
        slope = np.linalg.norm(centred[:2, :2]) + radius * np.linalg.norm(back[2, :2])
        near = np.nonzero(np.abs(beyond) < 0.75 * self._steepest * float(slope))
        return (beyond < 0).astype(np.float32), near


def _edge_coverage(back: Array, radius: float, discs: Array, x: Singles, y: Singles, turn: Singles) -> Array:
    """Return the covered share of pixels from the distance (px) and direction of their disc's edge."""
    p, q, w = back @ np.stack((x, y, np.ones_like(x))).astype(np.float64)
    w = np.maximum(w, 1e-9)  # a ray that does not go up never meets the ceiling
    a, b = p - discs[:, 0] * w, q - discs[:, 1] * w
    m = np.maximum(np.hypot(a, b), 1e-12)
    a, b, out = a / m, b / m, (a * discs[:, 0] + b * discs[:, 1] + m * m / w) / m
    by_x = a * back[0, 0] + b * back[1, 0] - out * back[2, 0]
    by_y = a * back[0, 1] + b * back[1, 1] - out * back[2, 1]
    along_u = by_x * turn[:, 0, 0] + by_y * turn[:, 1, 0]
    along_v = by_x * turn[:, 0, 1] + by_y * turn[:, 1, 1]
    steepness = np.maximum(np.hypot(along_u, along_v), 1e-12)
    # The edge deviates from its tangent: on average over a pixel's width by 1/24 of the curvature.
    bend = steepness / (24 * radius * w)
    return half_plane_share((m - radius * w) / steepness + bend, along_u / steepness, along_v / steepness)


def half_plane_share(distance: Array, normal_u: Array, normal_v: Array) -> Array:
    """Return the share of unit pixels in a half plane whose edge is `distance` px away along the normal.

    A positive distance means that the pixel's centre is outside. The share is the integral of the pixel's
    shadow along the normal, a trapezium.
    """
    long = np.maximum(np.abs(normal_u), np.abs(normal_v))
    short = np.maximum(np.minimum(np.abs(normal_u), np.abs(normal_v)), 1e-9)
    away = np.abs(distance)
    ramp = away / long
    corner = np.maximum((long + short) / 2 - away, 0.0) ** 2 / (2 * long * short)
    inner = np.where(away <= (long - short) / 2, 0.5 - ramp, corner)
    return np.asarray(np.where(distance > 0, inner, 1 - inner))


def _meet(box: Box, other: Box) -> bool:
    return all(a.start < b.stop and b.start < a.stop for a, b in zip(box, other, strict=True))


def _overlap(box: Box, other: Box) -> tuple[Box, Box]:
    """Return the common part of two boxes, in the coordinates of the first and of the second."""
    here, there = [], []
    for mine, theirs in zip(box, other, strict=True):
        first, last = max(mine.start, theirs.start), min(mine.stop, theirs.stop)
        here.append(slice(first - mine.start, last - mine.start))
        there.append(slice(first - theirs.start, last - theirs.start))
    return (here[0], here[1]), (there[0], there[1])


def _image(points: Array, homography: Array) -> tuple[Array, Array]:
    """Return the normalised image (..., 2) and the depth of points (..., 3) of the ceiling plane."""
    images = points[..., :2] @ homography[:, :2].T + homography[:, 2]
    depth = images[..., 2]
    return images[..., :2] / np.where(depth > 1e-9, depth, np.nan)[..., None], depth


def _shade(u: Array, v: Array, scene: Scene) -> Singles:
    """Return the light by pixel and channel: white balance, and a fall with the square of the radius."""
    centre_u, centre_v = u[0, -1] / 2, v[-1, 0] / 2
    square = ((u - centre_u) ** 2 + (v - centre_v) ** 2) / (centre_u**2 + centre_v**2)
    shade: Singles = ((1 - scene.vignette * square)[..., None] * scene.white_balance).astype(np.float32)
    return shade


@lru_cache(maxsize=2)
def _noise_bank(sigma: float, size: int) -> tuple[Picture, Picture]:
    """Return whole grey levels to add and to subtract; at each position one of the two is zero.

    All cameras of one size and noise share the two arrays, so nobody can write to them.
    """
    # numpy promises never to change the numbers of RandomState, so a run repeats on other versions too.
    noise = np.rint(sigma * np.random.RandomState(0).standard_normal(size + NOISE_STARTS))
    more, less = np.clip(noise, 0, 255).astype(np.uint8), np.clip(-noise, 0, 255).astype(np.uint8)
    more.flags.writeable = less.flags.writeable = False
    return more, less
