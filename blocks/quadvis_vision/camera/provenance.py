"""Provenance of a calibration: its residuals, its date, and points to check it by.

A file still looks right after a digit was changed by hand, after two numbers were swapped (as in the printed
(37)), or with the lens of another camera in it. So the file keeps some of the points from which the camera
was found, and every reader of the file projects them again.
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
MOST_POINTS = 40  # in a file
LEAST_ERROR = 0.01  # px: the error that rounding in the file may give a perfect calibration
MOST_ERROR = 2.0  # times the rms of all points: the rms of the few stored points differs somewhat


class CalibrationError(QuadvisError):
    """A calibration that no camera can have; `field` names the wrong part."""

    def __init__(self, field: str, problem: str, remedy: str = "") -> None:
        """Keep the parts and join them to the message."""
        self.field, self.problem, self.remedy = field, problem, remedy
        super().__init__(sentence(problem, remedy))


@dataclass(frozen=True, eq=False)
class Evidence:
    """How a calibration was found; any part of it may be unknown.

    `rms` is the root mean square distance of measured and predicted pixels, `errors` (m,) the same distance
    in each view or plane, `date` the day, such as 2026-11-22. `points` (n, 5) are some of the points that
    were used: x, y, z in the frame and unit of the calibration, u, v as measured.
    """

    rms: float | None = None
    errors: Floats | None = None
    date: str | None = None
    points: Floats | None = None

    @classmethod
    def of(
        cls, points: Sequence[ArrayLike], measured: Sequence[ArrayLike], predicted: Sequence[ArrayLike]
    ) -> Evidence:
        """Return the evidence, without a date, of the points (n, 3) and pixels (n, 2) of each view."""
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
        """Return the evidence under the `KEYS` of a file; `DiagramError` with the place of a wrong value."""
        return cls(
            rms=fields["rms"].number() if "rms" in fields else None,
            errors=np.array(fields["errors"].array((None,))) if "errors" in fields else None,
            date=fields["date"].text() if "date" in fields else None,
            points=np.array(fields["points"].array((None, 5))) if "points" in fields else None,
        )

    def facts(self) -> dict[str, Any]:
        """Return the known parts as plain data for a file."""
        return known(self)

    def check(self, project: Callable[[Floats], Floats]) -> None:
        """Raise `CalibrationError` if the parts contradict each other, or the predictions of `project`."""
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
    """Return the numbers rounded to seven digits (1e-4 px), without a minus sign before a zero."""
    return np.array([[float(f"{number:.7g}") + 0.0 for number in row] for row in rows.tolist()])


def _typical(squares: Floats) -> NDArray[np.int64]:
    """Return the indices of the points to keep, in order: a sample with the same spread of errors as all."""
    if len(squares) <= MOST_POINTS:
        return np.arange(len(squares))
    order = np.argsort(squares, kind="stable")
    return np.sort(order[((np.arange(MOST_POINTS) + 0.5) * len(squares) / MOST_POINTS).astype(int)])


def known(evidence: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not None, in their order, as plain data."""
    plain = {field.name: getattr(evidence, field.name) for field in fields(evidence)}
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in plain.items()
        if value is not None
    }


def check_date(text: str) -> None:
    """Raise `CalibrationError` if a text is not a day such as 2026-11-22."""
    try:
        date.fromisoformat(text)
    except ValueError:
        raise CalibrationError("date", f"date is {quoted(text)}", "write it as 2026-11-22") from None
