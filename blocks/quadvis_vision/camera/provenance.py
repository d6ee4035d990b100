"""What a calibration file keeps of its making: errors, date, and points by which a reader can check it.

A digit that was changed by hand, two numbers in the wrong order (as in the printed (37)) or the lens of
another camera leave a file that looks right. So some of the points that the camera was found with stay in the
file, and whoever reads it projects them again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError, quoted, sentence

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from quadvis.document import YamlNode

    Floats = NDArray[np.float64]

KEYS = ("rms", "errors", "date", "points")
MOST_POINTS = 40  # that a file keeps
LEAST_ERROR = 0.01  # px: what rounding in the file may make of a perfect calibration
MOST_ERROR = 2.0  # times the rms of all points; that of a few of them is not quite the same


class CalibrationError(QuadvisError):
    """A calibration that no camera can have: `field` says which part, the text what would be right."""

    def __init__(self, field: str, problem: str, remedy: str = "") -> None:
        """Keep the parts; the message joins them."""
        self.field, self.problem, self.remedy = field, problem, remedy
        super().__init__(sentence(problem, remedy))


@dataclass(frozen=True, eq=False)
class Evidence:
    """How a calibration was found; all of it may be unknown.

    `rms` is the root mean square distance of measured and predicted pixels, `errors` (m,) the same of each
    view or plane, `date` the day, as 2026-11-22. `points` (n, 5) are some of those that were used: x, y, z in
    the frame and unit of the calibration, u, v as measured.
    """

    rms: float | None = None
    errors: Floats | None = None
    date: str | None = None
    points: Floats | None = None

    @classmethod
    def of(
        cls, points: Sequence[ArrayLike], measured: Sequence[ArrayLike], predicted: Sequence[ArrayLike]
    ) -> Evidence:
        """Return the evidence of points (n, 3) and pixels (n, 2), one of each a view; without a date."""
        views = zip(measured, predicted, strict=True)
        squares = [np.sum((np.asarray(seen) - np.asarray(meant)) ** 2, axis=1) for seen, meant in views]
        rows = np.column_stack((np.vstack([*points]), np.vstack([*measured])))
        every = np.concatenate(squares)
        return cls(
            rms=float(np.sqrt(every.mean())),
            errors=np.sqrt([view.mean() for view in squares]),
            points=_rounded(rows[_typical(every)]),
        )

    @classmethod
    def read(cls, fields: Mapping[str, YamlNode] | Any) -> Evidence:
        """Return what a file says under the `KEYS`; `DiagramError` with its place if that cannot be read."""
        return cls(
            rms=fields["rms"].number() if "rms" in fields else None,
            errors=np.array(fields["errors"].array((None,))) if "errors" in fields else None,
            date=fields["date"].text() if "date" in fields else None,
            points=np.array(fields["points"].array((None, 5))) if "points" in fields else None,
        )

    def facts(self) -> dict[str, Any]:
        """Return what is known as plain data for a file."""
        return known(self)

    def check(self, project: Callable[[Floats], Floats]) -> None:
        """Raise `CalibrationError` if this contradicts itself, or what `project` makes of points (n, 3)."""
        if self.rms is not None and not (np.isfinite(self.rms) and self.rms >= 0):
            raise CalibrationError("rms", f"rms is {self.rms:g}", "it must be a number of px, not negative")
        if self.errors is not None:
            self._check_errors(self.errors)
        if self.date is not None:
            check_date(self.date)
        if self.points is not None:
            self._check_points(self.points, project)

    def _check_errors(self, errors: Floats) -> None:
        if errors.ndim != 1 or not len(errors) or not (np.isfinite(errors) & (errors >= 0)).all():
            raise CalibrationError("errors", "errors are not rms values", "they must be px, not negative")
        low, high = errors.min() - LEAST_ERROR, errors.max() + LEAST_ERROR
        if self.rms is None or not low <= self.rms <= high:
            problem = f"errors go from {errors.min():.4g} to {errors.max():.4g} px"
            raise CalibrationError("errors", problem, "rms must be there, and lie between them")

    def _check_points(self, points: Floats, project: Callable[[Floats], Floats]) -> None:
        if points.ndim != 2 or points.shape[1] != 5 or not len(points) or not np.isfinite(points).all():
            raise CalibrationError("points", "points are not rows x, y, z, u, v", "give five numbers a row")
        if self.rms is None:
            raise CalibrationError("points", "points have no rms to go by", "add rms, in px")
        missed = np.sqrt(np.mean(np.sum((project(points[:, :3]) - points[:, 3:]) ** 2, axis=1)))
        if not missed <= MOST_ERROR * self.rms + LEAST_ERROR:
            problem = f"the camera misses the stored points by {missed:.3g} px rms, not by {self.rms:.3g} px"
            raise CalibrationError("points", problem, "a number was changed since; calibrate again")


def _rounded(rows: Floats) -> Floats:
    """Return numbers of seven digits, for files that people read: 1e-4 px, and no minus before a zero."""
    return np.array([[float(f"{number:.7g}") + 0.0 for number in row] for row in rows.tolist()])


def _typical(squares: Floats) -> NDArray[np.int64]:
    """Return which points to keep: as many of each size of error as there are, in their order."""
    if len(squares) <= MOST_POINTS:
        return np.arange(len(squares))
    order = np.argsort(squares, kind="stable")
    return np.sort(order[((np.arange(MOST_POINTS) + 0.5) * len(squares) / MOST_POINTS).astype(int)])


def known(evidence: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are known as plain data, in their order."""
    plain = {field.name: getattr(evidence, field.name) for field in fields(evidence)}
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in plain.items()
        if value is not None
    }


def check_date(text: str) -> None:
    """Raise `CalibrationError` if a text is no day such as 2026-11-22."""
    try:
        date.fromisoformat(text)
    except ValueError:
        raise CalibrationError("date", f"date is {quoted(text)}", "write it as 2026-11-22") from None
