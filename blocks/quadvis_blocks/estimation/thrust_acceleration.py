"""The acceleration that the thrust gives a tilted craft."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._craft import GRAVITY, MASS
from quadvis_blocks.estimation._rotors import acceleration


class ThrustAcceleration(Block):
    """Acceleration along x, y, h that the collective thrust and gravity give a craft of known attitude.

    It is ``u / m`` along minus the third column of Rz(yaw) Ry(pitch) Rx(roll), minus g along h.
    `estimation.position_filter` takes this acceleration as known; the disturbance that it estimates includes
    wind, drag and an error of the mass.

    Source: equations (11) to (13), and yaw, which these equations leave out.
    """

    collective = In(unit="N", doc="collective thrust u that the rotors give")
    roll = In(unit="rad", doc="right side down is positive")
    pitch = In(unit="rad", doc="nose up is positive")
    yaw = In(unit="rad", default=0.0, doc="clockwise from above is positive")
    acceleration = Out("float64[3]", unit="m/s^2", doc="along x, y, h")

    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")

    example = """
        tilt: {block: sources.sine, rate: fast, with: {amplitude: 5 deg, frequency: 1 Hz}}
        acceleration:
          block: estimation.thrust_acceleration
          rate: fast
          in: {collective: 5 N, roll: tilt.y, pitch: 0 rad}
    """

    def output(self, collective: float, roll: float, pitch: float, yaw: float) -> Any:
        """Return the acceleration."""
        return acceleration(collective, np.array((roll, pitch, yaw)), self.mass, self.gravity)
