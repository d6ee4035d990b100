"""How well a calibration is determined: standard deviations, and a warning where they are large.

With residuals r and their derivatives J at the least squares, the covariance of the parameters is s^2
(J'J)^-1, s^2 = r'r over the degrees of freedom (Hartley and Zisserman, 2004, section 5.2); poses are
eliminated by the Schur complement, as OpenCV's calibrateCameraExtended does. This is right for noise that is
independent from point to point. It does not see errors that all views share, such as a board that is not
flat, or corners that all move the same way: where all views are alike, such errors change the camera and not
the residuals. So a noise below `LEAST_NOISE` counts as `LEAST_NOISE`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from quadvis_vision.calibrate.bundle import LENS, Bundle, derivatives, free_parameters, linearise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadvis_vision.camera.homogeneous import HomogeneousCalibration

    Floats = NDArray[np.float64]
    Free = NDArray[np.bool_]

NAMES = ("fx", "fy", "cx", "cy", "skew", *LENS)
LEAST_NOISE = 0.25  # px of each coordinate: the usual shared error of corners in photographs
# Parts of the focal length: 1 % of it changes every distance by 1 %; 2 % in the principal point turns the
# optical axis by 1.1 deg, and few sets of views determine it better.
MOST = {"fx": 0.01, "fy": 0.01, "cx": 0.02, "cy": 0.02, "skew": 0.01}


@dataclass(frozen=True, eq=False)
class Deviations:
    """Standard deviations of a camera's parameters, in the order of `NAMES`; NaN for held parameters.

    `per_pixel` (10,) are the deviations for noise of 1 px in each coordinate, `noise` (px) is the noise
    according to the residuals, `focal` is the focal length (px).
    """

    per_pixel: Floats
    noise: float
    focal: float

    @property
    def camera(self) -> Floats:
        """The standard deviations (10,), in px and in the units of the lens."""
        return self.per_pixel * self.noise

    def facts(self) -> dict[str, float]:
        """Return the deviations of the parameters that were found, by name."""
        return {
            name: value
            for name, value in zip(NAMES, self.camera.tolist(), strict=True)
            if not math.isnan(value)
        }

    def warning(self, views: str, remedy: str) -> str:
        """Return a sentence about the parameters that the views leave uncertain; "" if all are certain."""
        noise = max(self.noise, LEAST_NOISE)
        changes = dict(zip(MOST, (self.per_pixel[: len(MOST)] * noise).tolist(), strict=True))
        weak = [
            f"{name} by {change:.2g} px ({change / self.focal:.1%} of the focal length)"
            if change < self.focal
            else f"{name} by any amount"
            for name, change in changes.items()
            if change > MOST[name] * self.focal
        ]
        if not weak:
            return ""
        problem = f"{views} leave the camera undetermined: errors of {noise:.2g} px in them change"
        return f"{problem} {', '.join(weak)}; {remedy}"


def bundle_deviations(bundle: Bundle, board: Floats, views: Floats, free: Free) -> Deviations:
    """Return the deviations of a camera found with the poses of a board (n, 2) in views (m, n, 2).

    `free` (10,) is a mask of the camera's parameters that were found.
    """
    return _deviations(*linearise(bundle, board, views), free, float(bundle.matrix[0, 0]))


def homogeneous_deviations(camera: HomogeneousCalibration, points: Floats, pixels: Floats) -> Deviations:
    """Return the deviations of K of eq. (10) from points (n, 3) and their pixels (n, 2).

    Eq. (9) minimises another error than the distance in the picture; near the minimum both agree to first
    order.
    """
    seen = ((points - camera.centre) @ camera.rotation.T)[None]
    predicted, jacobians = derivatives(seen, seen, camera.matrix, np.zeros(5))
    free = free_parameters(skew=True, lens=())
    return _deviations(predicted - pixels, jacobians, free, float(camera.matrix[0, 0]))


def _deviations(residuals: Floats, jacobians: Floats, free: Free, focal: float) -> Deviations:
    """Return the deviations from residuals (m, n, 2) and derivatives (m, n, 2, 16); six are of the pose."""
    views = len(residuals)
    j = jacobians.reshape(views, -1, 16)
    normal = j.transpose(0, 2, 1) @ j
    mixed = normal[:, :10, 10:]
    eliminated = np.linalg.solve(normal[:, 10:, 10:], mixed.transpose(0, 2, 1))
    reduced = np.sum(normal[:, :10, :10] - mixed @ eliminated, axis=0)[np.ix_(free, free)]
    per_pixel = np.full(10, np.nan)
    per_pixel[free] = np.sqrt(_inverse_diagonal(reduced))
    redundant = residuals.size - 6 * views - int(free.sum())
    noise = float(np.sqrt(np.sum(residuals**2) / redundant)) if redundant > 0 else 0.0
    return Deviations(per_pixel, noise, focal)


def _inverse_diagonal(matrix: Floats) -> Floats:
    """Return the diagonal of the inverse of a symmetric matrix (n, n); huge where the matrix is singular."""
    scale = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    sizes, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    return np.asarray(np.sum(vectors**2 / np.maximum(sizes, np.finfo(float).eps), axis=1) / scale**2)
