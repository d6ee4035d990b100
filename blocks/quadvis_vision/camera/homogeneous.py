"""Camera matrix from known points in space: the paper's homogeneous transformation approach, eq. (7)-(10).

Three corrections to the printed equations are made here. The second row of each pair in (9) is (d', 0, -rho
d'), since e x (T d) = 0; with the printed plus sign the null vector does not reproject. (8) holds up to a
scale per point. The RQ decomposition of (10) is unique only once signs are fixed: det M > 0 and a positive
diagonal of K.

Arrays hold one point a row: points (n, 3) in any unit of length, pixels (n, 2) as rho = u to the right, gamma
= v downwards. Matrices act on columns: e ~ T (x, y, z, 1)'.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]

# Below these limits the points lie in one plane, or more than one camera solves their equations, up to
# rounding.
_FLAT = 1e-7
_AMBIGUOUS = 1e-9
_SINGULAR = 1e-12

_COLUMNS = ("x", "y", "z", "rho", "gamma")
_ALSO = {"u": "rho", "v": "gamma"}


@dataclass(frozen=True, eq=False)
class HomogeneousCalibration:
    """A camera as eq. (10) gives it: T ~ K R [I | -C].

    `transformation` T (3, 4) is scaled so that T[2] (x, y, z, 1)' is the depth. `matrix` K (3, 3) is upper
    triangular with K33 = 1: [[fx, s, cx], [0, fy, cy], [0, 0, 1]] in pixels. `rotation` R (3, 3), det +1,
    goes from the axes of the points to the camera's (x right, y down, z forward). `centre` C (3,) is in the
    frame and unit of the points. `rms` is the root mean square distance of measured and reprojected pixels.
    """

    transformation: Floats
    matrix: Floats
    rotation: Floats
    centre: Floats
    rms: float

    def project(self, points: ArrayLike) -> Floats:
        """Return the pixels (n, 2) of points (n, 3), eq. (8); NaN for points behind the camera."""
        return project(self.transformation, points)


def calibrate(points: ArrayLike, pixels: ArrayLike) -> HomogeneousCalibration:
    """Return the camera that maps points (n, 3) to pixels (n, 2), n >= 6 and not coplanar, by eq. (7)-(10).

    `QuadvisError` for too few, coplanar, ambiguous or non-finite points, and for a mirrored frame or picture.
    """
    points, pixels = _correspondences(points, pixels)
    transformation = projection_matrix(points, pixels)
    matrix, rotation, centre = decompose(transformation)
    scaled = matrix @ rotation @ np.column_stack([np.eye(3), -centre])
    seen = project(scaled, points)
    behind = int(np.isnan(seen[:, 0]).sum())
    if behind:
        raise QuadvisError(
            f"{behind} of {len(points)} points lie behind the camera that fits best; the axes of the points "
            "must be right-handed and the picture must not be mirrored"
        )
    rms = float(np.sqrt(np.mean(np.sum((seen - pixels) ** 2, axis=1))))
    return HomogeneousCalibration(scaled, matrix, rotation, centre, rms)


def projection_matrix(points: ArrayLike, pixels: ArrayLike) -> Floats:
    """Return T (3, 4) of norm 1 with det M > 0: the null vector of eq. (9) by SVD, in normalised coordinates.

    `QuadvisError` as for `calibrate`.
    """
    points, pixels = _correspondences(points, pixels)
    if _flatness(points) < _FLAT:
        raise QuadvisError(
            "the points lie in one plane, which leaves the camera undetermined; give points at several depths"
        )
    d, from_points = _normalise(points)
    e, from_pixels = _normalise(pixels)
    normal = _null_vector(_equations(d, e), unknown="camera")
    transformation = np.linalg.solve(from_pixels, normal.reshape(3, 4) @ from_points)
    transformation /= np.linalg.norm(transformation)
    return transformation if np.linalg.det(transformation[:, :3]) > 0 else -transformation


def homography(source: ArrayLike, target: ArrayLike) -> Floats:
    """Return H (3, 3) of norm 1 with target ~ H (source, 1)' for n >= 4 points (n, 2): eq. (9) without z.

    The sign makes the third homogeneous coordinate of the targets positive.

    `QuadvisError` for fewer than 4 points, non-finite points, or points on a line.
    """
    a, b = _finite(source, 2, "plane"), _finite(target, 2, "picture")
    if len(a) != len(b):
        raise QuadvisError(f"{len(a)} points in the plane but {len(b)} in the picture; give one for each")
    if len(a) < 4:
        raise QuadvisError(f"{len(a)} points do not determine a homography; give at least 4")
    d, from_source = _normalise(a)
    e, from_target = _normalise(b)
    normal = _null_vector(_equations(d, e), unknown="homography")
    result = np.linalg.solve(from_target, normal.reshape(3, 3) @ from_source)
    result *= np.sign(np.sum(a @ result[2, :2] + result[2, 2])) / np.linalg.norm(result)
    return np.asarray(result, dtype=float)


def decompose(transformation: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return K (3, 3), R (3, 3) and C (3,) with T ~ K R [I | -C], eq. (10); K33 = 1, diag K > 0, det R = +1.

    `QuadvisError` if T is not (3, 4) and finite, or its left block M is singular (a camera at infinity).
    """
    t = np.asarray(transformation, dtype=float)
    if t.shape != (3, 4) or not np.isfinite(t).all():
        raise QuadvisError(f"T must be a finite 3 x 4 matrix, not {'x'.join(map(str, t.shape))} or with NaN")
    m = t[:, :3]
    scale = np.linalg.norm(m)
    if scale == 0 or abs(np.linalg.det(m / scale)) < _SINGULAR:
        raise QuadvisError("the left 3 x 3 block of T is singular; this camera has its centre at infinity")
    if np.linalg.det(m) < 0:
        t, m = -t, -m
    k, rotation = rq(m)
    return k / k[2, 2], rotation, -np.linalg.solve(m, t[:, 3])


