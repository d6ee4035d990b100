"""The two-planes calibration of a camera, eq. (1)-(6): pixels to lines in space without a lens model.

Two pictures of points on two parallel planes give a map from pixels to each plane; a pixel then belongs to
the line through its two images. Vectors are ROWS here, as in the published matrices (36): (x, y, z) = (rho,
gamma, 1) H. Printed (3) means H = (Q'Q)^-1 Q'G with one point a row of Q and G.

The calibration frame is the paper's: x right, y up, z from the planes toward the camera. The camera's axes (x
along the rows of the image, y down, z forward) follow from the maps themselves, see
`TwoPlanesCalibration.pinhole`; for a board parallel to the image and aligned with it that is diag(1, -1, -1).

Two equations of the paper are not exact. First, an affine map (1) holds only for planes parallel to the image
plane. A board turned by some angle turns every ray by the same angle; projective maps avoid this. Second, (5)
with the unit vectors of (4) is not the pinhole: the image of a pinhole is linear in v divided by the
component of v along the axis. The difference is 0.3 to 4 px and grows with the field of view, and V_R, V_C
and the piercing point depend on the pixels of the fit. Rays use neither equation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.document import dump_yaml, read_fields
from quadvis.errors import DiagramError, Fault, QuadvisError
from quadvis.machine.files import Kind, write_output
from quadvis.units import Unit, UnitError
from quadvis_vision.camera.homogeneous import rq
from quadvis_vision.camera.plane_maps import (
    PARALLEL,
    affine_map,
    apply,
    columns,
    focal_point,
    homogeneous,
    image_plane,
    projective_map,
    unit,
)
from quadvis_vision.camera.provenance import KEYS, LEAST_ERROR, MOST_ERROR, CalibrationError, Evidence

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]

_SHAPES = {"H1": (3, 3), "H2": (3, 3), "F": (3,), "V_R": (3,), "V_C": (3,)}
_NUMBERS = ("z1", "z2", "rho_p", "gamma_p")
_SIGNIFICANT = 10.0  # F ratio; noise alone exceeds it in 7 of 100 000 calibrations with 20 points
_NOTHING_KNOWN = Evidence()
TWO_PLANES = Kind("the two planes", pattern=rb"^H1:")


@dataclass(frozen=True, eq=False)
class TwoPlanesCalibration:
    """A camera calibrated on the planes z = z1 and z = z2; impossible values raise `CalibrationError`.

    `z1`, `z2` are heights in the calibration frame, whose unit of length is the user's. The maps `H1`, `H2`
    (3, 3) are affine, (rho, gamma, 1) H = (x, y, z), or `projective`, (x w, y w, w) with w > 0. The focal
    point `F` (3,) is nearest to all lines. `V_R`, `V_C` (3,) and the piercing point `rho_p` (to the right),
    `gamma_p` (downwards) belong to (5) and are in pixels; (37) prints the piercing point in the other order.
    `evidence` says how the calibration was found, if known: its errors are those of `pinhole` on the first
    and the second plane, its points are in the calibration frame. `unit` is the unit of all lengths, if
    known.
    """

    z1: float
    z2: float
    H1: Floats
    H2: Floats
    F: Floats
    V_R: Floats
    V_C: Floats
    rho_p: float
    gamma_p: float
    projective: bool = False
    evidence: Evidence = _NOTHING_KNOWN
    unit: str | None = None

    def __post_init__(self) -> None:
        """Make the arrays read-only and check everything."""
        for name, shape in _SHAPES.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise CalibrationError(
                    name, f"{name} has shape {array.shape} or holds NaN", f"it needs {shape}"
                )
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        for name in _NUMBERS:
            if not np.isfinite(getattr(self, name)):
                raise CalibrationError(name, f"{name} is not finite", "give an ordinary number")
        _check(self)

    @classmethod
    def fit(cls, points: ArrayLike, pixels: ArrayLike, *, projective: bool = False) -> TwoPlanesCalibration:
        """Return the calibration from points (n, 3), which lie at two heights z, and their pixels (n, 2).

        z1 is the smaller height. F is the point nearest to the lines of all pixels of both pictures.

        `QuadvisError` if there are not two heights, too few points at one of them, or points on a line.
        """
        g, q = np.asarray(points, dtype=float), np.asarray(pixels, dtype=float)
        first, second = _split(g)
        make = projective_map if projective else affine_map
        maps = [(make(q[plane], g[plane]), float(np.median(g[plane, 2]))) for plane in (first, second)]
        focus = focal_point(*(apply(h, z, q, projective=projective) for h, z in maps))
        v_r, v_c, piercing = image_plane(unit(g - focus), q)
        (h1, z1), (h2, z2) = maps
        found = cls(z1, z2, h1, h2, focus, v_r, v_c, float(piercing[0]), float(piercing[1]), projective)
        planes = [(g[plane], q[plane]) for plane in (first, second)]
        predicted = [found.project(points, exact=True) for points, _ in planes]
        evidence = Evidence.of([points for points, _ in planes], [seen for _, seen in planes], predicted)
        return replace(found, evidence=evidence)

    @classmethod
    def load(cls, path: str | Path) -> TwoPlanesCalibration:
        """Read a calibration file; `DiagramError` with file, line and column if anything in it is wrong.

        The file is YAML with the keys convention (row), z1, z2, H1, H2, projective, F, V_R, V_C, rho_p,
        gamma_p and, optionally, unit (of length), rms (px), errors (px, of both planes), date and points
        (rows x, y, z, rho, gamma). The camera must project these points to their pixels as exactly as rms
        says.
        """
        required = ("convention", "projective", *_NUMBERS, *_SHAPES)
        fields = read_fields(path, "a two-planes calibration", required, (*KEYS, "unit"))
        fields["convention"].choice(("row",))
        values: dict[str, Any] = {name: fields[name].number() for name in _NUMBERS}
        values |= {name: fields[name].array(shape) for name, shape in _SHAPES.items()}
        values["unit"] = fields["unit"].text() if "unit" in fields else None
        try:
            return cls(**values, projective=fields["projective"].boolean(), evidence=Evidence.read(fields))
        except CalibrationError as error:
            fault = Fault(fields[error.field].place, "two planes", error.problem, error.remedy)
            raise DiagramError([fault]) from None

    def save(self, path: str | Path, comment: str = "") -> None:
        """Write the calibration as YAML so that `load` returns the same numbers; `comment` goes on top."""
        lines = [f"# {line}" for line in comment.splitlines()]
        lines += ["convention: row", f"projective: {str(self.projective).lower()}"]
        lines += [f"{name}: {float(getattr(self, name))!r}" for name in ("z1", "z2")]
        for name in ("H1", "H2"):
            lines += [f"{name}:", *(f"  - {_flow(row)}" for row in getattr(self, name))]
        lines += [f"{name}: {_flow(getattr(self, name))}" for name in ("F", "V_R", "V_C")]
        lines += [f"{name}: {float(getattr(self, name))!r}" for name in ("rho_p", "gamma_p")]
        known = self.evidence.facts() | ({} if self.unit is None else {"unit": self.unit})
        text = "\n".join(lines) + "\n" + (dump_yaml(known) if known else "")
        write_output(path, TWO_PLANES, text)

    def back_project(self, pixels: ArrayLike) -> tuple[Floats, Floats]:
        """Return the images (n, 3) of pixels (n, 2) on the first and the second plane, eq. (1)."""
        first, second = ((self.H1, self.z1), (self.H2, self.z2))
        return (
            apply(*first, pixels, projective=self.projective),
            apply(*second, pixels, projective=self.projective),
        )

    def rays(self, pixels: ArrayLike) -> Floats:
        """Return the unit vectors (n, 3) of the rays from F through pixels (n, 2), eq. (4), in camera axes.

        Camera axes are x along the rows of the image, y down, z forward. Rows with NaN stay NaN.
        """
        q = homogeneous(pixels)
        return unit(q @ np.linalg.inv(self.pinhole[0]).T)

    @cached_property
    def pinhole(self) -> tuple[Floats, Floats]:
        """The exact pinhole of these maps: K (3, 3) in pixels, R (3, 3) from calibration to camera axes.

        By either plane the direction of a pixel, seen from F, is linear in (rho, gamma, 1). The mean over
        both planes, each scaled to unit distance, is the inverse of K R, and RQ decomposes K R as in (10).
        Affine maps contain no tilt, so with them the optical axis is always z.
        """
        directions = sum(self._directions(h, z) for h, z in ((self.H1, self.z1), (self.H2, self.z2)))
        k, rotation = rq(np.linalg.inv(directions))
        return k / k[2, 2], rotation

    @cached_property
    def numbers(self) -> tuple[float, ...]:
        """The exact pinhole as `quadvis_vision.camera.pinhole.pinhole` takes it: it has no lens."""
        (fx, skew, cx), (_, fy, cy), _ = self.pinhole[0].tolist()
        return (fx, skew, cx, fy, cy, 0.0, 0.0, 0.0, 0.0, 0.0)

    def project(self, points: ArrayLike, *, exact: bool = False) -> Floats:
        """Return the pixels (n, 2) of points (n, 3) of the calibration frame by eq. (4)-(5).

        With exact the pixels come from `pinhole` instead, and are NaN for points not in front of the camera.
        """
        rays = np.asarray(points, dtype=float) - self.F
        if exact:
            k, rotation = self.pinhole
            e = rays @ (k @ rotation).T
            return np.asarray(e[:, :2] / np.where(e[:, 2:] > 0, e[:, 2:], np.nan))
        plane = np.column_stack([self.V_R, self.V_C])
        return np.asarray(unit(rays) @ plane + [self.rho_p, self.gamma_p])

    def residuals(self, points: ArrayLike, pixels: ArrayLike) -> Floats:
        """Return points (n, 3) at z1 or z2 minus the images (n, 3) of their pixels (n, 2)."""
        g = np.asarray(points, dtype=float)
        first, second = self.back_project(pixels)
        upper = np.abs(g[:, 2] - self.z2) < np.abs(g[:, 2] - self.z1)
        return np.asarray(g - np.where(upper[:, None], second, first))

    def _directions(self, h: Floats, z: float) -> Floats:
        """Return A (3, 3) with g - F ~ A (rho, gamma, 1)' for the image g on one plane."""
        x, y, w = columns(h, self.projective).T
        scale = np.linalg.norm(w) * abs(self.F[2] - z)
        rows = [x - self.F[0] * w, y - self.F[1] * w, (z - self.F[2]) * w]
        return np.asarray(np.stack(rows) / scale)


