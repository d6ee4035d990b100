"""The camera's calibration: intrinsic matrix with skew, lens distortion, and the file that holds them.

Source: the intrinsic matrix K of equations (10) and (38); distortion is OpenCV's model (k1, k2, p1, p2, k3),
applied to normalised points before K. OpenCV itself ignores the skew K[0, 1], so pixels are normalised here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis.document import YamlNode, dump_yaml, read_fields
from quadvis.errors import DiagramError, Fault
from quadvis.machine.files import Kind, write_output
from quadvis_vision.camera import lens as lens_model
from quadvis_vision.camera.picture_size import BOUND, is_too_large
from quadvis_vision.camera.provenance import KEYS, CalibrationError, Evidence

Array = NDArray[np.float64]

_ITERATIONS = 50
_TOLERANCE = 1e-13  # of a normalised coordinate: far below a millionth of a pixel

NOTHING_KNOWN = Evidence()
CAMERA = Kind("the camera", pattern=rb"^matrix:")


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """The calibration of a camera; impossible values raise `CalibrationError`.

    `size` is (width, height) in px. `matrix` is K = [[fx, s, cx], [0, fy, cy], [0, 0, 1]] in px, pixel
    centres at whole numbers. `distortion` is (k1, k2, p1, p2, k3). `evidence` says how the calibration was
    found, if known; its points are in camera axes.
    """

    size: tuple[int, int]
    matrix: Array
    distortion: Array
    evidence: Evidence = NOTHING_KNOWN

    def __post_init__(self) -> None:
        """Make the arrays read-only float64 and check everything."""
        for name, shape in (("matrix", (3, 3)), ("distortion", (5,))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape:
                wanted = "x".join(map(str, shape))
                raise CalibrationError(name, f"{name} has {array.size} numbers", f"it needs {wanted}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        object.__setattr__(self, "size", (int(self.size[0]), int(self.size[1])))
        _check(self)

    @classmethod
    def load(cls, path: str | Path) -> CameraCalibration:
        """Read a calibration file; `DiagramError` with file, line and column if anything in it is wrong.

        The file is YAML: `size: [width, height]`, `matrix: 3x3`, `distortion: [k1, k2, p1, p2, k3]` and,
        optionally, `rms` (px), `errors: [px of each view]`, `date` and `points: [[x, y, z, u, v], ...]` in
        camera axes. The camera must project these points to their pixels as exactly as `rms` says.
        """
        fields = read_fields(path, "a camera calibration", ("size", "matrix", "distortion"), KEYS)
        try:
            return cls(
                size=_size(fields["size"]),
                matrix=np.array(fields["matrix"].array((3, 3))),
                distortion=np.array(fields["distortion"].array((5,))),
                evidence=Evidence.read(fields),
            )
        except CalibrationError as error:
            place = fields[error.field].place
            raise DiagramError([Fault(place, "camera calibration", error.problem, error.remedy)]) from None

    def save(self, path: str | Path, comment: str = "") -> None:
        """Write the calibration as YAML for `load`, number for number; `comment` goes on top of the file."""
        data = {
            "size": list(self.size),
            "matrix": self.matrix.tolist(),
            "distortion": self.distortion.tolist(),
        }
        head = "".join(f"# {line}\n" for line in comment.splitlines())
        write_output(path, CAMERA, head + dump_yaml(data | self.evidence.facts()))

    @cached_property
    def intrinsics(self) -> tuple[float, float, float, float, float]:
        """The matrix in plain numbers: fx, s, cx, fy, cy (px)."""
        (fx, skew, cx), (_, fy, cy), _ = self.matrix.tolist()
        return fx, skew, cx, fy, cy

    @cached_property
    def numbers(self) -> tuple[float, ...]:
        """The camera as `quadvis_vision.camera.pinhole.pinhole` takes it."""
        return (*self.intrinsics, *self.distortion.tolist())

    @cached_property
    def _affine(self) -> tuple[Array, Array]:
        return self.matrix[:2, :2].T, self.matrix[:2, 2]

    @cached_property
    def bends(self) -> bool:
        """Whether the lens bends anything."""
        return bool(self.distortion.any())

    def normalise(self, pixels: ArrayLike) -> Array:
        """Return the rays (n, 2), as (x, y) at depth 1, of pixels (n, 2): K and the lens are removed.

        Rows with NaN stay NaN; a pixel that no ray reaches through this lens becomes NaN.
        """
        uv = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        fx, skew, cx, fy, cy = self.intrinsics
        distorted = np.empty(uv.shape)
        distorted[:, 1] = y = (uv[:, 1] - cy) / fy
        distorted[:, 0] = (uv[:, 0] - cx - skew * y) / fx
        return self._undistort(distorted) if self.bends else distorted

    def project(self, points_camera: ArrayLike) -> Array:
        """Return the pixels (n, 2) of points (n, 3) in camera axes (m); NaN if not in front of the camera."""
        points = np.asarray(points_camera, dtype=np.float64).reshape(-1, 3)
        depth = np.where(points[:, 2] > 0, points[:, 2], np.nan)
        return self.to_pixels(points[:, :2] / depth[:, None])

    def to_pixels(self, rays: ArrayLike) -> Array:
        """Return the pixels (n, 2) of normalised points (n, 2): the inverse of `normalise`."""
        xy = np.asarray(rays, dtype=np.float64).reshape(-1, 2)
        if self.bends:
            xy = lens_model.distort(xy, self.distortion)
        scale, middle = self._affine
        return np.asarray(xy @ scale + middle)

    def _undistort(self, distorted: Array) -> Array:
        """Invert the distortion by Newton's method; NaN where no point fits, or only one behind a fold."""
        xy = distorted.copy()
        with np.errstate(all="ignore"):
            bent, jacobian = lens_model.linearise(xy, self.distortion)
            for _ in range(_ITERATIONS):
                step = _solve(jacobian, distorted - bent)
                xy += step
                bent, jacobian = lens_model.linearise(xy, self.distortion)
                if not (np.abs(step) > _TOLERANCE).any():
                    break
            at_rest = np.abs(bent - distorted).max(axis=1) < 1e-9
            unfolded = _determinant(jacobian) > 0
            xy[~(at_rest & unfolded)] = np.nan
        return xy


