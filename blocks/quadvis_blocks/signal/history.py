"""The value of a signal at an earlier instant."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, State, passed

CAPACITY = 256


class History(Block):
    """The value of a signal at an earlier instant: ``y = u(instant)``, with straight lines between samples.

    The block pairs a late measurement with a signal at the measurement's stamp: for example, a frame of a
    camera with the angles of the inertial unit at the instant of the frame. The last 256 samples are kept.
    An instant before them gives the oldest sample; an instant in the future or NaN gives the newest sample;
    in these cases ``ok`` is false. Instants may repeat and go back: `supervision.frame_news` decides whether
    a stamp is news.

    Error: at most ``M T^2 / 8`` for a signal with ``|u''| <= M``.
    """

    u = In(unit="a", doc="the signal; not an angle that wraps")
    instant = In(unit="s", doc="instant of the wanted value, such as the stamp of a frame")
    y = Out(unit="a", doc="value of the signal at that instant")
    ok = Out("bool", doc="whether the instant lies between the oldest sample and now")
    values = State(f"float64[{CAPACITY}]")  # at the ticks before this one, newest first
    kept = State("int64")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        earlier: {block: signal.history, rate: fast, in: {u: wave.y, instant: 0.1 s}}
    """

    def output(self, u: float, instant: float, time: float) -> tuple[float, bool]:
        """Return the value at the instant."""
        if math.isnan(instant):
            return u, False
        if passed(instant, time):
            return u, False
        kept = self.kept
        if passed(time - instant, kept * self.period):
            return (u if kept == 0 else float(self.values[kept - 1])), False
        age = min(max((time - instant) / self.period, 0.0), float(kept))
        steps = min(int(age), kept - 1)
        if steps < 0:
            return u, True
        share = age - steps
        later = u if steps == 0 else float(self.values[steps - 1])
        earlier = float(self.values[steps])
        return later + share * (earlier - later), True

    def update(self, u: float) -> None:
        """Keep this sample."""
        self.values[1:] = self.values[:-1].copy()
        self.values[0] = u
        self.kept = min(self.kept + 1, CAPACITY)