def rq(matrix: ArrayLike) -> tuple[Floats, Floats]:
    """Return upper triangular K with a positive diagonal and orthogonal R with matrix = K R; both (3, 3).

    det R has the sign of det matrix. The matrix must not be singular.
    """
    flip = np.eye(3)[::-1]
    q, r = np.linalg.qr((flip @ np.asarray(matrix, dtype=float)).T)
    k, rotation = flip @ r.T @ flip, flip @ q.T
    signs = np.where(np.diag(k) < 0, -1.0, 1.0)
    return np.triu(k * signs), signs[:, None] * rotation


def project(transformation: ArrayLike, points: ArrayLike) -> Floats:
    """Return the pixels (n, 2) of points (n, 3) under T (3, 4), eq. (8); NaN where T[2] (x, y, z, 1)' < 0."""
    t = np.asarray(transformation, dtype=float)
    e = np.asarray(points, dtype=float) @ t[:, :3].T + t[:, 3]
    depth = np.where(e[:, 2:] > 0, e[:, 2:], np.nan)
    return np.asarray(e[:, :2] / depth)


def read_correspondences(path: str | Path) -> tuple[Floats, Floats]:
    """Return points (n, 3) and pixels (n, 2) of a CSV file with the columns x, y, z, rho, gamma (or u, v).

    The first line names the columns; further columns and empty lines do not matter.

    `QuadvisError` for an unreadable file, for a missing column, and, with its line, for a cell that is not a
    finite number.
    """
    try:
        lines = read_input(path).decode("utf-8-sig").splitlines()
    except (QuadvisError, UnicodeDecodeError) as error:
        problem = error if isinstance(error, QuadvisError) else f"cannot read '{path}': it is not text"
        raise QuadvisError(f"{problem}; give a CSV file with {','.join(_COLUMNS)}") from None
    table = csv.DictReader(lines, skipinitialspace=True)
    names = {_ALSO.get(name.strip(), name.strip()): name for name in table.fieldnames or ()}
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        raise QuadvisError(f"{path}:1: no column {', '.join(missing)}; name the columns {','.join(_COLUMNS)}")
    try:
        rows = [
            [_number(row[names[name]], name, f"{path}:{table.line_num}") for name in _COLUMNS]
            for row in table
        ]
    except csv.Error as error:
        raise QuadvisError(f"{path}:{table.line_num}: {error}; give a CSV file with numbers") from None
    values = np.array(rows, dtype=float).reshape(-1, 5)
    return values[:, :3], values[:, 3:]


def _number(text: str | None, column: str, place: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise QuadvisError(f"{place}: {column} is {quoted(text or '')}; it must be a finite number")
    return value


def _correspondences(points: ArrayLike, pixels: ArrayLike) -> tuple[Floats, Floats]:
    d, e = _finite(points, 3, "space"), _finite(pixels, 2, "picture")
    if len(d) != len(e):
        raise QuadvisError(f"{len(d)} points in space but {len(e)} in the picture; give one for each")
    if len(d) < 6:
        raise QuadvisError(f"{len(d)} points do not determine a camera; give at least 6")
    return d, e


def _finite(values: ArrayLike, columns: int, place: str) -> Floats:
    array = np.asarray(values, dtype=float)
    if array.ndim != 2 or array.shape[1] != columns:
        raise QuadvisError(
            f"points in the {place} have shape {array.shape}; they must be rows of {columns} coordinates"
        )
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise QuadvisError(
            f"point {bad[0] + 1} in the {place} is {array[bad[0]].tolist()}; it must be finite"
        )
    return array


def _flatness(points: Floats) -> float:
    """Return the thickness of a set of points divided by its extent: 0 for points in one plane."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[2] / extents[0]) if extents[0] > 0 else 0.0


def _normalise(points: Floats) -> tuple[Floats, Floats]:
    """Return homogeneous points with mean 0 and rms 1 per coordinate, and the matrix of this scaling."""
    dimension = points.shape[1]
    mean = points.mean(axis=0)
    spread = np.sqrt(np.mean(np.sum((points - mean) ** 2, axis=1)) / dimension)
    scale = 1.0 / spread if spread > 0 else 1.0
    matrix = np.diag([scale] * dimension + [1.0])
    matrix[:dimension, dimension] = -scale * mean
    return np.column_stack([(points - mean) * scale, np.ones(len(points))]), matrix


def _equations(d: Floats, e: Floats) -> Floats:
    """Return the rows (0, -d', gamma d') and (d', 0, -rho d') of eq. (9) for homogeneous d and e."""
    zero = np.zeros_like(d)
    first = np.hstack([zero, -d, e[:, 1:2] * d])
    second = np.hstack([d, zero, -e[:, :1] * d])
    return np.vstack([first, second])


def _null_vector(equations: Floats, unknown: str) -> Any:
    # The triangular factor has the same null vector, and its SVD does not grow with the number of points.
    triangle = np.linalg.qr(equations, mode="r")
    _, sizes, vectors = np.linalg.svd(triangle)
    if sizes[vectors.shape[0] - 2] < _AMBIGUOUS * sizes[0]:
        raise QuadvisError(
            f"the points fit more than one {unknown}; spread them, not all on one line or curve"
        )
    return vectors[-1]
