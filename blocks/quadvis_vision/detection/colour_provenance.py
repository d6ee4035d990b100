"""Provenance of calibrated colours: the colours in each picture, by which a reader checks the file.

`quadvis_vision.camera.provenance` does the same for cameras. A file still looks right after a number was
changed by hand, so the file keeps the measured colours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis_vision.camera.provenance import CalibrationError, check_date, known

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadvis.document import YamlNode

    Floats = NDArray[np.float64]

KEYS = ("date", "rms", "errors", "samples")
DIGITS = 4  # of the ratios in a file
ROUNDING = 0.001  # the error of a ratio or of a distance by these digits
_REMEDY = "a number was changed since; calibrate again, or take out rms, errors and samples"


@dataclass(frozen=True, eq=False)
class ColourEvidence:
    """How colours were found; any part of it may be unknown.

    `samples` (n, 4, 3) are the ratios of circles 1..4 in each of n pictures; the colours are their medians.
    `errors` (n,) are the rms distances of each picture's colours from the medians, as
    `ColourCalibration.nearest` measures them; `rms` is the same over all pictures; `date` is the day, such as
    2026-11-22.
    """

    date: str | None = None
    rms: float | None = None
    errors: Floats | None = None
    samples: Floats | None = None

    @classmethod
    def of(cls, samples: Floats, distances: Floats) -> ColourEvidence:
        """Return the evidence of samples (n, 4, 3) and their distances (n, 4); without a date."""
        return cls(
            rms=round(float(_rms(distances.ravel())), DIGITS),
            errors=np.round(_rms(distances), DIGITS),
            samples=np.round(samples, DIGITS),
        )

    @classmethod
    def read(cls, fields: Mapping[str, YamlNode] | Any) -> ColourEvidence:
        """Return the evidence under the `KEYS` of a file; `DiagramError` with the place of a wrong value."""
        return cls(
            date=fields["date"].text() if "date" in fields else None,
            rms=fields["rms"].number() if "rms" in fields else None,
            errors=np.array(fields["errors"].array((None,))) if "errors" in fields else None,
            samples=np.array(fields["samples"].array((None, 4, 3))) if "samples" in fields else None,
        )

    def facts(self) -> dict[str, Any]:
        """Return the known parts as plain data for a file."""
        return known(self)

    def check(self, prototypes: Floats, distances: Callable[[Floats], Floats]) -> None:
        """Raise `CalibrationError` if the parts contradict each other, or the prototypes (4, 3).

        `distances` returns the distances (n, 4) of samples (n, 4, 3) from the prototypes.
        """
        if self.date is not None:
            check_date(self.date)
        if self.samples is None:
            given = "rms" if self.rms is not None else "errors" if self.errors is not None else None
            if given is not None:
                raise CalibrationError(
                    given, f"{given} has no samples to go by", "add samples, or take it out"
                )
            return
        samples = self.samples
        whole = samples.ndim == 3 and samples.shape[1:] == (4, 3) and len(samples)
        if not whole or not (np.isfinite(samples) & (samples >= 0)).all():
            raise CalibrationError(
                "samples", "samples are not ratios", "give four of each picture, from 0 on"
            )
        off = np.abs(np.median(samples, axis=0) - prototypes).max()
        if not off <= ROUNDING:
            raise CalibrationError(
                "samples", f"the median of the samples is {off:.2g} off the ratios", _REMEDY
            )
        away = distances(samples)
        self._check_sizes("errors", self.errors, _rms(away))
        self._check_sizes("rms", self.rms, _rms(away.ravel()))

    @staticmethod
    def _check_sizes(field: str, said: Floats | float | None, found: Floats) -> None:
        """Compare the file's numbers with those of the samples; dark colours magnify rounding fivefold."""
        if said is None:
            return
        if np.shape(said) != found.shape or not np.abs(said - found).max() <= 5 * ROUNDING:
            numbers = ", ".join(f"{number:.4g}" for number in np.atleast_1d(found))
            raise CalibrationError(field, f"{field} should be {numbers} by the samples", _REMEDY)


def _rms(distances: Floats) -> Floats:
    """Return the root mean square over the last axis."""
    return np.asarray(np.sqrt(np.mean(distances**2, axis=-1)))
