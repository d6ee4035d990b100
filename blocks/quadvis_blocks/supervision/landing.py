"""The descent to the ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State

INSTANT = 1e-9  # m, s


class Landing(Block):
    """A reference that descends, and the moment at which the craft stands on the ground.

    While ``descend`` is true x and y of the reference stay where they were when it became true (or where
    ``recapture`` puts them) and the height falls at ``speed``. The craft has landed when for ``settle`` it
    neither follows (it is more than ``gap`` above the reference) nor moves (``still``): this needs no height
    of the ground. While its height is reckoned and not seen (``blind``), it has landed when the reference is
    ``margin`` below ``ground``; there the reference stops. ``landed`` stays until ``descend`` is false.
    """

    speed = Param(0.3, unit="m/s", above=0.0, tune=True, doc="speed of the descent")
    gap = Param(0.15, unit="m", above=0.0, tune=True, doc="least height above the reference on the ground")
    still = Param(0.1, unit="m/s", above=0.0, tune=True, doc="greatest rate of the height on the ground")
    settle = Param(0.5, unit="s", min=0.0, tune=True, doc="how long both must hold")
    ground = Param(0.0, unit="m", tune=True, doc="height of the craft as it stands on the ground")
    margin = Param(0.5, unit="m", above=0.0, tune=True, doc="how far the reference goes below that")
    position_reference = In("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity_reference = In(
        "float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="rate of change of the reference"
    )
    descend = In("bool", doc="whether to land")
    recapture = In("bool", default=False, doc="true to take x and y from the reference anew")
    height = In(unit="m", doc="height of the craft")
    climb = In(unit="m/s", doc="rate of change of the height")
    blind = In("bool", default=False, doc="whether the height is reckoned, not seen")
    position = Out("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="its rate of change")
    landed = Out("bool", doc="whether the craft stands on the ground: let the rotors idle")
    active = State("bool")
    spot = State("float64[3]", unit="m")
    resting = State(unit="s")
    down = State("bool")

    def output(
        self, position_reference: Any, velocity_reference: Any, descend: bool, recapture: bool, height: float,
        climb: float, blind: bool,
    ) -> tuple[Any, Any, bool]:  # fmt: skip
        """Return the reference, and whether the craft has landed."""
        if not descend:
            return 1.0 * position_reference, 1.0 * velocity_reference, False
        spot = _spot(self.active, self.spot, position_reference, recapture)
        lowest = spot[2] <= self.ground - self.margin + INSTANT
        rests = not blind and height - spot[2] > self.gap and abs(climb) < self.still
        landed = (rests and self.resting >= self.settle - INSTANT) or (blind and lowest)
        return spot, np.array((0.0, 0.0, 0.0 if lowest else -self.speed)), self.down or landed

    def update(
        self,
        position_reference: Any,
        descend: bool,
        recapture: bool,
        height: float,
        climb: float,
        blind: bool,
    ) -> None:
        """Go down by one period."""
        if descend:
            spot = _spot(self.active, self.spot, position_reference, recapture)
            lowest = spot[2] <= self.ground - self.margin + INSTANT
            rests = not blind and height - spot[2] > self.gap and abs(climb) < self.still
            landed = (rests and self.resting >= self.settle - INSTANT) or (blind and lowest)
            self.down = self.down or landed
            self.resting = self.resting + self.period if rests else 0.0
            spot[2] = max(spot[2] - self.speed * self.period, min(spot[2], self.ground - self.margin))
            self.spot = spot
        else:
            self.down = False
            self.resting = 0.0
        self.active = descend


def _spot(active: bool, spot: Any, reference: Any, recapture: bool) -> Any:
    """Return the reference of the descent at this tick."""
    if not active:
        return 1.0 * reference
    if recapture:
        return np.array((reference[0], reference[1], spot[2]))
    return 1.0 * spot
