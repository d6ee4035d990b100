"""The pilot's switches, and sticks that take a channel back."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State, Work

CHANNELS = 4
ENGAGEMENT, NEUTRAL = range(2)
SWITCH_ON, SWITCH_OFF = 0.6, 0.4  # a switch comes on above the first value, and goes off below the second


class StickOverride(Block):
    """Which channels the pilot leaves to the control law: his switches decide, unless he moves a stick.

    A channel is automatic while its switch is on. A stick takes its channel back at once when it moves by
    more than ``threshold`` from its position at the tick when the switch came on. The pilot then keeps the
    channel until the switch has been off. With ``origin: neutral`` the deflection counts from neutral
    instead, and a switch that comes on while its stick is further out than ``release`` does not make the
    channel automatic. With ``together`` one stick takes back all channels.

    While the sticks are stale nothing changes: a link that fails must not look like a pilot who moves.
    """

    threshold = Param(0.3, above=0.0, max=2.0, tune=True, doc="deflection that takes a channel back")
    release = Param(
        0.2,
        min=0.0,
        max=1.0,
        tune=True,
        doc="greatest deflection at which a switch takes effect, origin neutral",
    )
    origin = Param(
        "engagement", choices=("engagement", "neutral"), doc="the point from which a deflection counts"
    )
    together = Param(False, type="bool", tune=True, doc="whether one stick takes back all channels")
    sticks = In("float64[4]", doc="collective, roll, pitch, yaw, each -1 to 1")
    switches = In("float64[4]", doc="one for each channel: 1 wants automatic, 0 or less manual")
    stale = In("bool", default=False, doc="whether the sticks are too old to count")
    automatic = Out("bool[4]", doc="channels that the law may have: collective, roll, pitch, yaw")
    overridden = Out("bool[4]", doc="channels that a stick took back, until the switch has been off")
    on = State("bool[4]")
    taken = State("bool[4]")
    origins = State("float64[4]")
    on_now = Work("bool[4]")
    taken_now = Work("bool[4]")
    origins_now = Work("float64[4]")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with:
            times: {value: [0, 0.3, 0.6], unit: s}
            values: [[0, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0, 0]]
            interpolation: hold
        override:
          block: supervision.stick_override
          rate: fast
          in: {sticks: sticks.y, switches: [1, 1, 1, 1]}
    """

    def check(self) -> None:
        """Refuse a release beyond the threshold."""
        if self.release > self.threshold:
            problem = f"release must be at most the threshold, {self.threshold:g}, got {self.release:g}"
            raise ParameterError("release", problem)

    def output(self, sticks: Any, switches: Any, stale: bool) -> tuple[Any, Any]:
        """Return the channels that are automatic, and the channels that a stick took back."""
        on, taken, origins = _decided(
            sticks, switches, stale, self.on, self.taken, self.origins,
            self.origin, self.threshold, self.release, self.together,
        )  # fmt: skip
        self.on_now = on
        self.taken_now = taken
        self.origins_now = origins
        return on & ~taken, taken

    def update(self) -> None:
        """Keep the decisions."""
        self.on = self.on_now
        self.taken = self.taken_now
        self.origins = self.origins_now


def _decided(
    sticks: Any, switches: Any, stale: bool, on: Any, taken: Any, origins: Any,
    origin: int, threshold: float, release: float, together: bool,
) -> tuple[Any, Any, Any]:  # fmt: skip
    """Return which switches are on, which channels are taken back, and from where deflections count."""
    on, taken, origins = on.copy(), taken.copy(), origins.copy()
    if stale:
        return on, taken, origins
    for channel in range(CHANNELS):
        was_on = on[channel]
        on[channel] = switches[channel] > (SWITCH_OFF if was_on else SWITCH_ON)
        if on[channel] and not was_on:
            origins[channel] = sticks[channel] if origin == ENGAGEMENT else 0.0
            taken[channel] = abs(sticks[channel] - origins[channel]) > release
        elif on[channel] and abs(sticks[channel] - origins[channel]) > threshold:
            taken[channel] = True
        elif not on[channel]:
            taken[channel] = False
    if together and np.any(taken):
        taken |= on
    return on, taken, origins
