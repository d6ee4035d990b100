"""Poses of a flat board in several views, with the camera and its lens: bundle adjustment.

All points of a flat board lie in one plane, so eq. (9) alone does not determine a camera from it. Several
views of the board do, once their boards are placed in one common frame, the camera's. This module finds the
poses that place them: a homography for each view, Zhang's two constraints per homography for the focal
lengths (Zhang, 2000, section 3.1, with the principal point at the centre of the picture), then
Levenberg-Marquardt over the camera, the lens and all poses.

The lens is OpenCV's model k1 k2 p1 p2 k3. Skew is held at zero unless the caller asks for it: real pixels
have right angles, and beside five lens parameters the views hardly determine a skew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from quadvis.errors import QuadvisError
from quadvis_vision.camera import lens as lens_model
from quadvis_vision.camera.homogeneous import homography

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]

LENS = ("k1", "k2", "p1", "p2", "k3")

_STEPS = 100
_SETTLED = 1e-10  # a step whose relative fall of the squared error is below this is the last one
_STIFFEST = 1e10  # a damping above this means that no direction leads downhill


@dataclass(frozen=True, eq=False)
class Bundle:
    """A camera and m poses of a flat board.

    `camera` (10,) is fx, fy, cx, cy, skew in pixels, then k1, k2, p1, p2, k3. `rotations` (m, 3, 3) go from
    the board's axes to the camera's (x right, y down, z forward); `translations` (m, 3) are the board's
    origin in camera axes, in the board's unit of length.
    """

    camera: Floats
    rotations: Floats
    translations: Floats

    @property
    def matrix(self) -> Floats:
        """K, (3, 3), in pixels."""
        fx, fy, cx, cy, skew = self.camera[:5]
        return np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Floats:
        """The lens, (5,): k1, k2, p1, p2, k3."""
        return self.camera[5:]

    def place(self, board: Floats) -> Floats:
        """Return the points (m, n, 3) of the boards in camera axes; board (n, 2)."""
        return np.asarray(board @ self.rotations[:, :, :2].transpose(0, 2, 1) + self.translations[:, None])


def adjust(
    board: ArrayLike,
    views: ArrayLike,
    size: tuple[int, int],
    *,
    skew: bool = False,
    lens: Collection[str] = LENS,
) -> Bundle:
    """Return the camera and the poses that best explain views (m, n, 2) of a board (n, 2), m >= 3, in pixels.

    size is the width and height of the picture in pixels. skew says whether K may have a skew; lens names
    those of k1, k2, p1, p2, k3 that are free. All other terms stay zero.

    `QuadvisError` for fewer than 3 views, or views that show the board from one direction only.
    """
    points, pixels = np.asarray(board, dtype=float), np.asarray(views, dtype=float)
    if len(pixels) < 3:
        raise QuadvisError(f"{len(pixels)} views of the board do not determine a camera; give at least 3")
    bundle = _start(points, pixels, size)
    free = free_parameters(skew=skew, lens=lens)
    residuals, jacobians = linearise(bundle, points, pixels)
    damping, error = 1e-3, float(np.sum(residuals**2))
    for _ in range(_STEPS):
        trial = _step(bundle, residuals, jacobians, damping, free)
        trial_residuals, trial_jacobians = linearise(trial, points, pixels)
        trial_error = float(np.sum(trial_residuals**2))
        if trial_error < error:
            settled = error - trial_error <= _SETTLED * error
            bundle, residuals, jacobians, error = trial, trial_residuals, trial_jacobians, trial_error
            damping = max(damping / 10, 1e-12)
            if settled:
                break
        else:
            damping *= 10
            if damping > _STIFFEST:
                break
    return bundle


def free_parameters(*, skew: bool, lens: Collection[str]) -> NDArray[np.bool_]:
    """Return a mask (10,) of the free parameters of a camera, in the order of `Bundle.camera`."""
    return np.array([True] * 4 + [skew] + [name in lens for name in LENS])


def linearise(bundle: Bundle, board: Floats, views: Floats) -> tuple[Floats, Floats]:
    """Return residuals (m, n, 2), predicted minus measured, and their derivatives (m, n, 2, 16).

    See `derivatives` for the columns.
    """
    placed = bundle.place(board)
    turned = placed - bundle.translations[:, None]
    predicted, jacobian = derivatives(placed, turned, bundle.matrix, bundle.distortion)
    return predicted - views, jacobian


def derivatives(placed: Floats, turned: Floats, matrix: Floats, lens: Floats) -> tuple[Floats, Floats]:
    """Return the pixels (m, n, 2) of points (m, n, 3) in camera axes, and their derivatives (m, n, 2, 16).

    The first ten columns belong to the camera, in the order of `Bundle.camera`, the next three to a small
    turn about the camera's axes, the last three to a shift. A turn moves the points by its cross product with
    `turned`.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth = placed[..., 2]
        normalised = placed[..., :2] / depth[..., None]
        bent, slopes = lens_model.linearise(normalised, lens)
        focal = matrix[:2, :2]
        jacobian = np.zeros((*placed.shape[:2], 2, 16))
        jacobian[..., 0, 0], jacobian[..., 0, 4] = bent[..., 0], bent[..., 1]
        jacobian[..., 1, 1] = bent[..., 1]
        jacobian[..., 0, 2] = jacobian[..., 1, 3] = 1
        jacobian[..., 5:10] = focal @ lens_model.by_lens(normalised)
        by_point = focal @ slopes @ _by_depth(normalised, depth)
        # d(w x p)/dw = -[p]x, written out as a cross product of each row with p.
        jacobian[..., 10:13] = np.cross(turned[..., None, :], by_point)
        jacobian[..., 13:] = by_point
        return np.asarray(bent @ focal.T + matrix[:2, 2]), jacobian


