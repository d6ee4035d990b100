"""The descent to the ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work, copied, reached

TOUCH = 1e-9  # m; heights that differ by no more than this count as equal


class Landing(Block):
    """A reference that descends, and the decision that the craft stands on the ground.

    ======= ============================================ ======================== ========================
    phase   begins when                                  x and y of the reference height of the reference
    ======= ============================================ ======================== ========================
    off     ``descend`` is false                         those of the input       that of the input
    descent ``descend`` becomes true                     kept since then          falls at ``speed``
    flare   the reference is ``flare`` above ``ground``  kept                     falls at ``touch_speed``
    ground  the reference is below ``ground``            those of the craft       falls on
    lowest  the reference is ``margin`` below ``ground`` those of the craft       stops
    ======= ============================================ ======================== ========================

    ``recapture`` takes x and y from the input again. While the craft is more than ``gap`` above the
    reference, x and y are those of the craft, so that the craft is not pushed sideways. Below the ground the
    velocity of the reference is that of the craft (``current_velocity``): an estimator that does not know
    that the craft stands must not drive it sideways.

    The craft has landed when it no longer follows the reference: the craft is more than ``gap`` above the
    reference, and its height has stayed within ``band`` for ``settle``. This rule needs neither the right
    height of the ground nor a vertical speed. While the height is reckoned and not seen (``blind``), the
    craft has landed in the phase "lowest". When the height is seen again, the reference continues from the
    height of the craft. ``landed`` stays true until ``descend`` is false.
    """

    speed = Param(0.3, unit="m/s", above=0.0, tune=True, doc="speed of the descent")
    gap = Param(0.15, unit="m", above=0.0, tune=True, doc="least height above the reference on the ground")
    band = Param(0.06, unit="m", above=0.0, tune=True, doc="greatest change of the height on the ground")
    settle = Param(1.0, unit="s", min=0.0, tune=True, doc="how long the height must stay within ``band``")
    ground = Param(0.0, unit="m", tune=True, doc="height of the craft when it stands on the ground")
    flare = Param(
        0.5, unit="m", min=0.0, tune=True, doc="height above the ground where the descent slows down"
    )
    touch_speed = Param(0.2, unit="m/s", above=0.0, tune=True, doc="speed of the rest of the descent")
    margin = Param(1.5, unit="m", above=0.0, tune=True, doc="how far below the ground the reference descends")
    position_reference = In("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity_reference = In(
        "float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="rate of change of the reference"
    )
    descend = In("bool", doc="whether to land")
    recapture = In("bool", default=False, doc="true to take x and y from the input again")
    current = In("float64[3]", unit="m", doc="where the craft is: x, y, h")
    current_velocity = In(
        "float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="velocity of the craft, as far as it is known"
    )
    blind = In("bool", default=False, doc="whether the height is reckoned, not seen")
    position = Out("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")
    landed = Out("bool", doc="whether the craft stands on the ground: let the rotors idle")
    active = State("bool")
    was_blind = State("bool")
    spot = State("float64[3]", unit="m")
    rest = State(unit="m")  # height from which the craft has not moved
    since = State(unit="s")  # when the craft came to that height
    down = State("bool")
    place = Work("float64[3]", unit="m")  # the reference at this tick
    slow = Work("bool")  # whether the reference is near the ground
    stands = Work("bool")  # whether the craft stands on the ground at this tick

    example = """
        now: {block: sources.clock, rate: fast}
        end: {block: logic.compare, rate: fast, with: {operator: ">="}, in: {a: now.y, b: 0.2 s}}
        landing:
          block: supervision.landing
          rate: fast
          in:
            position_reference: {value: [0, 0, 1.5], unit: m}
            descend: end.y
            current: {value: [0.1, 0, 1.45], unit: m}
    """

    def output(
        self, position_reference: Any, velocity_reference: Any, descend: bool, recapture: bool, current: Any,
        current_velocity: Any, blind: bool, time: float,
    ) -> tuple[Any, Any, bool]:  # fmt: skip
        """Return the reference, and whether the craft has landed."""
        seen_again = self.was_blind and not blind
        spot = _spot(self.active, self.spot, position_reference, recapture, seen_again, current, self.gap)
        height = float(current[2])
        lowest = spot[2] <= self.ground - self.margin + TOUCH
        rests = self.active and abs(height - self.rest) <= self.band and height - spot[2] > self.gap
        self.place = spot
        self.slow = spot[2] <= self.ground + self.flare
        self.stands = lowest if blind else rests and reached(time - self.since, self.settle)
        if not descend:
            return copied(position_reference), copied(velocity_reference), False
        speed = 0.0 if lowest else self.speed
        where = 1.0 * spot
        pace = np.array((0.0, 0.0, -min(speed, self.touch_speed) if self.slow else -speed))
        if spot[2] < self.ground:
            where[:2] = current[:2]
            pace[:2] = current_velocity[:2]
        return where, pace, self.down or self.stands

    def update(self, descend: bool, current: Any, blind: bool, time: float) -> None:
        """Lower the reference by one period."""
        height = float(current[2])
        if blind or not self.active or abs(height - self.rest) > self.band:
            self.rest = height
            self.since = time
        step = (min(self.speed, self.touch_speed) if self.slow else self.speed) * self.period
        here = self.place[2]
        self.spot = self.place
        self.spot[2] = max(here - step, min(here, self.ground - self.margin))
        self.down = descend and (self.down or self.stands)
        self.active = descend
        self.was_blind = descend and blind


def _spot(
    active: bool, spot: Any, reference: Any, recapture: bool, seen_again: bool, current: Any, gap: float
) -> Any:
    """Return the reference of the descent at this tick."""
    if not active:
        return copied(reference)
    h = current[2] if seen_again else spot[2]
    if current[2] - h > gap:
        return np.array((current[0], current[1], h))
    return np.array((reference[0], reference[1], h)) if recapture else np.array((spot[0], spot[1], h))