def _solve(matrices: Array, right: Array) -> Array:
    """Solve linear systems (n, 2, 2) by Cramer's rule; a singular system gives infinities, no exception."""
    a, b, c, d = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 0], matrices[:, 1, 1]
    e, f = right[:, 0], right[:, 1]
    return np.column_stack((e * d - b * f, a * f - e * c)) / _determinant(matrices)[:, None]


def _determinant(matrices: Array) -> Array:
    return np.asarray(matrices[:, 0, 0] * matrices[:, 1, 1] - matrices[:, 0, 1] * matrices[:, 1, 0])


def _size(node: YamlNode) -> tuple[int, int]:
    sides = node.items()
    if len(sides) != 2:
        raise node.wrong("a list of width and height", found=f"a list of {len(sides)}")
    return sides[0].integer(), sides[1].integer()


def _check(camera: CameraCalibration) -> None:
    width, height = camera.size
    matrix = camera.matrix
    if width < 2 or height < 2:
        raise CalibrationError(
            "size", f"size is {width} x {height} px", "width and height must be at least 2"
        )
    if is_too_large(camera.size):
        raise CalibrationError("size", f"size is {width} x {height} px", BOUND)
    if not np.isfinite(matrix).all():
        raise CalibrationError("matrix", "matrix is not finite", "it needs nine ordinary numbers")
    if not np.isfinite(camera.distortion).all():
        raise CalibrationError("distortion", "distortion is not finite", "it needs five ordinary numbers")
    if matrix[2].tolist() != [0.0, 0.0, 1.0] or matrix[1, 0] != 0:
        form = "it must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]]"
        raise CalibrationError("matrix", "matrix is not an intrinsic matrix", form)
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        lengths = f"fx = {matrix[0, 0]:g}, fy = {matrix[1, 1]:g}"
        raise CalibrationError(
            "matrix", f"a focal length is not positive ({lengths})", "give both in px, above 0"
        )
    u, v = np.meshgrid(np.linspace(0, width - 1, 17), np.linspace(0, height - 1, 13))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    error = np.abs(camera.to_pixels(camera.normalise(pixels)) - pixels).max()
    if not error < 1e-6:
        problem = "distortion folds the picture: pixels inside the image have no ray"
        raise CalibrationError("distortion", problem, "calibrate again with points out to the corners")
    camera.evidence.check(camera.project)
    points = camera.evidence.points
    if points is not None and not ((points[:, 3:] > -1) & (points[:, 3:] < camera.size)).all():
        problem = f"a stored point lies outside a picture of {width} x {height} px"
        raise CalibrationError(
            "size", problem, "give the size of the pictures that the camera was found with"
        )
