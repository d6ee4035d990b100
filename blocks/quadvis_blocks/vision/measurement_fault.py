"""A detector whose measurements fail for a while, on purpose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, Random, State, Work, fill_normal
from quadvis_blocks.vision._fault_timing import LATE, NO_FAULT, TIMING, comes, is_on, shows, stamped

SHAPES = ("no_target", "turned", "mirrored", "shifted", "noise", "other_colours", "half_gone", "two_left")
KINDS = (NO_FAULT, *TIMING, *SHAPES)
STAMP, CENTRES, WIDTH = 0, 1, 9  # a measurement: stamp, u, v of four circles
SHOWN = LATE + 1  # row of the measurement shown last, behind those of the last ticks; then the one before


class MeasurementFault(Block, numeric=False):
    """Measured centres that pass unchanged, except during a fault: for ``duration`` from ``begin`` on.

    This block is the `vision.frame_fault` for `vision.geometric_camera`, which has no pictures. The kinds
    that concern times and stamps are the same. The other kinds are faults that a detector would not notice,
    or faults with which it would find nothing.
    """

    kind = Param(NO_FAULT, choices=KINDS, doc="kind of the fault")
    begin = Param(0.0, unit="s", doc="beginning of the fault (inclusive)")
    duration = Param(3.0, unit="s", min=0.0, doc="length of the fault")
    middle = Param((226.0, 161.0), type="float64[2]", unit="px", doc="middle of the picture")
    centres = In("float64[4,2]", unit="px", doc="u, v of circles 1 to 4; NaN rows are missing")
    instant = In(unit="s", doc="stamp of the measurement; NaN before the first")
    faulty = Out("float64[4,2]", unit="px", nan=True, doc="the centres, or what the fault makes of them")
    faulty_stamp = Out(unit="s", nan=True, doc="the stamp, or what the fault makes of it")
    active = Out("bool", doc="whether the fault is active")
    chance = Random()
    drawn = State("float64[8]")  # random numbers for the measurement of the coming tick
    ticks = State("int64")  # of the fault so far
    kept = State(f"float64[{SHOWN + 2},{WIDTH}]", math.nan)  # the last that came, then the last shown
    row = Work(f"float64[{WIDTH}]")  # the measurement that is shown now
    on = Work("bool")

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        camera:
          block: vision.geometric_camera
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", ceiling: 4.5 m, side: 1 m, noise: 0.3 px}
          in: {position: place.y, attitude: {value: [0, 0, 0], unit: rad}}
        fault:
          block: vision.measurement_fault
          rate: slow
          with: {kind: turned, begin: 0.3 s, duration: 0.4 s}
          in: {centres: camera.centres, instant: camera.stamp}
    """

    def start(self) -> None:
        """Draw the random numbers of the first measurement."""
        fill_normal(self.chance, self.drawn)

    def output(self, centres: Any, instant: float, time: float) -> tuple[Any, float, bool]:
        """Return the measurement, with the fault while that is active, and whether it is active."""
        self.on = is_on(time, self.begin, self.duration)
        row = self._faulty(centres, instant)
        self.row = row
        return row[CENTRES:].reshape(4, 2), row[STAMP], self.on

    def update(self, centres: Any, instant: float) -> None:
        """Keep the measurement that came and the measurement that was shown."""
        self.kept[1:SHOWN] = self.kept[: SHOWN - 1].copy()
        self.kept[0] = _row(centres, instant)
        self.kept[SHOWN + 1] = self.kept[SHOWN]
        self.kept[SHOWN] = self.row
        self.ticks = self.ticks + 1 if self.on else 0
        fill_normal(self.chance, self.drawn)

    def _faulty(self, centres: Any, stamp: float) -> Any:
        """Return stamp and centres (9,) of a measurement, with the fault while that is active."""
        row, kind = _row(centres, stamp), KINDS[self.kind]
        if kind == NO_FAULT or math.isnan(stamp) or not self.on:
            return row
        past = (row, *self.kept[:LATE])
        which = comes(kind, self.ticks)
        if which < 0 or math.isnan(past[which][STAMP]):
            return self.kept[SHOWN].copy()
        row, picture = past[which].copy(), shows(kind, self.ticks)
        row[CENTRES:] = (self.kept[SHOWN - 1 - picture] if picture < 0 else past[which + picture])[CENTRES:]
        before = float(self.kept[SHOWN][STAMP])
        row[STAMP] = stamped(kind, float(row[STAMP]), self.ticks, self.period, self.begin, before)
        row[CENTRES:] = self._moved(kind, row[CENTRES:].reshape(4, 2)).ravel()
        return row

    def _moved(self, kind: str, centres: Any) -> Any:
        """Return the centres (4, 2) of a picture with the fault."""
        off = centres - self.middle
        moved = {
            "no_target": np.full((4, 2), math.nan),
            "turned": self.middle - off,
            "mirrored": self.middle + off * np.array([-1.0, 1.0]),
            "shifted": centres + np.array([60.0, 0.0]),
            "noise": centres + 50.0 * np.asarray(self.drawn).reshape(4, 2),
            "other_colours": np.roll(centres, 1, axis=0),
            "half_gone": np.where(off[:, :1] > 0.0, math.nan, centres),
            "two_left": np.where(np.arange(4)[:, None] < 2, centres, math.nan),
        }
        return moved.get(kind, centres)


def _row(centres: Any, stamp: float) -> Any:
    return np.concatenate(([stamp], np.asarray(centres).ravel()))
