"""The angle to ask a flight controller for, whose level is not ours."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, State, Work, clip


class LevelCorrection(Block):
    """An angle, corrected such that the craft takes it by our inertial unit, not by the flight controller's.

    ``asked = wanted + correction``; the correction grows by ``(wanted - measured) / time_constant``, within
    ``limit``, and stands still while ``freeze`` is true. So a lasting difference between the two levels, of
    the flight controller's inertial unit or of its trim, is gone after some time constants. Choose it well
    above the time that the flight controller takes for an angle.
    """

    time_constant = Param(1.0, unit="s", above=0.0, tune=True, shown=True, doc="of the correction")
    limit = Param(0.1, unit="rad", min=0.0, tune=True, doc="greatest correction")
    wanted = In(unit="rad", doc="angle that the craft is to take")
    measured = In(unit="rad", doc="angle that it has, by our inertial unit; NaN if there is none")
    freeze = In("bool", default=False, doc="true to keep the correction, for example on the ground")
    asked = Out(unit="rad", doc="angle to ask the flight controller for")
    correction = State(unit="rad")
    error = Work(unit="rad")

    example = """
        wanted: {block: sources.pulse, rate: fast, with: {high: 5 deg, interval: 1 s, width: 0.5 s}}
        level:
          block: control.level_correction
          rate: fast
          in: {wanted: wanted.y, measured: 1 deg}
    """

    def output(self, wanted: float, measured: float) -> float:
        """Return the angle to ask for."""
        self.error = 0.0 if math.isnan(measured) else wanted - measured
        return float(wanted + self.correction)

    def update(self, freeze: bool) -> None:
        """Let the correction grow."""
        if not freeze:
            step = self.period / self.time_constant * self.error
            self.correction = clip(self.correction + step, -self.limit, self.limit)