def board_tilt(points: ArrayLike, pixels: ArrayLike) -> float:
    """Return the angle (rad) between the planes and the image; 0 if it is not significant.

    points (n, 3) lie at two heights, pixels (n, 2) belong to them. An angle is significant if projective maps
    fit much better than affine maps, which have no tilt: an F test with four more parameters.

    `QuadvisError` as for `TwoPlanesCalibration.fit`.
    """
    affine, projective = (TwoPlanesCalibration.fit(points, pixels, projective=kind) for kind in (False, True))
    loose, tight = (float(np.sum(kind.residuals(points, pixels) ** 2)) for kind in (affine, projective))
    free = 2 * len(np.asarray(points)) - 16
    exact = (PARALLEL * float(np.ptp(points))) ** 2
    if free < 1 or loose <= exact or loose - tight <= _SIGNIFICANT * 4 * tight / free:
        return 0.0
    return float(np.arccos(np.clip(abs(projective.pinhole[1][2, 2]), 0.0, 1.0)))


def _split(points: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks (n,) of the points (n, 3) at the lower and at the upper of two heights."""
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all() or not len(points):
        raise QuadvisError(f"points have shape {points.shape} or hold NaN; give rows x, y, z")
    z = points[:, 2]
    lower = np.abs(z - z.min()) < np.abs(z - z.max())
    apart = np.ptp(z)
    if not apart or any(np.ptp(z[plane]) > 1e-6 * apart for plane in (lower, ~lower)):
        raise QuadvisError(
            f"points have z from {z.min():g} to {z.max():g}; two planes have exactly two heights z"
        )
    return lower, ~lower


def _flow(row: Floats) -> str:
    return "[" + ", ".join(repr(float(number)) for number in row) + "]"


def _check(planes: TwoPlanesCalibration) -> None:
    z1, z2, height = planes.z1, planes.z2, planes.F[2]
    if z1 == z2:
        raise CalibrationError("z2", f"both planes are at z = {z1:g}", "they must be apart")
    if (height - z1) * (height - z2) <= 0:
        raise CalibrationError(
            "F", f"F is at z = {height:g}, not beyond both planes", "check z1, z2 and the maps"
        )
    for name, z in (("H1", z1), ("H2", z2)):
        h = getattr(planes, name)
        if not planes.projective and not np.allclose(h[:, 2], (0, 0, z), rtol=0, atol=1e-9 * max(1, abs(z))):
            raise CalibrationError(
                name, f"the last column of {name} is not (0, 0, {z:g})", "affine maps end so"
            )
        sizes = np.linalg.svd(planes._directions(h, z), compute_uv=False)
        if not sizes[2] > PARALLEL * sizes[0]:
            raise CalibrationError(name, f"{name} is singular", "its points must not lie on a line")
        if np.linalg.det(planes._directions(h, z)) < 0:
            remedy = "x right, y up, z toward the camera is right-handed"
            raise CalibrationError(name, f"{name} mirrors the picture", remedy)
    planes.evidence.check(lambda points: planes.project(points, exact=True))
    if planes.evidence.points is not None:
        _check_points(planes, planes.evidence.points)
    if planes.unit is not None:
        _check_unit(planes.unit)


def _check_points(planes: TwoPlanesCalibration, stored: Floats) -> None:
    """Refuse V_R, V_C and a piercing point that fit the stored points much worse than the best ones do."""
    points, pixels = stored[:, :3], stored[:, 3:]
    v_r, v_c, piercing = image_plane(unit(points - planes.F), pixels)
    best = unit(points - planes.F) @ np.column_stack([v_r, v_c]) + piercing
    found, least = (
        float(np.sqrt(np.mean(np.sum((kind - pixels) ** 2, axis=1))))
        for kind in (planes.project(points), best)
    )
    if found > MOST_ERROR * least + 50 * LEAST_ERROR:
        problem = f"equation (5) misses the stored points by {found:.3g} px rms; {least:.3g} px is possible"
        raise CalibrationError("V_R", problem, "check V_R, V_C, rho_p and gamma_p, or calibrate again")


def _check_unit(text: str) -> None:
    try:
        known = Unit.parse(text)
    except UnitError as error:
        raise CalibrationError("unit", error.problem, error.remedy) from None
    if not known.dimension_equals(Unit.parse("m")):
        raise CalibrationError("unit", f"'{text}' is not a unit of length", "write m, cm or mm")