def _start(board: Floats, views: Floats, size: tuple[int, int]) -> Bundle:
    """Return the starting bundle: focal lengths in closed form and their poses, without a lens."""
    maps = np.stack([homography(board, view) for view in views])
    centre = np.array([(size[0] - 1) / 2, (size[1] - 1) / 2])
    fx, fy = _focal_lengths(maps, centre)
    camera = np.array([fx, fy, *centre, 0, 0, 0, 0, 0, 0])
    poses = [_pose(np.diag([1 / fx, 1 / fy, 1]) @ _centred(h, centre)) for h in maps]
    return Bundle(camera, np.stack([r for r, _ in poses]), np.stack([t for _, t in poses]))


def _centred(h: Floats, centre: Floats) -> Floats:
    result = h.copy()
    result[:2] -= centre[:, None] * h[2]
    return result


def _focal_lengths(maps: Floats, centre: Floats) -> tuple[float, float]:
    """Solve r1'r2 = 0 and r1'r1 = r2'r2 for 1/fx^2 and 1/fy^2, least squares over all views."""
    rows, sides = [], []
    for h in maps:
        a, b = _centred(h, centre)[:, :2].T
        # Each view is divided by its own scale, so that near and far boards count alike.
        scale = 1 / (np.linalg.norm(a) * np.linalg.norm(b))
        rows += [a[:2] * b[:2] * scale, (a[:2] ** 2 - b[:2] ** 2) * scale]
        sides += [-a[2] * b[2] * scale, -(a[2] ** 2 - b[2] ** 2) * scale]
    inverse, _, rank, _ = np.linalg.lstsq(np.array(rows), np.array(sides), rcond=1e-10)
    if rank < 2 or not (inverse > 0).all():
        raise undetermined()
    return float(inverse[0] ** -0.5), float(inverse[1] ** -0.5)


def undetermined() -> QuadvisError:
    """Return the error for views that do not determine a camera."""
    return QuadvisError(
        "the views do not determine the focal length; show the board tilted in several directions"
    )


def _pose(a: Floats) -> tuple[Floats, Floats]:
    """Return R and t with a ~ [r1 r2 t], R the nearest rotation and the board in front of the camera."""
    u, s, vt = np.linalg.svd(a[:, :2], full_matrices=False)
    first, second = (u @ vt).T
    translation = a[:, 2] * 2 / s.sum()
    if translation[2] < 0:
        first, second, translation = -first, -second, -translation
    return np.column_stack([first, second, np.cross(first, second)]), translation


def _by_depth(normalised: Floats, depth: Floats) -> Floats:
    """Return the derivatives (..., 2, 3) of normalised coordinates by the point in camera axes."""
    result = np.zeros((*normalised.shape, 3))
    result[..., 0, 0] = result[..., 1, 1] = 1
    result[..., 2] = -normalised
    return np.asarray(result / depth[..., None, None])


def _step(
    bundle: Bundle, residuals: Floats, jacobians: Floats, damping: float, free: NDArray[np.bool_]
) -> Bundle:
    """Return the bundle after one damped Gauss-Newton step; poses are eliminated first (Schur complement)."""
    views = len(residuals)
    r = residuals.reshape(views, -1)
    j = jacobians.reshape(views, r.shape[1], 16)
    normal = j.transpose(0, 2, 1) @ j
    gradient = np.einsum("mij,mi->mj", j, r)
    camera, pose = normal[:, :10, :10].sum(axis=0), normal[:, 10:, 10:].copy()
    camera += damping * np.diag(np.diag(camera))
    pose += damping * np.einsum("mii->mi", pose)[:, :, None] * np.eye(6)
    mixed = normal[:, :10, 10:]
    eliminated = np.linalg.solve(
        pose, np.concatenate([mixed.transpose(0, 2, 1), gradient[:, 10:, None]], axis=2)
    )
    reduced = camera - np.sum(mixed @ eliminated[:, :, :10], axis=0)
    side = gradient[:, :10].sum(axis=0) - np.sum(mixed @ eliminated[:, :, 10:], axis=0)[:, 0]
    change = np.zeros(10)
    change[free] = -np.linalg.solve(reduced[np.ix_(free, free)], side[free])
    poses = -(eliminated[:, :, 10] + eliminated[:, :, :10] @ change)
    return replace(
        bundle,
        camera=bundle.camera + change,
        rotations=_turns(poses[:, :3]) @ bundle.rotations,
        translations=bundle.translations + poses[:, 3:],
    )


def _turns(vectors: Floats) -> Floats:
    """Return the rotations (m, 3, 3) about vectors (m, 3) by their lengths in radians (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    axis = vectors / np.maximum(angle[:, :, 0], 1e-300)
    cross = np.cross(np.eye(3), axis[:, None, :])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
